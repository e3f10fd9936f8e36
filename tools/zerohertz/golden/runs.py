"""The runs behind the golden hashes, each by its name.

figures.fig07.paper      a figure in one configuration, seed 1
modes.weakening.3        a case of `zh modes`, numbered from 1 in the order of its table
monitor.sensor.168       a case of `zh campaign monitor`, by its number in the group
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

from zerohertz import sim
from zerohertz.atlas.simulate import make_bench
from zerohertz.campaign import monitor_cases, monitor_run
from zerohertz.errors import UserError
from zerohertz.golden.store import digest
from zerohertz.modes.cases import GROUPS
from zerohertz.scenario import evaluate
from zerohertz.scenario.predicates import FIGURES
from zerohertz.scenario.setup import load_setup

CONFIGS = ("paper", "recommended")
SEED = 1
MONITOR_CASES = 4  # of each group, evenly spaced
QUICK_STEP = 5  # `zh golden --quick` takes every fifth run


@functools.cache
def every_run() -> Mapping[str, Callable[[], object]]:
    """What to call for each run, in the order in which they are hashed."""
    return {**_figures(), **_modes(), **_monitor()}


def select(only: str, quick: bool) -> list[str]:
    """Names of the runs: those with one of the given parts in their name; all for an empty text."""
    names = list(every_run())
    for part in filter(None, only.split(",")):
        if not any(_has(name, part) for name in names):
            raise UserError(f"golden: --only: {part}: no such run; known are {known_parts()}")
    if only:
        names = [name for name in names if any(_has(name, p) for p in only.split(","))]
    return names[::QUICK_STEP] if quick else names


def known_parts() -> str:
    """What --only takes, run numbers aside."""
    parts = dict.fromkeys(part for name in every_run() for part in name.split("."))
    return ", ".join(part for part in parts if not part.isdigit())


def hashes_of(name: str) -> sim.Hashes:
    """One hash per traced signal; a case of more than one simulation hashes their hashes."""
    call = every_run()[name]
    with sim.signal_hashes() as hashes:
        call()
    if len(hashes) == 1:
        return hashes[0]
    return {signal: int(digest(h[signal] for h in hashes), 16) for signal in hashes[0]}


def run_all(
    names: Sequence[str], workers: int, progress: Callable[[int], None]
) -> dict[str, sim.Hashes]:
    """The hashes of every run, in the order of the names."""
    sim.signal_names()  # builds the library once, before there are processes
    found: dict[str, sim.Hashes] = {}
    if workers == 1 or len(names) == 1:
        results = map(hashes_of, names)
        for name, hashes in zip(names, results, strict=True):
            found[name] = hashes
            progress(len(found))
        return found
    # spawn: the library's threads and handles must not be inherited half open.
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        for name, hashes in zip(names, pool.map(hashes_of, names, chunksize=2), strict=True):
            found[name] = hashes
            progress(len(found))
    return found


def _has(name: str, part: str) -> bool:
    return f".{part.strip()}." in f".{name}."


def _figures() -> dict[str, Callable[[], object]]:
    return {
        f"figures.fig{figure:02d}.{config}": functools.partial(
            sim.run, evaluate.job(evaluate.Run(load_setup(config), figure, SEED))
        )
        for config in CONFIGS
        for figure in FIGURES
    }


def _modes() -> dict[str, Callable[[], object]]:
    return {
        f"modes.{group}.{number}": case
        for group, cases in GROUPS.items()
        for number, case in enumerate(cases, 1)
    }


def _monitor() -> dict[str, Callable[[], object]]:
    bench = make_bench(load_setup("recommended"))
    groups = monitor_cases.groups()
    return {
        f"monitor.{group}.{case.index}": functools.partial(monitor_run.run_case, bench, case)
        for group, cases in groups.items()
        for case in cases[:: len(cases) // MONITOR_CASES]
    }
