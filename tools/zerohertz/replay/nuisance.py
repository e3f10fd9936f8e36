"""Voltage gain and delay that fit a log best: nuisance parameters, not results.

A logged voltage is mostly a command: its size is known to some per cent, and when it acted is not
known. Both are fitted to the speed sensor, so that what is left is closer to the estimator's own
error; the unfitted error stands beside it. A log at one speed and load does not tell the two apart:
a departure of PRIOR_GAIN or PRIOR_DELAY_S has to pay with PRIOR_RAD_S of error.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from zerohertz.replay.run import Replay, Voltage
from zerohertz.replay.statistics import SpeedError, speed_error

GAIN = 0.1  # most that the gain may differ from the declared one
DELAY_S = 5e-4  # likewise the delay
PRIOR_GAIN, PRIOR_DELAY_S, PRIOR_RAD_S = 0.05, 3e-4, 0.5
STEP = np.array([0.02, 2e-4])
TOLERANCE_RAD_S = 1e-3
RUNS = 60


@dataclasses.dataclass(frozen=True)
class Fit:
    """The voltage that fits, and what error it leaves."""

    voltage_gain: float
    voltage_delay_s: float
    error: SpeedError


def fit_voltage(replay: Replay, declared: Voltage, from_s: float, until_s: float) -> Fit:
    """Least rms error between the two times, by simplex around what was declared."""
    start = np.array([declared.gain, declared.delay_s])
    room = np.array([GAIN, DELAY_S])

    def error(scaled: np.ndarray) -> SpeedError:
        gain, delay_s = start + STEP * np.clip(scaled, -room / STEP, room / STEP)
        stream, speed = replay.run(Voltage(float(gain), float(delay_s)))
        return speed_error(stream.t_s, speed, stream.omega_e_rad_s, from_s, until_s)

    simplex = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    options = {"initial_simplex": simplex, "fatol": TOLERANCE_RAD_S, "xatol": 0.02, "maxfev": RUNS}
    prior = PRIOR_RAD_S * STEP / np.array([PRIOR_GAIN, PRIOR_DELAY_S])

    def cost(scaled: np.ndarray) -> float:
        return float(np.hypot(error(scaled).rms_rad_s, np.linalg.norm(prior * scaled)))

    from scipy import optimize  # 150 MB, not for every command

    found = optimize.minimize(cost, simplex[0], method="Nelder-Mead", options=options)
    best = np.clip(found.x, -room / STEP, room / STEP)
    gain, delay_s = start + STEP * best
    return Fit(float(gain), float(delay_s), error(best))
