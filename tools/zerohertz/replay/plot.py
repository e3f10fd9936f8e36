"""Estimated and measured speed over time, and their difference."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from zerohertz.errors import UserError
from zerohertz.replay.log import FloatArray
from zerohertz.replay.statistics import SpeedError
from zerohertz.report import style

SUFFIXES = (".png", ".svg")
WIDTH_PX = 1200


def write_plot(
    file: Path,
    title: str,
    t_s: FloatArray,
    estimate_rad_s: FloatArray,
    measured_rad_s: FloatArray,
    error: SpeedError,
) -> None:
    """PNG or SVG, by the name of the file."""
    check_plot_name(file)
    with style.figure(6.6, 3.9) as drawn:
        upper, lower = drawn.subplots(2, 1, sharex=True, gridspec_kw={"height_ratios": [1.4, 1.0]})
        drawn.suptitle(title, x=0.01, ha="left", fontsize=9.5, fontweight="bold")
        upper.plot(t_s, measured_rad_s, color=style.TRUE, linewidth=1.3, label="measured")
        upper.plot(t_s, estimate_rad_s, color=style.ESTIMATE, label="estimated")
        style.panel_title(upper, "electrical rotor speed [rad/s]")
        style.legend_above(upper)
        _view(upper, measured_rad_s, estimate_rad_s)
        difference = estimate_rad_s - measured_rad_s
        lower.axhline(0.0, color=style.MUTED, linewidth=0.8)
        lower.plot(t_s, difference, color=style.ESTIMATE)
        lower.axvspan(error.from_s, error.until_s, color=style.GRID, alpha=0.5, linewidth=0)
        counted = (t_s >= error.from_s) & (t_s <= error.until_s)
        largest = max(1.25 * float(np.max(np.abs(difference[counted]))), 1.0)
        lower.set_ylim(-largest, largest)
        style.panel_title(lower, "estimate minus measurement [rad/s]; shaded: in the statistics")
        lower.set_xlabel("time in the log [s]")
        lower.set_xlim(0.0, float(t_s[-1]))
        data = style.svg(drawn) if file.suffix == ".svg" else style.png(drawn, WIDTH_PX)
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(data)
    except OSError as problem:
        raise UserError(f"{file}: cannot be written: {problem.strerror}") from None


def check_plot_name(file: Path) -> None:
    """UserError unless the suffix says what to write."""
    if file.suffix not in SUFFIXES:
        raise UserError(f"--plot: '{file}' must end in .png or .svg")


def _view(axes, measured: FloatArray, estimate: FloatArray) -> None:
    """All of the measurement, and of the estimate what is not wildly elsewhere."""
    low, high = float(np.min(measured)), float(np.max(measured))
    reach = max(high - low, 0.5 * max(abs(low), abs(high)), 10.0)
    axes.set_ylim(
        max(min(low, float(np.min(estimate))) - 0.05 * reach, low - reach),
        min(max(high, float(np.max(estimate))) + 0.05 * reach, high + reach),
    )
