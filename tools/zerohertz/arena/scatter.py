"""How far chance may carry the shares of the envelope's runs, and who beats whom beyond it.

A share has Wilson's interval. Two entrants are compared on the runs that both have, which draw the
same motors, loads and missions: the runs are resampled in pairs, and a difference counts when 95 %
of the resampled ones have its sign on either side. What is measured while torque is on is compared
on the runs that both held: who trips early would have the easy rest of the runs for himself.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from zerohertz.arena.runs import COLUMNS, SHARES

Floats = npt.NDArray[np.float64]
Z95 = 1.959964
RESAMPLED = 2000
SEED = 1
WHILE_HELD = ("oriented_above_1Hz", "torque_ripple_p95_pu")
LEAST_RUNS = 20  # that are compared: fewer say nothing
RIPPLE_SHARE = 0.95

Runs = Mapping[str, Sequence[float | None]]
Table = Mapping[str, Floats]


def wilson(count: float, of: int) -> tuple[float, float]:
    """95 % interval of the share behind `count` of `of` independent runs."""
    if of == 0:
        return 0.0, 1.0
    share, z2 = count / of, Z95 * Z95
    middle = (share + z2 / (2 * of)) / (1.0 + z2 / of)
    half = Z95 / (1.0 + z2 / of) * math.sqrt(share * (1.0 - share) / of + z2 / (4.0 * of * of))
    return max(0.0, middle - half), min(1.0, middle + half)


def interval(runs: Runs, name: str) -> tuple[float, float]:
    """95 % interval: Wilson's of a share of the runs, of other statistics by resampling them."""
    if name in SHARES:
        known = [each for each in runs[name] if each is not None]
        return wilson(sum(known), len(known))
    return _bounds(_resampled(_table(runs), name))


def same_runs(every: Sequence[Runs], name: str) -> list[Table]:
    """The runs that a statistic of several entrants is compared on; empty: too few."""
    tables = [_table(runs) for runs in every]
    shared = set.intersection(*(set(_usable(table, name).tolist()) for table in tables))
    if len(shared) < LEAST_RUNS:
        return []
    kept = list(shared)
    return [{key: c[np.isin(t["index"], kept)] for key, c in t.items()} for t in tables]


def _usable(table: Table, name: str) -> Floats:
    """Numbers of the runs that have the statistic."""
    index = table["index"]
    if name not in WHILE_HELD:
        return index
    known = table["torque_ripple_pu" if name == "torque_ripple_p95_pu" else "above_1Hz_s"]
    return index[(table["held"] > 0.0) & ~np.isnan(known)]


def statistic(table: Table, name: str) -> float:
    """Of the runs as they are."""
    return float(_drawn(table, name, np.arange(len(table["index"]))[None, :])[0])


def beyond_chance(better: Runs, other: Runs, name: str) -> bool:
    """Whether the statistics of two entrants differ by more than chance."""
    paired = same_runs((better, other), name)
    if not paired:
        return False
    low, high = _bounds(_resampled(paired[0], name) - _resampled(paired[1], name))
    return low > 0.0 or high < 0.0


def _table(runs: Runs) -> Table:
    return {name: np.array(runs[name], dtype=np.float64) for name in COLUMNS}


def _resampled(table: Table, name: str) -> Floats:
    """The statistic of so many draws of the runs, each as large as the sample."""
    count = len(table["index"])
    return _drawn(table, name, np.random.default_rng(SEED).integers(0, count, (RESAMPLED, count)))


def _drawn(table: Table, name: str, drawn: npt.NDArray[np.int64]) -> Floats:
    """The statistic of each row of run numbers."""
    if name == "oriented_above_1Hz":
        above_s = table["above_1Hz_s"][drawn].sum(axis=1)
        oriented_s = table["oriented_above_1Hz_s"][drawn].sum(axis=1)
        unknown = np.full(len(drawn), np.nan)
        return np.divide(oriented_s, above_s, out=unknown, where=above_s > 0.0)
    if name == "torque_ripple_p95_pu":
        ordered = np.sort(table["torque_ripple_pu"][drawn], axis=1)  # unknown ones last
        last = np.count_nonzero(~np.isnan(ordered), axis=1) - 1
        at = np.round(RIPPLE_SHARE * np.maximum(last, 0)).astype(np.int64)
        ripple: Floats = np.take_along_axis(ordered, at[:, None], axis=1)[:, 0]
        return ripple
    means: Floats = table[name][drawn].mean(axis=1)
    return means


def _bounds(statistic: Floats) -> tuple[float, float]:
    known = statistic[~np.isnan(statistic)]
    if len(known) == 0:
        return math.nan, math.nan
    low, high = np.quantile(known, (0.025, 0.975))
    return float(low), float(high)
