"""The control interrupt of one configuration: its slots, its functions, and what a period costs in
which more happens than the law: a live change of a parameter, a running trace."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from zerohertz.build import build_image
from zerohertz.drive import State
from zerohertz.errors import UserError
from zerohertz.image import cycles, histogram, loop
from zerohertz.image.command import PRESETS, Experiment, job_of, measure
from zerohertz.image.histogram import SLOTS, Row
from zerohertz.image.loop import End, Inject, PilRun

PERIODS = 30_000  # 6 s: the start, and steady running behind it
STRETCH = 200 * SLOTS  # periods of steady running that functions are counted in
STEADY = tuple(Experiment("fig07", config) for config in PRESETS)
ADDED_MIN = 100  # periods that an addition has to show in


@dataclass(frozen=True)
class Slot:
    """One slot of the schedule, in state RUN."""

    slot: int
    mean: float
    worst: int


@dataclass(frozen=True)
class Interrupt:
    """Instructions of the control interrupt, entry to exit, in one run."""

    scenario: str
    config: str
    periods: int
    mean: float  # in state RUN
    worst: int  # in any state
    worst_period: int
    worst_state: str
    live_change: int  # the most that one adds to a period
    trace: int  # the most that a running trace of eight signals adds
    cycles_per_instruction: float  # estimate
    slots: tuple[Slot, ...]
    call: int  # instructions counted besides those of functions: the call, the timer's readings
    first: int  # periods that the functions were counted in
    last: int
    functions: tuple[Row, ...]


@dataclass(frozen=True)
class Load:
    """What instructions are on a core, estimated (cycles.MODEL)."""

    cycles_mean: int
    cycles_worst: int
    load_mean_percent: float  # of the period at cycles.CLOCK_HZ
    load_worst_percent: float
    pwm_max_Hz: int  # every worst period fits into half the core


def measure_interrupt(experiment: Experiment, worst_only: bool = False) -> Interrupt:
    """Run the first PERIODS; functions of the last STRETCH of them, or of the worst period."""
    run = measure(experiment, "mps2-an386", PERIODS)
    if run.end is not End.EQUAL:
        raise UserError(f"{experiment.name}: image and SIL differ: {run.difference or run.text}")
    at = int(np.argmax(run.each.instructions))
    first, last = (at, at) if worst_only else _steady(run)
    counted = histogram.count(job_of(experiment, None), PRESETS[experiment.config], first, last)
    return Interrupt(
        scenario=experiment.scenario,
        config=experiment.config,
        periods=run.periods,
        mean=round(run.mean_instructions, 1),
        worst=run.worst_instructions,
        worst_period=at,
        worst_state=State(int(run.each.state[at])).name,
        live_change=added(experiment, run, Inject.LIVE_CHANGE),
        trace=added(experiment, run, Inject.TRACE),
        cycles_per_instruction=round(counted.cycles_per_instruction, 3),
        slots=_slots(run),
        call=round(run.each.instructions[first : last + 1].mean() - counted.instructions),
        first=first,
        last=last,
        functions=counted.rows,
    )


def added(experiment: Experiment, without: PilRun, what: Inject) -> int:
    """The most instructions that `what` adds to a period of `without`, a run of the experiment.

    The same run with it: a live change is to the values in force, so both agree in every bit, and
    two periods differ by what was added alone.
    """
    job = job_of(experiment, len(without.each.instructions))
    ran = loop.run(job, build_image(PRESETS[experiment.config]), inject=what, inject_at=0)
    if ran.end is not End.EQUAL:
        raise UserError(f"{experiment.name}: {what.name} alters the run: {ran.difference}")
    extra = ran.each.instructions - without.each.instructions
    if (extra > 0).sum() < ADDED_MIN:
        raise UserError(f"{experiment.name}: {what.name} shows in {(extra > 0).sum()} periods only")
    return int(extra.max())


def load_of(mean: float, worst: float, cycles_per_instruction: float) -> Load:
    """Of instructions as counted; the exception comes on top."""
    spent = [n * cycles_per_instruction + cycles.EXCEPTION_CYCLES for n in (mean, worst)]
    percent = [round(100.0 * n / (cycles.CLOCK_HZ * cycles.PERIOD_S), 1) for n in spent]
    return Load(
        cycles_mean=round(spent[0]),
        cycles_worst=round(spent[1]),
        load_mean_percent=percent[0],
        load_worst_percent=percent[1],
        pwm_max_Hz=int(0.5 * cycles.CLOCK_HZ / spent[1]),
    )


def _steady(run: PilRun) -> tuple[int, int]:
    last = len(run.each.state) - 1
    first = last + 1 - STRETCH
    if first < 0 or (run.each.state[first:] != State.RUN).any():
        raise UserError(f"the run's last {STRETCH} periods are not all in state RUN; take another")
    return first, last


def _slots(run: PilRun) -> tuple[Slot, ...]:
    """None where a slot did not come."""
    found = []
    for slot in range(SLOTS):
        here = (run.each.state == State.RUN) & (run.each.slot == slot)
        counted = run.each.instructions[here]
        if len(counted):
            found.append(Slot(slot, round(float(counted.mean()), 1), int(counted.max())))
    return tuple(found)
