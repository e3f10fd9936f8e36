"""`zh atlas`: what the drive holds with wrong parameters, point by point."""

from __future__ import annotations

import contextlib
import dataclasses
import importlib.util
import json
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from zerohertz.errors import UserError
from zerohertz.paths import BUILD

VOLTAGE = {"sensors": 0, "duty": 1}


def register(app: typer.Typer) -> None:
    """Add `zh atlas`."""
    app.command("atlas")(atlas)


def atlas(
    config: Annotated[
        str, typer.Option(help="recommended, paper, no_gain, or a TOML file like theirs.")
    ] = "recommended",
    standard: Annotated[
        bool, typer.Option("--standard", help="Maps i, ii and drift, and test R.")
    ] = False,
    maps: Annotated[
        list[str] | None, typer.Option("--map", help="i, ii, drift, rr or m; may be repeated.")
    ] = None,
    random: Annotated[int, typer.Option(min=0, help="A sample of N points off the grid.")] = 0,
    seed: Annotated[int, typer.Option(min=0, help="Of the sample.")] = 1,
    sets: Annotated[
        list[str] | None, typer.Option("--set", help="Firmware parameter name=value, last word.")
    ] = None,
    plant: Annotated[
        list[str] | None,
        typer.Option(help="Rig or board section.key=value, for example inverter.model=switched."),
    ] = None,
    voltage: Annotated[
        str | None, typer.Option(help="Voltage the observer uses: sensors or duty.")
    ] = None,
    workers: Annotated[int, typer.Option("-j", "--workers", min=1, help="Processes.")] = 2,
    scheduler: Annotated[
        str | None, typer.Option(help="Address of a Dask scheduler, instead of --workers.")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Folder of the results.")] = None,
    fresh: Annotated[
        bool,
        typer.Option("--fresh/--resume", help="Run everything again, or only what is missing."),
    ] = False,
    throughput: Annotated[
        bool, typer.Option("--throughput", help="Measure points per second, and stop.")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON object on stdout.")] = False,
) -> None:
    """Run the real firmware over a map of speed x load x errors, and class every point.

    Without --standard, --map or --random: map i. Rows go to Parquet, maps to PNG and HTML.
    """
    # Here and not above: other commands need not wait for numpy and pyarrow.
    from zerohertz.atlas.points import STANDARD, random_sample, standard_map
    from zerohertz.atlas.run import Means, run_map
    from zerohertz.atlas.simulate import make_bench
    from zerohertz.scenario.setup import load_setup

    began = time.monotonic()
    firmware = _assignments("--set", sets or [], numbers=True)
    if voltage is not None:
        if voltage not in VOLTAGE:
            raise UserError(f"--voltage: '{voltage}': give sensors or duty")
        firmware = {"voltage_source": VOLTAGE[voltage]} | firmware
    names = [*(STANDARD if standard else ()), *(maps or ())]
    if not names and not random:
        names = ["map_i"]
    chosen = [standard_map(name) for name in names]
    if random:
        chosen.append(random_sample(random, seed))
    setup = load_setup(config)
    bench = make_bench(setup, firmware, _assignments("--plant", plant or [], numbers=False))
    folder = out or BUILD / "atlas" / "-".join(filter(None, (setup.name, voltage)))
    means = Means(folder, workers, scheduler, fresh)
    console = Console(stderr=True)

    def tell(text: str) -> None:
        console.print(text, highlight=False)

    results = {}
    for points in chosen:
        with _bar(console, points[0].map, len(points)) as progress:
            results[points[0].map] = run_map(bench, points, means, tell, progress)
    _report(setup, results, folder, bench, standard, began, as_json, tell)


def _report(
    setup: Any,
    results: dict[str, Any],
    folder: Path,
    bench: Any,
    standard: bool,
    began: float,
    as_json: bool,
    tell: Callable[[str], None],
) -> None:
    from zerohertz.atlas.summary import counts, shares

    content: dict[str, Any] = {name: counts(rows) for name, rows in results.items()}
    content["run_s"] = round(time.monotonic() - began, 1)
    (folder / "summary.json").write_text(
        json.dumps(content | {"shares": {n: shares(r) for n, r in results.items()}}, indent=1)
        + "\n"
    )
    if as_json:
        print(json.dumps(content))
    else:
        _print_table(setup.name, results)


def _print_table(config: str, results: dict[str, Any]) -> None:
    from zerohertz.atlas.summary import counts, percent, shares

    table = Table(title=f"configuration {config}", title_justify="left")
    for text in "map points oriented% held% takeover safe_stop unsafe silent".split():
        table.add_column(text, justify="left" if text == "map" else "right")
    for text in ("closed%", "degraded%", "impressed%", "closed% held >1 Hz", "failed starts"):
        table.add_column(text, justify="right")
    for name, rows in results.items():
        count, share = counts(rows), shares(rows)
        cells = [f"{percent(count[key], len(rows)):.1f}" for key in ("oriented", "held")]
        cells += [str(count[key]) for key in ("takeover", "safe_stop", "unsafe", "silent")]
        for key in ("closed_share", "degraded_share", "impressed_share"):
            cells.append(f"{100.0 * share[key]:.1f}")
        fast = share["closed_share_held_above_1Hz"]
        cells.append("" if fast is None else f"{100.0 * fast:.1f}")
        table.add_row(name, str(count["points"]), *cells, str(share["failed_starts"]))
    Console(width=None if sys.stdout.isatty() else 150).print(table)


def _assignments(option: str, lines: list[str], numbers: bool) -> dict[str, Any]:
    values: dict[str, Any] = {}
    for line in lines:
        name, equals, text = line.partition("=")
        if not equals or not name or not text:
            raise UserError(f"{option}: '{line}': write name=value")
        try:
            values[name] = float(text)
        except ValueError:
            if numbers:
                raise UserError(f"{option}: {name}: '{text}' is no number") from None
            values[name] = text
    return values


@contextlib.contextmanager
def _bar(console: Console, text: str, total: int) -> Iterator[Callable[[int], None]]:
    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.completed}"))
    hidden = not sys.stderr.isatty()
    with Progress(
        *columns, TimeRemainingColumn(), console=console, transient=True, disable=hidden
    ) as bar:
        task = bar.add_task(text, total=total)
        yield lambda done: bar.update(task, completed=done)
