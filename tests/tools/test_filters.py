"""What replaced scipy in `zh demo` and the studio, against scipy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator
from scipy.ndimage import minimum_filter1d
from scipy.signal import butter, sosfilt, sosfilt_zi

from zerohertz.commission.curve import monotone_cubic
from zerohertz.scenario.filters import high_pass, sliding_minimum


@pytest.mark.parametrize("step_s", [1e-3, 5e-3])
def test_the_high_pass_is_scipys(step_s: float) -> None:
    rng = np.random.default_rng(1)
    values = 300.0 * np.exp(-3.0 * step_s * np.arange(30_001)) + rng.standard_normal(30_001)
    sos = butter(2, 0.5, "highpass", fs=1.0 / step_s, output="sos")
    wanted, _ = sosfilt(sos, values, zi=sosfilt_zi(sos) * values[0])
    assert high_pass(values, 0.5, step_s) == pytest.approx(wanted, abs=1e-8)


@pytest.mark.parametrize("width", [1, 2, 3, 7, 64, 500, 999, 1000])
def test_the_sliding_minimum_is_scipys(width: int) -> None:
    values = np.random.default_rng(2).standard_normal(1000)
    lowest = minimum_filter1d(values, width, mode="nearest")
    half = width // 2
    wanted = lowest[half : len(values) - (width - 1 - half)]
    assert np.array_equal(sliding_minimum(values, width), wanted)


def test_the_monotone_cubic_is_scipys_inside_and_beyond_the_points() -> None:
    rng = np.random.default_rng(3)
    for _ in range(500):
        count = int(rng.integers(2, 9))
        x = np.sort(rng.random(count))
        y = (
            np.cumsum(rng.standard_normal(count))
            if rng.random() < 0.5
            else np.sort(rng.random(count))
        )
        at = float(rng.uniform(-0.1, 1.1))
        wanted = float(PchipInterpolator(x, y, extrapolate=True)(at))
        assert monotone_cubic(x, y, at) == pytest.approx(wanted, rel=1e-10, abs=1e-10)
