"""`zh special hot_motor` and `torque`: many runs of drawn plants, and their quantiles."""

from __future__ import annotations

import json
import math
import multiprocessing
from collections.abc import Callable
from typing import Any

import typer
from rich.console import Console
from rich.table import Table

Row = dict[str, Any]
Found = dict[str, dict[str, Any]]
TESTS = ("hot_motor", "torque")


def command(
    name: str, config: str, asked: tuple[int, int, float, str], workers: int, as_json: bool
) -> None:
    """Runs, prints, and exits with 1 when a goal is missed."""
    from zerohertz.scenario.setup import load_setup

    runs, seed, speed_up, thermal = asked
    setup = load_setup(config)
    if name == "hot_motor":
        found = _hot_motor(setup, (runs, seed, speed_up, thermal), workers)
    else:
        found = _torque(setup, runs, seed, workers)
    met = {kind: result["within"] == len(result["rows"]) for kind, result in found.items()}
    if as_json:
        print(json.dumps({"config": setup.name, "seed": seed, **finite(found), "met": met}))
    else:
        _print(f"{name}, {setup.name}, seed {seed}", found)
    if not all(met.values()):
        raise typer.Exit(1)


def _hot_motor(setup: Any, asked: tuple[int, int, float, str], workers: int) -> Found:
    from zerohertz.atlas import hot_motor

    runs, seed, speed_up, thermal = asked
    kinds = {"averaged": (runs, False), "switched": (-(-runs // hot_motor.SWITCHED_EVERY), True)}
    found: Found = {}
    for kind, (count, switched) in kinds.items():
        jobs = [(setup, seed, k, switched, speed_up, thermal) for k in range(count)]
        rows = _all(_hot_row, jobs, f"hot_motor, {kind}", workers)
        found[kind] = hot_motor.summary(rows) | {"rows": rows}
    return found


def _torque(setup: Any, runs: int, seed: int, workers: int) -> Found:
    from zerohertz.atlas import torque

    found: Found = {}
    for kind, band in torque.BANDS.items():
        jobs = [(setup, seed, k, band) for k in range(runs)]
        some = _all(_torque_rows, jobs, f"torque, {kind}", workers)
        rows = [row for rows in some for row in rows]
        found[kind] = torque.summary(band, rows) | {"rows": rows}
    return found


def _hot_row(job: tuple[Any, ...]) -> Row:
    from zerohertz.atlas import hot_motor

    return hot_motor.one(*job)[0]


def _torque_rows(job: tuple[Any, ...]) -> list[Row]:
    from zerohertz.atlas import torque

    return torque.one(*job)[0]


def _all(one: Callable[[Any], Any], jobs: list[Any], text: str, workers: int) -> list[Any]:
    """Side by side in processes."""
    from zerohertz.console import progress_bar

    done: list[Any] = []
    # spawn: the library's threads and handles must not be inherited half open.
    with (
        multiprocessing.get_context("spawn").Pool(workers) as pool,
        progress_bar(text, len(jobs)) as progress,
    ):
        for result in pool.imap(one, jobs, chunksize=1):
            done.append(result)
            progress(len(done))
    return done


def finite(value: Any) -> Any:
    """What was not measured is null: JSON has no NaN and no infinity."""
    if isinstance(value, dict):
        return {key: finite(v) for key, v in value.items()}
    if isinstance(value, list):
        return [finite(v) for v in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _print(title: str, found: Found) -> None:
    console = Console(width=max(Console().width, 120))
    table = Table(title=title)
    table.add_column("", no_wrap=True)
    for kind in found:
        table.add_column(kind, justify="right")
    for key in next(iter(found.values())):
        if key != "rows":
            values = (result[key] for result in found.values())
            table.add_row(key.replace("_", " "), *(_text(value) for value in values))
    console.print(table)


def _text(value: Any) -> str:
    if value is None:
        return "lost"
    return f"{value:.4g}" if isinstance(value, float) else str(value)
