"""zh bench: the shape of its answer, and the count of instructions. Times are not tested."""

from __future__ import annotations

import json
import shutil

import pytest
import typer
from typer.testing import CliRunner

from zerohertz.bench import command, measure
from zerohertz.bench.measure import DesignTime, SimSpeed
from zerohertz.errors import UserError
from zerohertz.image import budget

TOLERANCE = 0.02


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
    known = {"images": {}, "periods": {"fig07 paper": period}, "compiler": "some"}
    monkeypatch.setattr(budget, "committed", lambda: known)


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
            "instructions": {"paper": {"mean": 555.5, "worst": 600}, "latency": 4},
            "committed": {
                "bytes": {},
                "instructions": {"paper": {"mean": 555.5, "worst": 600}, "latency": 4},
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


@pytest.mark.usefixtures("measured")
def test_the_count_can_be_stored(app: typer.Typer, tmp_path, monkeypatch) -> None:
    file = tmp_path / "docs" / "counts.json"
    monkeypatch.setattr(command, "COUNTS", file)
    assert CliRunner().invoke(app, ["bench", "--counts", "--write"]).exit_code == 0
    stored = json.loads(file.read_text())
    assert stored == {"instructions_per_step": 1000.0, "compiler": measure.compiler()}


def test_real_runs_give_speeds_of_both_inverters() -> None:
    for model in ("averaged", "switched"):
        speed = measure.simulation_speed(model, runs=1)
        # Not a limit of time: a run slower than reality means that something else is measured.
        assert speed.sim_s_per_cpu_s > 1.0
        assert speed.controller_ns_per_step > 0.0
        assert speed.plant_ns_per_step > 0.0


@pytest.mark.skipif(shutil.which("valgrind") is None, reason="valgrind is not installed")
def test_the_control_period_executes_the_committed_number_of_instructions() -> None:
    committed = json.loads(command.COUNTS.read_text())
    if committed["compiler"] != measure.compiler():
        pytest.skip(f"the count is of {committed['compiler']}, this is {measure.compiler()}")
    counted = measure.instructions_per_step()
    assert counted == pytest.approx(committed["instructions_per_step"], rel=TOLERANCE), (
        "the control period has become longer or shorter; if that is meant: "
        "tools/zh bench --counts --write"
    )


@pytest.mark.skipif(shutil.which("valgrind") is None, reason="valgrind is not installed")
def test_counting_a_run_that_cannot_start_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(measure, "SCENARIO", measure.SCENARIO.with_name("no_such.toml"))
    with pytest.raises(UserError, match="no_such"):
        measure.instructions_per_step()
