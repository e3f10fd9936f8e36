"""Cases of which no observer of the words could tell: excepted.toml, and what is exactly one."""

from __future__ import annotations

import functools
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from zerohertz.campaign.faults.cases import Case, case_of
from zerohertz.campaign.faults.conditions import STARTING
from zerohertz.campaign.faults.judge import CURRENT, EXCEPTED, UNDECLARED

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
def every_proven() -> Mapping[str, Proven]:
    rows = tomllib.loads(FILE.read_text(encoding="utf-8"))["excepted"]
    return {row["kind"]: Proven(row["kind"], row["gain"], row["proof"].strip()) for row in rows}


def looked_up(row: Mapping[str, Any], over_A: float) -> dict[str, Any]:
    """The row of a case with EXCEPTED for its verdict where the list has it.

    Stored rows keep what the judge said: a change of the list runs nothing again.
    """
    return {**row, "verdict": verdict(case_of(str(row["name"])), row, over_A)}


def verdict(case: Case, row: Mapping[str, Any], over_A: float) -> str:
    """The row's, or EXCEPTED: alone, from the start, by its current, not beyond the proof."""
    name = case.kinds[0].name
    found = every_proven().get(name) if len(case.kinds) == 1 else None
    exact = (
        found is not None
        and case.condition.mode == STARTING
        and row["verdict"] == UNDECLARED
        and row["undeclared"] == CURRENT
        and row["peak_A"] <= found.allowed_A(over_A)
    )
    return EXCEPTED if exact else str(row["verdict"])
