"""Which axis is it? A run again and again, each time with one axis where it disturbs nothing."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

from zerohertz.envelope.axes import AXES
from zerohertz.envelope.run import Sample, run_case

Row = dict[str, Any]


def faulty(row: Row) -> int:
    """How many of the things that count are wrong."""
    return int(row["undeclared_harm"]) + int(row["false_trip"]) + int(not row["held"])


def mending(sample: Sample, index: int, progress: Callable[[int], None]) -> list[Row]:
    """The axes of which the plain value leaves less wrong; the best first."""
    drawn = sample.case(index).values
    before = faulty(run_case(sample.case(index))[0])
    found = []
    for k, axis in enumerate(AXES):
        progress(k)
        plain = axis.plain
        if plain is None or plain == drawn[axis.name] or not axis.acts(drawn):
            continue
        fixed = {**sample.fixed, axis.name: plain}
        other = dataclasses.replace(sample, fixed=fixed).case(index)
        row = run_case(other)[0]
        if faulty(row) < before:
            found.append(
                {"axis": axis.name, "drawn": drawn[axis.name], "plain": plain}
                | {name: row[name] for name in ("held", "verdict", "fault")}
                | {"wrong": faulty(row)}
            )
    return sorted(found, key=lambda row: row["wrong"])
