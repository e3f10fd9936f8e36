"""The lag of the estimate on ramps, and what takes it away.

At an operating point z = Im(conj(lambda) e1) answers a speed error w - w_hat by G(s), and the
adaptation closes the loop: w_hat = (K_P + K_I/s) z. G(0) = G0 is finite, so that on a ramp with
acceleration a the estimate stays a/(K_I G0) behind, whatever K_P. Meanwhile z = a/K_I, hence

    w = w_hat + z/G0,    G0 = lambda^2 Re(j w_s/eps / D(j w_s)),    D(s) = det(sI - A - L C1)

z passes a first-order low-pass before, because it carries the ripple of the recording.
"""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Self

import numpy as np

from zerohertz.gain_design.stored import read_table_json
from zerohertz.gain_design.table import gains_of
from zerohertz.motor import Circuit
from zerohertz.replay.estimate import Estimate
from zerohertz.replay.log import ComplexArray, FloatArray


@dataclasses.dataclass(frozen=True)
class Tables:
    """A motor and its L over the speed, as the firmware looks it up."""

    circuit: Circuit
    step_rad_s: float
    gain: FloatArray  # Re l1, Im l1, Re l2, Im l2

    @classmethod
    def read(cls, circuit: Circuit, file: Path) -> Self:
        content = read_table_json(file)
        return cls(circuit, float(content["step_rad_s"]), gains_of(content).astype(np.float64))

    def at(self, omega_e_rad_s: FloatArray) -> tuple[ComplexArray, ComplexArray]:
        """l1 in 1/s, l2 in ohm; L(-w) is the conjugate of L(w)."""
        entry = np.rint(np.abs(omega_e_rad_s) / self.step_rad_s).astype(int)
        row = self.gain[np.minimum(entry, len(self.gain) - 1)]
        sign = np.where(omega_e_rad_s < 0.0, -1.0, 1.0)
        return row[:, 0] + 1j * sign * row[:, 1], row[:, 2] + 1j * sign * row[:, 3]


def static_gain_Wb_A_s(
    tables: Tables,
    omega_e_rad_s: FloatArray,
    omega_s_rad_s: FloatArray,
    lambda_Wb: FloatArray | float,
) -> FloatArray:
    """G0 in Wb A per rad/s, at each of the operating points."""
    c = tables.circuit
    l1_per_s, l2_ohm = tables.at(omega_e_rad_s)
    turning = c.tau_per_s - 1j * omega_e_rad_s
    s = 1j * omega_s_rad_s
    D = (s + c.a11_per_s - l1_per_s) * (s + turning)
    D = D - turning / c.eps_H * (c.M_H * c.tau_per_s + l2_ohm)
    return np.square(lambda_Wb) * np.real(s / c.eps_H / D)


def corrected_rad_s(
    estimate: Estimate, tables: Tables, corner_rad_s: float, least_gain: float, period_s: float
) -> FloatArray:
    """The speed without its lag; least_gain keeps a flux that is still to come out of the way."""
    keep = np.exp(-corner_rad_s * period_s)
    from scipy import signal  # 150 MB, not for every command

    smooth = signal.lfilter([1.0 - keep], [1.0, -keep], estimate.z_Wb_A)
    static = static_gain_Wb_A_s(
        tables, estimate.omega_e_rad_s, estimate.omega_s_rad_s, estimate.lambda_r_Wb
    )
    return estimate.omega_e_rad_s + smooth / np.maximum(static, least_gain)
