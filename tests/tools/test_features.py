"""`zh atlas --features` and `--compare`: recipes as data, what they change, page, picture."""

import dataclasses
import itertools
import json
from contextlib import contextmanager

import numpy as np
import pytest

from zerohertz import param_list
from zerohertz.atlas import compare, features, features_table, points
from zerohertz.atlas.features import DROPPED, KEPT, RECIPES, REFERENCE, Recipe, recipes
from zerohertz.atlas.run import RunOptions
from zerohertz.atlas.simulate import job_of, make_bench
from zerohertz.cli import main
from zerohertz.console import tell
from zerohertz.errors import UserError
from zerohertz.paths import ROOT
from zerohertz.scenario.setup import load_setup
from zerohertz.sim import run


@contextmanager
def _bar(_text, _total):
    yield lambda _done: None


def _bench(name, folder):
    (recipe,) = recipes([name])
    return make_bench(*features_table.setup_of(recipe, folder))


def _told(bench, name):
    return (dict(bench.params) | dict(bench.firmware)).get(name, param_list.defaults()[name])


@pytest.mark.parametrize("recipe", RECIPES, ids=lambda recipe: recipe.name)
def test_a_recipe_changes_its_configuration_and_the_firmware_takes_it(recipe, tmp_path):
    setup, told = features_table.setup_of(recipe, tmp_path)
    known = setup.parameters()
    assert set(told) <= set(known)
    differs = any(told[name] != known[name] for name in told)
    whole = recipe.name in ("no_gain", "paper", "recommended")
    other_table = setup.motor_dir != load_setup(recipe.config).motor_dir
    assert whole != (differs or other_table), "the recipe tries nothing"
    assert recipe.verdict in (KEPT, DROPPED, REFERENCE)
    assert recipe.reason
    bench = make_bench(setup, told)
    assert 0.5 < bench.run_s < 7.5, "the drive reaches RUN"


def test_names_are_unique_and_unknown_ones_refused():
    assert len({r.name for r in RECIPES}) == len(RECIPES)
    assert [r.name for r in recipes(["recommended", "no_gain"])] == [
        "no_gain",
        "recommended",
    ]
    with pytest.raises(UserError, match="'nobody' is unknown"):
        recipes(["nobody"])


def test_features_are_added_one_by_one_up_to_all_of_them(tmp_path):
    whole = load_setup("recommended").parameters()
    on = [
        {k for k in features._WITHOUT if _told(_bench(name, tmp_path), k) == whole[k]}
        for name in (
            "pr",
            "pr_rs_102",
            "dead_time",
            "steering",
            "tracking",
            "recommended",
        )
    ]
    assert on[0] == set()
    assert all(small < large for small, large in itertools.pairwise(on))
    assert on[-1] == set(features._WITHOUT)


def test_a_vertex_table_is_designed_for_its_rs_and_the_firmware_keeps_the_nameplate(
    tmp_path,
):
    bench = _bench("vertex_high", tmp_path)
    designed = json.loads((tmp_path / "gain_table" / "l_gain.json").read_text())
    assert designed["inputs"]["circuit"]["Rs_ohm"] == pytest.approx(1.25 * 0.93)
    assert _told(bench, "Rs_ohm") == 0.93
    usual = json.loads((ROOT / "gain_tables/hasegawa2005_recommended/l_gain.json").read_text())
    assert designed["crc32c"] != usual["crc32c"]
    point = points.standard_map("i")[0]
    short = dataclasses.replace(point, loaded_s=1.0)
    record, other = (run(job_of(b, short)) for b in (bench, _bench("recommended", tmp_path)))
    assert not np.array_equal(record["lambda_hat_Wb"], other["lambda_hat_Wb"])


def test_a_scaled_parameter_follows_the_configuration(tmp_path):
    kp = load_setup("recommended").parameters()["adapt_kp"]
    assert _told(_bench("adapt_kp_x2", tmp_path), "adapt_kp") == 2.0 * kp


def test_a_quick_look_takes_points_from_all_over_the_map():
    few = features_table.column_points("map_i", 7)
    assert len(few) == 7
    assert few == features_table.column_points("map_i", 7)
    assert len({p.rs_ratio for p in few}) > 2
    assert features_table.column_points("map_i", 0) == points.standard_map("i")
    assert len(features_table.column_points("drift", 0)) == features_table.SIZES["drift"]
    assert features_table.column_points("random", 3) == points.random_sample(3, features_table.SEED)


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    out = tmp_path_factory.mktemp("features")
    chosen = recipes(["no_gain", "recommended"])
    with pytest.MonkeyPatch.context() as patch:
        # The drift map's 70 s say nothing about the table.
        columns = {k: v for k, v in features_table.COLUMNS.items() if k != "drift"}
        patch.setattr(features_table, "COLUMNS", columns)
        run_all = features_table.run_recipes(chosen, 6, RunOptions(out, workers=1), print, _bar)
        return list(run_all)


def test_recipes_run_and_all_features_beat_none(found):
    (_, none), (_, whole) = found
    assert {c["points"] for by in (none, whole) for c in by.values()} == {6}
    assert none["map_i"] != none["map_ii"] or none["map_ii"] != none["map_ii_duty"]
    total = [sum(c["oriented"] for c in by.values()) for by in (none, whole)]
    assert total[0] < total[1]


def test_the_page_says_how_it_was_made_and_what_differs(found, tmp_path, monkeypatch):
    monkeypatch.setattr(features_table, "PAGE", tmp_path / "features.md")
    features_table.write_page(found, [])
    text = (tmp_path / "features.md").read_text()
    assert "`tools/zh atlas --features --write`" in text
    (_, none), _ = found
    share = 100.0 * none["map_i"]["oriented"] / 6
    row = next(line for line in text.splitlines() if line.startswith("| no_gain |"))
    assert f"{share:.1f} / " in row
    assert "`tools/zh atlas --features no_gain --write`" in features_table.page(
        found[:1], ["no_gain"]
    )
    assert features_table.as_json(found, 1.0)["features"]["no_gain"]["map_i"] == none["map_i"]


def test_overrides_are_written_for_the_reader():
    recipe = Recipe("x", "g", KEPT, "r", firmware={"rs_bias": 1.0}, scaled={"adapt_kp": 2.0})
    assert recipe.overrides() == "rs_bias = 1, adapt_kp x 2"


@pytest.mark.parametrize(
    ("line", "text"),
    [
        (["--features", "nobody"], "unknown"),
        (["--features", "--write", "--points", "3"], "--write"),
        (["recommended"], "--features or --compare"),
        (["--compare", "--map", "i", "--map", "ii"], "draws only one"),
        (["--compare", "--map", "iii"], "no such map"),
        (["--map", "i", "--points", "9"], "--points: only with --features"),
    ],
)
def test_bad_input_is_one_line(line, text, monkeypatch, capsys):
    monkeypatch.setattr("sys.argv", ["zh", "atlas", *line])
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 2
    error = capsys.readouterr().err
    assert error.startswith("error: ")
    assert text in error
    assert error.count("\n") == 1


def test_maps_of_configurations_stand_in_one_picture(tmp_path, monkeypatch):
    few = [p for p in points.standard_map("i") if p.load_pu == 0.0 and p.speed_rpm == 120.0]
    monkeypatch.setattr(compare, "standard_map", lambda _name: few)
    rows = compare.run(["no_gain", "recommended"], "i", RunOptions(tmp_path, 1), tell, _bar)
    assert [len(r) for r in rows.values()] == [5, 5]
    assert list(rows) == ["no_gain", "recommended"]
    compare.write_png(tmp_path / "atlas.png", rows)
    data = (tmp_path / "atlas.png").read_bytes()
    assert data[:4] == b"\x89PNG"
    assert len(data) < 200_000
    compare.write_png(tmp_path / "again.png", rows)
    assert (tmp_path / "again.png").read_bytes() == data
