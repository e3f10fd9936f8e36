"""The parameter store under power cuts: all single and double ones, random triple ones, saves.

The work is done by tests/powercut, linked with the firmware's own store; here it is asked for, and
its answers become one table.
"""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from zerohertz.build import configure_tests, ensure_built
from zerohertz.errors import UserError
from zerohertz.paths import ROOT

PAGE = ROOT / "tools" / "docs" / "powercut.md"
UNITS_WORDS = (1, 2)
SAVES = 10_000
MODES = 4
NAMES = {
    "single": "one cut, every operation, every mode, from 0, 1, 2 and 3 sets before",
    "double": "two cuts, every pair of operations, every pair of modes",
    "triple": "three cuts, random",
    "saves": "saves in a row, each read back after a boot",
}


@dataclass(frozen=True)
class Row:
    """One run of the bench."""

    what: str
    unit_bytes: int
    operations: int
    runs: int
    failed: int


def run_all(triple: int, seed: int, jobs: int, done: Callable[[Row], None]) -> list[Row]:
    """Every kind with both sizes of a program unit; rows in the order of the table."""
    configure_tests()
    bench = ensure_built("powercut").folder / "tests" / "powercut" / "powercut"
    counts = {"single": 0, "double": 0, "triple": triple, "saves": SAVES}
    wanted = [(what, n, unit) for what, n in counts.items() for unit in UNITS_WORDS]

    def run(one: tuple[str, int, int]) -> Row:
        row = _run(bench, *one, seed)
        done(row)
        return row

    with ThreadPoolExecutor(max_workers=jobs) as pool:
        return list(pool.map(run, wanted))


def _run(bench: Path, what: str, count: int, unit_words: int, seed: int) -> Row:
    command = [str(word) for word in (bench, what, count, unit_words, seed)]
    ended = subprocess.run(command, capture_output=True, text=True)
    if ended.returncode not in (0, 1):
        raise UserError(f"{what}: the bench ended with {ended.returncode}: {ended.stderr[-500:]}")
    return Row(**json.loads(ended.stdout))


def good(rows: list[Row]) -> bool:
    """Something ran and nothing failed."""
    return all(row.runs > 0 and row.failed == 0 for row in rows)


def page_text(rows: list[Row], triple: int, seed: int) -> str:
    """The committed result."""
    lines = "\n".join(
        f"| {NAMES[row.what]} | {row.unit_bytes} | {row.operations} | {row.runs} | {row.failed} |"
        for row in rows
    )
    return f"""\
# The parameter store under power cuts

Made by `tools/zh campaign powercut --triple {triple} --seed {seed} --write`; `tools/zh test` runs
a sample.

| what | program unit, bytes | operations of a save | runs | failed |
|---|---|---|---|---|
{lines}

A run fails in any of these cases: a boot finds another set than the old or the new one; a set that
the store had proven is gone later; the store reports "lost"; a save after the cuts does not work;
the store programs a word twice.

A cut interrupts an erase or program operation in one of {MODES} ways: nothing happened; some cells
changed; the cells to change hold random values; or they are marginal. Marginal cells read at every
boot as before, as intended, or differently each time. The operations include the two marks that a
boot may have to add before it erases. Two cuts: the sets stored before are 0, 1, 2, 3 in turn over
the pairs. Half of the random cuts are aimed at the erasure, the trailer and the marks. The bench is
`tests/powercut`.
"""
