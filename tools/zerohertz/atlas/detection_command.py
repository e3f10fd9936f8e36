"""`zh detection`: does the firmware's supervisor tell a lost orientation, and only that?"""

from __future__ import annotations

import json
import time
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

from zerohertz.options import Json, Workers


def register(app: typer.Typer) -> None:
    """Add `zh detection`."""
    app.command("detection")(detection)


def detection(
    hours: Annotated[
        float,
        typer.Option(
            min=0.1, help="Simulated hours of random missions; the rates need at least 1."
        ),
    ] = 1.0,
    seeds: Annotated[
        int, typer.Option(min=1, max=100, help="Number of noise seeds per figure.")
    ] = 6,
    workers: Workers = 2,
    as_json: Json = False,
) -> None:
    """Test the supervisor's loss detection on the paper's experiments and on random missions.

    Exit 1 if a detection takes too long, a loss goes undetected, or a false alarm occurs.
    """
    from zerohertz.atlas import detection as judge

    start_s = time.monotonic()
    console = Console(stderr=True)
    with console.status("0 h") as status:
        done_s = 0

        def told(gained_s: int) -> None:
            nonlocal done_s
            done_s += gained_s
            status.update(f"{done_s / 3600.0:.2f} of {hours:g} h")

        result = judge.detection(hours, seeds, workers, told)
    result["run_s"] = round(time.monotonic() - start_s, 1)
    if as_json:
        print(json.dumps(result))
    else:
        _print(result)
    if not result["meets"]:
        raise typer.Exit(1)


def _print(result: dict[str, Any]) -> None:
    console = Console()
    table = Table(title="losing experiments of the paper, times in ms", title_justify="left")
    for name in ("experiment", "worst delay", "longest silence", "loss indicated", "take-over"):
        table.add_column(name, justify="left" if name == "experiment" else "right")
    for name, figure in result["losses"]["figures"].items():
        indicated, impressed = figure["indicated_ms"], figure["impressed_ms"]
        table.add_row(
            name,
            f"{figure['worst_delay_ms']:g}",
            f"{figure['worst_silent_ms']:g}",
            f"{max(indicated):g}" if indicated else "never",
            f"{max(impressed):g}" if impressed else "never",
        )
    console.print(table)
    for label, key in (("above", "above_1Hz"), ("below", "below_1Hz")):
        delay = result["losses"][key]
        console.print(
            f"|f_s| {label} 1 Hz: {delay['crossings']} crossings of 25 deg, median "
            f"{delay['median_ms']} ms, worst {delay['worst_ms']} ms, unseen {delay['unseen']}",
            highlight=False,
        )
    for key, value in result["missions"].items():
        console.print(f"{key}: {value}", highlight=False)
    console.print("meets" if result["meets"] else "does not meet what is asked", highlight=False)
