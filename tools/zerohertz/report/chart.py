"""Charts of the report: what is drawn, as JSON for chart.js, which zooms. No drawing library.

A signal becomes the least and the greatest value of every bucket of time, as 16-bit numbers: no
spike is lost, and the page stays small.
"""

from __future__ import annotations

import base64
import dataclasses
import json
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from zerohertz.check.loci import MARKED_ELEC_PER_MIN, Loci, degrees
from zerohertz.report import style
from zerohertz.report.figure_plot import (
    FREQUENCY_VIEW_HZ,
    RAMP_WINDOW_S,
    SPEED_VIEW_RPM,
    STEP_WINDOW_S,
    TORQUE_CURRENT_VIEW_A,
    end_of,
    is_ramp,
    view,
)
from zerohertz.scenario.signals import RATED_TORQUE_NM, Signals

BUCKETS = 2500
LEVELS = 32767
Numbers = Sequence[float] | NDArray[Any]


@dataclasses.dataclass(frozen=True)
class Line:
    """A signal over even x; with `points`, a curve through points, a mark every so many."""

    label: str
    color: str
    packed: dict[str, Any]
    dashed: bool = False
    mark_every: int = 0


@dataclasses.dataclass(frozen=True)
class Panel:
    """Lines above one another."""

    title: str
    view: tuple[float, float]
    lines: tuple[Line, ...]
    note: str = ""
    limits: tuple[float, ...] = ()  # dashed, across
    height: float = 2.0


@dataclasses.dataclass(frozen=True)
class Chart:
    """Panels with a common x axis."""

    panels: tuple[Panel, ...]
    x_view: tuple[float, float]
    x_title: str
    source: str = ""
    marks: tuple[tuple[float, str], ...] = ()  # upright lines

    def json(self) -> str:
        return json.dumps(dataclasses.asdict(self), separators=(",", ":"))


def signal(values: Numbers, x_view: tuple[float, float]) -> dict[str, Any]:
    """Least and greatest of every bucket between the ends of the view."""
    kept = np.nan_to_num(np.asarray(values, dtype=float))
    count = min(BUCKETS, len(kept))
    edges = np.linspace(0, len(kept), count + 1).astype(int)[:-1]
    pairs = np.stack([np.minimum.reduceat(kept, edges), np.maximum.reduceat(kept, edges)], axis=1)
    return {"from": x_view[0], "to": x_view[1], "y": _packed(pairs)}


def points(x: Numbers, y: Numbers) -> dict[str, Any]:
    return {"x": _packed(np.asarray(x, dtype=float)), "y": _packed(np.asarray(y, dtype=float))}


def _packed(values: NDArray[Any]) -> dict[str, Any]:
    low, high = float(values.min()), float(values.max())
    step = (high - low) / (2 * LEVELS) or 1.0
    levels = np.round((values - low) / step - LEVELS).astype("<i2")
    text = base64.b64encode(levels.tobytes()).decode()
    return {"low": low + LEVELS * step, "step": step, "data": text}


def experiment(signals: Signals, source: str) -> Chart:
    """Laid out like the paper's figures: speed, torque current, stator frequency; R: the load."""
    ramp = is_ramp(signals)
    wanted = RAMP_WINDOW_S if ramp else STEP_WINDOW_S
    part = signals.window(*wanted)
    t_s = signals.t_s[part] - signals.event_s
    span = (float(t_s[0]), float(t_s[-1]))

    def line(label: str, color: str, name: str, dashed: bool = False) -> Line:
        return Line(label, color, signal(getattr(signals, name)[part], span), dashed)

    def panel(title: str, largest: float, least: float, *lines: tuple[Any, ...]) -> Panel:
        shown = [getattr(signals, entry[2])[part] for entry in lines]
        low, high, note = view(shown, largest, least)
        return Panel(title, (low, high), tuple(line(*entry) for entry in lines), note)

    speed = panel(
        "speed [min⁻¹]", SPEED_VIEW_RPM, 200.0,
        ("ω̂ estimate", style.ESTIMATE, "speed_hat_rpm"),
        ("ω true", style.TRUE, "speed_rpm"),
        ("ω* command", style.REFERENCE, "speed_ref_rpm", True),
    )  # fmt: skip
    current = panel(
        "torque current [A]", TORQUE_CURRENT_VIEW_A, 8.0,
        ("i_q", style.TRUE, "i_q_A"),
        ("i_q* command", style.REFERENCE, "i_q_ref_A", True),
    )  # fmt: skip
    frequency = panel(
        "stator frequency [Hz]", FREQUENCY_VIEW_HZ, 4.0, ("", style.FREQUENCY, "f_s_Hz")
    )
    limits = (-signals.i_q_limit_A, signals.i_q_limit_A)
    panels = [
        dataclasses.replace(speed, height=3.0),
        dataclasses.replace(current, limits=limits, height=2.4),
        frequency,
    ]
    if ramp:
        load = signal(100.0 * signals.load_Nm[part] / RATED_TORQUE_NM, span)
        panels.append(
            Panel("load torque [% of rated]", (-115.0, 10.0), (Line("", style.LOAD, load),))
        )
    end = end_of(signals, ramp)
    since = "start of the load ramp" if ramp else "speed step"
    return Chart(
        tuple(panels), wanted, f"time from the {since} [s]", source,
        ((0.0, ""), *((end,) if end else ())),
    )  # fmt: skip


def root_loci(table: Loci) -> Chart:
    """Fig. 4 of the paper: upper half plane."""
    every = round(MARKED_ELEC_PER_MIN / float(table.speeds_elec_per_min[1]))
    lines = tuple(
        Line(
            label if column == 0 else "", color,
            points(poles[:, column].real, np.abs(poles[:, column].imag)), mark_every=every,
        )
        for label, color, poles in (
            ("motor", style.TRUE, table.motor_poles),
            ("observer", style.ESTIMATE, table.observer_poles),
        )
        for column in range(2)
    )  # fmt: skip
    every_pole = np.concatenate([table.motor_poles.ravel(), table.observer_poles.ravel()])
    top = 1.05 * float(np.abs(every_pole.imag).max())
    low, high = float(every_pole.real.min()), float(every_pole.real.max())
    room = 0.04 * (high - low)
    title = f"imaginary part [rad/s]; a mark every {MARKED_ELEC_PER_MIN} elec. min⁻¹"
    return Chart((Panel(title, (0.0, top), lines),), (low - room, high + room), "real part [1/s]")


def orientation(table: Loci) -> Chart:
    """The proven bound of the field orientation's error over speed, and what no gain can beat."""
    end = float(table.speeds_elec_per_min[-1])
    lines = (
        Line("proven for the table", style.ESTIMATE, signal(degrees(table.gamma), (0.0, end))),
        Line("floor for any gain", style.MUTED, signal(degrees(table.floor), (0.0, end)), True),
    )
    top = 1.1 * float(degrees(table.gamma).max())
    title = f"2 atan γ [degrees], for speed errors up to {table.dw0_rad_s:g} rad/s"
    return Chart((Panel(title, (0.0, top), lines),), (0.0, end), "electrical speed [min⁻¹]")
