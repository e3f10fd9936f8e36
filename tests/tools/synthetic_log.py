"""A log of a machine that exists only as equations: what replay is tested on.

Shares no code with the firmware or the plant: stator and rotor flux as states, Runge-Kutta in
double precision, speed prescribed, voltage a sine whose frequency follows the speed and a slip.
"""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np

COLUMNS = ("t_s", "ialpha_A", "ibeta_A", "valpha_V", "vbeta_V", "omega_el_meas_rad_s")


@dataclasses.dataclass(frozen=True)
class Machine:
    Rs_ohm: float
    Rr_ohm: float
    Ls_H: float
    Lr_H: float
    M_H: float


# Table 1 of Hasegawa (2005).
TABLE_1 = Machine(Rs_ohm=0.93, Rr_ohm=0.50, Ls_H=0.110, Lr_H=0.102, M_H=0.102)
# data/im_bench/motor.toml
IM_BENCH = Machine(Rs_ohm=0.0697, Rr_ohm=0.03471, Ls_H=2.77e-3, Lr_H=2.77e-3, M_H=2.66e-3)


@dataclasses.dataclass(frozen=True)
class Recording:
    t_s: np.ndarray
    i_s_A: np.ndarray  # complex, power invariant, like u_s_V
    u_s_V: np.ndarray
    omega_e_rad_s: np.ndarray


def record(
    machine: Machine = TABLE_1,
    *,
    duration_s: float = 1.5,
    period_s: float = 200e-6,
    omega_e_rad_s: tuple[float, float] = (180.0, 195.0),
    move_s: float = 0.05,
    slip_rad_s: float = 5.0,
    flux_Wb: float = 0.45,
) -> Recording:
    """Runs 1 s unrecorded until flux stands, then `duration_s` with the speed moving once."""
    before_s, substeps = 1.0, 4
    step_s = period_s / substeps
    rows = round((before_s + duration_s) / period_s) + 1
    det = machine.Ls_H * machine.Lr_H - machine.M_H**2

    def speed(t_s: float) -> float:
        # Half way through, within move_s, from the first speed to the second.
        share = min(max((t_s - before_s - 0.5 * duration_s) / move_s, 0.0), 1.0)
        return omega_e_rad_s[0] + share * (omega_e_rad_s[1] - omega_e_rad_s[0])

    def voltage(angle_rad: float, t_s: float) -> complex:
        # Amplitude for about the wanted flux: u = j w_s lambda, with room for Rs and leakage.
        return (
            (speed(t_s) + slip_rad_s)
            * flux_Wb
            * 1.15
            * complex(math.cos(angle_rad), math.sin(angle_rad))
        )

    def currents(x: np.ndarray) -> tuple[complex, complex]:
        i_s = (machine.Lr_H * x[0] - machine.M_H * x[1]) / det
        i_r = (machine.Ls_H * x[1] - machine.M_H * x[0]) / det
        return i_s, i_r

    def rate(x: np.ndarray, t_s: float) -> np.ndarray:
        i_s, i_r = currents(x)
        omega_s = speed(t_s) + slip_rad_s
        return np.array(
            [
                voltage(x[2].real, t_s) - machine.Rs_ohm * i_s,
                1j * speed(t_s) * x[1] - machine.Rr_ohm * i_r,
                omega_s,
            ]
        )

    x = np.zeros(3, dtype=complex)
    out = np.zeros((rows, 4), dtype=complex)
    for k in range(rows):
        t_s = k * period_s
        out[k] = (t_s, currents(x)[0], voltage(x[2].real, t_s), speed(t_s))
        for j in range(substeps):
            x = _runge_kutta(rate, x, t_s + j * step_s, step_s)
    kept = out[round(before_s / period_s) :]
    t_s = kept[:, 0].real
    return Recording(t_s - t_s[0], kept[:, 1], kept[:, 2], kept[:, 3].real)


def write_csv(file: Path, recording: Recording, scaling: str = "amplitude") -> Path:
    """The recording in the default columns."""
    factor = math.sqrt(2.0 / 3.0) if scaling == "amplitude" else 1.0
    table = np.column_stack(
        [
            recording.t_s,
            factor * recording.i_s_A.real,
            factor * recording.i_s_A.imag,
            factor * recording.u_s_V.real,
            factor * recording.u_s_V.imag,
            recording.omega_e_rad_s,
        ]
    )
    np.savetxt(file, table, fmt="%.9g", delimiter=",", header=",".join(COLUMNS), comments="")
    return file


def _runge_kutta(rate, x: np.ndarray, t_s: float, step_s: float) -> np.ndarray:
    k1 = rate(x, t_s)
    k2 = rate(x + 0.5 * step_s * k1, t_s + 0.5 * step_s)
    k3 = rate(x + 0.5 * step_s * k2, t_s + 0.5 * step_s)
    k4 = rate(x + step_s * k3, t_s + step_s)
    return x + step_s / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
