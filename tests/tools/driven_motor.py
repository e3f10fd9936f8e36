"""A motor driven as a perfect flux-oriented drive would: signals that estimators are judged on.

Shares no code with the firmware or the plant. Exact step of the linear motor for a voltage that is
constant over a period (eigenvalues of a complex 2 x 2 matrix), speed prescribed, currents led to
their references in one period.
"""

from __future__ import annotations

import dataclasses

import numpy as np
from synthetic_log import TABLE_1, Machine

T_S = 200e-6
POLE_PAIRS = 2
RPM = 30.0 / np.pi / POLE_PAIRS
BIT_A, NOISE_A = 25.0 / 8192, 8e-3  # 14 bit of +-25 A, and the noise of a current sensor
OFFSET_V, DEAD_V = 0.1 + 0.05j, 0.5


@dataclasses.dataclass(frozen=True)
class Record:
    """Voltage: mean over the interval that ends at t. Everything else: at t."""

    machine: Machine
    t_s: np.ndarray
    u_s_V: np.ndarray
    i_s_A: np.ndarray
    lambda_Wb: np.ndarray
    omega_e_rad_s: np.ndarray

    def noisy(self, seed: int, noise_V: float = 0.0) -> Record:
        """With white noise on current and voltage, and the converter's quantisation."""
        rng = np.random.default_rng(seed)
        noise = rng.normal(0.0, 1.0, (4, len(self.t_s)))
        i_A = self.i_s_A + NOISE_A * (noise[0] + 1j * noise[1])
        i_A = BIT_A * (np.round(i_A.real / BIT_A) + 1j * np.round(i_A.imag / BIT_A))
        u_V = self.u_s_V + noise_V * (noise[2] + 1j * noise[3])
        return dataclasses.replace(self, i_s_A=i_A, u_s_V=u_V)

    def measured(self, seed: int, Rs_extra_ohm: float = 0.0) -> Record:
        """On a board: noisy, with an offset, dead time left by a compensated inverter, wrong Rs."""
        rough = self.noisy(seed)
        sector = np.round(np.angle(rough.i_s_A) * 3.0 / np.pi)
        left_V = OFFSET_V + DEAD_V * np.exp(1j * np.pi / 3.0 * sector)
        u_V = rough.u_s_V + left_V + Rs_extra_ohm * rough.i_s_A
        return dataclasses.replace(rough, u_s_V=u_V)


def matrices(m: Machine, omega: float) -> tuple[np.ndarray, np.ndarray]:
    """x = (i, lambda): x' = A x + b u."""
    coupling, tau = m.M_H / m.Lr_H, m.Rr_ohm / m.Lr_H
    sigma_Ls = m.Ls_H - coupling * m.M_H
    decay = tau - 1j * omega
    flux = np.array([m.M_H * tau, -decay])
    current = np.array([-m.Rs_ohm, 0.0]) - coupling * flux
    return np.array([current / sigma_Ls, flux]), np.array([1.0 / sigma_Ls, 0.0])


def exact_step(m: Machine, omega: float) -> tuple[np.ndarray, np.ndarray]:
    a, b = matrices(m, omega)
    poles, vectors = np.linalg.eig(a)
    phi = (vectors * np.exp(poles * T_S)) @ np.linalg.inv(vectors)
    return phi, np.linalg.solve(a, (phi - np.eye(2)) @ b)


def drive(
    profile: list[tuple[float, float, float]], i_d_A: float = 5.1, machine: Machine = TABLE_1
) -> Record:
    """profile: corners of (time, mechanical speed in min^-1, torque current), joined by lines."""
    corners = np.array(profile).T
    t_s = np.arange(0.0, corners[0, -1], T_S)
    omega = np.interp(t_s, corners[0], corners[1]) / RPM
    i_q_A = np.interp(t_s, corners[0], corners[2])
    x = np.array([i_d_A, machine.M_H * i_d_A], dtype=complex)
    rows = np.empty((3, len(t_s)), dtype=complex)
    for k in range(len(t_s)):
        phi, gamma = exact_step(machine, omega[k])
        slip = machine.M_H * machine.Rr_ohm / machine.Lr_H * i_q_A[k] / abs(x[1])
        axis = x[1] / abs(x[1]) * np.exp(1j * (omega[k] + slip) * T_S)
        u_V = ((i_d_A + 1j * i_q_A[k]) * axis - phi[0] @ x) / gamma[0]
        x = phi @ x + gamma * u_V
        rows[:, k] = u_V, *x
    return Record(machine, t_s + T_S, rows[0], rows[1], rows[2], omega)
