"""The same function over many points: in this process, in processes, or on Dask workers."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from functools import partial
from multiprocessing import get_context
from typing import Any

from zerohertz.atlas.simulate import Bench, begin_s, run_points
from zerohertz.build import ensure_built
from zerohertz.errors import UserError
from zerohertz.estimators.chosen import is_foreign

Rows = list[dict[str, Any]]
Share = Callable[[Sequence[Any]], Rows]

# Simulated seconds a worker is given at once: a tenth of a second of its time, so that handing over
# costs nothing and the last worker does not keep the others waiting.
CHUNK_SIM_S = 120.0
# One thread each: the workers are the parallelism.
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def run_all(
    bench: Bench,
    points: Sequence[Any],
    workers: int,
    scheduler: str | None,
    run: Callable[[Bench, Sequence[Any]], Rows] = run_points,
) -> Iterator[Rows]:
    """Rows as they become ready, in any order."""
    share = partial(run, bench)
    chunks = list(_chunks(bench, points))
    if scheduler is not None:
        return _by_dask(share, chunks, scheduler)
    # An estimator of somebody else may crash: then it does so in a process of its own.
    if not is_foreign() and (workers <= 1 or len(chunks) <= 1):
        return map(share, chunks)
    return _by_processes(share, chunks, workers)


def _chunks(bench: Bench, points: Sequence[Any]) -> Iterator[list[Any]]:
    chunk: list[Any] = []
    sim_s = 0.0
    for point in points:
        chunk.append(point)
        sim_s += getattr(point, "sim_s", None) or begin_s(bench, point) + point.loaded_s
        if sim_s >= CHUNK_SIM_S:
            yield chunk
            chunk, sim_s = [], 0.0
    if chunk:
        yield chunk


def _by_processes(share: Share, chunks: list[list[Any]], workers: int) -> Iterator[Rows]:
    # spawn: the library's threads and handles must not be inherited half open.
    with (
        worker_environment(),
        ProcessPoolExecutor(min(workers, len(chunks)), mp_context=get_context("spawn")) as pool,
    ):
        try:
            yield from _as_ready(pool, share, iter(chunks), 3 * workers)
        except BrokenProcessPool:
            raise UserError(
                "a worker died (memory? a crash of the library?); finished rows are stored: run "
                "the same command again, with --workers 1 to see the crash itself"
            ) from None
        except GeneratorExit:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _as_ready(
    pool: ProcessPoolExecutor, share: Share, chunks: Iterable[list[Any]], ahead: int
) -> Iterator[Rows]:
    """Few chunks ahead of the workers: 100 000 points need no 100 000 futures."""
    waiting = set()
    for chunk in chunks:
        waiting.add(pool.submit(share, chunk))
        if len(waiting) >= ahead:
            done, waiting = wait(waiting, return_when=FIRST_COMPLETED)
            for future in done:
                yield future.result()
    for future in waiting:
        yield future.result()


def _by_dask(share: Share, chunks: list[list[Any]], scheduler: str) -> Iterator[Rows]:
    from distributed import Client, KilledWorker, as_completed

    try:
        client = Client(scheduler, timeout="10s")
    except (OSError, TimeoutError, ValueError) as error:
        raise UserError(
            f"--scheduler: {scheduler}: no Dask scheduler answers ({error}); start one with "
            "`tools/zh python -m distributed.cli.dask_scheduler` and name its tcp:// address"
        ) from None
    with client:
        if not client.scheduler_info()["workers"]:
            raise UserError(
                f"--scheduler: {scheduler}: has no workers; start one per machine with "
                f"`tools/zh python -m distributed.cli.dask_worker {scheduler}`"
            )
        # A run is a function of its arguments, but a repeated throughput run must not be cached.
        futures = client.map(share, chunks, pure=False)
        try:
            for future in as_completed(futures):
                yield future.result()
                future.release()
        except KilledWorker as error:
            raise UserError(
                f"--scheduler: {error}; finished rows are stored: run the same command again"
            ) from None


@contextlib.contextmanager
def worker_environment() -> Iterator[None]:
    """What children inherit: one thread per numerical library, and the firmware already built."""
    wanted = dict.fromkeys(_THREADS, "1")
    wanted["ZEROHERTZ_SIL"] = os.fspath(ensure_built().sil_library)
    before = {name: os.environ.get(name) for name in wanted}
    os.environ.update(wanted)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value
