"""zh demo and zh report: pictures of known signals, and a page that says what was measured."""

from __future__ import annotations

import base64
import dataclasses
import io
import json
import re
import xml.etree.ElementTree as ElementTree
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
import typer
from PIL import Image
from rich.console import Console
from typer.testing import CliRunner

from zerohertz.check import loci
from zerohertz.check.certificate import Report as Certificate
from zerohertz.errors import UserError
from zerohertz.gain_design.table import design_table, table_json
from zerohertz.motor import load_motor, motor_toml, with_design
from zerohertz.paths import ROOT
from zerohertz.report import chart, command, demo, figure_plot, pictures, style
from zerohertz.report.experiments import EXPERIMENTS, GROUPS, SITUATIONS, observed
from zerohertz.report.page import Report, build_page, short_reason
from zerohertz.report.tables import TableOutcome, _difference, check_tables
from zerohertz.scenario import evaluate
from zerohertz.scenario.evaluate import Result
from zerohertz.scenario.predicates import FIGURES, Clause, Judgement, measure_ramp, measure_step
from zerohertz.scenario.setup import load_setup
from zerohertz.scenario.signals import Signals

SOURCE = "configuration some, rig some, seed 1"


def signals(ramp: bool = False, wild: bool = False, trips: bool = False) -> Signals:
    """A run of protocol S, or R: quiet, or with an estimate that jumps after the event."""
    t_s = np.arange(0.0, 100.0 if ramp else 45.0, 1e-3)
    event_s = 12.0
    since = np.maximum(t_s - event_s, 0.0)
    ref = np.full_like(t_s, 60.0) if ramp else np.where(t_s < event_s, 300.0, 0.0)
    speed = ref + (0.0 if ramp else 300.0 * np.exp(-3.0 * since) * (t_s >= event_s))
    hat = speed + (np.where(np.arange(len(t_s)) % 2, 5e3, -5e3) * (since > 1.0) if wild else 1.0)
    load = -8.4 * np.clip(since / 40.0, 0.0, 1.0) if ramp else np.full_like(t_s, 4.2)
    if ramp:
        speed = speed + 200.0 * (since > 60.0)
    return Signals(
        event_s=event_s,
        i_q_limit_A=15.0,
        lambda_max_Wb=2.0,
        speed_hat_max_rpm=3000.0,
        trip=int(trips),
        trip_s=event_s + 2.0 if trips else np.nan,
        first_fault=int(trips),
        t_s=t_s,
        speed_ref_rpm=ref,
        speed_rpm=speed,
        speed_hat_rpm=hat,
        i_q_ref_A=np.clip(load + 25.0 * (since > 5.0) * wild, -15.0, 15.0),
        i_q_A=load + 0.1,
        load_Nm=load,
        f_s_Hz=speed / 30.0,
        i_abs_A=np.full_like(t_s, 6.0),
        lambda_hat_Wb=np.full_like(t_s, 0.5),
        faults=np.where((since > 2.0) & trips, 1.0, 0.0),
    )


def judgement(match: bool, ramp: bool = False) -> Judgement:
    run = signals(ramp)
    measures = measure_ramp(run) if ramp else measure_step(run)
    clauses = [Clause('ripple of w < "half" & more', 2.0, 3.0, 0.3)]
    if not match:
        clauses += [Clause(f"number {k}", 9.0, 3.0, -k - 1.0) for k in range(4)]
    return Judgement(tuple(clauses), measures.as_dict())


@pytest.fixture(scope="module")
def report() -> Report:
    def result(key: str, match: bool, ramp: bool) -> Result:
        other = judgement(True, ramp)
        return Result(key, "PREDICATE <" + key + ">", (other, judgement(match, ramp)))

    results = [result(str(n), n % 2 == 0, n >= 17) for n in FIGURES]
    situations = [result(name, True, n >= 17) for name, n in evaluate.SITUATIONS.items()]
    picture = chart.experiment(signals(), SOURCE)
    certificate = Certificate("m", "gamma_pr", 1801, 1801, 0.32, 35.8, 0.999, 3.7, {}, (), ())
    setup = load_setup("paper")
    return Report(
        paper=setup,
        results=results,
        pictures={str(n): picture for n in FIGURES} | dict.fromkeys(SITUATIONS, picture),
        recommended=setup,
        situations=situations,
        tables=[TableOutcome("m", Path("m"), "gamma_pr", 1801, 4.0, 1e-5, certificate)],
        sensitivity={"1%": 9.5, "3%": 7.25, "10%": 4.0},
        sensitivity_source="committed result, tools/docs/figures_paper.json",
        versions=[("zerohertz", "<0.1>")],
    )


# ---- plots ------------------------------------------------------------------------------------


def test_thinning_keeps_every_spike_and_the_order_of_time() -> None:
    t_s = np.arange(100_000) * 1e-3
    values = np.sin(t_s)
    values[[7, 50_001, 99_998]] = (40.0, -30.0, 20.0)
    thin_t_s, thin = figure_plot.extremes(t_s, values, buckets=100)
    assert len(thin) <= 400
    assert np.all(np.diff(thin_t_s) > 0.0)
    assert {40.0, -30.0, 20.0} <= set(thin)
    assert (thin_t_s[0], thin_t_s[-1]) == (t_s[0], t_s[-1])


@pytest.mark.parametrize(
    "run",
    [signals(), signals(ramp=True), signals(wild=True), signals(trips=True)],
    ids=["step", "ramp", "wild", "trip"],
)
def test_a_plot_is_svg_with_the_panels_of_its_protocol(run: Signals) -> None:
    with figure_plot.draw(run, SOURCE) as drawn:
        titles = [axes.get_title(loc="left") for axes in drawn.axes]
        picture = style.svg(drawn)
    assert ElementTree.fromstring(picture).tag == "{http://www.w3.org/2000/svg}svg"
    assert len(picture) < 600_000
    ramp = np.ptp(run.load_Nm) > 0.0
    assert [t.split(" [")[0] for t in titles[:3]] == ["speed", "torque current", "stator frequency"]
    assert (len(titles) == 4) == ramp


def drawn_texts(run: Signals) -> set[str]:
    with figure_plot.draw(run, SOURCE) as drawn:
        return {text.get_text() for axes in drawn.axes for text in axes.texts}


def test_what_leaves_the_view_is_said() -> None:
    assert not any("off scale" in text for text in drawn_texts(signals()))
    assert "off scale: beyond −3000 and beyond 3000" in drawn_texts(signals(wild=True))


def test_the_end_of_a_run_is_marked() -> None:
    assert not {"lost", "trip"} & drawn_texts(signals())
    assert "trip" in drawn_texts(signals(trips=True))
    assert "lost" in drawn_texts(signals(ramp=True))


def test_a_picture_names_configuration_rig_and_seed() -> None:
    setup = load_setup("recommended")
    source = pictures.source(evaluate.Run(setup, 18, 3))
    assert source == "configuration recommended, rig hasegawa2005, seed 3"
    with figure_plot.draw(signals(), source) as drawn:
        assert source in [text.get_text() for text in drawn.texts]
    changed = dataclasses.replace(setup, rig_overrides={"motor.Rs_ohm": 1.0})
    assert (
        pictures.source(evaluate.Run(changed, 18, 3)).split(", ")[1] == "rig hasegawa2005 changed"
    )


def test_the_same_run_gives_the_same_bytes() -> None:
    found = []
    for _ in range(2):
        with figure_plot.draw(signals(), SOURCE) as drawn:
            found.append((style.svg(drawn), style.png(drawn, 800)))
    assert found[0] == found[1]


def test_a_png_has_the_width_asked_for() -> None:
    with figure_plot.draw(signals(ramp=True), SOURCE, title="a title") as drawn:
        data = style.png(drawn, 1200)
    assert Image.open(io.BytesIO(data)).width == 1200
    assert len(data) < 150_000


# ---- words ------------------------------------------------------------------------------------


def test_every_figure_has_its_words_once() -> None:
    assert tuple(EXPERIMENTS) == FIGURES
    assert tuple(n for group in GROUPS for n in group.figures) == FIGURES
    assert set(SITUATIONS) == set(evaluate.SITUATIONS)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({}, "stays within 60 min⁻¹; ripple ω"),
        ({"faulted": True, "trip": "over current"}, "trips (over current)"),
        ({"trip": "plant diverged", "sustained_error_rpm": None}, "trips (plant diverged)"),
        ({"peak_speed_rpm": 5000.0}, "runs away beyond 3000 min⁻¹"),
        ({"peak_speed_rpm": None}, "runs away beyond 3000 min⁻¹"),
        ({"sustained_error_rpm": 140.0}, "loses the speed, off by 140 min⁻¹"),
        ({"worst_second_limit_share": 0.7}, "at its limit for 70 % of a second"),
        ({"pre_error_rpm": 200.0}, "does not reach 300"),
    ],
)
def test_a_step_is_described_by_what_was_measured(change: dict, words: str) -> None:
    measured = dict(measure_step(signals()).as_dict()) | {"hold_error_rpm": 60.0} | change
    assert words in observed(measured)


def test_a_ramp_is_described_by_where_it_was_lost() -> None:
    measured = dict(measure_ramp(signals(ramp=True)).as_dict())
    assert observed(measured).startswith("lost after 60.0 s, in the dwell at 100 % load; +2.00 Hz")
    early = observed(measured | {"lost_s": 20.0, "lost_pu": 0.5})
    assert early.startswith("lost after 20.0 s, in the ramp at 50 % load")
    held = observed(measured | {"lost_s": None, "lost_pu": None, "f_s_end_Hz": -0.25})
    assert held == "held to the end; −0.25 Hz at the end of the ramp"


def test_the_short_reason_names_the_worst_clauses_and_counts_the_rest() -> None:
    result = Result("7", "P", (judgement(False),))
    assert short_reason(result).startswith("number 3: 9 (threshold 3); number 2: 9")
    assert short_reason(result).endswith("; 2 more")
    assert short_reason(Result("7", "P", (judgement(True),))) == ""


# ---- the page ---------------------------------------------------------------------------------


class Reader(HTMLParser):
    """Tags in balance, links, texts."""

    VOID = frozenset(("meta", "img"))

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.attributes: list[tuple[str, str, str]] = []
        self.text = ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.attributes += [(tag, name, value or "") for name, value in attrs]
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text += data


@pytest.fixture(scope="module")
def read(report: Report) -> Reader:
    reader = Reader()
    reader.feed(build_page(report))
    return reader


def test_the_page_is_whole_and_needs_nothing_from_outside(read: Reader) -> None:
    assert read.open == []
    assert not {"link", "iframe"} & {tag for tag, _, _ in read.attributes}
    for tag, name, value in read.attributes:
        if name in ("src", "href"):
            assert value.startswith(("data:image/png;base64,", "data:image/gif;base64,", "#")), tag
    assert not re.search(r"url\(|@import|https?:|fetch\(|import\(", read.text)


def test_every_link_of_the_page_leads_somewhere(read: Reader) -> None:
    names = {value for _, name, value in read.attributes if name == "id"}
    targets = {v.removeprefix("#") for _, name, v in read.attributes if name == "href"}
    assert targets <= names


def test_pictures_are_the_ones_handed_in(read: Reader, report: Report) -> None:
    drawn = [value for _, name, value in read.attributes if name == "data-chart"]
    assert len(drawn) == len(FIGURES) + len(SITUATIONS)
    assert drawn[0] == report.pictures["no_load"].json()
    assert read.text.index("Recommended drive") < read.text.index("Thirteen experiments")


def levels(line: dict, name: str = "y") -> np.ndarray:
    """As chart.js unpacks them."""
    packed = line["packed"][name]
    counts = np.frombuffer(base64.b64decode(packed["data"]), dtype="<i2")
    return packed["low"] + packed["step"] * counts


def test_a_chart_keeps_every_spike_of_a_signal() -> None:
    run = signals(wild=True)
    speed = json.loads(chart.experiment(run, SOURCE).json())["panels"][0]
    part = run.window(*figure_plot.STEP_WINDOW_S)
    for line, name in zip(
        speed["lines"], ("speed_hat_rpm", "speed_rpm", "speed_ref_rpm"), strict=True
    ):
        given, shown = getattr(run, name)[part], levels(line)
        rounding = np.ptp(given) / 60_000
        assert (shown.min(), shown.max()) == pytest.approx((given.min(), given.max()), abs=rounding)
        assert np.all(shown[0::2] <= shown[1::2])
    assert speed["note"] == "off scale: beyond −3000 and beyond 3000"


def test_a_chart_has_the_panels_and_marks_of_its_protocol() -> None:
    step = json.loads(chart.experiment(signals(trips=True), SOURCE).json())
    assert [panel["title"].split(" [")[0] for panel in step["panels"]] == [
        "speed", "torque current", "stator frequency",
    ]  # fmt: skip
    assert step["panels"][1]["limits"] == [-15.0, 15.0]
    assert [text for _, text in step["marks"]] == ["", "trip"]
    ramp = json.loads(chart.experiment(signals(ramp=True), SOURCE).json())
    assert ramp["panels"][3]["title"].startswith("load torque")
    assert [text for _, text in ramp["marks"]] == ["", "lost"]


def test_the_charts_of_a_gain_table_show_its_poles_and_its_proof() -> None:
    table = loci.read(ROOT / "gain_tables" / "hasegawa2005" / "l_gain.json")
    drawn = json.loads(chart.root_loci(table).json())["panels"][0]["lines"]
    real = np.concatenate([levels(line, "x") for line in drawn])
    poles = np.concatenate([table.motor_poles.ravel(), table.observer_poles.ravel()])
    assert (real.min(), real.max()) == pytest.approx((poles.real.min(), poles.real.max()), abs=0.1)
    proven, floor = json.loads(chart.orientation(table).json())["panels"][0]["lines"]
    assert np.all(levels(proven) >= levels(floor) - 1e-2)


def test_what_does_not_match_is_shown_as_not_matching(report: Report) -> None:
    page = build_page(report)
    missed = sum(not r.match for r in report.results)
    assert missed == 6
    assert page.count('<article class="card miss" id="fig') == missed
    assert page.count("✗ does not match") == 2 * missed  # in the table and beside the picture
    assert page.count("✓ matches") == 2 * (13 - missed)
    assert f"<b>{13 - missed} of 13</b>" in page
    for result in report.results:
        if not result.match:
            assert f'class="chip no" href="#fig{result.key}"' in page


def test_texts_from_data_are_escaped_and_present(report: Report, read: Reader) -> None:
    page = build_page(report)
    assert "PREDICATE <7>" in read.text
    assert "PREDICATE <7>" not in page
    assert "<0.1>" not in page
    for text in ("1/2", "9.50", "7.25", "committed result", "35.8°", "1801 of 1801", "J_kg_m2"):
        assert text in read.text


def test_a_report_without_sensitivity_or_recommendation_says_so(report: Report) -> None:
    bare = dataclasses.replace(
        report,
        sensitivity=None,
        sensitivity_source="never computed",
        recommended=None,
        situations=[],
        pictures={},
    )
    page = build_page(bare)
    assert "Not in this report: never computed" in page
    assert "There is none in host_sim/configs yet" in page
    assert "no picture" in page


def test_a_redesign_is_compared_gain_by_gain() -> None:
    gain = np.array([[3.0, 4.0, 0.0, 1.0], [30.0, 40.0, 0.0, 10.0]], dtype=np.float32)
    assert _difference(gain, gain) == 0.0
    moved = gain.copy()
    moved[1, 0] += np.float32(0.05)  # |l1| = 50
    assert _difference(gain, moved) == pytest.approx(1e-3, rel=1e-3)
    assert _difference(gain[:1], gain) == float("inf")


def test_a_table_is_redesigned_compared_and_proven(tmp_path: Path) -> None:
    short = with_design(load_motor(ROOT / "gain_tables" / "hasegawa2005"), table_end_elec_per_min=8)
    folder = tmp_path / "motor"
    folder.mkdir()
    (folder / "motor.toml").write_text(motor_toml(short))
    (folder / "l_gain.json").write_text(table_json(design_table(short)))
    (good,) = check_tables([folder], tmp_path / "fresh", 1, lambda done: None)
    assert good.holds
    assert (good.entries, good.certificate.proven, good.difference) == (5, 5, 0.0)
    assert (tmp_path / "fresh" / short.name / "l_gain.json").is_file()
    # Without a fresh design only its proof counts.
    (kept,) = check_tables([folder], None, 1, lambda done: None)
    assert kept.holds
    assert kept.difference is None
    # A table of other requirements is proven, but it is not the one that motor.toml gives.
    other = with_design(short, decay_per_s=2.0)
    (folder / "motor.toml").write_text(motor_toml(other))
    (bad,) = check_tables([folder], tmp_path / "fresh", 1, lambda done: None)
    assert not bad.holds


# ---- the whole --------------------------------------------------------------------------------


def test_the_demo_runs_every_experiment_and_writes_the_page(
    tmp_path: Path, report: Report, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Design and proof have tests of their own, of half a minute each.
    monkeypatch.setattr(demo, "check_tables", lambda folders, *_: report.tables)
    monkeypatch.setattr(demo, "_design_pictures", lambda *_: {})
    setup = load_setup("paper")
    said = io.StringIO()
    made = demo.make_report(
        setup, setup, tmp_path, seeds=1, workers=2, console=Console(file=said, width=100)
    )
    assert [r.key for r in made.results] == [str(n) for n in FIGURES]
    assert set(made.pictures) == {str(n) for n in FIGURES} | set(SITUATIONS)
    page = (tmp_path / "index.html").read_text(encoding="utf-8")
    assert page.count("data-chart=") == 17
    assert len(page) < 8_000_000
    assert (tmp_path / "figures.json").is_file()
    assert re.findall(r"^\[(\d)/6\] .*: [\d.]+ s$", said.getvalue(), re.M) == list("123456")


@pytest.mark.parametrize(("difference", "code"), [(1e-5, 0), (2e-3, 1)])
def test_the_demo_fails_when_a_gain_table_is_not_the_designed_one(
    tmp_path: Path,
    report: Report,
    monkeypatch: pytest.MonkeyPatch,
    difference: float,
    code: int,
) -> None:
    table = dataclasses.replace(report.tables[0], difference=difference)
    made = dataclasses.replace(report, tables=[table])
    (tmp_path / "index.html").write_text("page")
    monkeypatch.setattr(demo, "make_report", lambda *_, **__: made)
    app = typer.Typer()
    command.register(app)
    result = CliRunner().invoke(app, ["demo", "--out", str(tmp_path)])
    assert result.exit_code == code, result.exception
    assert "7 of 13 figures match" in result.stdout
    assert str(tmp_path / "index.html") in result.stdout
    assert ("do not hold" in result.stdout) == bool(code)


def test_a_folder_that_cannot_be_is_refused_before_any_work() -> None:
    app = typer.Typer()
    command.register(app)
    for folder in ("/proc/none", "/etc/passwd/none"):
        result = CliRunner().invoke(app, ["demo", "--out", folder])
        assert isinstance(result.exception, UserError)
        assert f"--out: {folder}: " in str(result.exception)


def test_the_hold_is_enlarged_where_the_drive_holds() -> None:
    for wild in (False, True):
        with figure_plot.draw(signals(wild=wild), SOURCE) as drawn:
            insets = [c for c in drawn.axes[0].child_axes if c.get_title("left")]
            assert len(insets) == (0 if wild else 1)
            if not wild:
                assert insets[0].get_ylim() == (-5.0, 5.0)


def test_a_picture_is_written_for_a_readme(tmp_path: Path) -> None:
    app = typer.Typer()
    command.register(app)
    file = tmp_path / "new" / "fig18.png"
    words = ["report", "--figure", "18", "--png", str(file)]
    result = CliRunner().invoke(app, words)
    assert result.exit_code == 0, result.exception
    assert Image.open(file).width == 1200
    assert file.stat().st_size < 150_000
    refused = CliRunner().invoke(app, [*words[:-1], "/proc/none/fig18.png"])
    assert isinstance(refused.exception, UserError)


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        ([], "give one of them"),
        (["--figure", "18", "--situation", "no_load"], "give one of them"),
        (["--situation", "storm"], "there are no_load, load_50"),
        (["--figure", "6", "--config", "nothing"], "there are no_gain, paper, recommended"),
        (["--figure", "6", "--png", "x.jpg"], "only PNG is written"),
    ],
)
def test_a_senseless_picture_is_refused(words: list[str], complaint: str, tmp_path: Path) -> None:
    app = typer.Typer()
    command.register(app)
    result = CliRunner().invoke(app, ["report", "--png", str(tmp_path / "x.png"), *words])
    assert isinstance(result.exception, UserError)
    assert complaint in str(result.exception)
