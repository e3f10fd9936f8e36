"""A case from its name to its row: the image on the emulated core, then the judge."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from zerohertz import sim
from zerohertz.atlas.simulate import Bench, library_sha256
from zerohertz.campaign.faults import judge
from zerohertz.campaign.flips.run import (
    DECLARED,
    HARMLESS,
    NOTHING,
    NUMBERS,
    PERIOD_S,
    STOPPED,
    UNDECLARED,
    Usual,
    as_usual,
    class_of,
    faults_of,
)
from zerohertz.campaign.skips.cases import PLAIN, Case, Skip, skip_of
from zerohertz.campaign.skips.core import run_skipping
from zerohertz.errors import UserError
from zerohertz.image.emulator import EXIT_DONE
from zerohertz.image.loop import End, PilRun

# A row depends on these besides the firmware: a change of one makes stored rows old.
_HERE = Path(__file__).parent
SOURCES = (
    *(_HERE / f"{name}.py" for name in ("cases", "core")),
    *(_HERE.parent / "flips" / f"{name}.py" for name in ("modes", "run")),
    *(_HERE.parent / "faults" / f"{name}.py" for name in ("judge", "kinds", "run")),
    _HERE.parent / "rig.py",
)
HANG, LOCK_UP = "hang", "lock-up"
_ABORTED = -6  # so the emulator ends when the core locks up


@functools.cache
def usual(skip: Skip) -> Usual:
    """The same run on the SIL, which is the image to the bit, with nothing skipped."""
    record = sim.run(skip.job())
    found = judge.judge(record, skip.mode.limits(_bench()), skip.period * PERIOD_S)
    return Usual(record, frozenset(found["undeclared"].split()), {})


def _bench() -> Bench:
    from zerohertz.campaign.flips.modes import bench

    return bench()


def died_of(ran: PilRun) -> str:
    """Why the image ended by itself: the exit code of its fault handler (hal/cortex_m/cm_fault.h)
    or a core that locked up; empty when it did not."""
    if ran.end == End.SILENT:
        return HANG
    if ran.end != End.LEFT or ran.exit_code == EXIT_DONE:
        return ""
    return LOCK_UP if ran.exit_code == _ABORTED else f"exit {ran.exit_code}"


def row_of(ran: PilRun, skip: Skip) -> dict[str, Any]:
    """Class and numbers of a run."""
    died = died_of(ran)
    if died:
        # The fault handler opens the gates; a core that just stands still does not.
        harm = {"class": UNDECLARED, "harms": HANG} if died == HANG else {"class": DECLARED}
        return {**NOTHING, "lost": "", "died": died, **harm}
    assert ran.record is not None
    if skip.faulty:
        return {**NOTHING, "died": "", **_answer(ran.record)}
    base, at = usual(skip), skip.period
    if as_usual(ran.record, base.record, at):
        return {**NOTHING, "lost": "", "died": "", "class": HARMLESS}
    row = judge.judge(ran.record, skip.mode.limits(_bench()), at * PERIOD_S)
    run_on = round(float(skip.mode.scenario.get("scenario.run_on_s", 0.0)) / PERIOD_S)
    found, harms = class_of(ran.record, base, row, at, run_on)
    kept = {key: row[key] for key in NUMBERS}
    return {**NOTHING, "class": found, "harms": harms, "lost": "", "died": "", **kept}


def _answer(record: sim.Record) -> dict[str, Any]:
    """With a fault present: it has to trip as if nothing was skipped."""
    peak_A = float(np.max(record["i_peak_A"]))
    if (faults_of(record) != 0).any():
        return {"class": DECLARED, "lost": "", "peak_A": peak_A}
    if record["gates_on"][-1] == 0:
        return {"class": STOPPED, "lost": "", "peak_A": peak_A}
    return {"class": HARMLESS, "lost": PLAIN, "peak_A": peak_A}


def run_case(case: Case) -> dict[str, Any]:
    """One row."""
    skip = skip_of(case.map)
    ran = run_skipping(skip.job(), skip.period, case.address)
    names = {"map": case.map, "index": case.index, "name": case.name, "owner": case.function}
    return {**names, **row_of(ran, skip)}


def run_cases(bench: Bench, cases: Sequence[Case]) -> list[dict[str, Any]]:
    """A worker's share, with the very firmware the bench was made with."""
    if library_sha256() != bench.library_sha256:
        raise UserError("firmware library: differs from the one the campaign was started with")
    return [run_case(case) for case in cases]
