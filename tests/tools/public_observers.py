"""Public implementations of four rivals' methods on a record of signals.

The first three are stated anew in double precision, with the discretisation of their sources; none
of their code is here. The last one is the package itself, given the motor.

    TiHybrid         ACI_FE and ACI_SE of Texas Instruments' controlSUITE, math_blocks 4.3
    NxpMras          ACIMRotFluxObsrv and ACIMSpeedMRAS of NXP's AMCLIB (RTCESL): its headers, as
                     the library comes without sources
    Harnefors2003    VM_Harnefors2003_SCVM of emachinery 2.0.1 (acmsimcv5), GPL 3
    Kalman           ExtendedKalmanFilter of filterpy 2.0.0, MIT licence
"""

from __future__ import annotations

import numpy as np
from driven_motor import T_S, Record, matrices
from filterpy.kalman import ExtendedKalmanFilter

FASTER = 4  # 20 kHz: at 5 kHz they are worse
DT_S = T_S / FASTER
Estimates = tuple[np.ndarray, np.ndarray]


class _Circuit:
    """Where a record begins."""

    def __init__(self, record: Record) -> None:
        m = record.machine
        self.M_H, self.kr, self.a = m.M_H, m.M_H / m.Lr_H, m.Rr_ohm / m.Lr_H
        self.Rs, self.sigma_Ls = m.Rs_ohm, m.Ls_H - self.kr * m.M_H
        self.i, self.flux, self.w = record.i_s_A[0], record.lambda_Wb[0], record.omega_e_rad_s[0]

    def slip(self, i: complex) -> float:
        return self.M_H * self.a * (i / self.flux).imag

    def step(self, u: complex, i: complex) -> None:
        raise NotImplementedError


class TiHybrid(_Circuit):
    """Current model in the frame of the flux, voltage model held by it through a PI controller.

    kp and ki of TI's example for its board of 236 V and 10 A: 2.8 pu and T/.45; low-pass of the
    speed 3 Hz. Kinder than theirs: the angle's difference is right where the angle wraps around.
    """

    kp_per_s, ki_per_s, speed_Hz = 2.8 * 236.0 / (0.294 * 10.0), 1.0 / 0.45, 3.0

    def __init__(self, record: Record) -> None:
        super().__init__(record)
        self.length = abs(self.flux)
        self.psi = self.kr * self.flux + self.sigma_Ls * self.i
        self.emf, self.ui, self.w_s = 1j * self.w * self.psi, 0j, self.w

    def step(self, u: complex, i: complex) -> None:
        axis = self.flux / abs(self.flux)
        share = DT_S * self.a / (1.0 + DT_S * self.a)
        self.length += share * (self.M_H * (i / axis).real - self.length)
        error = self.psi - self.kr * self.length * axis - self.sigma_Ls * i
        held = self.kp_per_s * error + self.ui
        self.ui += self.kp_per_s * self.ki_per_s * DT_S * error
        before, self.emf = self.emf, u - self.Rs * i - held
        self.psi += 0.5 * DT_S * (self.emf + before)
        old, self.flux = self.flux, (self.psi - self.sigma_Ls * i) / self.kr
        speed_share = DT_S / (DT_S + 1.0 / (2.0 * np.pi * self.speed_Hz))
        self.w_s += speed_share * (np.angle(self.flux / old) / DT_S - self.w_s)
        self.w = self.w_s - self.slip(i)


class NxpMras(TiHybrid):
    """The flux of such an observer as reference, the current model in the rotor's frame, PI.

    The gains are the user's: two poles at 100 rad/s as our own MRAS, crossover 10 Hz.
    """

    kp_per_s, ki_per_s = 2.0 * np.pi * 10.0, 0.0
    kp, ki = 200.0, 10000.0  # over the squared nominal flux

    def __init__(self, record: Record) -> None:
        super().__init__(record)
        self.model, self.angle, self.x, self.speed = self.flux, 0.0, self.w, self.w
        self.per_flux2 = abs(self.flux) ** -2

    def step(self, u: complex, i: complex) -> None:
        super().step(u, i)
        self.angle += DT_S * self.speed
        turned = i * np.exp(-1j * self.angle)
        self.model = (self.model + DT_S * self.a * self.M_H * turned) / (1.0 + DT_S * self.a)
        z = self.per_flux2 * (np.conj(self.model * np.exp(1j * self.angle)) * self.flux).imag
        self.x += DT_S * self.ki * z
        self.w = self.speed = self.x + self.kp * z


class Harnefors2003(_Circuit):
    """Its low-pass works on the stator flux, and lambda is 2. It has no speed: ours is added."""

    bandwidth, alpha_o = 2.0, 2.0 * np.pi * 40.0

    def __init__(self, record: Record) -> None:
        super().__init__(record)
        self.psi, self.w_1 = self.kr * self.flux + self.sigma_Ls * self.i, self.w

    def step(self, u: complex, i: complex) -> None:
        sign = -1.0 if self.w_1 < 0.0 else 1.0
        emf = (1.0 - 1j * self.bandwidth * sign) * (u - 0.5 * self.Rs * (i + self.i))
        rate = self.bandwidth * abs(self.w_1)
        decay = np.exp(-rate * DT_S)
        self.psi = decay * self.psi + (DT_S if rate == 0.0 else (1.0 - decay) / rate) * emf
        self.i, old = i, self.flux
        self.flux = (self.psi - self.sigma_Ls * i) / self.kr
        slip = self.slip(i)
        self.w += DT_S * self.alpha_o * (np.angle(self.flux / old) / DT_S - slip - self.w)
        self.w_1 = self.w + slip


def run(law: _Circuit, record: Record) -> Estimates:
    """Theirs sample faster than our 5 kHz: between two samples the current is a straight line."""
    flux = np.empty(len(record.t_s), dtype=complex)
    omega = np.empty(len(record.t_s))
    flux[0], omega[0] = law.flux, law.w
    for k in range(1, len(record.t_s)):
        i, u = complex(record.i_s_A[k]), complex(record.u_s_V[k])
        start = complex(record.i_s_A[k - 1])
        for n in range(1, FASTER + 1):
            law.step(u, start + (i - start) * n / FASTER)
        flux[k], omega[k] = law.flux, law.w
    return flux, omega


class Kalman(ExtendedKalmanFilter):
    """filterpy's filter with the motor: i, lambda in two axes, w; F by forward Euler.

    second: the state by second order, as the firmware; else by forward Euler, as published.
    """

    def __init__(
        self, record: Record, Q: np.ndarray, R: float, P: np.ndarray, second: bool
    ) -> None:
        super().__init__(dim_x=5, dim_z=2)
        self.machine, self.second = record.machine, second
        self.x = _real(record.i_s_A[0], record.lambda_Wb[0], record.omega_e_rad_s[0])
        self.Q, self.R, self.P = np.diag(Q), R * np.eye(2), np.diag(P)
        self.u = 0j

    def predict_x(self, u: complex = 0) -> None:
        i, flux, w = complex(*self.x[:2]), complex(*self.x[2:4]), self.x[4]
        a, b = matrices(self.machine, w)
        state = np.array([i, flux])
        rate = a @ state + b * u
        order = 0.5 * T_S * T_S * (a @ rate) if self.second else 0.0
        self.x = _real(*(state + T_S * rate + order), w)

    def period(self, u: complex, i: complex) -> None:
        flux, w = complex(*self.x[2:4]), self.x[4]
        a, _ = matrices(self.machine, w)
        F = np.eye(5)
        for row, column in np.ndindex(2, 2):
            c = T_S * a[row, column]
            block = [[c.real, -c.imag], [c.imag, c.real]]
            F[2 * row : 2 * row + 2, 2 * column : 2 * column + 2] += block
        inv_eps = a[0, 1].real / (self.machine.Rr_ohm / self.machine.Lr_H)
        for row, of_speed in ((0, -1j * inv_eps * flux), (2, 1j * flux)):
            F[row : row + 2, 4] = T_S * of_speed.real, T_S * of_speed.imag
        self.F = F
        self.predict(u)
        self.update(np.array([i.real, i.imag]), lambda _: H, lambda x: x[:2])


H = np.eye(2, 5)


def _real(i: complex, flux: complex, w: float) -> np.ndarray:
    return np.array([i.real, i.imag, flux.real, flux.imag, w])


def run_kalman(law: Kalman, record: Record) -> Estimates:
    states = np.empty((len(record.t_s), 5))
    states[0] = law.x
    for k in range(1, len(record.t_s)):
        law.period(complex(record.u_s_V[k]), complex(record.i_s_A[k]))
        states[k] = law.x
    return states[:, 2] + 1j * states[:, 3], states[:, 4]
