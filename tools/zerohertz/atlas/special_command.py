"""`zh special`: the special tests beside the atlas' maps, and performance."""

from __future__ import annotations

import json
import time
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table


def register(app: typer.Typer) -> None:
    """Add `zh special`."""
    app.command("special")(special)


def special(
    names: Annotated[
        list[str] | None, typer.Argument(help="Tests by name; none: all of them.")
    ] = None,
    config: Annotated[
        str, typer.Option(help="A configuration of host_sim/configs, or a TOML file.")
    ] = "recommended",
    workers: Annotated[int, typer.Option("-j", "--workers", min=1, help="Processes.")] = 2,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON object on stdout.")] = False,
) -> None:
    """Special tests on the atlas' bench: long holds, slow crossings, performance.

    test_R, slow_crossing, dwell, situations, speed_range, static_accuracy, torque_rise,
    speed_bandwidth, starting_torque. Exit 1 when a goal is missed.
    """
    from zerohertz.atlas.special import case_count, run_tests
    from zerohertz.console import progress_bar
    from zerohertz.scenario.setup import load_setup

    setup = load_setup(config)
    asked = names or []
    begin_s = time.monotonic()
    with progress_bar("special tests", case_count(setup, asked)) as progress:
        results = run_tests(setup, asked, workers, progress)
    if as_json:
        content: dict[str, Any] = {"config": setup.name}
        content |= {result.name: result.as_json() for result in results}
        print(json.dumps(content | {"run_s": round(time.monotonic() - begin_s, 1)}))
    else:
        _print(setup.name, results)
    if any(result.met is False for result in results):
        raise typer.Exit(1)


def _print(config: str, results: list[Any]) -> None:
    # Wide enough for the numbers where nobody looks: a pipe has 80 columns.
    console = Console(width=max(Console().width, 120))
    words = {True: "[green]met[/green]", False: "[red]missed[/red]", None: "-"}
    for result in results:
        console.print(f"{result.name}, {config}: {result.goal}", highlight=False)
        table = Table()
        table.add_column("case", no_wrap=True)
        table.add_column("ended", no_wrap=True)
        table.add_column("goal")
        numbers = [finding.as_json() for finding in result.findings]
        keys = [key for key in numbers[0] if key not in ("case", "verdict", "met")]
        for key in keys:
            table.add_column(key.replace("_", " "), justify="right")
        for row in numbers:
            values = ("-" if row[key] is None else f"{row[key]:.4g}" for key in keys)
            table.add_row(row["case"], row["verdict"], words[row["met"]], *values)
        console.print(table)
    met = {r.name: r.met for r in results if r.met is not None}
    console.print(f"goals met: {sum(met.values())} of {len(met)}", highlight=False)
