"""The campaign: the cases of each mode on the atlas' runner, and what their rows say together."""

from __future__ import annotations

import dataclasses
import json
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Mapping
from contextlib import AbstractContextManager
from typing import Any

from zerohertz.atlas.run import RunOptions, Tell, run_map
from zerohertz.campaign.flips.cases import cases, split
from zerohertz.campaign.flips.modes import bench
from zerohertz.campaign.flips.run import CLASSES, STOPPED, UNDECLARED, run_cases

Bar = Callable[[str, int], AbstractContextManager[Callable[[int], None]]]
Row = dict[str, Any]


@dataclasses.dataclass(frozen=True)
class Asked:
    """Which flips."""

    modes: tuple[str, ...]
    runs: int  # 0: every bit
    seed: int
    member: str = ""


@dataclasses.dataclass(frozen=True)
class Result:
    """Rows by mode."""

    asked: Asked
    rows: Mapping[str, list[Row]]

    @property
    def every(self) -> list[Row]:
        return [row for rows in self.rows.values() for row in rows]

    @property
    def bad(self) -> list[Row]:
        """Undeclared harm or a lost protection, the worst first."""
        return sorted(filter(is_bad, self.every), key=severity)


def is_bad(row: Row) -> bool:
    return row["class"] == UNDECLARED or bool(row["lost"])


def severity(row: Row) -> tuple[bool, float, float]:
    """To order rows: harm before a lost protection, then by true current and speed."""
    return (row["class"] != UNDECLARED, -row["peak_A"], -row["off_rpm"])


def run_all(asked: Asked, how: RunOptions, tell: Tell, bar: Bar) -> Result:
    """All of it, mode by mode."""
    rows = {}
    for mode, count in split(list(asked.modes), asked.runs).items():
        chosen = cases(mode, count, asked.seed, asked.member)
        with bar(mode, len(chosen)) as progress:
            rows[mode] = run_map(bench(), chosen, how, tell, progress, run_cases)
    return Result(asked, rows)


def summary(rows: Iterable[Row]) -> dict[str, Any]:
    """Counts of the classes, and what the campaign asks to be 0."""
    every = list(rows)
    classes = Counter(row["class"] for row in every)
    lost = Counter(plain for row in every for plain in row["lost"].split())
    return {
        "runs": len(every),
        **{name: classes[name] for name in CLASSES if name not in (UNDECLARED, STOPPED)},
        "stopped_without_reason": classes[STOPPED],
        "undeclared_harm": classes[UNDECLARED],
        "protections_lost": sum(bool(row["lost"]) for row in every),
        "lost": dict(lost.most_common()),
        "lost_in_i_f": sum(bool(row["lost"]) and row["fallen"] for row in every),
        "exceptions": sum(row["died"] not in ("", "hang", "lock-up") for row in every),
        "lock_ups": sum(row["died"] == "lock-up" for row in every),
        "hangs": sum(row["died"] == "hang" for row in every),
    }


def by_owner(rows: Iterable[Row]) -> list[tuple[str, list[Row]]]:
    """Rows under the C object they belong to, the worst object first."""
    found: defaultdict[str, list[Row]] = defaultdict(list)
    for row in rows:
        found[row["owner"]].append(row)
    return sorted(found.items(), key=lambda item: (_worst(item[1]), -len(item[1])))


def _worst(rows: list[Row]) -> tuple[bool, float, float]:
    return min(severity(row) for row in rows)


def as_dict(result: Result) -> dict[str, Any]:
    """The whole result for --json."""
    kept = ("name", "owner", "class", "harms", "lost", "harm_s", "peak_A", "off_rpm")
    return {
        "seed": result.asked.seed,
        **summary(result.every),
        "modes": {mode: summary(rows) for mode, rows in result.rows.items()},
        "bad": [{key: row[key] for key in kept} for row in result.bad],
        "stopped": [row["name"] for row in result.every if row["class"] == STOPPED],
    }


def show(result: Result, as_json: bool) -> None:
    """On stdout."""
    if as_json:
        print(json.dumps(as_dict(result), indent=2))
        return
    for mode, rows in result.rows.items():
        print(f"{mode}: {summary(rows)}")
    for owner, rows in by_owner(result.bad):
        print(f"{owner}: {len(rows)}, e.g. {rows[0]['name']}")
