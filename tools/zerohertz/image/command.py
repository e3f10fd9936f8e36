"""`zh pil`: the flash image on an emulated core, in closed loop with the plant, bit for bit."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from zerohertz.console import tell
from zerohertz.errors import UserError
from zerohertz.estimators import chosen
from zerohertz.options import Estimator, Json

if TYPE_CHECKING:
    from zerohertz import sim
    from zerohertz.image import loop

# Configuration -> preset of the image that carries its gain table and parameters.
PRESETS = {
    "paper": "qemu_mps2_paper",
    "recommended": "qemu_mps2",
    "all_options": "qemu_mps2",
}
# `recommended` with everything on that costs instructions: the worst case of the control period.
ALL_OPTIONS = {
    "voltage_source": 0,
    "observer_method": 1,
    "phi_factor": 0.5,
    "dead_time_fraction": 1.0,
    "eps1_mode": 2,
    "decoupling": 1.0,
    "min_pulse_s": 2e-6,
}
# A start that the short scenario has time for. What it finds is of little use: the drive falls back
# to I-f and returns, again and again, which is what makes its worst period.
SHORT_START = {"rs_level_s": 0.05, "premagnetise_s": 0.2, "dead_time_identify": 1}
# With every configuration the drive reaches RUN in it.
LONG_ENOUGH = "fig07 --max-periods 30000"
# Boards whose objects also make a program of the emulated board, with the table of `recommended`.
BOARDS = ("stm32g431_esc", "stm32g431_ihm08m1")
MACHINES = {"an386": "mps2-an386", "an500": "mps2-an500"}


@dataclasses.dataclass(frozen=True)
class Experiment:
    """One scenario with one configuration, first noise seed."""

    scenario: str
    config: str

    @property
    def name(self) -> str:
        return f"{self.scenario} {self.config}"


def register(app: typer.Typer) -> None:
    """Add `zh pil`."""
    app.command("pil")(pil)


def pil(
    scenario: Annotated[
        str, typer.Argument(help="Scenario: fig06 .. fig18, a file of host_sim/scenarios, or all.")
    ] = "all",
    config: Annotated[
        str | None,
        typer.Option(help="Configuration: paper, recommended, or all_options (every option on)."),
    ] = None,
    machine: Annotated[
        str, typer.Option(help="Emulated machine: an386 (Cortex-M4F) or an500 (Cortex-M7).")
    ] = "an386",
    estimator: Estimator = None,
    board: Annotated[
        str | None,
        typer.Option(
            help="The firmware's objects as built for this board: stm32g431_esc or "
            "stm32g431_ihm08m1. Runs the experiments of `recommended`."
        ),
    ] = None,
    max_periods: Annotated[
        int | None, typer.Option(min=1, help="Stop each run after this many control periods.")
    ] = None,
    fieldbus: Annotated[
        str | None,
        typer.Option(help="A master on this bus commands, not a scenario: modbus, canopen, all."),
    ] = None,
    as_json: Json = False,
) -> None:
    """Run the flash image on an emulated core in closed loop, and compare it with the SIL.

    The image's duties drive the plant. Every signal of firmware/unit/signal_list.def is compared
    bit for bit in every control period. The first difference ends the run with exit 1. The command
    also counts the instructions of the control period, worst and mean. A run in which the drive
    never reached RUN is named: it compared nothing of the estimator.
    """
    if machine not in MACHINES:
        raise UserError(f"--machine: no '{machine}'; there are {', '.join(MACHINES)}")
    if board is not None and board not in BOARDS:
        raise UserError(f"--board: no '{board}'; there are {', '.join(BOARDS)}")
    if board is not None and config not in (None, "recommended", "all_options"):
        raise UserError(f"--config: {board} has no gain table of '{config}'; leave it out")
    chosen.refuse_python(estimator)
    chosen.use(estimator)
    if fieldbus is not None:
        found = [(Experiment(bus, "fieldbus"), on_a_bus(bus, machine)) for bus in buses(fieldbus)]
        _report(found, as_json)
        return
    to_run = experiments(scenario, config or ("recommended" if board else None))
    console = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn())
    runs = []
    with Progress(*columns, TimeRemainingColumn(), console=console) as progress:
        task = progress.add_task("processor in the loop", total=len(to_run))
        for experiment in to_run:
            progress.update(task, description=experiment.name)
            runs.append((experiment, measure(experiment, MACHINES[machine], max_periods, board)))
            progress.advance(task)
    _report(runs, as_json)


def buses(name: str) -> list[str]:
    """Those whose session to run; UserError with the choices for a name that is none."""
    from zerohertz.image.bus_session import SESSIONS

    if name != "all" and name not in SESSIONS:
        raise UserError(f"--fieldbus: no '{name}'; there are all, {', '.join(SESSIONS)}")
    return [bus for bus in SESSIONS if name in ("all", bus)]


def on_a_bus(bus: str, machine: str) -> loop.PilRun:
    """The session of its master on the image with fieldbuses."""
    from zerohertz.build import build_image
    from zerohertz.image.bus_session import SESSIONS

    return SESSIONS[bus]().on_the_image(build_image("qemu_mps2_fieldbus"), MACHINES[machine])[0]


def _report(runs: list[tuple[Experiment, loop.PilRun]], as_json: bool) -> None:
    """Exit 1 when a bit differs."""
    result = summary(runs)
    if as_json:
        print(json.dumps(result))
    else:
        _show(result)
    for experiment, run in runs:
        if text := never_ran(experiment, run):
            tell(text)
    if result["differing_runs"]:
        raise typer.Exit(1)


def never_ran(experiment: Experiment, run: Any) -> str:
    """What to say of a run without a single period in state RUN; empty: it had some."""
    if run.run_periods:
        return ""
    return (
        f"{experiment.name}: the drive did not reach RUN in {run.periods} periods; only its start "
        f"was compared; take `zh pil {LONG_ENOUGH}`"
    )


def experiments(scenario: str, config: str | None) -> list[Experiment]:
    """What to run; UserError with the choices for a name that is none."""
    from zerohertz.scenario.evaluate import SITUATIONS
    from zerohertz.scenario.predicates import FIGURES
    from zerohertz.scenario.setup import SCENARIOS

    if config is not None and config not in PRESETS:
        raise UserError(f"--config: no image of '{config}'; there are {', '.join(PRESETS)}")
    if scenario == "all":
        paper = [Experiment(f"fig{n:02d}", "paper") for n in FIGURES]
        recommended = [Experiment(f"fig{n:02d}", "recommended") for n in SITUATIONS.values()]
        return [e for e in paper + recommended if config in (None, e.config)]
    known = sorted(path.stem for path in SCENARIOS.glob("*.toml"))
    if scenario not in known:
        raise UserError(f"SCENARIO: no '{scenario}'; there are all, {', '.join(known)}")
    return [Experiment(scenario, config or "paper")]


def job_of(experiment: Experiment, max_periods: int | None) -> sim.Job:
    """The run of the plant for an experiment."""
    from zerohertz import sim
    from zerohertz.scenario.setup import SCENARIOS, load_setup

    extra: dict[str, float] = {}
    if experiment.config == "all_options":
        extra = ALL_OPTIONS | (SHORT_START if experiment.scenario == "smoke" else {})
    setup = load_setup("recommended" if extra else experiment.config)
    return sim.Job(
        scenario=Path(SCENARIOS / f"{experiment.scenario}.toml"),
        rig=setup.rig,
        board=setup.board,
        motor_dir=setup.motor_dir,
        firmware_config=setup.params,
        firmware=extra,
        seed=1,
        decimate=1_000_000,  # the record is of no interest
        max_steps=max_periods,
    )


def measure(
    experiment: Experiment, machine: str, max_periods: int | None, board: str | None = None
) -> loop.PilRun:
    """One run on the emulated core, of its own image or of a board's objects."""
    from zerohertz.build import build_image
    from zerohertz.image import loop

    image = build_image(board, "zh_mps2") if board else build_image(PRESETS[experiment.config])
    return loop.run(job_of(experiment, max_periods), image, machine=machine)


def summary(runs: list[tuple[Experiment, Any]]) -> dict[str, Any]:
    """All runs as one JSON object."""
    periods, seconds = _total(runs, "periods"), _total(runs, "loop_s")
    return {
        "runs": [dataclasses.asdict(e) | _as_json(run) for e, run in runs],
        "periods": periods,
        "differing_runs": sum(run.end.name != "EQUAL" for _, run in runs),
        "differing_bits": _total(runs, "differing_bits"),
        "periods_per_s": round(periods / seconds) if seconds > 0.0 else 0,
        "mean_instructions": round(_mean_instructions(runs), 1),
        "worst_instructions": _worst(runs, "worst_instructions"),
        "worst_latency_instructions": _worst(runs, "worst_latency_instructions"),
        "late_periods": _total(runs, "late_periods"),
        "stack_bytes": _worst(runs, "stack_bytes"),
        "stack_used_bytes": _worst(runs, "stack_used_bytes"),
    }


def _total(runs: list[tuple[Experiment, Any]], name: str) -> Any:
    return sum(getattr(run, name) for _, run in runs)


def _worst(runs: list[tuple[Experiment, Any]], name: str) -> int:
    return max(getattr(run, name) for _, run in runs)


def _mean_instructions(runs: list[tuple[Experiment, Any]]) -> float:
    """Of all periods in state RUN."""
    started = [run for _, run in runs if run.mean_instructions > 0.0]
    weight = sum(run.run_periods for run in started)
    return sum(run.mean_instructions * run.run_periods for run in started) / max(weight, 1)


def _as_json(run: Any) -> dict[str, Any]:
    figures = (f.name for f in dataclasses.fields(run) if f.name not in ("each", "bus_said"))
    words = {name: getattr(run, name) for name in figures}
    return words | {
        "end": run.end.name.lower(),
        "periods_per_s": round(run.periods_per_s),
        "mean_instructions": round(run.mean_instructions, 1),
        "loop_s": round(run.loop_s, 3),
    }


def _show(result: dict[str, Any]) -> None:
    title = "processor in the loop: image against SIL, instructions of a control period"
    table = Table(title=title, title_justify="left")
    for name in ("scenario", "config"):
        table.add_column(name, no_wrap=True)
    for name in ("periods", "bits off", "mean", "worst", "periods/s"):
        table.add_column(name, justify="right", no_wrap=True)
    for run in result["runs"]:
        table.add_row(*_cells(run["scenario"], run["config"], run))
    table.add_section()
    table.add_row(*_cells("all", "", result))
    console = Console()
    console.print(table)
    for run in result["runs"]:
        if run["end"] != "equal":
            what = run["difference"] or f"the image ended with code {run['exit_code']}"
            console.print(f"{run['scenario']} {run['config']}: {what}", highlight=False)
            console.print(run["text"], highlight=False, end="")


def _cells(scenario: str, config: str, run: dict[str, Any]) -> tuple[str, ...]:
    return (
        *(scenario, config, str(run["periods"]), str(run["differing_bits"])),
        *(f"{run['mean_instructions']:.0f}", str(run["worst_instructions"])),
        str(run["periods_per_s"]),
    )
