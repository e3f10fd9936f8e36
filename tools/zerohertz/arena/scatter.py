"""How far chance may carry the shares of the envelope's runs, and who beats whom beyond it.

A share has Wilson's interval. Two entrants are compared on the runs that both have, which draw the
same motors, loads and missions: the runs are resampled in pairs, and a difference counts when 95 %
of the resampled ones have its sign on either side.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Z95 = 1.959964
RESAMPLED = 2000
SEED = 1
# A run in numbers, as the answers keep it.
SHARES = ("held", "undeclared_harm", "false_trip")
COLUMNS = ("index", *SHARES, "above_1Hz_s", "oriented_above_1Hz_s", "torque_ripple_pu")
RIPPLE_SHARE = 0.95


def wilson(count: float, of: int) -> tuple[float, float]:
    """95 % interval of the share behind `count` of `of` independent runs."""
    if of == 0:
        return 0.0, 1.0
    share, z2 = count / of, Z95 * Z95
    middle = (share + z2 / (2 * of)) / (1.0 + z2 / of)
    half = Z95 / (1.0 + z2 / of) * math.sqrt(share * (1.0 - share) / of + z2 / (4.0 * of * of))
    return max(0.0, middle - half), min(1.0, middle + half)


def columns_of(rows: Sequence[Mapping[str, Any]]) -> dict[str, list[float | None]]:
    """What `beyond_chance` needs of the envelope's rows."""
    return {
        name: [None if row[name] is None else round(float(row[name]), 5) for row in rows]
        for name in COLUMNS
    }


def interval(runs: Mapping[str, Sequence[float | None]], name: str) -> tuple[float, float]:
    """95 % interval: Wilson's of a share of the runs, of other statistics by resampling them."""
    if name in SHARES:
        known = [each for each in runs[name] if each is not None]
        return wilson(sum(known), len(known))
    return _bounds(_resampled(_table(runs), name))


def beyond_chance(
    better: Mapping[str, Sequence[float | None]],
    other: Mapping[str, Sequence[float | None]],
    name: str,
) -> bool:
    """Whether the statistics of two entrants differ by more than chance."""
    tables = _table(better), _table(other)
    both = sorted(set(tables[0]["index"]) & set(tables[1]["index"]))
    if not both:
        return False
    paired = [
        {key: column[np.isin(table["index"], both)] for key, column in table.items()}
        for table in tables
    ]
    difference = _resampled(paired[0], name) - _resampled(paired[1], name)
    low, high = _bounds(difference)
    return low > 0.0 or high < 0.0


def _table(runs: Mapping[str, Sequence[float | None]]) -> dict[str, Floats]:
    return {name: np.array(runs[name], dtype=np.float64) for name in COLUMNS}


def _resampled(table: Mapping[str, Floats], name: str) -> Floats:
    """The statistic of so many draws of the runs, each as large as the sample."""
    count = len(table["index"])
    drawn = np.random.default_rng(SEED).integers(0, count, (RESAMPLED, count))
    if name == "oriented_above_1Hz":
        above_s = table["above_1Hz_s"][drawn].sum(axis=1)
        oriented_s = table["oriented_above_1Hz_s"][drawn].sum(axis=1)
        return np.divide(oriented_s, above_s, out=np.full(RESAMPLED, np.nan), where=above_s > 0.0)
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
