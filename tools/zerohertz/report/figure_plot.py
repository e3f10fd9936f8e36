"""One plot per experiment, laid out like the paper's: speed, torque current, stator frequency."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

from zerohertz.report import style
from zerohertz.scenario.signals import RATED_TORQUE_NM, Array, Signals, lost_at_s

BUCKETS = 700  # columns of the plot in which the extremes of a signal are kept
STEP_WINDOW_S = (-4.0, 30.0)  # protocol S, from the speed step
RAMP_WINDOW_S = (-4.0, 80.0)  # protocol R, from the start of the load ramp
WILD_PU = 0.2  # of the panel, mean jump from one extreme to the next
SPEED_VIEW_RPM = 600.0  # a drive that runs away is cut here, and said so
TORQUE_CURRENT_VIEW_A = 20.0
FREQUENCY_VIEW_HZ = 20.0
HOLD_S = (8.0, 30.0)  # protocol S: where the ripple is measured; shown once more, enlarged
HOLD_BELOW = 0.42  # of the panel: what is above is free for the enlargement
HOLD_SCALES_RPM = (5.0, 10.0, 20.0, 50.0)
LOST_RPM = 100.0  # protocol R
LOST_AT_LIMIT_S = 0.3


def draw(signals: Signals, source: str, width_in: float = 6.6, title: str = "") -> Any:
    """Context manager with the drawn figure; is_ramp adds the panel of the load.

    source: what was run, in the lower right corner, for who sees the picture alone.
    """
    return _Drawn(signals, source, width_in, title)


def extremes(t_s: Array, values: Array, buckets: int = BUCKETS) -> tuple[Array, Array]:
    """A signal thinned for drawing: first, least, greatest and last of every bucket survive."""
    if len(t_s) <= 4 * buckets:
        return t_s, values
    edges = np.linspace(0, len(t_s), buckets + 1).astype(int)
    kept: list[int] = []
    for first, end in itertools.pairwise(edges):
        part = values[first:end]
        low, high = first + int(np.argmin(part)), first + int(np.argmax(part))
        kept += sorted({first, low, high, end - 1})
    index = np.array(kept)
    return t_s[index], values[index]


class _Drawn:
    def __init__(self, signals: Signals, source: str, width_in: float, title: str) -> None:
        self.signals = signals
        self.source = source
        self.ramp = is_ramp(signals)
        ratios = [3.0, 2.4, 1.8, 1.1] if self.ramp else [3.0, 2.4, 1.8]
        self.ratios = ratios
        self.height_in = (4.9 if self.ramp else 4.3) * width_in / 6.6
        self.canvas = style.figure(width_in, self.height_in)
        self.title = title

    def __enter__(self) -> Any:
        drawn = self.canvas.__enter__()
        panels = drawn.subplots(
            len(self.ratios), 1, sharex=True, gridspec_kw={"height_ratios": self.ratios}
        )
        if self.title:
            drawn.suptitle(self.title, x=0.01, ha="left", fontsize=10.5, fontweight="bold")
        window = RAMP_WINDOW_S if self.ramp else STEP_WINDOW_S
        part = self.signals.window(*window)
        t_s = self.signals.t_s[part] - self.signals.event_s
        _speed(panels[0], t_s, self.signals, part)
        _torque_current(panels[1], t_s, self.signals, part)
        _frequency(panels[2], t_s, self.signals, part)
        if self.ramp:
            _load(panels[3], t_s, self.signals, part)
        for axes in panels:
            axes.set_xlim(*window)
            axes.margins(x=0.0)
            axes.axvline(0.0, color=style.MUTED, linewidth=0.8, linestyle=(0, (1, 1.5)), zorder=1)
        if not self.ramp:
            _hold_enlarged(panels[0], self.signals)
        _mark_end(panels[0], self.signals, self.ramp)
        since = "start of the load ramp" if self.ramp else "speed step t₀"
        panels[-1].set_xlabel(f"time from the {since} [s]", loc="left")
        corner = {"ha": "right", "va": "bottom", "fontsize": 7.0, "color": style.MUTED}
        drawn.text(0.995, 0.007, self.source, **corner)
        return drawn

    def __exit__(self, *error: Any) -> None:
        self.canvas.__exit__(*error)


def is_ramp(signals: Signals) -> bool:
    """Protocol R: the load moves after the event."""
    after = signals.load_Nm[signals.t_s >= signals.event_s]
    return bool(len(after)) and float(np.ptp(after)) > 0.1 * RATED_TORQUE_NM


def _line(axes: Any, t_s: Array, values: Array, **look: Any) -> None:
    """A signal within the limits already set; where it jumps all over the panel it is drawn
    faintly, or it would hide everything else."""
    t_s, values = extremes(t_s, values)
    low, high = axes.get_ylim()
    jumps = np.abs(np.diff(np.clip(values, low, high), append=values[-1:].clip(low, high)))
    wild = np.convolve(jumps, np.full(21, 1.0 / 21.0), "same") > WILD_PU * (high - low)
    axes.plot(t_s, np.where(wild, np.nan, values), solid_joinstyle="round", **look)
    if np.any(wild):
        faint = {**look, "alpha": 0.3, "linewidth": 0.4, "zorder": 2, "label": None}
        axes.plot(t_s, np.where(wild, values, np.nan), **faint)


def view(signals: list[Array], largest: float, least_span: float) -> tuple[float, float, str]:
    """Limits that hold the signals, no narrower than least_span, cut at +-largest; what is cut."""
    low = min(float(np.min(s)) for s in signals)
    high = max(float(np.max(s)) for s in signals)
    middle = 0.5 * (low + high)
    half = max(0.5 * (high - low) * 1.08, 0.5 * least_span)
    low_view, high_view = max(middle - half, -largest), min(middle + half, largest)
    cut = low < low_view - 0.02 * largest or high > high_view + 0.02 * largest
    beyond = " and ".join(_beyond(low, high, low_view, high_view))
    return low_view, high_view, f"off scale: {beyond}" if cut else ""


def _view(axes: Any, signals: list[Array], largest: float, least_span: float) -> None:
    low_view, high_view, note = view(signals, largest, least_span)
    axes.set_ylim(low_view, high_view)
    if note:
        axes.annotate(
            note,
            (0.995, 0.04),
            xycoords="axes fraction",
            ha="right",
            va="bottom",
            fontsize=7.0,
            color=style.MUTED,
            bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.85, "pad": 1.0},
            zorder=9,
        )


def _beyond(low: float, high: float, low_view: float, high_view: float) -> list[str]:
    return [
        (f"{value:.0f}" if abs(value) < 3000.0 else f"beyond {np.sign(value) * 3000:.0f}").replace(
            "-", "−"
        )
        for value, beyond in ((low, low < low_view), (high, high > high_view))
        if beyond
    ]


def _speed(axes: Any, t_s: Array, s: Signals, part: slice) -> None:
    shown = [s.speed_ref_rpm[part], s.speed_rpm[part], s.speed_hat_rpm[part]]
    _view(axes, shown, SPEED_VIEW_RPM, 200.0)
    _line(axes, t_s, shown[2], color=style.ESTIMATE, label="$\\hat\\omega$ estimate", zorder=3)
    _line(axes, t_s, shown[1], color=style.TRUE, label="$\\omega$ true", linewidth=1.3, zorder=4)
    _line(
        axes,
        t_s,
        shown[0],
        color=style.REFERENCE,
        label="$\\omega^*$ command",
        linestyle=(0, (4, 2)),
        zorder=5,
    )
    style.panel_title(axes, "speed [min⁻¹]")
    style.legend_above(axes)


def _hold_enlarged(axes: Any, s: Signals) -> None:
    """The speed of the hold on a scale that shows its ripple, in the empty corner of a panel.

    Nothing where the drive does not hold: then the panel itself shows it, and there is no corner.
    """
    part = s.window(*HOLD_S)
    ref, speed, hat = s.speed_ref_rpm[part], s.speed_rpm[part], s.speed_hat_rpm[part]
    largest = max(float(np.max(np.abs(x - ref), initial=0.0)) for x in (speed, hat))
    scale_rpm = next((scale for scale in HOLD_SCALES_RPM if largest < scale), None)
    bottom, top = axes.get_ylim()
    if (
        scale_rpm is None
        or not len(ref)
        or ref[-1] + largest > bottom + HOLD_BELOW * (top - bottom)
    ):
        return
    t_s = s.t_s[part] - s.event_s
    low_s, high_s = axes.get_xlim()
    left, right = ((t - low_s) / (high_s - low_s) for t in HOLD_S)
    inset = axes.inset_axes((left, 0.47, right - left, 0.48))
    inset.plot(*extremes(t_s, hat), color=style.ESTIMATE, linewidth=0.6)
    inset.plot(*extremes(t_s, speed), color=style.TRUE, linewidth=0.9)
    inset.plot(t_s, ref, color=style.REFERENCE, linewidth=0.8, linestyle=(0, (4, 2)))
    inset.set_xlim(*HOLD_S)
    inset.set_ylim(float(ref[-1]) - scale_rpm, float(ref[-1]) + scale_rpm)
    inset.tick_params(labelsize=6.0, length=2.0, labelbottom=False, bottom=False)
    inset.set_title("the hold, enlarged", fontsize=6.5, loc="left", pad=1.5, color=style.MUTED)


def _torque_current(axes: Any, t_s: Array, s: Signals, part: slice) -> None:
    shown = [s.i_q_ref_A[part], s.i_q_A[part]]
    _view(axes, shown, TORQUE_CURRENT_VIEW_A, 8.0)
    _line(axes, t_s, shown[1], color=style.TRUE, label="$i_q$", zorder=3)
    _line(
        axes,
        t_s,
        shown[0],
        color=style.REFERENCE,
        label="$i_q^*$ command",
        linewidth=0.8,
        linestyle=(0, (4, 2)),
        zorder=4,
    )
    low, high = axes.get_ylim()
    for limit_A in (-s.i_q_limit_A, s.i_q_limit_A):
        if low < limit_A < high:
            axes.axhline(limit_A, color=style.MUTED, linewidth=0.7, linestyle=(0, (1, 2)), zorder=1)
            axes.annotate(
                "limit",
                (1.0, limit_A),
                xycoords=("axes fraction", "data"),
                xytext=(2, 0),
                textcoords="offset points",
                va="center",
                fontsize=6.5,
                color=style.MUTED,
            )
    style.panel_title(axes, "torque current [A]")
    style.legend_above(axes)


def _frequency(axes: Any, t_s: Array, s: Signals, part: slice) -> None:
    shown = s.f_s_Hz[part]
    _view(axes, [shown, np.zeros(1)], FREQUENCY_VIEW_HZ, 4.0)
    axes.axhline(0.0, color="#9CA3AF", linewidth=0.8, zorder=1)
    _line(axes, t_s, shown, color=style.FREQUENCY, linewidth=0.9, zorder=3)
    style.panel_title(axes, "stator frequency [Hz]")


def _load(axes: Any, t_s: Array, s: Signals, part: slice) -> None:
    shown = 100.0 * s.load_Nm[part] / RATED_TORQUE_NM
    axes.plot(t_s, shown, color=style.LOAD, linewidth=1.2)
    axes.set_ylim(-115.0, 10.0)
    axes.set_yticks([-100, -50, 0])
    style.panel_title(axes, "load torque [% of $T_N$ = 8.4 Nm]")


def end_of(s: Signals, ramp: bool) -> tuple[float, str] | None:
    """Where the firmware tripped, or where protocol R counts the run as lost."""
    tripped = np.flatnonzero(s.faults != 0)
    trip_s = float(s.t_s[tripped[0]]) - s.event_s if len(tripped) else np.inf
    lost_s = lost_at_s(s, LOST_RPM, LOST_AT_LIMIT_S) if ramp else np.inf
    first_s, text = min((lost_s, "lost"), (trip_s, "trip"))
    return (first_s, text) if np.isfinite(first_s) else None


def _mark_end(axes: Any, s: Signals, ramp: bool) -> None:
    end = end_of(s, ramp)
    if end is None:
        return
    first_s, text = end
    axes.axvline(first_s, color="#B91C1C", linewidth=0.9, linestyle=(0, (3, 2)), zorder=6)
    axes.annotate(
        text,
        (first_s, 1.0),
        xycoords=("data", "axes fraction"),
        xytext=(3, -2),
        textcoords="offset points",
        ha="left",
        va="top",
        fontsize=7.5,
        color="#B91C1C",
        bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.85, "pad": 0.5},
        zorder=9,
    )
