"""The passage through zero stator frequency as an animated GIF.

On the left what the drive does over time, on the right the true operating point in the speed-torque
plane with the wedge of low stator frequency, which turns with the flux.
"""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from zerohertz.atlas import bench_run, special
from zerohertz.atlas.bench_run import POLE_PAIRS, RR_OHM
from zerohertz.report import gif, style
from zerohertz.scenario.setup import Setup
from zerohertz.sim import Record

TIMES_REAL_TIME = 5.0
FRAME_S = 0.09  # of the picture
HOLD_S = 1.5  # the last frame, before it begins again
SIZE_IN, DPI = (9.2, 4.6), 96
TRAIL_S = 5.0
FLUX_STEP_WB = 0.01  # the wedge turns in steps: a frame costs what moved
MOST_RPM, MOST_NM = 175.0, 12.0
WEDGE_HZ = ((2.0, "#F6E3B4"), (0.6, "#EDC25E"))
Row = NDArray[np.float32]
PANELS: tuple[tuple[str, tuple[tuple[str, str, str], ...], tuple[float, float]], ...] = (
    (
        "speed\nmin⁻¹",
        (("true", "speed_rpm", style.TRUE), ("estimated", "speed_hat_rpm", style.ESTIMATE)),
        (-180.0, 180.0),
    ),
    ("stator\nfrequency, Hz", (("", "f_s_Hz", style.FREQUENCY),), (-5.0, 8.0)),
    ("flux angle\nerror, deg", (("", "flux_angle_err_deg", style.LOAD),), (-10.0, 10.0)),
)


@dataclasses.dataclass(frozen=True)
class Made:
    """What was written."""

    frames: int
    bytes: int
    worst_rpm: float  # of the estimate
    worst_deg: float


def write_gif(setup: Setup, path: Path, load_pu: float, rs_ratio: float) -> Made:
    """Run the crossing of `zh special slow_crossing` and draw it."""
    what = special.crossing(load_pu, rs_ratio)
    record = bench_run.run(setup, what)
    keep = bench_run.window(record, special.SETTLE_S - 2.0, what.duration_s - 2.0)
    columns = {name: column[keep] for name, column in record.columns.items()}
    frames = _frames(columns, f"load {100 * load_pu:.0f} % of rated, true Rs × {rs_ratio:g}")
    gif.save(path, frames, FRAME_S, HOLD_S)
    return Made(len(frames), path.stat().st_size, *_worst(record, keep))


def _worst(record: Record, keep: NDArray[np.bool_]) -> tuple[float, float]:
    off = np.abs(record["speed_hat_rpm"] - record["speed_rpm"])[keep]
    return float(off.max()), float(np.abs(record["flux_angle_err_deg"][keep]).max())


def _frames(columns: dict[str, Row], text: str) -> list[Any]:
    t_s = columns["t_s"]
    rows = np.searchsorted(t_s, np.arange(t_s[0], t_s[-1], FRAME_S * TIMES_REAL_TIME))
    with style.figure(*SIZE_IN) as drawn:
        drawn.set_dpi(DPI)
        drawn.suptitle(
            f"Through zero stator frequency without a speed sensor: {text}",
            x=0.01, ha="left", fontsize=10,
        )  # fmt: skip
        grid = drawn.add_gridspec(len(PANELS), 2, width_ratios=(1.15, 1.0))
        moving = [
            *(_Panel(drawn, grid[k, 0], columns, k) for k in range(len(PANELS))),
            _Plane(drawn, grid[:, 1], columns),
        ]
        drawn.canvas.draw()
        drawn.set_layout_engine("none")
        still = drawn.canvas.copy_from_bbox(drawn.bbox)
        pictures = []
        for row in rows:
            drawn.canvas.restore_region(still)
            for part in moving:
                part.draw(int(row))
            pictures.append(gif.frame(drawn))
    return pictures


class _Panel:
    """Lines that grow with time."""

    def __init__(self, drawn: Any, place: Any, columns: dict[str, Row], k: int) -> None:
        label, lines, limits = PANELS[k]
        self.axes, self.columns = drawn.add_subplot(place), columns
        t_s = columns["t_s"]
        self.axes.set(xlim=(t_s[0], t_s[-1]), ylim=limits, ylabel=label)
        self.axes.axhline(0.0, color=style.MUTED, linewidth=0.8)
        self.lines = []
        for name, column, color in lines:
            width = 2.6 if name == "true" else 1.1  # the estimate runs on top of it
            (line,) = self.axes.plot(
                [], [], color=color, linewidth=width, label=name or None, animated=True
            )
            self.lines.append((line, column))
        if len(lines) > 1:
            self.axes.legend(loc="upper right", ncols=len(lines))
        if k == len(PANELS) - 1:
            self.axes.set_xlabel("s")
        else:
            self.axes.tick_params(labelbottom=False)

    def draw(self, row: int) -> None:
        for line, column in self.lines:
            line.set_data(self.columns["t_s"][: row + 1], self.columns[column][: row + 1])
            self.axes.draw_artist(line)


class _Plane:
    """Speed and torque, the wedge about zero stator frequency, the true point and the estimate."""

    def __init__(self, drawn: Any, place: Any, columns: dict[str, Row]) -> None:
        self.axes, self.columns = drawn.add_subplot(place), columns
        self.axes.set(xlim=(-MOST_RPM, MOST_RPM), ylim=(-MOST_NM, MOST_NM))
        self.axes.set(xlabel="speed, min⁻¹", ylabel="torque of the motor, N m")
        self.axes.axhline(0.0, color=style.MUTED, linewidth=0.8)
        self.axes.axvline(0.0, color=style.MUTED, linewidth=0.8)
        self.wedges = [
            (self.axes.fill([], [], color=color, lw=0, aa=False, animated=True)[0], f_Hz)
            for f_Hz, color in WEDGE_HZ
        ]
        (self.zero,) = self.axes.plot([], [], color="#8A6100", linewidth=1.4, animated=True)
        (self.trail,) = self.axes.plot([], [], color=style.TRUE, animated=True)
        kind: dict[str, Any] = {"linestyle": "", "animated": True}
        (self.hat,) = self.axes.plot(
            [], [], "o", color=style.ESTIMATE, ms=11, mew=1.8, fillstyle="none",
            label="estimated", **kind,
        )  # fmt: skip
        (self.point,) = self.axes.plot([], [], "o", color=style.TRUE, ms=7, label="true", **kind)
        self.legend = self.axes.legend(
            handles=[self.point, self.hat, self.wedges[1][0]],
            labels=["true", "estimated", "stator frequency below .6 Hz"],
            loc="lower left", frameon=True, framealpha=1.0, edgecolor=style.GRID,
        )  # fmt: skip
        self.legend.set_animated(True)  # on top of the wedge

    def draw(self, row: int) -> None:
        at = {name: float(column[row]) for name, column in self.columns.items()}
        T_Nm = np.array((-MOST_NM, MOST_NM))
        flux_Wb = FLUX_STEP_WB * round(at["lambda_Wb"] / FLUX_STEP_WB)
        for wedge, f_Hz in self.wedges:
            low, high = (_speed_rpm(T_Nm, f, flux_Wb) for f in (-f_Hz, f_Hz))
            corners = (*zip(low, T_Nm, strict=True), *zip(high[::-1], T_Nm[::-1], strict=True))
            wedge.set_xy(np.array(corners))
        self.zero.set_data(_speed_rpm(T_Nm, 0.0, flux_Wb), T_Nm)
        first = int(np.searchsorted(self.columns["t_s"], at["t_s"] - TRAIL_S))
        trail = slice(first, row + 1)
        self.trail.set_data(self.columns["speed_rpm"][trail], self.columns["torque_Nm"][trail])
        self.point.set_data([at["speed_rpm"]], [at["torque_Nm"]])
        self.hat.set_data([at["speed_hat_rpm"]], [at["torque_Nm"]])
        wedges = (wedge for wedge, _ in self.wedges)
        for artist in (*wedges, self.zero, self.trail, self.point, self.hat, self.legend):
            self.axes.draw_artist(artist)


def _speed_rpm(torque_Nm: NDArray[Any], f_s_Hz: float, flux_Wb: float) -> NDArray[Any]:
    """Where the slip Rr T / (p lambda^2) leaves this stator frequency."""
    slip_rad_s = RR_OHM * torque_Nm / (POLE_PAIRS * flux_Wb**2)
    return (2.0 * math.pi * f_s_Hz - slip_rad_s) / POLE_PAIRS * 30.0 / math.pi
