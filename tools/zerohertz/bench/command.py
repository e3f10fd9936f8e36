"""`zh bench`: times and counts in one call."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

from zerohertz.paths import ROOT

COUNTS = ROOT / "tools" / "docs" / "bench_counts.json"
# Goals: simulated seconds per CPU second, CPU seconds of a design.
GOALS = {"averaged": 2000.0, "switched": 500.0, "design": 4.0}


def register(app: typer.Typer) -> None:
    """Add `zh bench`."""
    app.command("bench")(bench)


def bench(
    counts: Annotated[
        bool, typer.Option("--counts", help="Only count instructions, no times.")
    ] = False,
    write: Annotated[
        bool, typer.Option("--write", help=f"Store the count in {COUNTS.name} (for a commit).")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON object on stdout.")] = False,
) -> None:
    """Measure the simulation, the gain design and the control period on this machine.

    Times are CPU time, medians of several runs, and are only reported; the tests hold the count of
    instructions to the committed one.
    """
    from zerohertz.bench import measure

    console = Console(stderr=True)
    result: dict[str, Any] = {}
    if not counts:
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
            "design": {"entries": design.entries, "cpu_s": round(design.cpu_s, 2)},
        }
    console.print("counting instructions", highlight=False)
    result["callgrind"] = {"instructions_per_step": round(measure.instructions_per_step(), 2)}
    if write:
        _write(COUNTS, result["callgrind"], measure.compiler())
    if as_json:
        print(json.dumps(result))
    else:
        _show(result)


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
    count = result["callgrind"]["instructions_per_step"]
    table.add_row("instructions per control period (x86-64)", f"{count:.1f}", "")
    Console().print(table)
