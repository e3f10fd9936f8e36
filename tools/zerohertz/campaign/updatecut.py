"""Updates under power cuts and failing flash: every single cut, random double and triple ones.

The work is done by tests/boot, linked with the loader's own sources; here it is asked for, and its
answers become one table.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated

import typer

from zerohertz.build import configure_tests, ensure_built
from zerohertz.errors import UserError
from zerohertz.options import Json
from zerohertz.paths import ROOT

PAGE = ROOT / "tools" / "docs" / "updatecut.md"
SLOTS = ("staged", "lone")
UNITS_WORDS = (1, 2)
NAMES = {
    "single": "one cut or failure, every operation, every mode",
    "double": "two, random",
    "triple": "three, random",
    "frames": "arbitrary requests, flash that fails again and again",
}


@dataclass(frozen=True)
class Row:
    """One run of the bench."""

    what: str
    slots: int
    unit_bytes: int
    operations: int
    runs: int
    failed: int


def run_all(count: int, seed: int, jobs: int, done: Callable[[Row], None]) -> list[Row]:
    """Every kind, with one slot and two, with both sizes of a program unit."""
    configure_tests()
    bench = ensure_built("bootcut").folder / "tests" / "boot" / "bootcut"
    counts = {"single": 0, "double": count, "triple": count, "frames": max(1, count // 4)}
    wanted = [
        (what, n, slots, unit)
        for what, n in counts.items()
        for slots in SLOTS
        for unit in UNITS_WORDS
    ]

    def run(one: tuple[str, int, str, int]) -> Row:
        row = _run(bench, [str(word) for word in (*one, seed)])
        done(row)
        return row

    with ThreadPoolExecutor(max_workers=jobs) as pool:
        return list(pool.map(run, wanted))


def _run(bench: Path, words: list[str]) -> Row:
    ended = subprocess.run([str(bench), *words], capture_output=True, text=True)
    if ended.returncode not in (0, 1):
        raise UserError(f"{words}: the bench ended with {ended.returncode}: {ended.stderr[-500:]}")
    return Row(**json.loads(ended.stdout))


def good(rows: list[Row]) -> bool:
    """Something ran and nothing failed."""
    return all(row.runs > 0 and row.failed == 0 for row in rows)


def page_text(rows: list[Row], count: int, seed: int) -> str:
    """The committed result."""
    lines = "\n".join(
        f"| {NAMES[row.what]} | {row.slots} | {row.unit_bytes} | {row.operations} | {row.runs} "
        f"| {row.failed} |"
        for row in rows
    )
    return f"""\
# Updates under power cuts

Made by `tools/zh campaign update --count {count} --seed {seed} --write`; `tools/zh test` runs a
sample.

| what | slots | program unit, bytes | operations of an update | runs | failed |
|---|---|---|---|---|---|
{lines}

A run: version 1 runs; a higher one is sent; within a flash operation the power goes, or the
operation fails and the power stays; the next power-up, the next update, and so on. A run fails in
any of these cases: something is started that is not a whole signed image, or older than what ran
before; the counter of versions stands below what ran; a forged or an older image is accepted; with
two slots nothing starts after a power cut; the update behind the last cut does not succeed; a word
is programmed twice.

Arbitrary requests: 200 to a run, in any order. Among them are signed headers for this board, for
another one, of an old version or with a changed bit; data of other places, lengths and contents;
noise. In two runs of three the flash fails again and again meanwhile. Such a run also fails if
anything is erased but for a signed newer header, or the running slot of two by any request.

An interrupted operation leaves one of four things: nothing happened; some cells changed; the cells
to change hold random values; or they are marginal. Marginal cells read at every power-up as before,
as intended, or differently each time. A third of the random cuts are aimed at the first operations
behind a power-up, a third at the last ones of an update. The cryptography is a toy here, to be
fast. The bench is `tests/boot`.
"""


def update(
    count: Annotated[
        int,
        typer.Option(
            min=1,
            help="Number of random double and of random triple cuts; a fourth of it with requests.",
        ),
    ] = 1_000_000,
    seed: Annotated[int, typer.Option(min=0, help="Seed of all random draws.")] = 2005,
    jobs: Annotated[int, typer.Option(min=1, help="Number of parallel runs.")] = 2,
    write: Annotated[bool, typer.Option(help="Write tools/docs/updatecut.md.")] = False,
    as_json: Json = False,
) -> None:
    """Cut the power at any moment of an update, and check what the boot loader starts."""

    def show(row: Row) -> None:
        text = f"{row.what}, {row.slots} slots, unit of {row.unit_bytes} bytes: {row.runs} runs"
        print(f"{text}, {row.failed} failed", file=sys.stderr if as_json else sys.stdout)

    rows = run_all(count, seed, jobs, show)
    if write:
        PAGE.write_text(page_text(rows, count, seed), encoding="utf-8")
    if as_json:
        print(json.dumps({"seed": seed, "runs": [asdict(row) for row in rows]}, indent=2))
    raise typer.Exit(0 if good(rows) else 1)
