"""Runs the experiments of a configuration through the real firmware and judges them."""

from __future__ import annotations

import dataclasses
import multiprocessing
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

from zerohertz import sim
from zerohertz.scenario import predicates
from zerohertz.scenario.by_eye import judge_by_eye
from zerohertz.scenario.predicates import (
    FIGURES,
    NEEDS,
    Judgement,
    RampMeasures,
    StepMeasures,
    judge,
)
from zerohertz.scenario.setup import Setup, event_s, figure_scenario, scenario_file
from zerohertz.scenario.signals import Signals

SEEDS = 6
# Every fifth control step is judged: 1 ms, against windows of a third of a second and a ripple of
# tens of hertz. Noise above 500 Hz folds down and keeps its rms.
DECIMATE = 5

Measures = StepMeasures | RampMeasures
Progress = Callable[[int], None]

# The four physical situations for a configuration that is not bound to the paper's settings: the
# scenarios with L and without eps1, and what a good drive does in them.
SITUATIONS: Mapping[str, int] = {
    "no_load": 7,
    "load_50": 9,
    "load_50_rs_1.5": 15,
    "regen_ramp": 17,
}


@dataclasses.dataclass(frozen=True)
class Run:
    setup: Setup
    figure: int
    seed: int
    guard_acts: bool = False  # else that of the speed counts and makes no verdict


@dataclasses.dataclass(frozen=True)
class Result:
    """One figure (or situation) over all seeds, the judgements in the order of the seeds."""

    key: str
    predicate: str
    judgements: tuple[Judgement, ...]
    by_eye: tuple[Judgement, ...] = ()  # the stricter reading, of the paper's figures alone

    @property
    def seeds_by_eye(self) -> int:
        return sum(j.match for j in self.by_eye)

    @property
    def match_by_eye(self) -> bool:
        return bool(self.by_eye) and self.seeds_by_eye == len(self.by_eye)

    @property
    def reason_by_eye(self) -> str | None:
        """What an eye objects to in the worst seed, the predicate's own clauses left out."""
        if not self.by_eye or self.match_by_eye:
            return None
        worst = min(self.by_eye, key=lambda j: j.margin)
        own = {c.text for j in self.judgements for c in j.clauses}
        seen = [str(c) for c in worst.failing if c.text not in own]
        return "; ".join(seen) or "its predicate does not hold"

    @property
    def seeds_matched(self) -> int:
        return sum(j.match for j in self.judgements)

    @property
    def match(self) -> bool:
        return self.seeds_matched == len(self.judgements)

    @property
    def worst(self) -> Judgement:
        return min(self.judgements, key=lambda j: j.margin)

    @property
    def reason(self) -> str | None:
        """Why it does not match: the clauses that fail, of the worst seed."""
        return None if self.match else "; ".join(str(c) for c in self.worst.failing)

    def as_json(self) -> dict[str, Any]:
        """Measured are the numbers of the first seed, then margin and reason of the worst."""
        extra = {"worst_margin": _finite(self.worst.margin), "reason": self.reason}
        eye = {
            "match": self.match_by_eye,
            "seeds_matched": self.seeds_by_eye,
            "reason": self.reason_by_eye,
        }
        return {
            "match": self.match,
            "seeds_matched": self.seeds_matched,
            "seeds": len(self.judgements),
            "predicate": self.predicate,
            "measured": dict(self.judgements[0].measured) | extra,
        } | ({"by_eye": eye} if self.by_eye else {})


def job(run: Run) -> sim.Job:
    """The job of one figure and seed."""
    setup = run.setup
    return sim.Job(
        scenario=scenario_file(figure_scenario(run.figure)),
        rig=setup.rig,
        board=setup.board,
        motor_dir=setup.motor_dir,
        firmware_config=setup.params,
        rig_overrides=setup.rig_overrides,
        gain=setup.gain,
        seed=run.seed,
        decimate=DECIMATE,
        guard_recorded=not run.guard_acts,
    )


def signals(record: sim.Record, event_time_s: float, setup: Setup) -> Signals:
    """What the predicates need of a record."""
    trip = record.stopping_trip
    trip_s = record.trip_s if trip and record.trip_s is not None else np.nan
    numbers = {
        "event_s": event_time_s,
        "i_q_limit_A": setup.i_q_limit_A(),
        "lambda_max_Wb": setup.parameters()["lambda_max_Wb"],
        "speed_hat_max_rpm": setup.speed_hat_max_rpm(),
        "trip": int(trip),
        "trip_s": trip_s,
        "first_fault": record.first_fault,
    }
    arrays = {
        field.name: record[field.name].astype(np.float64)
        for field in dataclasses.fields(Signals)
        if field.name not in numbers
    }
    return Signals(**numbers, **arrays)


def measure_run(run: Run) -> Measures:
    """Simulate and measure: picklable in and out, for worker processes."""
    begin_s = event_s(scenario_file(figure_scenario(run.figure)))
    record = sim.run(job(run))
    return predicates.measure(run.figure, signals(record, begin_s, run.setup))


def measure_all(
    runs: Iterable[Run], workers: int, progress: Progress | None = None
) -> list[Measures]:
    """The measures of many runs in their order; two or more workers use processes."""
    runs = list(runs)
    found = []
    if workers <= 1:
        for run in runs:
            found.append(measure_run(run))
            if progress:
                progress(len(found))
        return found
    # spawn: the library's threads and handles must not be inherited half open.
    with multiprocessing.get_context("spawn").Pool(workers) as pool:
        for measures in pool.imap(measure_run, runs, chunksize=1):
            found.append(measures)
            if progress:
                progress(len(found))
    return found


def evaluate_figures(
    setup: Setup,
    seeds: int = SEEDS,
    workers: int = 1,
    progress: Progress | None = None,
    guard_acts: bool = False,
) -> list[Result]:
    """All thirteen figures over seeds 1..n."""
    numbers = range(1, seeds + 1)
    runs = [Run(setup, figure, seed, guard_acts) for seed in numbers for figure in FIGURES]
    found = dict(
        zip(((r.seed, r.figure) for r in runs), measure_all(runs, workers, progress), strict=True)
    )
    return [_result(figure, seeds, found) for figure in FIGURES]


def _result(figure: int, seeds: int, found: Mapping[tuple[int, int], Measures]) -> Result:
    compared = (figure, *NEEDS.get(figure, ()))
    measures = [{n: found[seed, n] for n in compared} for seed in range(1, seeds + 1)]
    return Result(
        str(figure),
        predicates.TEXT[figure],
        tuple(judge(figure, m) for m in measures),
        tuple(judge_by_eye(figure, m) for m in measures),
    )


def evaluate_situations(
    setup: Setup,
    seeds: int = SEEDS,
    workers: int = 1,
    progress: Progress | None = None,
    guard_acts: bool = False,
    only: Iterable[str] = tuple(SITUATIONS),
) -> list[Result]:
    """The four situations over seeds 1..n: STABLE, and the ramp with its dwell not LOST."""
    figures = {name: SITUATIONS[name] for name in only}
    numbers = range(1, seeds + 1)
    runs = [Run(setup, figure, seed, guard_acts) for figure in figures.values() for seed in numbers]
    found = measure_all(runs, workers, progress)
    return [
        Result(
            name,
            predicates.SITUATION_TEXT[figure in predicates.STEP_FIGURES],
            tuple(
                predicates.judge_held(m)
                for run, m in zip(runs, found, strict=True)
                if run.figure == figure
            ),
        )
        for name, figure in figures.items()
    ]


def score(results: Iterable[Result]) -> int:
    return sum(r.match for r in results)


def score_by_eye(results: Iterable[Result]) -> int:
    return sum(r.match_by_eye for r in results)


def _finite(value: float) -> float:
    return round(max(-1e3, min(1e3, value)), 6)
