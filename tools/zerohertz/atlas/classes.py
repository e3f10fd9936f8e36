"""How a run ended: the classes of the atlas, written once. Pure functions of arrays.

t = 0 is when the load begins to ramp in (RAMP_S). Exactly one class per run:
oriented   held, and the flux orientation right for 99 % of the judged window
held       speed right in the judged window, never far off after the ramp, torque on throughout
takeover   not held, but IMPRESSED is declared in the judged window and the load is not lost
safe_stop  not held, a fault is declared, the gates are off and the currents stayed within limits
unsafe     everything else
Beside the class, silent: CLOSED while orientation was lost for more than 100 ms.
"""

from __future__ import annotations

import dataclasses
from enum import IntEnum, StrEnum

import numpy as np
from numpy.typing import NDArray

from zerohertz.drive import State

Array = NDArray[np.floating]
Flags = NDArray[np.bool_]

RAMP_S = 1.0
SETTLED_S = RAMP_S + 1.0  # from here on the speed must never be far off
START_ERROR_RPM = 30.0  # at t = 0, else the start has failed
START_CHECK_S = 0.1
MEAN_ERROR_RPM = 30.0
STD_RPM = 15.0
FAR_RPM = 150.0  # the load is lost
ANGLE_DEG = 25.0
FLUX_PU = 0.25
ORIENTED_SHARE = 0.99
SILENT_S = 0.1
LOW_FREQUENCY_HZ = 1.0
# A current trip is only seen a sample after the limit; in that period and the one until the gates
# have closed, the current goes on rising.
TRIP_OVERSHOOT = 1.25


class Outcome(StrEnum):
    ORIENTED = "oriented"
    HELD = "held"
    TAKEOVER = "takeover"
    SAFE_STOP = "safe_stop"
    UNSAFE = "unsafe"


class Confidence(IntEnum):
    """Column `confidence`: what the firmware's supervisor says of itself."""

    CLOSED = 0
    DEGRADED = 1
    IMPRESSED = 2


@dataclasses.dataclass(frozen=True)
class Trace:
    """One run on its way, rows step_s apart; t_s counts from t = 0 and ends with the run."""

    t_s: Array
    step_s: float
    error_rpm: Array  # w - w*
    angle_err_deg: Array
    lambda_Wb: Array
    lambda_hat_Wb: Array
    f_s_Hz: Array
    i_abs_A: Array  # power invariant
    state: Array
    gates_on: Array
    confidence: Array


@dataclasses.dataclass(frozen=True)
class Judgement:
    """The class and the numbers it came from."""

    outcome: str
    silent: bool
    started: bool
    mean_error_rpm: float
    std_rpm: float
    worst_error_rpm: float  # from SETTLED_S on, in a shorter run from the judged window on
    oriented_share: float  # of the judged window
    lost_silent_s: float  # most of it within one loss of orientation: CLOSED
    closed_share: float  # of the time with torque from t = 0 on
    degraded_share: float
    impressed_share: float
    above_1Hz_s: float  # time with |f_s| > 1 Hz ...
    closed_above_1Hz_s: float  # ... and CLOSED in it


def oriented(trace: Trace) -> Flags:
    """Where the estimated flux is near the true one, in angle and in magnitude."""
    angle = np.abs(trace.angle_err_deg) < ANGLE_DEG
    return angle & (np.abs(trace.lambda_hat_Wb - trace.lambda_Wb) < FLUX_PU * trace.lambda_Wb)


def silent_time_s(trace: Trace, running: Flags, right: Flags) -> float:
    """The longest time CLOSED within one loss of orientation.

    A pole that slips comes past the right angle every turn: a loss is over only after SILENT_S in
    orientation.
    """
    lost = running & ~right
    closed = lost & (trace.confidence == Confidence.CLOSED)
    at = np.flatnonzero(lost)
    if at.size == 0:
        return 0.0
    losses = np.split(at, np.flatnonzero(np.diff(at) * trace.step_s > SILENT_S) + 1)
    return float(max(np.count_nonzero(closed[loss]) for loss in losses)) * trace.step_s


def judge(trace: Trace, loaded_s: float, judged_s: float, i_trip_A: float, trip: bool) -> Judgement:
    """`trip`: with the gates on, the run went beyond what a bench survives (speed, numbers)."""
    loaded, window = trace.t_s >= 0.0, trace.t_s >= loaded_s - judged_s
    settled = trace.t_s >= min(SETTLED_S, loaded_s - judged_s)
    complete = bool(trace.t_s[-1] >= loaded_s - 2.0 * trace.step_s)
    mean_rpm, std_rpm = _mean_std(trace.error_rpm[window]) if complete else (np.inf, np.inf)
    worst_rpm = _largest(np.abs(trace.error_rpm[settled]))
    right = oriented(trace)
    share = float(right[window].mean()) if complete else 0.0
    running = loaded & (trace.gates_on > 0)
    silent_s = silent_time_s(trace, running, right)
    begun = started(trace)
    torque = bool(np.all(trace.gates_on[loaded] > 0)) and complete and not trip and begun
    near = torque and worst_rpm <= FAR_RPM
    if near and abs(mean_rpm) < MEAN_ERROR_RPM and std_rpm < STD_RPM:
        outcome = Outcome.ORIENTED if share >= ORIENTED_SHARE else Outcome.HELD
    else:
        impressed = bool(np.any(trace.confidence[window] == Confidence.IMPRESSED))
        outcome = _not_held(trace, near and impressed, i_trip_A, trip)
    return Judgement(
        outcome=outcome.value,
        silent=silent_s > SILENT_S,
        started=begun,
        mean_error_rpm=mean_rpm,
        std_rpm=std_rpm,
        worst_error_rpm=worst_rpm,
        oriented_share=share,
        lost_silent_s=silent_s,
        **_shares(trace, running),
    )


def _not_held(trace: Trace, taken_over: bool, i_trip_A: float, trip: bool) -> Outcome:
    if taken_over:
        return Outcome.TAKEOVER
    safe = stopped_safely(trace, i_trip_A) and not trip
    return Outcome.SAFE_STOP if safe else Outcome.UNSAFE


def started(trace: Trace) -> bool:
    """In RUN and at the reference just before t = 0."""
    before = (trace.t_s < 0.0) & (trace.t_s >= -START_CHECK_S)
    running = bool(before.any()) and bool(np.all(trace.state[before] == State.RUN))
    return running and abs(float(trace.error_rpm[before].mean())) < START_ERROR_RPM


def stopped_safely(trace: Trace, i_trip_A: float) -> bool:
    """FAULT declared, gates off at the end, no phase beyond what a trip lets through."""
    declared = trace.state[-1] == State.FAULT and trace.gates_on[-1] == 0
    # The largest phase current is sqrt(2/3) of a power-invariant vector's length.
    peak_A = np.sqrt(2.0 / 3.0) * _largest(trace.i_abs_A)
    return bool(declared) and bool(peak_A <= TRIP_OVERSHOOT * i_trip_A)


def _shares(trace: Trace, running: Flags) -> dict[str, float]:
    total = max(int(np.count_nonzero(running)), 1)
    said = trace.confidence[running]
    fast = running & (np.abs(trace.f_s_Hz) > LOW_FREQUENCY_HZ)
    closed = fast & (trace.confidence == Confidence.CLOSED)
    return {
        **{
            f"{name.name.lower()}_share": np.count_nonzero(said == name) / total
            for name in Confidence
        },
        "above_1Hz_s": np.count_nonzero(fast) * trace.step_s,
        "closed_above_1Hz_s": np.count_nonzero(closed) * trace.step_s,
    }


def _mean_std(values: Array) -> tuple[float, float]:
    return float(np.mean(values, dtype=np.float64)), float(np.std(values, dtype=np.float64))


def _largest(values: Array) -> float:
    """Infinity for nothing and for NaN, so that no limit is met by either."""
    largest = float(values.max()) if len(values) else np.inf
    return largest if np.isfinite(largest) else np.inf
