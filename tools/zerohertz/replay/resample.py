"""From the rows of a log to control periods.

Current and speed are samples: linear interpolation. Voltage is wanted as the mean over the interval
that ends at the sample (observer.h): the integral of the interpolated signal, so that nothing of a
fundamental is lost whichever of the two periods is longer.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from zerohertz.replay.log import ComplexArray, FloatArray, Log


@dataclasses.dataclass(frozen=True)
class Stream:
    """What the observer is fed, one row per control period."""

    period_s: float
    t_s: FloatArray
    u_s_V: ComplexArray  # mean over the interval that ended at t_s
    i_s_A: ComplexArray
    omega_e_rad_s: FloatArray  # measured


def resample(log: Log, period_s: float, voltage_delay_s: float = 0.0) -> Stream:
    """The log at the control period; its voltage acted voltage_delay_s after the time it bears."""
    first_s = period_s + max(voltage_delay_s, 0.0)
    last_s = log.t_s[-1] + min(voltage_delay_s, 0.0)
    # A last sample that misses the end by rounding alone still counts.
    steps = int(np.floor((last_s - first_s) / period_s + 1e-6)) + 1
    t_s = first_s + period_s * np.arange(max(steps, 0))
    return Stream(
        period_s=period_s,
        t_s=t_s,
        u_s_V=_interval_mean(log, t_s - voltage_delay_s, period_s),
        i_s_A=np.interp(t_s, log.t_s, log.i_s_A),
        omega_e_rad_s=np.interp(t_s, log.t_s, log.omega_e_rad_s),
    )


def _interval_mean(log: Log, end_s: FloatArray, period_s: float) -> ComplexArray:
    """Mean of the linearly interpolated voltage over [end - period, end]."""
    return (_integral(log, end_s) - _integral(log, end_s - period_s)) / period_s


def _integral(log: Log, t_s: FloatArray) -> ComplexArray:
    """Integral of the interpolated voltage from 0 to t, exact: trapezoids up to the last row."""
    areas = 0.5 * (log.u_s_V[1:] + log.u_s_V[:-1]) * np.diff(log.t_s)
    at_row = np.concatenate(([0.0], np.cumsum(areas)))
    row = np.clip(np.searchsorted(log.t_s, t_s, side="right") - 1, 0, len(log.t_s) - 1)
    here_V = np.interp(t_s, log.t_s, log.u_s_V)
    return at_row[row] + 0.5 * (log.u_s_V[row] + here_V) * (t_s - log.t_s[row])
