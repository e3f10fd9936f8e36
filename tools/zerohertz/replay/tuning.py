"""What replay runs a motor with that brings no gain table: L, K_I and the corner of lag.py.

Chosen on the recording of README.md and on ramps of its machine in simulation, in units of the
motor's own numbers. K_P is 0: p1 is four times the loop's bandwidth, which damps it.
"""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np

from zerohertz.errors import UserError
from zerohertz.gain_design.table import design_table, table_json
from zerohertz.motor import MAX_ENTRIES, STEP_ELEC_PER_MIN, Circuit, Motor, motor_toml
from zerohertz.paths import BUILD
from zerohertz.replay.lag import Tables, static_gain_Wb_A_s
from zerohertz.replay.log import Log

TABLE = "l_gain.json"
KI_MAX = 1e6  # param_list.def: adapt_ki
P1_PU, P1_LOOPS = 1.1, 4.0  # of the stator's own decay a11; of the loop's bandwidth
P2_A, P2_B = 0.87, 2.0
# Shares of rated stator frequency: recordings ripple there, by current and voltage offsets.
LOOP_PU, CORNER_PU = 1.0 / 6.0, 1.0 / 10.0
SLOW_PU = 0.1  # of the largest stator frequency of a log: below, flux is not looked for


@dataclasses.dataclass(frozen=True)
class Tuning:
    """Folder for the SIL library, parameters of the firmware and the lag correction."""

    folder: Path
    overrides: dict[str, float]
    corner_rad_s: float  # 0: the estimate as the drive has it
    least_gain_Wb_A_s: float  # floor of lag.py's static gain


def own_table(motor_dir: Path) -> bool:
    return (_folder(motor_dir) / TABLE).is_file()


def tuning_of(motor: Motor, motor_dir: Path, gain: str, log: Log) -> Tuning:
    """gain: design (here), table (of the motor's method) or zero."""
    if gain != "design":
        enable = {"observer_gain_enable": float(gain == "table")}
        return Tuning(_folder_with_table(motor, motor_dir), enable, 0.0, 0.0)
    designed = _designed(motor)
    folder = _written(designed, "design")
    rated_rad_s = _rated_rad_s(motor)
    tables = Tables.read(motor.circuit, folder / TABLE)
    known = np.array([rated_rad_s])
    static = float(static_gain_Wb_A_s(tables, known, known, rotor_flux_Wb(log, motor.circuit))[0])
    overrides = {
        "observer_gain_enable": 1.0,
        "adapt_kp": 0.0,
        "adapt_ki": min(LOOP_PU * rated_rad_s / static, KI_MAX),
    }
    return Tuning(folder, overrides, CORNER_PU * rated_rad_s, 0.3 * static)


def rotor_flux_Wb(log: Log, circuit: Circuit) -> float:
    """Median over the log, from (u - Rs i)/(j w_s) less the leakage: good to some per cent."""
    turn = np.unwrap(np.angle(log.u_s_V))
    omega_s_rad_s = np.gradient(turn, log.period_s)
    fast = np.abs(omega_s_rad_s) > SLOW_PU * np.max(np.abs(omega_s_rad_s))
    if not np.any(fast):
        raise UserError(f"{log.file}: its voltage does not turn; use --gain table or --gain zero")
    i_s_A, u_s_V = log.i_s_A[fast], log.u_s_V[fast]
    stator_Wb = (u_s_V - circuit.Rs_ohm * i_s_A) / (1j * omega_s_rad_s[fast])
    rotor_Wb = (stator_Wb - circuit.sigma_Ls_H * i_s_A) * circuit.Lr_H / circuit.M_H
    return max(float(np.median(np.abs(rotor_Wb))), 1e-4)


def _rated_rad_s(motor: Motor) -> float:
    return 2.0 * math.pi * motor.nameplate.frequency_Hz


def _designed(motor: Motor) -> Motor:
    p1 = max(P1_PU * motor.circuit.a11_per_s, P1_LOOPS * LOOP_PU * _rated_rad_s(motor))
    design = dataclasses.replace(
        motor.design,
        method="closed_form",
        p1_per_s=-round(p1, 3),
        a=P2_A,
        b=P2_B,
        p1_fast_per_s=None,
        p1_slow_elec_per_min=None,
        p1_fast_elec_per_min=None,
        table_end_elec_per_min=(MAX_ENTRIES - 1) * STEP_ELEC_PER_MIN,
    )
    return dataclasses.replace(motor, design=design)


def _folder(motor_dir: Path) -> Path:
    return motor_dir if motor_dir.is_dir() else motor_dir.parent


def _folder_with_table(motor: Motor, motor_dir: Path) -> Path:
    """`motor_dir` when its table is there, else a copy under build/ with a table just designed."""
    folder = _folder(motor_dir)
    if own_table(motor_dir):
        return folder
    if motor.design.method == "gamma_pr":
        raise UserError(f"{folder / TABLE}: no such file; make it with tools/zh design {folder}")
    return _written(motor, "table")


def _written(motor: Motor, kind: str) -> Path:
    copy = BUILD / "replay" / kind / motor.name
    copy.mkdir(parents=True, exist_ok=True)
    (copy / "motor.toml").write_text(motor_toml(motor), encoding="utf-8")
    table = design_table(motor, certificate=False)
    (copy / TABLE).write_text(table_json(table), encoding="utf-8")
    return copy
