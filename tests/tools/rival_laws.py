"""Laws of two rivals in double precision, straight from their equations."""

from __future__ import annotations

import numpy as np
from driven_motor import T_S, Record

ALPHA_O = 2.0 * np.pi * 40.0
Estimates = tuple[np.ndarray, np.ndarray]


class _Common:
    """Interval, speed and the inverse-Gamma circuit."""

    def __init__(self, record: Record) -> None:
        m = record.machine
        self.kr = m.M_H / m.Lr_H
        self.sigma_Ls, self.Rs = m.Ls_H - self.kr * m.M_H, m.Rs_ohm
        self.a, self.R_R = m.Rr_ohm / m.Lr_H, self.kr**2 * m.Rr_ohm
        self.psi = self.kr * record.lambda_Wb[0]
        self.i, self.w, self.w_1 = record.i_s_A[0], record.omega_e_rad_s[0], 0.0
        self.w_1 = self.w

    def rate(self, v: complex, i: complex, middle: complex) -> complex:
        raise NotImplementedError

    def step(self, u: complex, i_now: complex) -> None:
        i = 0.5 * (i_now + self.i)
        v = u - self.Rs * i - self.sigma_Ls * (i_now - self.i) / T_S
        before, self.i = self.psi, i_now
        self.psi = before + T_S * self.rate(v, i, before + 0.5 * T_S * v)
        w_s = np.angle(self.psi / before) / T_S
        slip = self.R_R * (i_now / self.psi).imag
        self.w += T_S * ALPHA_O * (w_s - slip - self.w)
        self.w_1 = self.w + slip


class ReducedOrder(_Common):
    def rate(self, v: complex, i: complex, middle: complex) -> complex:
        d = middle / abs(middle)
        r_d = self.R_R * (i / d).real - self.a * abs(middle)
        k = (0.5 * self.a + 0.2 * abs(self.w)) / (self.a - 1j * self.w)
        return v + 2.0 * k * (r_d - (v / d).real) * d


class CompensatedVoltageModel(_Common):
    bandwidth = 1.0  # lambda

    def rate(self, v: complex, i: complex, middle: complex) -> complex:
        sign = -1.0 if self.w_1 < 0.0 else 1.0
        decay = self.bandwidth * abs(self.w_1) * middle
        return (1.0 - 1j * self.bandwidth * sign) * v - decay


def run(law: _Common, record: Record) -> Estimates:
    flux = np.empty(len(record.t_s), dtype=complex)
    omega = np.empty(len(record.t_s))
    flux[0], omega[0] = record.lambda_Wb[0], law.w
    for k in range(1, len(record.t_s)):
        law.step(complex(record.u_s_V[k]), complex(record.i_s_A[k]))
        flux[k], omega[k] = law.psi / law.kr, law.w
    return flux, omega
