"""How well speed, flux and Rs can be told at zero stator frequency, by what is modulated.

Standard deviation of each, from the current of one period of the modulation at 5 kHz with 20 mA of
noise and a voltage that is known: the inverse of the Fisher information of (constant speed error,
initial flux, Rs), the sensitivities integrated along the true trajectory in the stationary frame.
No estimator does better; the speed is not known from a load either.

With Rr unknown as well: a swing of the speed leaves the length of the flux as it is, and then no
signal tells a wrong Rr from a wrong speed. 1 % of Rr is 1 % of the slip.
"""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from zerohertz.motor import load_motor
from zerohertz.paths import ROOT
from zerohertz.report import style

NOISE_A = 0.02
PERIOD_S = 200e-6
KINDS = ("speed", "flux")
LABELS = {"speed": "speed, rad/s electrical", "flux": "flux, % of it", "Rs": "Rs, % of it"}
UNTOLD = 1e3  # as good as nothing is known


@dataclasses.dataclass(frozen=True)
class Deviations:
    speed: float  # rad/s, electrical
    flux: float  # % of the flux
    Rs: float  # % of Rs
    Rr: float | None = None  # % of Rr; None: it is known


@dataclasses.dataclass(frozen=True)
class Machine:
    """Stationary frame: x = (stator current, rotor flux), x' = A(w) x + b u."""

    Rs_ohm: float
    tau_per_s: float
    M_H: float
    kr: float
    sigma_Ls_H: float

    def slope(self, omega_rad_s: float) -> NDArray[np.complex128]:
        decay = self.tau_per_s - 1j * omega_rad_s
        back = self.kr / self.sigma_Ls_H
        return np.array(
            [
                [
                    -(self.Rs_ohm + self.kr * self.M_H * self.tau_per_s) / self.sigma_Ls_H,
                    back * decay,
                ],
                [self.M_H * self.tau_per_s, -decay],
            ]
        )


def machine() -> Machine:
    c = load_motor(ROOT / "gain_tables" / "hasegawa2005_recommended").circuit
    kr = c.M_H / c.Lr_H
    return Machine(c.Rs_ohm, c.Rr_ohm / c.Lr_H, c.M_H, kr, c.Ls_H - kr * c.M_H)


def deviations(
    motor: Machine,
    omega_rad_s: float,
    i_d_A: float,
    kind: str,
    amplitude: float,
    f_Hz: float,
    Rr_known: bool = True,
) -> Deviations:
    """At the load whose slip cancels the speed; amplitude: rad/s of the speed, or of the flux over
    nominal. i_q stays, and so does the current along a flux that does not move."""
    i_q_A = -omega_rad_s * i_d_A / motor.tau_per_s
    steps = max(200, round(1.0 / (f_Hz * PERIOD_S)))
    flux, angle = motor.M_H * i_d_A + 0j, 0.0
    # Columns: constant speed error, initial flux along and across, Rs, Rr as Rr/Lr.
    columns = 4 if Rr_known else 5
    e = np.zeros((2, columns), complex)
    e[1, 1], e[1, 2] = 1.0, 1j
    information = np.zeros((columns, columns))
    for k in range(steps):
        phase = 2.0 * math.pi * f_Hz * k * PERIOD_S
        omega = omega_rad_s + (amplitude * math.sin(phase) if kind == "speed" else 0.0)
        size = 1.0 - (amplitude * (1.0 - math.cos(phase)) if kind == "flux" else 0.0)
        turn = complex(math.cos(angle), math.sin(angle))
        current = _current(motor, i_d_A, i_q_A, kind, amplitude, phase, f_Hz) * turn
        flux = motor.M_H * i_d_A * size * turn
        half = np.eye(2) + 0.5 * PERIOD_S * motor.slope(omega)
        drive = _drive(motor, flux, current)[:, :columns]
        # Second order, so that what cannot be told is not told by the rounding.
        e = e + PERIOD_S * half @ (motor.slope(omega) @ e + drive)
        seen = np.vstack((e[0].real, e[0].imag)) / NOISE_A
        information += seen.T @ seen
        slip = motor.M_H * motor.tau_per_s * (current / flux).imag
        angle += PERIOD_S * (omega + slip)
    return _deviations(motor, i_d_A, information)


def _drive(motor: Machine, flux: complex, current: complex) -> NDArray[np.complex128]:
    """What a unit of each unknown adds to the slope of the two states."""
    back = motor.kr / motor.sigma_Ls_H
    decays = flux - motor.M_H * current
    return np.array(
        [
            [-1j * back * flux, 0.0, 0.0, -current / motor.sigma_Ls_H, back * decays],
            [1j * flux, 0.0, 0.0, 0.0, -decays],
        ]
    )


def _current(
    motor: Machine,
    i_d_A: float,
    i_q_A: float,
    kind: str,
    amplitude: float,
    phase: float,
    f_Hz: float,
) -> complex:
    if kind != "flux":
        return complex(i_d_A, i_q_A)
    size = 1.0 - amplitude * (1.0 - math.cos(phase))
    rate = -amplitude * 2.0 * math.pi * f_Hz * math.sin(phase)
    return complex(i_d_A * (size + rate / motor.tau_per_s), i_q_A / size)


def _deviations(motor: Machine, i_d_A: float, information: NDArray[np.float64]) -> Deviations:
    flux_Wb = motor.M_H * i_d_A
    percent = (flux_Wb, flux_Wb, motor.Rs_ohm, motor.tau_per_s)
    scale = np.array([1.0, *(x / 100.0 for x in percent)])[: len(information)]
    scaled = information * np.outer(scale, scale)
    values, vectors = np.linalg.eigh(scaled)
    covariance = (vectors / np.maximum(values, UNTOLD**-2)) @ vectors.T
    deviation = np.sqrt(np.diag(covariance))
    told = (float(deviation[0]), float(deviation[1:3].max()), *(float(x) for x in deviation[3:]))
    return Deviations(*told)


def sweep(
    motor: Machine, omega_rad_s: float, i_d_A: float, kind: str, amplitudes: NDArray[np.float64],
    frequencies_Hz: tuple[float, ...],
) -> dict[float, list[Deviations]]:  # fmt: skip
    return {
        f_Hz: [deviations(motor, omega_rad_s, i_d_A, kind, float(a), f_Hz) for a in amplitudes]
        for f_Hz in frequencies_Hz
    }


def write_picture(
    path: Path, speed_rpm: float, i_d_A: float, pole_pairs: float
) -> dict[str, float]:
    """Rows: what is modulated; columns: what is told. Returns the numbers of constant flux and of
    the modulation of `recommended`."""
    motor = machine()
    omega = pole_pairs * speed_rpm * math.pi / 30.0
    amplitudes = {"speed": np.geomspace(0.1, 4.0, 6), "flux": np.geomspace(0.01, 0.3, 6)}
    frequencies = (0.35, 0.7, 1.3, 2.6)
    still = deviations(motor, omega, i_d_A, "speed", 0.0, 1.3)
    with style.figure(9.5, 5.6) as drawn:
        axes = drawn.subplots(2, 3, squeeze=False)
        for row, kind in enumerate(KINDS):
            found = sweep(motor, omega, i_d_A, kind, amplitudes[kind], frequencies)
            for column, name in enumerate(LABELS):
                _draw(axes[row][column], amplitudes[kind], found, name, getattr(still, name))
                unit = "rad/s" if kind == "speed" else "of nominal flux"
                axes[row][column].set_xlabel(f"amplitude of the {kind}, {unit}")
        axes[0][0].legend(fontsize=7)
        drawn.suptitle(
            f"Zero stator frequency at {speed_rpm:g} min⁻¹: what one period of modulation tells "
            "(standard deviation, 20 mA noise)",
            x=0.01, ha="left", fontsize=10,
        )  # fmt: skip
        drawn.savefig(path, dpi=120)
    swing = 0.2 * max(abs(omega), motor.tau_per_s)
    told = {
        "constant": still,
        "modulated": deviations(motor, omega, i_d_A, "speed", swing, 1.3),
        "Rr_unknown": deviations(motor, omega, i_d_A, "speed", swing, 1.3, Rr_known=False),
        "Rr_unknown_flux": deviations(motor, omega, i_d_A, "flux", 0.2, 1.3, Rr_known=False),
    }
    return {
        f"{name}_{k}": v
        for name, numbers in told.items()
        for k, v in dataclasses.asdict(numbers).items()
        if v is not None
    }


def _draw(axes, amplitudes, found, name: str, still: float) -> None:  # type: ignore[no-untyped-def]
    for f_Hz, row in found.items():
        axes.loglog(amplitudes, [getattr(d, name) for d in row], label=f"{f_Hz:g} Hz")
    axes.axhline(still, color="#444444", linestyle="--", label="constant flux")
    axes.set_ylabel(LABELS[name])
    axes.grid(True, alpha=0.3)
