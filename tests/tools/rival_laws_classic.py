"""Laws of four more rivals in double precision, straight from their equations.

Between two samples the models are integrated by Runge-Kutta with the voltage constant and the
current a straight line: neither the sums nor the discretisation of the firmware.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from driven_motor import T_S, Record

Estimates = tuple[np.ndarray, np.ndarray]
Rate = Callable[[np.ndarray, complex], np.ndarray]  # of state and current


class _Common:
    """The circuit, and where the record begins."""

    def __init__(self, record: Record) -> None:
        m = record.machine
        self.kr, self.Rs, self.a = m.M_H / m.Lr_H, m.Rs_ohm, m.Rr_ohm / m.Lr_H
        self.sigma_Ls, self.m_tau = m.Ls_H - self.kr * m.M_H, m.M_H * self.a
        self.a11 = (self.Rs + self.kr * self.m_tau) / self.sigma_Ls
        self.i, self.flux, self.w = record.i_s_A[0], record.lambda_Wb[0], record.omega_e_rad_s[0]
        self.x = self.w
        self.nominal_Wb = 5.1 * m.M_H

    def integrated(self, rate: Rate, state: np.ndarray, i_now: complex) -> np.ndarray:
        mean = 0.5 * (self.i + i_now)
        k1 = rate(state, self.i)
        k2 = rate(state + 0.5 * T_S * k1, mean)
        k3 = rate(state + 0.5 * T_S * k2, mean)
        k4 = rate(state + T_S * k3, i_now)
        return state + T_S / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)

    def adapt(self, z: float, kp: float, ki: float) -> None:
        self.x += T_S * ki * z
        self.w = self.x + kp * z

    def step(self, u: complex, i_now: complex) -> None:
        raise NotImplementedError


class Mras(_Common):
    pole_rad_s, high_pass_rad_s = 100.0, 20.0

    def __init__(self, record: Record) -> None:
        super().__init__(record)
        self.state = np.array([self.kr * self.flux + self.sigma_Ls * self.i, self.flux, 0.0])

    def step(self, u: complex, i_now: complex) -> None:
        def rate(state: np.ndarray, i: complex) -> np.ndarray:
            y, adjustable, slow = state
            return np.array(
                [
                    u - self.Rs * i - self.high_pass_rad_s * (y - self.sigma_Ls * i),
                    self.m_tau * i - (self.a - 1j * self.w) * adjustable,
                    self.high_pass_rad_s * (adjustable - slow),
                ]
            )

        self.state = self.integrated(rate, self.state, i_now)
        self.i = i_now
        y, adjustable, slow = self.state
        reference = (y - self.sigma_Ls * i_now) / self.kr
        z = (np.conj(adjustable - slow) * reference).imag
        gain = self.pole_rad_s / self.nominal_Wb**2
        self.adapt(z, 2.0 * gain, gain * self.pole_rad_s)
        self.flux = reference + slow


class Hybrid(_Common):
    corner_rad_s, filter_s = 2.0 * np.pi * 10.0, 5e-3

    def __init__(self, record: Record) -> None:
        super().__init__(record)
        self.state = np.array([self.kr * self.flux + self.sigma_Ls * self.i, abs(self.flux)])

    def step(self, u: complex, i_now: complex) -> None:
        def rate(state: np.ndarray, i: complex) -> np.ndarray:
            psi, length = state
            flux = (psi - self.sigma_Ls * i) / self.kr
            axis = flux / abs(flux)
            held = self.kr * length * axis + self.sigma_Ls * i - psi
            return np.array(
                [
                    u - self.Rs * i + self.corner_rad_s * held,
                    self.m_tau * (np.conj(axis) * i).real - self.a * length,
                ]
            )

        self.state = self.integrated(rate, self.state, i_now)
        self.i, before = i_now, self.flux
        self.flux = (self.state[0] - self.sigma_Ls * i_now) / self.kr
        slip = self.m_tau * (i_now / self.flux).imag
        turned = np.angle(self.flux / before) / T_S
        self.w += T_S / (T_S + self.filter_s) * (turned - slip - self.w)


class FullOrder(_Common):
    """Stator and rotor flux of the inverse-Gamma model; gain and rotation of Hinkkanen."""

    k0_per_s, phi0_rad, bandwidth_rad_s = 478.0, np.radians(80.0), 2.0 * np.pi * 40.0

    def __init__(self, record: Record) -> None:
        super().__init__(record)
        rotor = self.kr * self.flux
        self.state = np.array([rotor + self.sigma_Ls * self.i, rotor])
        self.e = 0.0
        nominal_Wb = self.kr * self.nominal_Wb
        self.kp = self.bandwidth_rad_s * self.sigma_Ls / nominal_Wb**2

    def ki(self) -> float:
        return self.kp * (self.a11 + 2.0 * self.gain_ohm(self.x) / self.sigma_Ls)

    def gain_ohm(self, w: float) -> float:
        return self.k0_per_s * self.sigma_Ls * min(abs(w) / 314.15927, 1.0)

    def phi_rad(self, w_s: float, slip: float) -> float:
        distance = 1.0 - abs(w_s) / 125.66371
        return self.phi0_rad * np.sign(w_s) * distance if w_s * slip < 0.0 < distance else 0.0

    def step(self, u: complex, i_now: complex) -> None:
        k, sign = self.gain_ohm(self.w), -1.0 if self.w < 0.0 else 1.0
        l_s, l_r = k * (1.0 + 1j * sign), k * (-1.0 + 1j * sign)

        def rate(state: np.ndarray, _: complex) -> np.ndarray:
            stator, rotor = state
            i = (stator - rotor) / self.sigma_Ls
            return np.array(
                [
                    u - self.Rs * i + l_s * self.e,
                    self.kr * self.m_tau * i - (self.a - 1j * self.w) * rotor + l_r * self.e,
                ]
            )

        self.state = self.integrated(rate, self.state, i_now)
        self.i = i_now
        stator, rotor = self.state
        i = (stator - rotor) / self.sigma_Ls
        self.e = i_now - i
        slip = ((self.kr * self.m_tau * i + l_r * self.e) / rotor).imag
        phi = self.phi_rad(self.w + slip, slip)
        self.adapt(-(np.conj(rotor) * self.e * np.exp(-1j * phi)).imag, self.kp, self.ki())
        self.flux = rotor / self.kr


class Natural(FullOrder):
    """Kubota's law on a copy of the motor."""

    k0_per_s, phi0_rad = 0.0, 0.0

    def __init__(self, record: Record) -> None:
        super().__init__(record)
        self.kp = 12.0 / self.kr**2

    def ki(self) -> float:
        return 2140.0 / self.kr**2


def run(law: _Common, record: Record) -> Estimates:
    flux = np.empty(len(record.t_s), dtype=complex)
    omega = np.empty(len(record.t_s))
    flux[0], omega[0] = record.lambda_Wb[0], law.w
    for k in range(1, len(record.t_s)):
        law.step(complex(record.u_s_V[k]), complex(record.i_s_A[k]))
        flux[k], omega[k] = law.flux, law.w
    return flux, omega
