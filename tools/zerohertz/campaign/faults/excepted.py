"""Cases of which no observer of the words could tell: excepted.toml, and what is exactly one."""

from __future__ import annotations

import functools
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from zerohertz.campaign.faults.cases import Case, case_of
from zerohertz.campaign.faults.conditions import STARTING, Condition
from zerohertz.campaign.faults.judge import CURRENT, EXCEPTED, UNDECLARED
from zerohertz.campaign.faults.kinds import LINE_VOLTAGES, Kind

FILE = Path(__file__).with_suffix(".toml")


@dataclass(frozen=True)
class Proven:
    """One row of the list."""

    kind: str
    gain: float  # of the words: the true current is larger by 1/gain
    proof: str

    def allowed_A(self, over_A: float) -> float:
        """What the judge's limit for a current is to one who sees gain times it."""
        return over_A / self.gain


@functools.cache
def _file() -> Mapping[str, Any]:
    return tomllib.loads(FILE.read_text(encoding="utf-8"))


def _beside() -> list[str]:
    return list(_file()["beside"])


@functools.cache
def every_proven() -> Mapping[str, Proven]:
    rows = _file()["excepted"]
    return {row["kind"]: Proven(row["kind"], row["gain"], row["proof"].strip()) for row in rows}


def looked_up(row: Mapping[str, Any], over_A: float) -> dict[str, Any]:
    """The row of a case with EXCEPTED for its verdict where the list has it.

    Stored rows keep what the judge said: a change of the list runs nothing again.
    """
    return {**row, "verdict": verdict(case_of(str(row["name"])), row, over_A)}


def verdict(case: Case, row: Mapping[str, Any], over_A: float) -> str:
    """The row's, or EXCEPTED: from the start, by its current, not beyond the proof."""
    found = [every_proven()[kind.name] for kind in case.kinds if kind.name in every_proven()]
    others = [kind for kind in case.kinds if kind.name not in every_proven()]
    exact = (
        len(found) == 1
        and all(_says_nothing(kind, case.condition) for kind in others)
        and case.condition.mode == STARTING
        and row["verdict"] == UNDECLARED
        and row["undeclared"] == CURRENT
        and row["peak_A"] <= found[0].allowed_A(over_A)
    )
    return EXCEPTED if exact else str(row["verdict"])


def _says_nothing(kind: Kind, condition: Condition) -> bool:
    """Of the true current: the proof holds beside it."""
    unused = condition.voltage == "duty" and kind.word in (*LINE_VOLTAGES, "voltages")
    return unused or kind.what in _beside()
