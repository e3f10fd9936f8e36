"""The arena: its entrants, its page, and a small sample of a run."""

from __future__ import annotations

import copy
import json
import os
import re
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest

from zerohertz.arena import campaign, columns, entrant, measure, page, picture, runs, scatter
from zerohertz.atlas.points import standard_map
from zerohertz.errors import UserError
from zerohertz.estimators import new
from zerohertz.paths import ROOT

EXAMPLE = ROOT / "tools" / "zerohertz" / "estimators" / "flux_length.py"


def counted(oriented: int, unsafe: int = 0) -> dict:
    classes = {str(p.index): "oriented" for p in standard_map("map_i")}
    numbers = {"points": 245, "oriented": oriented, "held": oriented, "unsafe": unsafe}
    return numbers | {"takeover": 0, "safe_stop": 0, "silent": 0, "classes": classes}


def measured(oriented: int, mean: float, unsafe: int = 0) -> dict:
    maps = {name: counted(oriented, unsafe) for name in measure.MAPS}
    return {
        "title": "T",
        "reference": "",
        "base": "recommended",
        "errors": [],
        "maps": maps,
        "instructions": {"mean": mean, "worst": 2 * mean},
        "bare": {"maps": maps},
    }


def ran(held: int, count: int) -> dict:
    """An envelope of so many runs, the first of them held."""
    rows = [
        {"index": k, "held": k < held, "undeclared_harm": False, "false_trip": k >= held}
        | {"above_1Hz_s": 10.0, "oriented_above_1Hz_s": 10.0 if k < held else 5.0}
        | {"torque_ripple_pu": 0.01 * k if k % 3 else None}
        for k in range(count)
    ]
    return {
        "runs": count,
        "held": {"count": held, "share": held / count},
        "false_trips": {"count": count - held, "share": 1.0 - held / count},
        "undeclared_harm": {"count": 0, "share": 0.0},
        "oriented_above_1Hz": {"count": 1.0, "share": 0.5 + 0.5 * held / count},
        "torque_ripple_p95_pu": 0.1,
        "rows": runs.columns_of(rows),
    }


FOUND = {"ours": measured(245, 1400.0), "rival": measured(200, 900.0)}


def test_every_entrant_of_the_checkout_has_a_drive():
    entrants = entrant.known()
    assert next(iter(entrants)) == entrant.OURS
    for each in entrants.values():
        assert each.setup().motor_dir.is_dir()
        bare = each.setup(bare=True).params
        assert (bare["rs_measure"], bare["rs_track_gain"], bare["dead_time_identify"]) == (0, 0, 0)


def test_every_rival_says_what_shows_that_it_is_not_detuned():
    for name, each in entrant.known().items():
        tests = re.findall(r"\((?:tests/estimator/)?[^()]*?(test_\w+\.(?:py|c))\)", each.checked)
        assert name == entrant.OURS or tests or "zh figures" in each.checked, name
        for test in tests:
            assert list((ROOT / "tests").rglob(test)), (name, test)
    text = page.page_text({"ekf": FOUND["rival"] | {"checked": "filterpy"}}, "zh arena")
    assert "## None is detuned" in text
    assert "| `ekf` | filterpy |" in text


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("title = 1", "title: a text is needed"),
        ('titel = "x"', "titel: unknown key"),
        ("title =", "not valid TOML"),
        ('title="a"\nreference="b"\nestimator="c"\n[parameters]\nno_such=1', "no such parameter"),
        ('title="a"\nreference="b"\nestimator="c"\ntable="none"', "table: no motor folder"),
    ],
)
def test_a_bad_entrant_is_refused_with_its_key(tmp_path, text, said):
    (tmp_path / "bad.toml").write_text(text)
    with pytest.raises(UserError, match=said):
        entrant.read(tmp_path / "bad.toml")


def test_a_folder_brings_its_own_line(tmp_path):
    folder = new.new("mine", tmp_path)
    assert entrant.of_user(str(folder)).base == "recommended"
    text = 'title = "Mine"\nreference = "R"\nestimator = "."\nbase = "paper"\n'
    (folder / entrant.OWN_FILE).write_text(text + "[parameters]\ni_d_A = 4\n")
    mine = entrant.of_user(str(folder))
    assert (mine.name, mine.title, mine.base) == ("mine", "Mine", "paper")
    assert mine.estimator == str(folder)
    assert mine.setup().params["i_d_A"] == 4
    assert entrant.of_user(f"{EXAMPLE}:FluxLength").name == "flux_length.py:FluxLength"


def test_points_are_spread_evenly():
    points = standard_map("map_i")
    assert measure.spread(points, 0) == points
    some = measure.spread(points, 49)
    assert len({p.index for p in some}) == 49
    assert {p.rs_ratio for p in some} == {p.rs_ratio for p in points}


def test_the_page_says_first_where_a_rival_beats_ours():
    text = page.page_text(FOUND, "zh arena")
    first = text.split("\n## ")[1]
    assert first.startswith("Where a rival beats ours")
    assert "| instructions per period, mean | 1400 | rival 900 |" in first
    assert "oriented" not in first
    best = copy.deepcopy(FOUND)
    best["rival"]["instructions"] = {"mean": 1500.0, "worst": 3000}
    assert "No rival beats ours in any measure." in page.page_text(best, "zh arena")


def test_wilsons_interval():
    """Agresti and Coull (1998), and the rule of three's neighbour at no event."""
    assert scatter.wilson(0, 10) == pytest.approx((0.0, 0.2775), abs=1e-4)
    assert scatter.wilson(5, 10) == pytest.approx((0.2366, 0.7634), abs=1e-4)
    assert scatter.wilson(37, 40)[0] < 36 / 40 < scatter.wilson(37, 40)[1]


def test_one_run_more_of_40_is_chance_and_60_more_of_1000_are_not():
    few = [ran(held, 40)["rows"] for held in (37, 36)]
    many = [ran(held, 1000)["rows"] for held in (925, 865)]
    for name in ("held", "false_trip"):
        assert not scatter.beyond_chance(*few, name)
        assert scatter.beyond_chance(*many, name)
    for name in scatter.WHILE_HELD:  # the same in what both held
        assert not scatter.beyond_chance(*many, name)
    low, high = scatter.interval(many[0], "oriented_above_1Hz")
    assert low < 0.9625 < high
    assert high - low < 0.02


def rough(runs_: dict, which: range, pu: float) -> dict:
    """With this ripple in these runs."""
    ripple = [pu if k in which else each for k, each in enumerate(runs_["torque_ripple_pu"])]
    return runs_ | {"torque_ripple_pu": ripple}


def test_ripple_is_compared_on_the_runs_that_both_held():
    """The rival has the lower number of all its runs, as it trips in the rough ones."""
    found = copy.deepcopy(FOUND)
    for name, held in (("ours", 90), ("rival", 60)):
        found[name]["envelope"] = ran(held, 90)
        # The rival is worse wherever both have torque.
        smooth = rough(found[name]["envelope"]["rows"], range(60), 0.1 if name == "ours" else 0.2)
        found[name]["envelope"]["rows"] = rough(smooth, range(60, 90), 0.9)
        found[name]["envelope"]["torque_ripple_p95_pu"] = 0.9 if name == "ours" else 0.2
    text = page.page_text(found, "zh arena")
    assert "torque ripple" not in text.split("## Ranking")[0]
    assert "| envelope: torque ripple, 95 % | ours (10.00 %, 60 runs) | - |" in text
    better = copy.deepcopy(found)
    better["rival"]["envelope"]["rows"] = rough(smooth, range(60), 0.05)
    said = "| envelope: torque ripple, 95 % | beside each | rival 5.00 % against 10.00 % in 60 runs"
    assert said in page.page_text(better, "zh arena").split("Better by no more than chance")[0]


def test_fewer_than_20_runs_compare_nothing():
    found = copy.deepcopy(FOUND)
    for name, held in (("ours", 1), ("rival", 19)):
        found[name]["envelope"] = ran(held, 19)
    assert "envelope" not in page.page_text(found, "zh arena").split("## Ranking")[0]
    for name, held in (("ours", 1), ("rival", 20)):
        found[name]["envelope"] = ran(held, 20)
    assert "envelope: held" in page.page_text(found, "zh arena").split("## Ranking")[0]


def test_who_returns_nan_or_is_too_slow_is_not_ranked():
    found = copy.deepcopy(FOUND)
    for cause in ("NaN", "too slow"):
        other = measured(245, 1.0)
        other["maps"]["drift"]["causes"] = {cause: {"count": 200, "first_s": 0.5}}
        found[cause.split()[-1]] = other
    found["rival"]["maps"] = copy.deepcopy(found["rival"]["maps"])
    once = {"NaN": {"count": 1, "first_s": 9.0}, "OVER_SPEED": {"count": 99, "first_s": 1.0}}
    found["rival"]["maps"]["map_i"]["causes"] = once
    assert columns.ranked(found) == ["ours", "rival", "NaN", "slow"]
    text = page.page_text(found, "zh arena")
    ranked = text.split("## Ranking")[1]
    assert "| 2 | `rival` |" in ranked
    assert "| `NaN` | NaN at 0.500 s, drift, 200 of 245 |" in ranked
    assert "| `slow` | too slow at 0.500 s, drift, 200 of 245 |" in ranked
    assert "| 3 |" not in ranked
    assert "slow" not in text.split("## Ranking")[0]
    assert page.as_json(found)["slow"]["not_ranked"].startswith("too slow at")


@pytest.mark.parametrize("where", ["docs", "build", "outside"])
def test_the_links_of_the_page_lead_somewhere(tmp_path, where):
    folder = {"docs": page.DOCS, "build": ROOT / "build" / "arena", "outside": tmp_path}[where]
    with_checked = {name: each | {"checked": "x"} for name, each in FOUND.items()}
    text = page.page_text(with_checked, "zh arena", folder)
    links = [link for link in re.findall(r"\]\(([^)#]+)", text) if link != "arena.svg"]
    assert len(links) == 2
    for link in links:
        assert Path(os.path.normpath(folder / link)).is_file(), link


def test_the_page_names_the_command_that_was_given():
    few = page.command_of(["ekf"], ["../mine"], ["maps"], (21, 4, 2, 7))
    words = "--estimator ../mine --only maps --points 21 --runs 4 --bare-runs 2 --seed 7"
    assert few == f"tools/zh arena ekf {words}"
    assert page.command_of([], [], [], (0, 40, 0, 1), write=True).endswith("--seed 1 --write")


def test_kept_answers_depend_on_judges_and_not_on_pages():
    names = {str(path.relative_to(ROOT / "tools" / "zerohertz")) for path in campaign.SOURCES}
    assert all(path.is_file() for path in campaign.SOURCES)
    assert {"atlas/classes.py", "envelope/measure.py", "campaign/faults/judge.py"} <= names
    assert not [name for name in names if re.search("page|picture|output|command|compared", name)]


def test_the_page_tells_chance_from_what_is_beyond_it():
    found = copy.deepcopy(FOUND)
    for name, held in (("ours", 36), ("rival", 37)):
        found[name]["envelope"] = ran(held, 40)
        found[name]["bare"]["envelope"] = ran(held - (30 if name == "ours" else 0), 40)
    text = page.page_text(found, "zh arena")
    certain, chance = text.split("\n## ")[1].split("Better by no more than chance")
    assert "| without helpers, envelope: held | 15.0 % | rival 92.5 % |" in certain
    assert "| envelope: held | 90.0 % | rival 92.5 % |" in chance
    assert "instructions" in certain
    assert "90.0 % (76.9 to 96.0 %)" in text.split("## Ranking")[1]
    assert "rows" not in page.as_json(found)["rival"]["bare"]["envelope"]


def test_unsafe_points_cost_the_score():
    found = FOUND | {"wild": measured(245, 1.0, unsafe=100)}
    assert columns.ranked(found) == ["ours", "rival", "wild"]
    assert columns.score(found["wild"]) == pytest.approx(100.0 * 145 / 245)


def test_who_did_not_run_is_listed_and_last():
    none = {**measured(0, 0.0), "errors": ["maps: crashed, exit code -11"], "bare": {}}
    del none["maps"], none["instructions"]
    found = {"gone": none} | FOUND
    assert columns.ranked(found)[-1] == "gone"
    text = page.page_text(found, "zh arena")
    assert "## What did not run\n\n- `gone`: maps: crashed, exit code -11" in text


def test_the_picture_has_every_cell():
    drawn = picture.svg({name: each["maps"] for name, each in FOUND.items()})
    root = ElementTree.fromstring(drawn)
    paths = [e.attrib["d"] for e in root.iter() if e.tag.endswith("path")]
    assert len(paths) == 2 * len(measure.MAPS)
    assert all(path.count("M") == 35 for path in paths)  # whole lines of seven cells
    assert len(drawn) < 40_000


def arena(*words: object, out: Path) -> subprocess.CompletedProcess[str]:
    command = (sys.executable, "-m", "zerohertz", "arena", *map(str, words), "--out", str(out))
    return subprocess.run(command, capture_output=True, text=True, cwd=ROOT)


def test_a_sample_ranks_a_stranger_beside_ours_and_is_kept(tmp_path):
    broken = tmp_path / "broken.py"
    broken.write_text("import os\n\nclass Broken:\n    def init(self, params, motor): os.abort()\n")
    few = ("ours", "--only", "maps", "--points", 3, "--json")
    words = (*few, "--estimator", f"{EXAMPLE}:FluxLength", "--estimator", f"{broken}:Broken")
    done = arena(*words, out=tmp_path)
    assert done.returncode == 1, done.stderr  # Broken was asked for
    estimators = json.loads(done.stdout)["estimators"]
    assert estimators["ours"]["maps"]["map_i"]["points"] == 3
    assert estimators["ours"]["maps"]["map_i"]["oriented"] == 3
    assert "classes" not in estimators["ours"]["maps"]["map_i"]
    assert estimators["flux_length.py:FluxLength"]["maps"]["drift"]["points"] == 3
    assert estimators["broken.py:Broken"]["errors"]
    assert "`flux_length.py:FluxLength`" in (tmp_path / "arena.md").read_text()
    again = arena(*words[:-2], out=tmp_path)
    assert again.returncode == 0, again.stderr
    assert "  maps: kept" in again.stderr
    assert json.loads(again.stdout)["estimators"]["ours"] == estimators["ours"]
    figures = arena("ours", "--only", "figures", "--json", out=tmp_path / "figures")
    assert json.loads(figures.stdout)["estimators"]["ours"]["figures"]["score"] == 4


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("nobody",), "no entrant 'nobody'; there are ours"),
        (("--only", "looks"), "no 'looks'; there are maps"),
        (("ours", "--write"), "leave out names and --estimator"),
        (
            ("--estimator", "no_such"),
            "no 'no_such'; there are compensated_voltage_model, ekf, hasegawa",
        ),
    ],
)
def test_bad_options_are_refused(tmp_path, words, said):
    done = arena(*words, out=tmp_path)
    assert done.returncode == 2
    assert said in done.stderr
