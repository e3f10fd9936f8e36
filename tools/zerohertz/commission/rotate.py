"""Inertia and friction of the free shaft: by the firmware's own speed, torque current and flux.

Up a ramp the torque is J a + friction, down the same ramp -J a + friction: difference and mean. The
ramp is slow enough for a first inertia that is wrong by several times; with what it gives the same
is done once more.
"""

from __future__ import annotations

import dataclasses
import math
import tempfile
from pathlib import Path

import numpy as np

from zerohertz.commission.board import Board
from zerohertz.commission.folder import BOARD, store, stored_parameters
from zerohertz.commission.plate import Plate
from zerohertz.commission.run import inertia_kg_m2
from zerohertz.commission.solve import Identified
from zerohertz.commission.trial import Times
from zerohertz.errors import UserError
from zerohertz.gain_design.command import JSON_NAME
from zerohertz.gain_design.table import design_table, table_json
from zerohertz.motor import load_motor
from zerohertz.sim import Job, Record, run

LOW, HIGH = 0.3, 0.6  # of rated speed: the ramps go between
INNER = 0.25  # of the ramp at either end that is left out: the speed controller swings in
TORQUE_PU = 0.2  # of rated torque, for the inertia that is assumed
ROUNDS = 2


@dataclasses.dataclass(frozen=True)
class Mechanics:
    """Of motor and whatever turns with it."""

    J_kg_m2: float
    friction_Nm: float


def find_mechanics(
    rig: Path, found: Identified, plate: Plate, board: Board | None = None, seed: int = 1
) -> Mechanics:
    """Turns the motor: nobody near the shaft. UserError when it does not run."""
    J_kg_m2 = inertia_kg_m2(dataclasses.replace(plate, J_kg_m2=None))
    for _ in range(ROUNDS):
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            store(folder, "turning", found, dataclasses.replace(plate, J_kg_m2=J_kg_m2), board)
            seen = _turn(folder, rig, found, plate, J_kg_m2, seed)
        J_kg_m2 = seen.J_kg_m2
    return seen


def _turn(
    folder: Path, rig: Path, found: Identified, plate: Plate, J_kg_m2: float, seed: int
) -> Mechanics:
    table = design_table(load_motor(folder), certificate=False)
    (folder / JSON_NAME).write_text(table_json(table), encoding="utf-8")
    parameters = stored_parameters(folder)
    slew = TORQUE_PU * plate.torque_Nm / J_kg_m2  # mechanical, rad/s^2
    parameters["speed_slew_rad_s2"] = slew * plate.pole_pairs
    ramp_s = (HIGH - LOW) * _rad_s(plate.speed_rpm) / slew
    start = 2.0 * parameters["rs_level_s"] + parameters["premagnetise_s"] + 0.6
    up = start + 2.0 * LOW / (HIGH - LOW) * ramp_s + 2.0
    # Twice the time: an inertia beyond the guess takes more torque than there is.
    down = up + 2.0 * ramp_s + 2.0
    at = Times(start, (up, down, down + 2.0 * ramp_s + 2.0, 0.0))
    record = run(
        Job(
            scenario=_scenario(plate, at),
            rig=rig,
            board=folder / BOARD,
            motor_dir=folder,
            firmware=parameters,
            seed=seed,
            decimate=5,
        )
    )
    if record.first_fault:
        raise UserError(f"turning: the drive tripped, fault bits {record.first_fault:#x}")
    return mechanics_of(record, at, found, plate)


def mechanics_of(record: Record, at: Times, found: Identified, plate: Plate) -> Mechanics:
    """From the two ramps; signals are those that the firmware itself has."""
    up_Nm, up = _ramp(record, at.ends_s[0], at.ends_s[1], found, plate)
    down_Nm, down = _ramp(record, at.ends_s[1], at.ends_s[2], found, plate)
    J_kg_m2 = (up_Nm - down_Nm) / (up - down)
    if not 0.0 < J_kg_m2 < 1e3:
        raise UserError(f"turning: an inertia of {J_kg_m2:.3g} kg m2 is none; is the shaft free?")
    return Mechanics(J_kg_m2, up_Nm - J_kg_m2 * up)


def _ramp(
    record: Record, begin_s: float, end_s: float, found: Identified, plate: Plate
) -> tuple[float, float]:
    """Mean torque and acceleration (rad/s^2) in the middle of the speed range."""
    t, speed = record.t_s, _rad_s(record["speed_hat_rpm"])
    rated = _rad_s(plate.speed_rpm)
    margin = INNER * (HIGH - LOW)
    inside = (t >= begin_s) & (t < end_s)
    inside &= (speed > (LOW + margin) * rated) & (speed < (HIGH - margin) * rated)
    if np.count_nonzero(inside) < 10:
        raise UserError("turning: the speed does not follow its ramp; is the shaft free?")
    c = found.circuit
    flux_Wb = c.M_H * record["i_d_A"][inside]
    torque_Nm = plate.pole_pairs * c.M_H / c.Lr_H * flux_Wb * record["i_q_A"][inside]
    slope = np.polyfit(t[inside], speed[inside], 1)[0]
    return float(np.mean(torque_Nm)), float(slope)


def _rad_s(rpm):
    return rpm * math.pi / 30.0


def _scenario(plate: Plate, at: Times) -> str:
    low, high = LOW * plate.speed_rpm, HIGH * plate.speed_rpm
    start, (up, down, end, _) = at.start_s, at.ends_s
    speed = [[0, 0], [start, 0], [start, low], [up, low], [up, high], [down, high], [down, low]]
    return f"""\
[scenario]
name = "turning"
duration_s = {end}
run_on_s = 0.3
[profiles]
speed_ref_rpm = {speed}
"""
