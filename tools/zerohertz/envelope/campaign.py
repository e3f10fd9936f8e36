"""The envelope from its cases to one result: counts, quantiles, axes, the worst runs."""

from __future__ import annotations

import dataclasses
import itertools
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from contextlib import AbstractContextManager
from typing import Any

from zerohertz.atlas.run import RunOptions, Tell, run_map
from zerohertz.atlas.summary import causes
from zerohertz.envelope.axes import AXES, Axis
from zerohertz.envelope.run import Sample, bench_of_envelope, cases_of, run_cases

Row = dict[str, Any]
Bar = Callable[[str, int], AbstractContextManager[Callable[[int], None]]]
BLOCK = 200  # runs stored together
BINS = 4  # of an axis that is a range
WORST = 10
QUANTILES = {"median": 0.5, "p95": 0.95, "p99": 0.99, "worst": 1.0}
MEASURES = {
    "torque_ripple_pu": "torque ripple, rms 1 Hz to 1 kHz in a hold, over rated torque",
    "torque_error_pu": "torque mode: mean torque off its reference, over rated torque",
    "speed_error_rpm": "mean speed off its reference in a hold, min^-1",
    "dip_rpm": "largest speed error after a load step, min^-1",
    "recovery_s": "until it stays below 15 min^-1 (2 pole pairs), s",
    "overshoot": "beyond the end of a speed ramp, over its height",
}


@dataclasses.dataclass(frozen=True)
class Result:
    """Rows in their order."""

    sample: Sample
    rows: list[Row]

    @property
    def possible(self) -> list[Row]:
        return [row for row in self.rows if not row["impossible"]]

    @property
    def impossible(self) -> list[Row]:
        return [row for row in self.rows if row["impossible"]]

    @property
    def worst(self) -> list[Row]:
        """Of the possible ones; harm first, then trips, then what is not held or not oriented."""
        return sorted(self.possible, key=badness, reverse=True)[:WORST]


def badness(row: Row) -> tuple[float, ...]:
    above_s = row["above_1Hz_s"]
    lost = 1.0 - row["oriented_above_1Hz_s"] / above_s if above_s else 0.0
    return (
        row["undeclared_harm"],
        row["undeclared_harm"] * row["peak_A"],
        row["false_trip"],
        not row["held"],
        lost,
        row["torque_ripple_pu"] or 0.0,
    )


def run_all(sample: Sample, runs: int, how: RunOptions, tell: Tell, bar: Bar) -> Result:
    bench = bench_of_envelope()
    rows: list[Row] = []
    with bar("envelope", runs) as progress:
        for block in cases_of(sample, runs, BLOCK):
            before = len(rows)
            rows += run_map(bench, block, how, tell, lambda n, b=before: progress(b + n), run_cases)
    return Result(sample, rows)


def quantile(values: Sequence[float], share: float) -> float | None:
    """Of the values as they are: no interpolation."""
    ordered = sorted(values)
    return ordered[round(share * (len(ordered) - 1))] if ordered else None


def quantiles(rows: Iterable[Row], name: str) -> list[float | None]:
    values = [row[name] for row in rows if row[name] is not None]
    return [quantile(values, share) for share in QUANTILES.values()]


def every_quantile(rows: Sequence[Row]) -> dict[str, dict[str, float | None]]:
    return {name: dict(zip(QUANTILES, quantiles(rows, name), strict=True)) for name in MEASURES}


def summary(rows: Sequence[Row]) -> dict[str, Any]:
    """Counts and shares of some rows, all of which can be done."""
    runs = len(rows)

    def counted(count: float, of: float) -> dict[str, float]:
        share = round(count / of, 5) if of else 0.0
        return {"count": round(count, 1), "share": share}

    above_s = sum(row["above_1Hz_s"] for row in rows)
    oriented_s = sum(row["oriented_above_1Hz_s"] for row in rows)
    ripple = [row["torque_ripple_pu"] for row in rows if row["torque_ripple_pu"] is not None]
    return {
        "runs": runs,
        "undeclared_harm": counted(sum(row["undeclared_harm"] for row in rows), runs),
        "false_trips": counted(sum(row["false_trip"] for row in rows), runs),
        "held": counted(sum(row["held"] for row in rows), runs),
        "oriented_above_1Hz": counted(oriented_s, above_s),
        "torque_ripple_p95_pu": quantile(ripple, 0.95),
    }


def as_dict(result: Result) -> dict[str, Any]:
    """The whole result for --json. The first keys are of the runs that can be done."""
    rows = result.possible
    return {
        "seed": result.sample.seed,
        "fixed": dict(result.sample.fixed),
        "set": dict(result.sample.firmware),
        **summary(rows),
        "impossible": len(result.impossible),
        "impossible_undeclared_harm": sum(row["undeclared_harm"] for row in result.impossible),
        "verdicts": dict(Counter(row["verdict"] for row in rows)),
        "faults": dict(as_counts(rows)),
        "causes": causes(rows),
        "quantiles": every_quantile(rows),
        "axes": {
            axis.name: {
                text: summary(part) | {"quantiles": every_quantile(part)}
                for text, part in parts(axis, rows)
            }
            for axis in AXES
        },
        "worst": [worst_dict(row) for row in result.worst],
    }


def as_counts(rows: Sequence[Row]) -> list[tuple[str, int]]:
    """First faults, the most frequent first."""
    return Counter(row["fault"] for row in rows if row["fault"]).most_common()


def worst_dict(row: Row) -> dict[str, Any]:
    names = ("index", "verdict", "harm", "fault", "held", "torque_ripple_pu", "peak_A", "off_rpm")
    return {name: row[name] for name in names}


def parts(axis: Axis, rows: Sequence[Row]) -> list[tuple[str, list[Row]]]:
    """Rows by the value of an axis: its choices, or equal numbers of runs in the order of it.

    Only rows in which the axis acts.
    """
    rows = [row for row in rows if axis.acts(row)]
    if axis.choices:
        found = [(text, [row for row in rows if row[axis.name] == text]) for text in axis.choices]
    else:
        ordered = sorted(rows, key=lambda row: row[axis.name])
        edges = [round(k * len(ordered) / BINS) for k in range(BINS + 1)]
        cuts = [ordered[slice(*pair)] for pair in itertools.pairwise(edges)]
        found = [(_range(cut, axis), cut) for cut in cuts]
    return [(text, part) for text, part in found if part]


def _range(rows: Sequence[Row], axis: Axis) -> str:
    """From the first to the last of ordered rows."""
    return f"{rows[0][axis.name]:.3g} to {rows[-1][axis.name]:.3g}" if rows else ""
