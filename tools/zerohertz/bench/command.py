"""`zh bench`: times and counts in one call."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from zerohertz.errors import UserError
from zerohertz.options import Json
from zerohertz.paths import ROOT

COUNTS = ROOT / "tools" / "docs" / "bench_counts.json"
IMAGE = ROOT / "tools" / "docs" / "image_budget.json"
# Of every scenario, so that the bench stays a matter of half a minute; all of it with --write.
IMAGE_PERIODS = 30_000
# Goals: simulated seconds per CPU second, CPU seconds of a design.
GOALS = {"averaged": 2000.0, "switched": 500.0, "design": 4.0}
# Times motulator's simulated seconds per CPU second.
PEER_GOALS = {"averaged": 4000.0, "switched": 2000.0}

FunctionsOption = Annotated[
    bool,
    typer.Option("--functions", help="Only instructions by function and slot; writes the page."),
]


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
    functions: FunctionsOption = False,
    only: Annotated[
        str | None,
        typer.Option(help="Only one scenario, on the image, by function; takes seconds."),
    ] = None,
    config: Annotated[
        str, typer.Option(help="With --only: paper, recommended or all_options.")
    ] = "paper",
    worst: Annotated[
        bool, typer.Option("--worst", help="With --only: count the worst period, not the mean.")
    ] = False,
    rows: Annotated[
        int, typer.Option(min=1, help="With --only: number of functions to list.")
    ] = 30,
    write: Annotated[
        bool,
        typer.Option(
            "--write", help=f"Store {COUNTS.name} or, with --image, {IMAGE.name} to be committed."
        ),
    ] = False,
    peer: Annotated[
        bool, typer.Option("--peer", help="Only compare the speed of the SIL with motulator 0.5.0.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Measure the simulation, the gain design, the control period and the flash images.

    Times are CPU time, medians of several runs, and are only reported; the tests hold instructions
    and bytes to the committed ones.
    """
    if peer:
        _bench_peer(as_json)
        return
    if only is not None:
        _bench_one(only, config, worst, rows, as_json)
        return
    console = Console(stderr=True)
    if functions:
        _write_page(console)
        return
    result: dict[str, Any] = {}
    if not counts and not image:
        result = _measure_times(console)
    if not image:
        result["callgrind"] = _count_callgrind(console, write)
    if not counts:
        result["image"] = _measure_image(console, write and image)
    if as_json:
        print(json.dumps(result))
    else:
        _show(result)


def _measure_times(console: Console) -> dict[str, Any]:
    from zerohertz.bench import measure

    console.print("measuring the closed loop, averaged inverter", highlight=False)
    averaged = measure.simulation_speed("averaged")
    console.print("measuring the closed loop, switched inverter", highlight=False)
    switched = measure.simulation_speed("switched")
    console.print("measuring the gain design", highlight=False)
    design = measure.design_time()
    return {
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


def _count_callgrind(console: Console, write: bool) -> dict[str, float]:
    from zerohertz.bench import measure

    console.print("counting instructions", highlight=False)
    counted = {"instructions_per_step": round(measure.instructions_per_step(), 2)}
    if write:
        _write(COUNTS, counted, measure.compiler())
    return counted


def _bench_one(scenario: str, config: str, worst: bool, rows: int, as_json: bool) -> None:
    from zerohertz.bench import one
    from zerohertz.image.command import experiments
    from zerohertz.image.interrupt import measure_interrupt

    if scenario == "all":
        raise UserError("--only: takes one scenario; without it all of them are measured")
    (experiment,) = experiments(scenario, config)
    found = measure_interrupt(experiment, worst)
    if as_json:
        print(json.dumps(dataclasses.asdict(found)))
    else:
        one.show(found, rows)


def _write_page(console: Console) -> None:
    from zerohertz.image import budget, instruction_page

    found = budget.measure_interrupts(lambda name: console.print(name, highlight=False))
    instruction_page.PAGE.write_text(instruction_page.page_text(found), encoding="utf-8")
    console.print(f"wrote {instruction_page.PAGE}", highlight=False)


def _bench_peer(as_json: bool) -> None:
    from zerohertz.bench.peer import measure_peer

    console = Console(stderr=True)
    result = measure_peer(lambda text: console.print(text, highlight=False))
    if as_json:
        print(json.dumps(result))
        return
    table = Table(title=f"beside {result['peer']['package']}", title_justify="left")
    table.add_column("what")
    for model in PEER_GOALS:
        table.add_column(model, justify="right")
    said = result["peer"]
    rows = {
        "motulator, simulated s per CPU s": "peer_sim_s_per_cpu_s",
        "SIL, one run": "single_sim_s_per_cpu_s",
        "SIL, a batch of runs": "batch_sim_s_per_cpu_s",
        "ratio, one run": "single_ratio",
        "ratio, a batch": "ratio",
    }
    for what, key in rows.items():
        table.add_row(what, *(f"{said[f'{model}_{key}']:.4g}" for model in PEER_GOALS))
    table.add_row("goal of the ratio", *(f"{goal:.0f}" for goal in PEER_GOALS.values()))
    for part in ("firmware", "plant"):
        counts = (result["instructions_per_period"][model][part] for model in PEER_GOALS)
        table.add_row(f"instructions per period, {part}", *(f"{count:.0f}" for count in counts))
    Console().print(table)


def _measure_image(console: Console, write: bool) -> dict[str, Any]:
    """Bytes of every port, instructions of every experiment, each beside the committed figure."""
    from zerohertz.image import budget, instruction_page

    ports = budget.measure_images()
    with Progress(console=console) as progress:
        chosen = budget.every_experiment()
        task = progress.add_task("flash image on the emulated core", total=len(chosen))
        periods = budget.measure_periods(
            chosen, None if write else IMAGE_PERIODS, lambda _: progress.advance(task)
        )
        task = progress.add_task("functions and additions", total=len(budget.STEADY))
        interrupts = budget.measure_interrupts(lambda _: progress.advance(task))
    added = budget.added_figures(interrupts)
    if write:
        budget.write(ports, periods, added)
        instruction_page.PAGE.write_text(instruction_page.page_text(interrupts), encoding="utf-8")
    instructions = budget.overall(periods, added)
    return {
        "bytes": ports,
        "instructions": instructions,
        "load": budget.load(instructions, interrupts),
        "committed": _committed(),
    }


def _committed() -> dict[str, Any]:
    """Of this compiler; empty figures when it has none yet."""
    from zerohertz.image import budget

    compiler = budget.compiler()
    known = budget.rows().get(compiler)
    if known is None:
        return {"bytes": {}, "instructions": {}, "compiler": compiler}
    return {
        "bytes": known["images"],
        "instructions": budget.overall(known["periods"], known["added"]),
        "compiler": compiler,
    }


def _write(file: Path, counted: dict[str, float], compiler: str) -> None:
    """Keeps this compiler's count; those of others stay."""
    file.parent.mkdir(parents=True, exist_ok=True)
    known = json.loads(file.read_text(encoding="utf-8")) if file.is_file() else {}
    content = dict(sorted((known | {compiler: counted}).items()))
    file.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")


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
    for config, figures in image["instructions"].items():
        if config != "latency":
            goals = dict(zip(("mean", "worst"), budget.GOALS.get(config, ("", "")), strict=True))
            _add_rows(table, f"{config}: instructions", figures, known["instructions"], goals)
            _add_rows(table, f"{config}: estimate", image["load"][config], {}, {})
            table.add_section()
    latency = (image["instructions"]["latency"], known["instructions"].get("latency", ""), "")
    table.add_row("instructions, event to interrupt", *map(str, latency))
    limits = {
        "flash_bytes": sizes.FLASH_GOAL_BYTES,
        "table_bytes": sizes.TABLE_MAX_BYTES,
        "ram_bytes": sizes.RAM_MAX_BYTES,
    }
    for port, figures in image["bytes"].items():
        table.add_section()
        _add_rows(table, port, figures, known["bytes"], limits)
    table.caption = f"Estimate: {image['load']['model']}. worst: with a live change in that period."
    return table


def _add_rows(
    table: Table, name: str, figures: dict[str, Any], known: dict[str, Any], limits: dict[str, Any]
) -> None:
    before = known.get(name.split(":")[0], {})
    for key, value in figures.items():
        cells = (value, before.get(key, ""), limits.get(key, ""))
        table.add_row(f"{name}: {key}", *map(str, cells))
