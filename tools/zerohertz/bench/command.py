"""`zh bench`: times and counts in one call."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from zerohertz.errors import UserError
from zerohertz.paths import ROOT

COUNTS = ROOT / "tools" / "docs" / "bench_counts.json"
IMAGE = ROOT / "tools" / "docs" / "image_budget.json"
# Of every scenario, so that the bench stays a matter of half a minute; all of it with --write.
IMAGE_PERIODS = 30_000
# Goals: simulated seconds per CPU second, CPU seconds of a design.
GOALS = {"averaged": 2000.0, "switched": 500.0, "design": 4.0}


def register(app: typer.Typer) -> None:
    """Add `zh bench`."""
    app.command("bench")(bench)


def bench(
    counts: Annotated[
        bool, typer.Option("--counts", help="Only count instructions, no times.")
    ] = False,
    image: Annotated[
        bool, typer.Option("--image", help="Only the flash images: bytes and instructions.")
    ] = False,
    only: Annotated[
        str | None,
        typer.Option(help="Only this scenario on the image, with its functions; seconds."),
    ] = None,
    config: Annotated[
        str, typer.Option(help="With --only: paper, recommended or all_options.")
    ] = "paper",
    worst: Annotated[
        bool, typer.Option("--worst", help="With --only: the functions of the worst period.")
    ] = False,
    rows: Annotated[int, typer.Option(min=1, help="With --only: how many functions.")] = 30,
    write: Annotated[
        bool,
        typer.Option(
            "--write", help=f"Store {COUNTS.name} or, with --image, {IMAGE.name} (for a commit)."
        ),
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON object on stdout.")] = False,
) -> None:
    """Measure the simulation, the gain design, the control period and the flash images.

    Times are CPU time, medians of several runs, and are only reported; the tests hold instructions
    and bytes to the committed ones.
    """
    from zerohertz.bench import measure

    if only is not None:
        _bench_one(only, config, worst, rows, as_json)
        return
    console = Console(stderr=True)
    result: dict[str, Any] = {}
    if not counts and not image:
        console.print("measuring the closed loop, averaged inverter", highlight=False)
        averaged = measure.simulation_speed("averaged")
        console.print("measuring the closed loop, switched inverter", highlight=False)
        switched = measure.simulation_speed("switched")
        console.print("measuring the gain design", highlight=False)
        design = measure.design_time()
        result = {
            "sil": {
                "averaged_sim_s_per_cpu_s": round(averaged.sim_s_per_cpu_s, 1),
                "switched_sim_s_per_cpu_s": round(switched.sim_s_per_cpu_s, 1),
                "controller_ns_per_step": round(averaged.controller_ns_per_step, 1),
                "plant_ns_per_step": round(averaged.plant_ns_per_step, 1),
            },
            "design": {
                "entries": design.entries,
                "solves": design.solves,
                "cpu_s": round(design.cpu_s, 2),
            },
        }
    if not image:
        console.print("counting instructions", highlight=False)
        result["callgrind"] = {"instructions_per_step": round(measure.instructions_per_step(), 2)}
        if write:
            _write(COUNTS, result["callgrind"], measure.compiler())
    if not counts:
        result["image"] = _measure_image(console, write and image)
    if as_json:
        print(json.dumps(result))
    else:
        _show(result)


def _bench_one(scenario: str, config: str, worst: bool, rows: int, as_json: bool) -> None:
    from zerohertz.bench import one
    from zerohertz.image.command import experiments

    if scenario == "all":
        raise UserError("--only: takes one scenario; without it all of them are measured")
    (experiment,) = experiments(scenario, config)
    result = one.measure_one(experiment, IMAGE_PERIODS, worst)
    if as_json:
        print(json.dumps(result))
    else:
        one.show(result, rows)


def _measure_image(console: Console, write: bool) -> dict[str, Any]:
    """Bytes of every port, instructions of every experiment, each beside the committed figure."""
    from zerohertz.image import budget

    ports = budget.measure_images()
    with Progress(console=console) as progress:
        chosen = budget.every_experiment()
        task = progress.add_task("flash image on the emulated core", total=len(chosen))
        periods = budget.measure_periods(
            chosen, None if write else IMAGE_PERIODS, lambda _: progress.advance(task)
        )
    if write:
        budget.write(ports, periods)
    known = budget.committed()
    return {
        "bytes": ports,
        "instructions": budget.overall(periods),
        "committed": {
            "bytes": known["images"],
            "instructions": budget.overall(known["periods"]),
            "compiler": known["compiler"],
        },
    }


def _write(file: Path, counted: dict[str, float], compiler: str) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(json.dumps(counted | {"compiler": compiler}, indent=1) + "\n", encoding="utf-8")


def _show(result: dict[str, Any]) -> None:
    table = Table(title="bench", title_justify="left")
    table.add_column("what")
    table.add_column("measured", justify="right")
    table.add_column("goal", justify="right")
    if "sil" in result:
        sil, design = result["sil"], result["design"]
        for model in ("averaged", "switched"):
            speed = sil[f"{model}_sim_s_per_cpu_s"]
            what = f"simulated s per CPU s, {model} inverter"
            table.add_row(what, f"{speed:.0f}", f"{GOALS[model]:.0f}")
        table.add_row("controller, per 200 µs step", f"{sil['controller_ns_per_step']:.0f} ns", "")
        table.add_row("plant, averaged, per step", f"{sil['plant_ns_per_step']:.0f} ns", "")
        what = f"gain table of {design['entries']} entries"
        table.add_row(what, f"{design['cpu_s']:.2f} CPU s", f"{GOALS['design']:.0f} CPU s")
        table.add_row("solves of that table", str(design["solves"]), f"{design['entries']}")
    if "callgrind" in result:
        count = result["callgrind"]["instructions_per_step"]
        table.add_row("instructions per control period (x86-64)", f"{count:.1f}", "")
    console = Console()
    if table.row_count:
        console.print(table)
    if "image" in result:
        console.print(image_table(result["image"]))


def image_table(image: dict[str, Any]) -> Table:
    """Bytes and instructions, each beside the committed figure and its limit."""
    from zerohertz.image import budget, sizes

    table = Table(title="flash image", title_justify="left")
    table.add_column("what")
    for column in ("measured", "committed", "limit or goal"):
        table.add_column(column, justify="right")
    known = image["committed"]
    goals = {"paper": (budget.MEAN_GOAL, ""), "all_options": ("", budget.WORST_GOAL)}
    for config, figures in image["instructions"].items():
        if config == "latency":
            continue
        for kind, goal in zip(("mean", "worst"), goals.get(config, ("", "")), strict=True):
            before = known["instructions"].get(config, {}).get(kind, "")
            text = f"{config}: instructions, {kind}"
            table.add_row(text, str(figures[kind]), str(before), str(goal))
    latency = (image["instructions"]["latency"], known["instructions"]["latency"], "")
    table.add_row("instructions, event to interrupt", *map(str, latency))
    limits = {
        "flash_bytes": sizes.FLASH_GOAL_BYTES,
        "table_bytes": sizes.TABLE_MAX_BYTES,
        "ram_bytes": sizes.RAM_MAX_BYTES,
    }
    for port, figures in image["bytes"].items():
        table.add_section()
        for key, value in figures.items():
            before = known["bytes"].get(port, {}).get(key, "")
            table.add_row(f"{port}: {key}", str(value), str(before), str(limits.get(key, "")))
    return table
