"""A smooth curve through points that neither overshoots nor turns back between them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def monotone_cubic(x: Sequence[float], y: Sequence[float], at: float) -> float:
    """Value at `at` of the cubic through (x, y) after Fritsch and Butland (1984), x ascending.

    Beyond the ends the outer cubic goes on. At least two points.
    """
    xs, ys = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    width = np.diff(xs)
    secant = np.diff(ys) / width
    if len(xs) == 2:
        return float(ys[0] + secant[0] * (at - xs[0]))
    slope = _slopes(width, secant)
    k = int(np.clip(np.searchsorted(xs, at, side="right") - 1, 0, len(width) - 1))
    t, h = (at - xs[k]) / width[k], width[k]
    left = (1.0 + 2.0 * t) * (1.0 - t) ** 2 * ys[k] + t * (1.0 - t) ** 2 * h * slope[k]
    right = t**2 * (3.0 - 2.0 * t) * ys[k + 1] + t**2 * (t - 1.0) * h * slope[k + 1]
    return float(left + right)


def _slopes(width: Array, secant: Array) -> Array:
    """Weighted harmonic mean of the secants beside a point; zero at a turning point."""
    slope = np.zeros(len(width) + 1)
    for k in range(1, len(width)):
        if secant[k - 1] * secant[k] > 0.0:
            first, second = 2.0 * width[k] + width[k - 1], width[k] + 2.0 * width[k - 1]
            slope[k] = (first + second) / (first / secant[k - 1] + second / secant[k])
    slope[0] = _end(width[0], width[1], secant[0], secant[1])
    slope[-1] = _end(width[-1], width[-2], secant[-1], secant[-2])
    return slope


def _end(h0: float, h1: float, secant0: float, secant1: float) -> float:
    """One-sided three-point slope, limited so that the shape is kept."""
    slope = ((2.0 * h0 + h1) * secant0 - h0 * secant1) / (h0 + h1)
    if np.sign(slope) != np.sign(secant0):
        return 0.0
    if np.sign(secant0) != np.sign(secant1) and abs(slope) > 3.0 * abs(secant0):
        return 3.0 * secant0
    return slope
