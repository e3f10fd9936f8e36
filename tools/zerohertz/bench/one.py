"""One scenario on one image, within seconds: for work on the length of the control period."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from zerohertz.drive import State
from zerohertz.errors import UserError
from zerohertz.image import histogram, live_change
from zerohertz.image.command import PRESETS, Experiment, job_of, measure
from zerohertz.image.histogram import SLOTS, Row
from zerohertz.image.loop import End, PilRun

STRETCH = 200 * SLOTS  # periods of steady running that functions are counted in


def measure_one(experiment: Experiment, periods: int, worst: bool) -> dict[str, Any]:
    """Instructions of the interrupt, of its functions and slots. Functions: of the last STRETCH
    periods, or of the worst period alone."""
    run = measure(experiment, "mps2-an386", periods)
    if run.end is not End.EQUAL:
        raise UserError(f"{experiment.name}: image and SIL differ: {run.difference or run.text}")
    at = int(np.argmax(run.each.instructions))
    first, last = (at, at) if worst else steady(run)
    counted = histogram.count(job_of(experiment, None), PRESETS[experiment.config], first, last)
    return {
        "scenario": experiment.scenario,
        "config": experiment.config,
        "periods": run.periods,
        "mean": round(run.mean_instructions, 1),
        "worst": run.worst_instructions,
        "worst_period": at,
        "worst_state": State(int(run.each.state[at])).name,
        "live_change": live_change.worst_extra(experiment, run),
        "cycles_per_instruction": round(counted.cycles_per_instruction, 3),
        "slots": slots(run),
        "first": first,
        "last": last,
        "functions": [dataclasses.asdict(row) for row in counted.rows],
    }


def steady(run: PilRun) -> tuple[int, int]:
    """First and last of the last STRETCH periods, all in state RUN."""
    last = len(run.each.state) - 1
    first = last + 1 - STRETCH
    if first < 0 or (run.each.state[first:] != State.RUN).any():
        raise UserError(f"the run's last {STRETCH} periods are not all in state RUN; take another")
    return first, last


def slots(run: PilRun) -> list[dict[str, float]]:
    """Of every slot the mean and the worst in state RUN; none where the slot did not come."""
    running = run.each.state == State.RUN
    found = []
    for slot in range(SLOTS):
        counted = run.each.instructions[running & (run.each.slot == slot)]
        if len(counted):
            mean, worst = round(float(counted.mean()), 1), int(counted.max())
            found.append({"slot": slot, "mean": mean, "worst": worst})
    return found


def show(result: dict[str, Any], rows: int) -> None:
    """For a terminal."""
    console = Console(highlight=False, soft_wrap=True)
    name = f"{result['scenario']} {result['config']}"
    at = f"period {result['worst_period']}, {result['worst_state']}"
    console.print(
        f"{name}: mean {result['mean']} instructions, worst {result['worst']} ({at}), "
        f"live change +{result['live_change']}; "
        f"{result['cycles_per_instruction']} cycles per instruction (estimate)"
    )
    text = "  ".join(f"{s['slot']}: {s['mean']:.0f}/{s['worst']}" for s in result["slots"])
    console.print(f"slots, mean/worst in RUN: {text}")
    title = f"functions, periods {result['first']} to {result['last']}"
    console.print(function_table(title, (Row(**row) for row in result["functions"]), rows))


def function_table(title: str, found: Iterable[Row], rows: int) -> Table:
    """The first rows, and what the others have together."""
    table = Table(title=title, title_justify="left")
    for column in ("function", "file"):
        table.add_column(column, no_wrap=True)
    for column in ("instructions", "cycles"):
        table.add_column(column, justify="right")
    listed = list(found)
    for row in listed[:rows]:
        table.add_row(row.function, row.file, f"{row.instructions:.1f}", f"{row.cycles:.1f}")
    rest = listed[rows:]
    table.add_section()
    for name, some in (("others", rest), ("all", listed)):
        instructions = sum(row.instructions for row in some)
        used = sum(row.cycles for row in some)
        table.add_row(name, str(len(some)), f"{instructions:.1f}", f"{used:.1f}")
    return table
