"""Does it run? A speed step from a quarter to three quarters of rated, then rated load on and off.

The firmware has the table and the parameters that were derived; the rig is the motor that was
identified. HELD: no fault, and at the end of each of the four phases the true speed within 1 % of
rated speed of its reference and the flux angle within 10 degrees.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from zerohertz.commission.folder import BOARD, stored_parameters
from zerohertz.motor import Motor, Nameplate, load_motor
from zerohertz.sim import Job, Record, run

LOW, HIGH = 0.25, 0.75  # of rated speed
SPEED_PU, ANGLE_DEG = 0.01, 10.0
SETTLED_S = 0.5  # judged at the end of each phase
PHASES = ("a quarter of rated speed", "three quarters", "with rated load", "load off")


@dataclass(frozen=True)
class Trial:
    """What was seen; speeds over rated speed, the worst of the four phases."""

    held: bool
    fault: int
    speed_err_pu: float
    angle_err_deg: float
    dip_pu: float  # the load step's
    rise_s: float  # of the speed step, to 90 %
    record: Record

    @property
    def word(self) -> str:
        return "held" if self.held else "NOT HELD"


@dataclass(frozen=True)
class Times:
    """Ends of the four phases."""

    start_s: float
    ends_s: tuple[float, float, float, float]


def times(motor: Motor, parameters: dict[str, float]) -> Times:
    """Room for measuring Rs, building up flux, and the ramps at the slew limit."""
    plate = motor.nameplate
    slew_rpm_s = parameters["speed_slew_rad_s2"] / plate.pole_pairs * 30.0 / math.pi
    ramp_s = plate.speed_rpm / slew_rpm_s
    start = 3.0 * parameters["rs_level_s"] + parameters["premagnetise_s"] + 0.6
    low = start + LOW * ramp_s + 1.5
    high = low + (HIGH - LOW) * ramp_s + 2.0
    return Times(start, (low, high, high + 2.0, high + 4.0))


def run_trial(folder: Path, rig: Path, seed: int = 1, asked: Nameplate | None = None) -> Trial:
    """asked: speed and torque instead of the rated ones."""
    motor, parameters = asked_of(load_motor(folder), asked), stored_parameters(folder)
    at = times(motor, parameters)
    record = run(
        Job(
            scenario=_scenario(motor, at),
            rig=rig,
            board=folder / BOARD,
            motor_dir=folder,
            firmware=parameters,
            seed=seed,
            decimate=5,
        )
    )
    return judge(record, at, motor.nameplate.speed_rpm)


def asked_of(motor: Motor, asked: Nameplate | None) -> Motor:
    return motor if asked is None else dataclasses.replace(motor, nameplate=asked)


def judge(record: Record, at: Times, rated_rpm: float) -> Trial:
    t, speed = record.t_s, record["speed_rpm"]
    target = rated_rpm * np.array([LOW, HIGH, HIGH, HIGH])
    parts = [(t >= end - SETTLED_S) & (t < end) for end in at.ends_s]
    errors = [
        float(np.max(np.abs(speed[part] - rpm))) / rated_rpm
        for part, rpm in zip(parts, target, strict=True)
    ]
    angles = [float(np.max(np.abs(record["flux_angle_err_deg"][part]))) for part in parts]
    loaded = (t >= at.ends_s[1]) & (t < at.ends_s[2])
    rising = (t >= at.ends_s[0]) & (speed >= rated_rpm * (LOW + 0.9 * (HIGH - LOW)))
    worst, angle = max(errors), max(angles)
    return Trial(
        held=record.first_fault == 0 and worst <= SPEED_PU and angle <= ANGLE_DEG,
        fault=record.first_fault,
        speed_err_pu=worst,
        angle_err_deg=angle,
        dip_pu=float(np.max(target[2] - speed[loaded])) / rated_rpm,
        rise_s=float(t[rising][0]) - at.ends_s[0] if rising.any() else math.inf,
        record=record,
    )


def _scenario(motor: Motor, at: Times) -> str:
    rpm, load = motor.nameplate.speed_rpm, motor.nameplate.torque_Nm
    start, (low, high, loaded, end) = at.start_s, at.ends_s
    speed = [[0, 0], [start, 0], [start, LOW * rpm], [low, LOW * rpm], [low, HIGH * rpm]]
    return f"""\
[scenario]
name = "trial"
duration_s = {end}
run_on_s = 0.3
[profiles]
speed_ref_rpm = {speed}
load_torque_Nm = [[0, 0], [{high}, 0], [{high}, {load}], [{loaded}, {load}], [{loaded}, 0]]
"""
