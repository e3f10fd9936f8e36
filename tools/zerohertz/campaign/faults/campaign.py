"""The campaign: groups of cases on the atlas' runner, and what their rows say together."""

from __future__ import annotations

import dataclasses
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Mapping
from contextlib import AbstractContextManager
from typing import Any

from zerohertz.atlas.run import RunOptions, Tell, run_map
from zerohertz.campaign.faults import excepted
from zerohertz.campaign.faults.cases import case_of, cases, split
from zerohertz.campaign.faults.judge import AFTER, BEFORE, EXCEPTED, HARMLESS, UNDECLARED
from zerohertz.campaign.faults.kinds import NOTHING
from zerohertz.campaign.faults.run import bench_of_campaign, over_A, run_cases

HEALTHY = "healthy"
Bar = Callable[[str, int], AbstractContextManager[Callable[[int], None]]]
Row = dict[str, Any]
QUANTILES = {"median_ms": 0.5, "p95_ms": 0.95, "worst_ms": 1.0}


@dataclasses.dataclass(frozen=True)
class Result:
    """Rows by group; healthy: the same conditions as undeclared rows have, with nothing broken."""

    seed: int
    rows: Mapping[str, list[Row]]
    healthy: list[Row] = dataclasses.field(default_factory=list)
    i_trip_A: float = 0.0

    @property
    def every(self) -> list[Row]:
        return [row for rows in self.rows.values() for row in rows]

    @property
    def undeclared(self) -> list[Row]:
        """The most current first, then the speed that is furthest off."""
        bad = [row for row in self.every if row["verdict"] == UNDECLARED]
        return sorted(bad, key=lambda row: (-row["over_current"], -severity(row)))

    @property
    def excepted(self) -> list[Row]:
        return [row for row in self.every if row["verdict"] == EXCEPTED]

    @property
    def of_the_fault(self) -> list[Row]:
        """Undeclared, and not the same undeclared harm as at this condition with nothing broken."""
        usual = {condition_name(row): set(row["undeclared"].split()) for row in self.healthy}
        return [
            row
            for row in self.undeclared
            if set(row["undeclared"].split()) - usual.get(condition_name(row), set())
        ]


def condition_name(row: Row) -> str:
    return str(row["name"]).partition("@")[2]


def severity(row: Row) -> float:
    """Of a harm, to order rows of the same sort."""
    return float(row["peak_A"] if row["over_current"] else row["off_rpm"])


def run_all(which: str, runs: int, seed: int, how: RunOptions, tell: Tell, bar: Bar) -> Result:
    """`runs` of the groups together, 0: all of them."""
    bench = bench_of_campaign()
    rows = {}
    for group, count in split(which, runs).items():
        chosen = cases(group, count, seed)
        with bar(group, len(chosen)) as progress:
            # What is shared goes to one worker.
            together = sorted(chosen, key=lambda case: case.stem)
            found = run_map(bench, together, how, tell, progress, run_cases)
        rows[group] = [excepted.looked_up(row, over_A(bench)) for row in found]
    result = Result(seed, rows, i_trip_A=bench.i_trip_A)
    wanted = sorted({condition_name(row) for row in result.undeclared})
    if not wanted:
        return result
    beside = [dataclasses.replace(case_of(f"{NOTHING}@{name}"), map=HEALTHY) for name in wanted]
    beside = [dataclasses.replace(case, index=k) for k, case in enumerate(beside)]
    with bar(HEALTHY, len(beside)) as progress:
        healthy = run_map(bench, beside, how, tell, progress, run_cases)
    return dataclasses.replace(result, healthy=healthy)


def summary(rows: Iterable[Row]) -> dict[str, Any]:
    """Counts, the time from the fault to the word, the time from the harm to the word."""
    every = list(rows)
    verdicts = Counter(row["verdict"] for row in every)
    # A word that was there before the fault is not about it.
    said_ms = [row["word_ms"] for row in every if row["word_ms"] is not None]
    words_ms = [word_ms for word_ms in said_ms if word_ms >= 0.0]
    late_ms = [row["late_ms"] for row in every if row["verdict"] == AFTER]
    return {
        "runs": len(every),
        "undeclared_harm": verdicts[UNDECLARED],
        "excepted": verdicts[EXCEPTED],
        "declared": verdicts[BEFORE] + verdicts[AFTER],
        "declared_before": verdicts[BEFORE],
        "declared_after": verdicts[AFTER],
        "harmless": verdicts[HARMLESS],
        "over_current": sum(row["over_current"] for row in every),
        "worst_A": round(max((row["peak_A"] for row in every), default=0.0), 1),
        "not_started": sum(not row["started"] for row in every),
        "fault_to_word": quantiles(words_ms),
        "harm_to_word": quantiles(late_ms),
    }


def quantiles(values: list[float]) -> dict[str, float] | None:
    """Of the values as they are: no interpolation."""
    ordered = sorted(values)
    if not ordered:
        return None
    last = len(ordered) - 1
    return {name: ordered[round(share * last)] for name, share in QUANTILES.items()}


def by_kind(rows: Iterable[Row]) -> dict[str, list[Row]]:
    """Rows under each of their faults, in the order of the faults."""
    found: defaultdict[str, list[Row]] = defaultdict(list)
    for row in rows:
        for what in dict.fromkeys(row["kinds"].split(" + ")):
            found[what].append(row)
    return dict(found)


def as_dict(result: Result) -> dict[str, Any]:
    """The whole result for --json; `runs` to `over_current` are of all groups together."""
    own = {row["name"] for row in result.of_the_fault}
    return {
        "seed": result.seed,
        **summary(result.every),
        "undeclared_of_the_fault": len(own),
        "undeclared_when_healthy": [
            condition_name(row) for row in result.healthy if row["verdict"] == UNDECLARED
        ],
        "groups": {group: summary(rows) for group, rows in result.rows.items()},
        "kinds": {what: summary(rows) for what, rows in by_kind(result.every).items()},
        "undeclared": [
            {
                key: row[key]
                for key in ("name", "harms", "undeclared", "harm_s", "peak_A", "off_rpm")
            }
            | {"of_the_fault": row["name"] in own}
            for row in result.undeclared
        ],
    }
