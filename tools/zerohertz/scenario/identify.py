"""Search for the rig and the tuning that reproduce the paper's figures.

Steady-state evolution: an elite of points, each new one a perturbed or crossed elite. The objective
of a point is the number of figures that match with margin on several seeds, plus smooth terms that
tell how far the others are, so that the search can climb. Judging is a cascade: one seed, given up
as soon as the rest could not lift the point into the elite; more seeds only for good ones.
Everything tried goes to a JSONL log, from which a search resumes.
"""

from __future__ import annotations

import dataclasses
import json
import math
import multiprocessing
import time
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from zerohertz.errors import UserError
from zerohertz.scenario.evaluate import Measures, Run, measure_run
from zerohertz.scenario.predicates import FIGURES, NEEDS, Clause, Judgement, judge
from zerohertz.scenario.space import BY_NAME, STARTS, perturbed, setup_of, start_point

# Figures in the order of judging: those that part good points from bad first. A figure stands
# after the one it is compared with.
CASCADE = (16, 14, 15, 9, 10, 11, 12, 6, 7, 13, 8, 17, 18)
SEEDS = (1, 2)
ELITE = 6
MATCH = 1.0
# A margin beyond this earns nothing more: robust enough, and no figure shall pay for another.
MARGIN_FULL = 0.10
MARGIN_WORTH = 0.15
FIGURE_BEST = MATCH + MARGIN_WORTH


@dataclasses.dataclass(frozen=True)
class Trial:
    """A point and what became of it. value: None when the cascade gave it up."""

    point: Mapping[str, float]
    value: float | None
    figures: Mapping[str, float]
    origin: str

    @property
    def matches(self) -> int:
        return sum(v >= MATCH for v in self.figures.values())


def figure_value(judgement: Judgement) -> float:
    """1 and more for a match with margin; down to -1 by how far the failing clauses are off."""
    if judgement.match:
        return MATCH + MARGIN_WORTH * min(1.0, judgement.margin / MARGIN_FULL)
    return -min(1.0, sum(_distance(c) for c in judgement.failing))


def _distance(clause: Clause) -> float:
    """0 at the threshold, 1 a factor of thirty away from it."""
    if not math.isfinite(clause.value):
        return 1.0
    if clause.threshold <= 0.0:
        return min(1.0, -clause.margin)
    ratio = clause.value / clause.threshold
    if ratio <= 0.0:
        return min(1.0, 0.6 - 0.05 * ratio)
    return min(0.6 if ratio < 1.0 else 1.0, abs(math.log(ratio)) / math.log(30.0))


def assess(point: Mapping[str, float], bar: float, origin: str) -> Trial:
    """Value of a point, or None as soon as it cannot reach the bar."""
    setup = setup_of(point)
    worst: dict[int, float] = {}
    for seed in SEEDS:
        found: dict[int, Measures] = {}
        for figure in CASCADE:
            try:
                found[figure] = measure_run(Run(setup, figure, seed))
            except UserError:
                # Values that each are in range, and together are no rig or no drive.
                return Trial(point, None, _named(worst), origin)
            needed = {n: found[n] for n in (figure, *NEEDS.get(figure, ()))}
            value = figure_value(judge(figure, needed))
            worst[figure] = min(value, worst.get(figure, FIGURE_BEST))
            reachable = sum(worst.get(n, FIGURE_BEST) for n in FIGURES)
            if reachable < bar:
                return Trial(point, None, _named(worst), origin)
    return Trial(point, sum(worst.values()), _named(worst), origin)


def _named(values: Mapping[int, float]) -> dict[str, float]:
    return {str(n): round(values[n], 4) for n in sorted(values)}


def read_point(path: Path) -> dict[str, float]:
    """A point of the space from JSON; coordinates it leaves out have their start value."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        given = {name: float(value) for name, value in content.items() if name in BY_NAME}
    except (OSError, ValueError, TypeError, AttributeError) as error:
        raise UserError(f"{path}: is not a point of the search: {error}") from None
    return start_point("paper_outcomes") | given


class Search:
    """The elite and its log."""

    def __init__(
        self, log: Path, seed: int, starts: Mapping[str, Mapping[str, float]] | None = None
    ) -> None:
        self.log = log
        self.rng = np.random.default_rng(seed)
        self.elite: list[Trial] = []
        self.tried = 0
        self.full = 0
        self.starts = dict(starts) if starts else {name: start_point(name) for name in STARTS}
        log.parent.mkdir(parents=True, exist_ok=True)
        if log.exists():
            self._resume(bool(starts))

    @property
    def best(self) -> Trial | None:
        return self.elite[0] if self.elite else None

    @property
    def bar(self) -> float:
        return self.elite[-1].value if len(self.elite) >= ELITE else -math.inf

    def propose(self) -> tuple[dict[str, float], str]:
        """A start that was not tried yet, else a child of the elite."""
        if self.starts:
            name = next(iter(self.starts))
            return dict(self.starts.pop(name)), name
        # Better ones more often: the square of a uniform number favours the front.
        parent = self.elite[int(len(self.elite) * self.rng.random() ** 2)] if self.elite else None
        point = dict(parent.point) if parent else start_point("paper_outcomes")
        origin = parent.origin if parent else "paper_outcomes"
        if len(self.elite) > 2 and self.rng.random() < 0.25:
            other = self.elite[self.rng.integers(len(self.elite))].point
            point = {k: (other[k] if self.rng.random() < 0.3 else v) for k, v in point.items()}
        sigma = 10.0 ** self.rng.uniform(-2.2, -0.6)
        count = int(1 + self.rng.geometric(0.2))
        return perturbed(point, self.rng, sigma, count), origin

    def absorb(self, trial: Trial) -> bool:
        """Logs a trial; true when it is a new best."""
        with self.log.open("a", encoding="utf-8") as out:
            out.write(json.dumps(dataclasses.asdict(trial)) + "\n")
        return self._take(trial)

    def _take(self, trial: Trial) -> bool:
        self.tried += 1
        if trial.value is None:
            return False
        self.full += 1
        before = self.best
        self.elite = sorted([*self.elite, trial], key=lambda t: -t.value)[:ELITE]
        return before is None or trial.value > before.value

    def _resume(self, starts: bool) -> None:
        for number, line in enumerate(self.log.read_text(encoding="utf-8").splitlines(), 1):
            try:
                trial = Trial(**json.loads(line))
            except (ValueError, TypeError) as error:
                raise UserError(
                    f"{self.log}: line {number}: is not a trial ({error}); remove it"
                ) from None
            if set(trial.point) == set(BY_NAME):
                self._take(trial)
        if self.tried and not starts:
            self.starts = {}


def search(
    run: Search,
    seconds: float,
    workers: int,
    report: Callable[[Search, bool], None],
) -> None:
    """Propose and assess until the time is over; every worker always has one point."""
    end = time.monotonic() + seconds
    with multiprocessing.get_context("spawn").Pool(workers) as pool:
        pending = []
        while pending or time.monotonic() < end:
            while len(pending) < workers and time.monotonic() < end:
                point, origin = run.propose()
                pending.append(pool.apply_async(assess, (point, run.bar, origin)))
            done = [p for p in pending if p.ready()]
            pending = [p for p in pending if not p.ready()]
            for result in done:
                report(run, run.absorb(result.get()))
            if not done:
                time.sleep(0.01)
