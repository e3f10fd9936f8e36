"""Flips on the simulated drive: runs up to the flip once, and from there on in a process per flip.

The main run goes on with nothing else broken, and the judge of `zh campaign faults` says what came
of it. Then the same flip again and again, each time followed by a plain fault that trips the drive
when no bit has flipped: a protection that no longer answers was lost.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from zerohertz import sim
from zerohertz.atlas.simulate import Bench, library_sha256
from zerohertz.campaign.faults import judge
from zerohertz.campaign.flips.cases import Case
from zerohertz.campaign.flips.layout import leaf_of
from zerohertz.campaign.flips.modes import MODES, PLAIN, Mode
from zerohertz.campaign.fork import answer_of
from zerohertz.errors import UserError
from zerohertz.sil_types import WARNINGS
from zerohertz.sim_steps import Steps

# A row depends on these besides the firmware: a change of one makes stored rows old.
_HERE = Path(__file__).parent
SOURCES = (
    *(_HERE / f"{name}.py" for name in ("cases", "layout", "modes")),
    *(_HERE.parent / "faults" / f"{name}.py" for name in ("judge", "kinds", "run")),
    _HERE.parent / "fork.py",
    _HERE.parent / "rig.py",
)

UNDECLARED, STOPPED, DECLARED = "undeclared", "stopped", "declared"
HEALED, HARMLESS = "healed", "harmless"
CLASSES = (HARMLESS, HEALED, DECLARED, STOPPED, UNDECLARED)
GATES = "gates"  # the harm that only this campaign knows: on in two periods before the run command
LATER = 2.0  # a protection has so many times as long as without a flip, and the grace
PERIOD_S = 200e-6  # of the campaign's board; a test compares
_OUTPUT = ("duty_u", "duty_v", "duty_w", "gates_on", "brake_on", "faults")


@dataclasses.dataclass(frozen=True)
class Trip:
    """How a drive that is well answers a plain fault."""

    at_s: float
    until_s: float  # by then it has to have answered


@dataclasses.dataclass(frozen=True)
class Usual:
    """A mode with no bit flipped."""

    record: sim.Record
    undeclared: frozenset[str]
    trips: dict[str, Trip]


def job_with(bench: Bench, mode: Mode, plain: str | None) -> sim.Job:
    """The mode's run, with a plain fault or none."""
    made = mode.job(bench)
    if plain is None:
        return made
    change = PLAIN[plain](mode.when(bench).fault_s)
    return dataclasses.replace(made, scenario_overrides={**made.scenario_overrides, **change})


@functools.cache
def _usual(mode_name: str, firmware: tuple[tuple[str, float], ...]) -> Usual:
    from zerohertz.campaign.flips.modes import bench as bench_of

    bench = dataclasses.replace(bench_of(), firmware=dict(firmware))
    mode = MODES[mode_name]
    span = mode.when(bench)
    with Steps(mode.job(bench)) as run:
        run.advance(steps_at(span.end_s))
        record = run.take()
    found = judge.judge(record, mode.limits(bench), span.first_s)
    trips = {}
    for plain in PLAIN:
        at_s = trip_s(sim.run(job_with(bench, mode, plain)))
        if span.fault_s - 1e-3 <= at_s < math.inf:
            until_s = at_s + (LATER - 1.0) * (at_s - span.fault_s) + judge.GRACE_S
            trips[plain] = Trip(at_s, until_s)
    return Usual(record, frozenset(found["undeclared"].split()), trips)


def usual(bench: Bench, mode: Mode) -> Usual:
    """Once per process and mode."""
    return _usual(mode.name, tuple(bench.firmware.items()))


def steps_at(t_s: float) -> int:
    return round(t_s / PERIOD_S)


def trip_s(record: sim.Record) -> float:
    """When the drive latched a fault or opened the gates; inf: never."""
    stopped = faults_of(record) != 0
    return float(record.t_s[np.argmax(stopped)]) if stopped.any() else math.inf


def faults_of(record: sim.Record) -> npt.NDArray[np.int64]:
    return record["faults"].astype(np.int64) & ~WARNINGS


def class_of(
    record: sim.Record, base: Usual, row: dict[str, Any], since: int, run_on: int
) -> tuple[str, str]:
    """The class of a main run that is not as usual, and the harms that nobody declared.

    since: period of the flip.
    """
    harms = set(row["undeclared"].split()) - base.undeclared
    on, usually_on = record["gates_on"] > 0, base.record["gates_on"] > 0
    before = on[since:run_on]
    if (before[1:] & before[:-1]).any():
        harms.add(GATES)
    if harms:
        return UNDECLARED, " ".join(sorted(harms))
    if row["verdict"] in (judge.BEFORE, judge.AFTER) or _refused(record) != 0:
        return DECLARED, ""
    n = min(len(on), len(usually_on))
    early = len(on) < len(usually_on) or (usually_on[since:n] & ~on[since:n]).any()
    # A commissioning that comes to its end may do so at another moment.
    finished = record.commissioned is not None and record.commissioned.done
    return (STOPPED if early and not finished else HEALED), ""


def as_usual(record: sim.Record, base: sim.Record, since: int) -> bool:
    """No output and no word differs."""
    return len(record.t_s) == len(base.t_s) and all(
        np.array_equal(record[name][since:], base[name][since:]) for name in _OUTPUT
    )


def _refused(record: sim.Record) -> int:
    """Commissioning says why it gave up."""
    found = record.commissioned
    return 0 if found is None or found.done else found.refusal


def _main(bench: Bench, run: Steps, case: Case, at_s: float) -> dict[str, Any]:
    """In the child: the rest of the run, judged."""
    mode, base = MODES[case.map], usual(bench, MODES[case.map])
    run.flip(case.byte, case.bit)
    run.advance(steps_at(mode.when(bench).end_s))
    record = run.take()
    since = steps_at(at_s)
    if as_usual(record, base.record, since):
        return {**NOTHING, "class": HARMLESS}
    row = judge.judge(record, mode.limits(bench), at_s)
    run_on = steps_at(float(mode.scenario.get("scenario.run_on_s", 0.0)))
    found, harms = class_of(record, base, row, since, run_on)
    fallen = bool((record["confidence"][since:] == IN_I_F).any())
    return {
        "class": found,
        "harms": harms,
        "fallen": fallen,
        **{key: row[key] for key in NUMBERS},
    }


def _protected(run: Steps, case: Case, trip: Trip) -> dict[str, Any]:
    """In the child: whether the drive still trips."""
    run.flip(case.byte, case.bit)
    for until_s in (trip.at_s + PERIOD_S, trip.until_s):
        run.advance(steps_at(until_s))
        if run.faults() & ~WARNINGS or not run.gates_on():
            return {"answered": True}
    return {"answered": False}


IN_I_F = 2  # of the column confidence: operation without an estimate
NUMBERS = ("harm_s", "word_ms", "bits", "peak_A", "off_rpm", "top_rpm")
NOTHING: dict[str, Any] = {
    **dict.fromkeys(("class", "harms"), ""),
    **dict.fromkeys(("harm_s", "word_ms")),
    "bits": 0,
    "fallen": False,
    **dict.fromkeys(("peak_A", "off_rpm", "top_rpm"), 0.0),
}


def _sweep(
    job: sim.Job,
    bench: Bench,
    cases: Sequence[Case],
    child: Callable[[Steps, Case, float], dict[str, Any]],
) -> list[dict[str, Any] | str]:
    """One run, with a fork at the moment of every case; answers in the order of the cases."""
    span = MODES[cases[0].map].when(bench)
    found: dict[int, dict[str, Any] | str] = {}
    with Steps(job) as run:
        for k in sorted(range(len(cases)), key=lambda k: cases[k].at_s(span)):
            at_s = cases[k].at_s(span)
            run.advance(steps_at(at_s))
            found[k] = answer_of(functools.partial(child, run, cases[k], at_s))
    return [found[k] for k in range(len(cases))]


def run_mode(bench: Bench, cases: Sequence[Case]) -> list[dict[str, Any]]:
    """Rows of cases of one mode."""
    mode = MODES[cases[0].map]
    base = usual(bench, mode)
    mains = _sweep(
        mode.job(bench), bench, cases, lambda run, case, at_s: _main(bench, run, case, at_s)
    )
    rows = []
    for case, main in zip(cases, mains, strict=True):
        died = main if isinstance(main, str) else ""
        rows.append(
            {
                "map": case.map,
                "index": case.index,
                "name": case.name,
                "owner": leaf_of(case.path).owner,
                "died": died,
                **(main if isinstance(main, dict) else {**NOTHING, "class": DECLARED}),
                "lost": "",
            }
        )
    for plain, trip in base.trips.items():
        _protections(bench, cases, rows, plain, trip)
    return rows


def _protections(
    bench: Bench, cases: Sequence[Case], rows: list[dict[str, Any]], plain: str, trip: Trip
) -> None:
    """Adds what was lost. A drive that stopped or died has nothing left to protect."""
    asked = [k for k, row in enumerate(rows) if row["class"] not in (DECLARED, STOPPED)]
    if not asked:
        return
    answers = _sweep(
        job_with(bench, MODES[cases[0].map], plain),
        bench,
        [cases[k] for k in asked],
        lambda run, case, _at_s: _protected(run, case, trip),
    )
    for k, answer in zip(asked, answers, strict=True):
        if isinstance(answer, dict) and not answer["answered"]:
            rows[k]["lost"] = f"{rows[k]['lost']} {plain}".strip()


def run_cases(bench: Bench, cases: Sequence[Case]) -> list[dict[str, Any]]:
    """A worker's share, with the very firmware the bench was made with."""
    if library_sha256() != bench.library_sha256:
        raise UserError("firmware library: differs from the one the campaign was started with")
    return run_mode(bench, cases)
