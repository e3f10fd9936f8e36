"""How fast the atlas is, beside processes that know nothing of each other."""

from __future__ import annotations

import contextlib
import dataclasses
import resource
import tempfile
import time
from collections.abc import Iterator, Sequence
from multiprocessing import get_context
from pathlib import Path

from zerohertz.atlas.parallel import worker_environment
from zerohertz.atlas.points import Point, random_sample
from zerohertz.atlas.run import RunOptions, run_map
from zerohertz.atlas.simulate import Bench, run_points

POINTS = 3000
LOADED_S = 2.0
ROUNDS = 3
PROJECTED_POINTS = 100_000


@dataclasses.dataclass(frozen=True)
class Throughput:
    """The best of ROUNDS, taken in turns, as whatever else the machine does disturbs both.

    On a busy machine only cpu_ratio means something; it knows nothing of workers that wait.
    """

    points: int
    workers: int
    atlas_points_per_s: float  # from spawning the workers to the finished Parquet file
    independent_points_per_s: float  # that many processes, each with its share and nothing else
    ratio: float
    cpu_ratio: float
    projected_100k_s: float


def measure(bench: Bench, workers: int, points: int = POINTS) -> Throughput:
    """Points of two seconds after the start, off the grid, every error at once."""
    sample = random_sample(points, seed=1, loaded_s=LOADED_S)
    atlas, independent = _Best(), _Best()
    for _ in range(ROUNDS):
        with independent.timed():
            _run_independent(bench, sample, workers)
        with atlas.timed():
            _run_atlas(bench, sample, workers)
    return Throughput(
        points=points,
        workers=workers,
        atlas_points_per_s=points / atlas.wall_s,
        independent_points_per_s=points / independent.wall_s,
        ratio=independent.wall_s / atlas.wall_s,
        cpu_ratio=independent.cpu_s / atlas.cpu_s,
        projected_100k_s=PROJECTED_POINTS * atlas.wall_s / points,
    )


class _Best:
    """The shortest of several runs; CPU time of this process and of its children that ended."""

    wall_s = cpu_s = float("inf")

    @contextlib.contextmanager
    def timed(self) -> Iterator[None]:
        wall_s, cpu_s = time.monotonic(), _cpu_s()
        yield
        self.wall_s = min(self.wall_s, time.monotonic() - wall_s)
        self.cpu_s = min(self.cpu_s, _cpu_s() - cpu_s)


def _cpu_s() -> float:
    used = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(usage.ru_utime + usage.ru_stime for usage in used)


def _run_atlas(bench: Bench, sample: Sequence[Point], workers: int) -> None:
    with tempfile.TemporaryDirectory() as folder:
        options = RunOptions(Path(folder), workers=workers)
        run_map(bench, sample, options, tell=lambda _: None, progress=lambda _: None)


def _run_independent(bench: Bench, sample: Sequence[Point], workers: int) -> None:
    context = get_context("spawn")
    with worker_environment():
        processes = [
            context.Process(target=run_points, args=(bench, sample[k::workers]))
            for k in range(workers)
        ]
        for process in processes:
            process.start()
        for process in processes:
            process.join()
