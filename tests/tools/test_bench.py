"""zh bench: the shape of its answer, and the count of instructions. Times are not tested."""

from __future__ import annotations

import importlib.metadata
import itertools
import json
import shutil

import pytest
import typer
from typer.testing import CliRunner

from zerohertz.bench import command, measure, peer
from zerohertz.bench.measure import DesignTime, SimSpeed
from zerohertz.errors import UserError
from zerohertz.image import budget, cycles, interrupt
from zerohertz.image.histogram import Row
from zerohertz.image.interrupt import Interrupt, Slot

TOLERANCE = 0.02
INTERRUPT = Interrupt(
    scenario="fig07",
    config="paper",
    periods=30_000,
    mean=555.0,
    worst=590,
    worst_period=7,
    worst_state="RUN",
    live_change=40,
    trace=200,
    cycles_per_instruction=1.5,
    slots=(Slot(0, 555.0, 590),),
    call=7,
    first=100,
    last=199,
    functions=(Row("svpwm_step", "svpwm.c", 44.0, 68.0, ()),),
)
INSTRUCTIONS = {
    "paper": {
        "mean": 555.5,
        "worst": 640,
        "worst_without_live_change": 600,
        "live_change": 40,
        "trace": 200,
    },
    "latency": 4,
}


@pytest.fixture
def app() -> typer.Typer:
    app = typer.Typer()
    command.register(app)
    app.command("other")(lambda: None)  # one command alone would lose its name
    return app


@pytest.fixture
def measured(monkeypatch: pytest.MonkeyPatch) -> None:
    speeds = {"averaged": SimSpeed(2000.04, 80.0, 60.0), "switched": SimSpeed(300.0, 81.0, 500.0)}
    monkeypatch.setattr(measure, "simulation_speed", lambda model: speeds[model])
    monkeypatch.setattr(measure, "design_time", lambda: DesignTime(1801, 905, 3.456))
    monkeypatch.setattr(measure, "instructions_per_step", lambda: 1000.004)
    monkeypatch.setattr(budget, "measure_images", lambda: {"board": {"flash_bytes": 40_000}})
    period = {"mean": 555.5, "worst": 600, "latency": 4}
    monkeypatch.setattr(budget, "measure_periods", lambda *_: {"fig07 paper": period})
    monkeypatch.setattr(budget, "measure_interrupts", lambda *_: [INTERRUPT])
    added = budget.added_figures([INTERRUPT])
    known = {"images": {}, "periods": {"fig07 paper": period}, "added": added}
    monkeypatch.setattr(budget, "compiler", lambda: "some")
    monkeypatch.setattr(budget, "rows", lambda: {"some": known})


@pytest.mark.usefixtures("measured")
def test_json_is_one_object_with_exactly_these_keys(app: typer.Typer) -> None:
    result = CliRunner().invoke(app, ["bench", "--json"])
    assert result.exit_code == 0, result.exception
    assert json.loads(result.stdout) == {
        "sil": {
            "averaged_sim_s_per_cpu_s": 2000.0,
            "switched_sim_s_per_cpu_s": 300.0,
            "controller_ns_per_step": 80.0,
            "plant_ns_per_step": 60.0,
        },
        "design": {"entries": 1801, "solves": 905, "cpu_s": 3.46},
        "callgrind": {"instructions_per_step": 1000.0},
        "image": {
            "bytes": {"board": {"flash_bytes": 40_000}},
            "instructions": INSTRUCTIONS,
            "load": {
                "model": cycles.MODEL_NAME,
                "paper": {
                    "cycles_mean": 889,
                    "cycles_worst": 1016,
                    "load_mean_percent": 2.6,
                    "load_worst_percent": 3.0,
                    "pwm_max_Hz": 82_677,
                },
            },
            "committed": {
                "bytes": {},
                "instructions": INSTRUCTIONS,
                "compiler": "some",
            },
        },
    }


@pytest.mark.usefixtures("measured")
def test_without_json_it_is_a_table(app: typer.Typer) -> None:
    result = CliRunner().invoke(app, ["bench"])
    assert result.exit_code == 0, result.exception
    for text in ("2000", "300", "3.46 CPU s", "905", "1000.0", "555.5", "board: flash_bytes"):
        assert text in result.stdout


def test_beside_a_peer_both_forms_tell_the_ratios(
    app: typer.Typer, monkeypatch: pytest.MonkeyPatch
) -> None:
    rounds = [peer.Round(0.8, 2400.0, 1200.0), peer.Round(1.0, 2000.0, 1000.0)]
    rounds.append(peer.Round(0.5, 2000.0, 1000.0))
    again = itertools.cycle(rounds)
    monkeypatch.setattr(peer, "_round", lambda *_: next(again))
    counted = peer.Instructions(firmware=1254.6, plant=759.4)
    monkeypatch.setattr(peer, "instructions", lambda _: counted)
    told = CliRunner().invoke(app, ["bench", "--peer", "--json"])
    assert told.exit_code == 0, told.exception
    result = json.loads(told.stdout)
    assert result["peer"]["package"] == "motulator 0.5.0"
    for model in ("averaged", "switched"):
        assert result["peer"][f"{model}_ratio"] == 3000.0  # of the rounds, not of the medians
        assert result["peer"][f"{model}_single_ratio"] == 1500.0
        assert result["instructions_per_period"][model] == {"firmware": 1254.6, "plant": 759.4}
    shown = CliRunner().invoke(app, ["bench", "--peer"]).stdout
    for text in ("motulator 0.5.0", "3000", "1255", "759"):
        assert text in shown


def test_the_peer_is_the_version_that_is_told() -> None:
    assert importlib.metadata.version(peer.PACKAGE) == peer.VERSION


def test_the_peer_gets_the_case_of_the_files() -> None:
    case = peer.peer_case("switched")
    assert case["model"] == "switched"
    assert case["period_s"] == pytest.approx(200e-6)
    assert case["motor"]["pole_pairs"] == 2
    assert case["speed_ref_rpm"][-1] == [1.5, 300.0]
    assert case["load_torque_Nm"][-1] == [2.2, 2.0]


@pytest.mark.skipif(shutil.which("valgrind") is None, reason="valgrind is not installed")
def test_firmware_and_plant_of_a_batch_are_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(peer, "COUNT_TO", peer.COUNT_FROM + 200)
    counted = peer.instructions("averaged")
    assert 100.0 < counted.firmware < 3000.0
    assert 50.0 < counted.plant < 3000.0


@pytest.mark.usefixtures("measured")
def test_the_count_can_be_stored(app: typer.Typer, tmp_path, monkeypatch) -> None:
    file = tmp_path / "docs" / "counts.json"
    monkeypatch.setattr(command, "COUNTS", file)
    assert CliRunner().invoke(app, ["bench", "--counts", "--write"]).exit_code == 0
    stored = json.loads(file.read_text())
    assert stored == {measure.compiler(): {"instructions_per_step": 1000.0}}


@pytest.mark.usefixtures("measured")
def test_a_compiler_without_a_row_is_measured_all_the_same(
    app: typer.Typer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(budget, "compiler", lambda: "another")
    result = CliRunner().invoke(app, ["bench", "--image", "--json"])
    image = json.loads(result.stdout)["image"]
    assert image["instructions"] == INSTRUCTIONS
    assert image["committed"] == {"bytes": {}, "instructions": {}, "compiler": "another"}


def test_one_scenario_tells_its_functions(
    app: typer.Typer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(interrupt, "measure_interrupt", lambda *_: INTERRUPT)
    shown = CliRunner().invoke(app, ["bench", "--only", "fig07"]).stdout
    for text in ("mean 555.0", "worst 590", "live change +40", "svpwm_step", "44.0"):
        assert text in shown
    told = CliRunner().invoke(app, ["bench", "--only", "fig07", "--json"]).stdout
    assert json.loads(told)["functions"][0]["function"] == "svpwm_step"


def test_all_scenarios_are_not_one(app: typer.Typer) -> None:
    result = CliRunner().invoke(app, ["bench", "--only", "all"])
    assert isinstance(result.exception, UserError)


def test_real_runs_give_speeds_of_both_inverters() -> None:
    for model in ("averaged", "switched"):
        speed = measure.simulation_speed(model, runs=1)
        # Not a limit of time: a run slower than reality means that something else is measured.
        assert speed.sim_s_per_cpu_s > 1.0
        assert speed.controller_ns_per_step > 0.0
        assert speed.plant_ns_per_step > 0.0


@pytest.mark.skipif(shutil.which("valgrind") is None, reason="valgrind is not installed")
def test_the_control_period_executes_the_committed_number_of_instructions() -> None:
    rows = json.loads(command.COUNTS.read_text())
    compiler = measure.compiler()
    assert compiler in rows, (
        f"{command.COUNTS.name} has nothing of {compiler}; measure with tools/zh bench --counts "
        "--write and commit the file"
    )
    counted = measure.instructions_per_step()
    assert counted == pytest.approx(rows[compiler]["instructions_per_step"], rel=TOLERANCE), (
        "the control period has become longer or shorter; if that is meant: "
        "tools/zh bench --counts --write"
    )


@pytest.mark.skipif(shutil.which("valgrind") is None, reason="valgrind is not installed")
def test_counting_a_run_that_cannot_start_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(measure, "SCENARIO", measure.SCENARIO.with_name("no_such.toml"))
    with pytest.raises(UserError, match="no_such"):
        measure.instructions_per_step()
