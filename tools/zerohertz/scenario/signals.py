"""What a figure is judged by: signals of one run, and numbers measured from them.

Speeds in mechanical min^-1, currents power invariant in A, as PAPER_OUTCOMES.md has them. Pure
functions of arrays: no firmware, no plant, no files.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from zerohertz.scenario.filters import high_pass, sliding_minimum

Array = NDArray[np.float64]

RATED_TORQUE_NM = 8.4
RIPPLE_CUTOFF_HZ = 0.5

# i_q* is "at its limit" within 1 % of the limit in force (Setup.i_q_limit_A): the speed
# controller's clamp is exact, the telemetry is float32.
AT_LIMIT_PU = 0.99
# The estimate is held by a bound of its own within 2 % of it.
AT_BOUND_PU = 0.98


@dataclass(frozen=True)
class Signals:
    """One run. event_s is t0 of protocol S, the start of the ramp of protocol R.

    trip and first_fault are bits (sim.Trip, drive.Fault), seen at every control step and not only
    at the samples kept here; trip_s is NaN without a trip.
    """

    event_s: float
    i_q_limit_A: float
    lambda_max_Wb: float
    speed_hat_max_rpm: float
    trip: int
    trip_s: float
    first_fault: int
    t_s: Array
    speed_ref_rpm: Array
    speed_rpm: Array
    speed_hat_rpm: Array
    i_q_ref_A: Array
    i_q_A: Array
    load_Nm: Array
    f_s_Hz: Array
    i_abs_A: Array
    lambda_hat_Wb: Array
    faults: Array

    @property
    def step_s(self) -> float:
        return float(self.t_s[1] - self.t_s[0])

    def window(self, start_s: float, end_s: float) -> slice:
        """Samples with event + start <= t <= event + end; half a sample of rounding either way."""
        edges = np.array([start_s - 0.5 * self.step_s, end_s + 0.5 * self.step_s]) + self.event_s
        first, last = np.searchsorted(self.t_s, edges)
        return slice(int(first), int(last))

    def covers(self, end_s: float) -> bool:
        """The record goes on to event + end: a plant whose numbers diverge ends its run early."""
        return bool(self.t_s[-1] >= self.event_s + end_s - 1.5 * self.step_s)

    @property
    def error_rpm(self) -> Array:
        return np.abs(self.speed_rpm - self.speed_ref_rpm)

    @property
    def at_limit(self) -> NDArray[np.bool_]:
        return np.abs(self.i_q_ref_A) >= AT_LIMIT_PU * self.i_q_limit_A

    @property
    def at_bound(self) -> NDArray[np.bool_]:
        """The estimate does not follow the motor but stands at a limit of the firmware's."""
        flux = np.abs(self.lambda_hat_Wb) >= AT_BOUND_PU * self.lambda_max_Wb
        return flux | (np.abs(self.speed_hat_rpm) >= AT_BOUND_PU * self.speed_hat_max_rpm)


def ripple(signals: Signals, values: Array) -> float:
    """rms over t0+8 s .. t0+30 s after a causal second-order 0.5 Hz Butterworth high-pass.

    The filter starts at t0, settled at the value there: the step of 300 min^-1 has decayed by
    exp(-2.2 * 8) when the window opens. NaN when the record ends before the window does.
    """
    if not signals.covers(30.0):
        return np.nan
    after = values[signals.window(0.0, 30.0)]
    filtered = high_pass(after, RIPPLE_CUTOFF_HZ, signals.step_s)
    kept = signals.window(8.0, 30.0)
    return float(np.sqrt(np.mean(np.square(filtered[kept.start - kept.stop :]))))


def largest(values: Array) -> float:
    """NaN for an empty window, so that no clause takes it for a small number."""
    return float(np.max(values)) if len(values) else np.nan


def sustained(values: Array, duration_s: float, step_s: float) -> float:
    """The largest level that `values` stay above for duration_s without a break.

    NaN when there is no such stretch of time at all.
    """
    n = int(np.ceil(duration_s / step_s - 1e-9)) + 1
    if len(values) < n:
        return np.nan
    return float(np.max(sliding_minimum(values, n)))


def worst_share(flags: NDArray[np.bool_], duration_s: float, step_s: float) -> float:
    """Largest share of true flags in any window of duration_s; NaN when there is none."""
    n = max(1, round(duration_s / step_s))
    total = np.concatenate(([0], np.cumsum(flags)))
    if len(flags) < n:
        return np.nan
    return float(np.max(total[n:] - total[:-n]) / n)


def longest_s(flags: NDArray[np.bool_], step_s: float) -> float:
    """The longest unbroken time that the flags are true; NaN when there are none."""
    if len(flags) == 0:
        return np.nan
    edges = np.flatnonzero(np.diff(np.concatenate(([False], flags, [False])).astype(np.int8)))
    lengths = edges[1::2] - edges[::2]
    return float(np.max(lengths - 1, initial=0) * step_s)


def lost_at_s(signals: Signals, error_rpm: float, limit_s: float) -> float:
    """Seconds from the start of the ramp to LOST; infinity when it never is.

    The first |w - w*| > error_rpm, or i_q* at its limit for limit_s (the end of that time).
    """
    part = signals.window(0.0, 80.0)
    t_s = signals.t_s[part] - signals.event_s
    far = np.flatnonzero(signals.error_rpm[part] > error_rpm)
    far_s = float(t_s[far[0]]) if len(far) else np.inf
    n = int(np.ceil(limit_s / signals.step_s - 1e-9)) + 1
    total = np.concatenate(([0], np.cumsum(signals.at_limit[part])))
    full = np.flatnonzero(total[n:] - total[:-n] == n) if len(total) > n else np.array([])
    limit_end_s = float(t_s[full[0] + n - 1]) if len(full) else np.inf
    return min(far_s, limit_end_s)


def load_pu_at(signals: Signals, since_ramp_s: float) -> float:
    """Magnitude of the load over T_N at a time after the start of the ramp."""
    if not np.isfinite(since_ramp_s):
        return np.inf
    at_s = signals.event_s + since_ramp_s
    return float(abs(np.interp(at_s, signals.t_s, signals.load_Nm)) / RATED_TORQUE_NM)
