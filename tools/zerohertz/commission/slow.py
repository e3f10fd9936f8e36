"""Does it run slowly? What a commissioned motor has to hold next to zero stator frequency.

Rated load both ways at 5 % and 2 % of rated speed; 3 % with rated load driving while Rs rises by
20 % in a minute; slow crossings of zero speed under rated load, driving and braking. HELD: no
fault, and the true speed within 1 % of rated speed of its reference, at the end of each load and
all through the drift and a crossing. A declared take-over that stays within that holds.
"""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np

from zerohertz.commission.folder import BOARD, stored_parameters
from zerohertz.commission.trial import asked_of, times
from zerohertz.motor import Nameplate, load_motor
from zerohertz.sim import Job, Record, run

SPEED_PU = 0.01
UP_S, SETTLE_S, HOLD_S, JUDGED_S = 1.0, 2.0, 5.0, 1.0
LOAD_S = 4.0  # from nothing to rated load: a shaft without a load's inertia is no flywheel
DRIFT_S, DRIFT = 60.0, 1.2
CROSSING_S, CROSSING_PU = 24.0, 0.05
IMPRESSED = 2  # of the record's column confidence

Points = list[list[float]]


@dataclasses.dataclass(frozen=True)
class Mission:
    """Profiles over time from the end of premagnetisation; judged are windows of time."""

    name: str
    speed_pu: Points
    load_pu: Points
    rs_factor: Points
    judged: tuple[tuple[float, float], ...]

    @property
    def duration_s(self) -> float:
        return self.judged[-1][1]

    @property
    def slowest_pu(self) -> float:
        """Under load: 0 where it crosses zero."""
        speeds = [speed for _, speed in self.speed_pu[1:]]
        return max(min(speeds), 0.0)


@dataclasses.dataclass(frozen=True)
class Seen:
    """A mission run; speed over rated speed, the worst of what is judged."""

    mission: str
    held: bool
    fault: int
    speed_err_pu: float
    angle_err_deg: float
    takeover: bool

    @property
    def word(self) -> str:
        if not self.held:
            return f"NOT HELD ({self.fault:#x})" if self.fault else "NOT HELD"
        return "take-over" if self.takeover else "held"


def _loads(speed_pu: float) -> Mission:
    """Rated load, then as much the other way."""
    begin = UP_S + SETTLE_S
    full, back = begin + LOAD_S, begin + LOAD_S + HOLD_S
    other = back + 2.0 * LOAD_S
    return Mission(
        f"{100.0 * speed_pu:.0f} %",
        [[0.0, 0.0], [UP_S, speed_pu]],
        [[begin, 0.0], [full, 1.0], [back, 1.0], [other, -1.0]],
        [[0.0, 1.0]],
        tuple((end - JUDGED_S, end) for end in (back, other + HOLD_S)),
    )


def _drift() -> Mission:
    begin = UP_S + SETTLE_S
    warm = begin + LOAD_S + SETTLE_S
    return Mission(
        "3 %, Rs drifts",
        [[0.0, 0.0], [UP_S, 0.03]],
        [[begin, 0.0], [begin + LOAD_S, -1.0]],
        [[warm, 1.0], [warm + DRIFT_S, DRIFT]],
        ((warm, warm + DRIFT_S + SETTLE_S),),
    )


def _crossing(load_pu: float) -> Mission:
    begin = UP_S + SETTLE_S
    start = begin + LOAD_S + SETTLE_S
    end = start + CROSSING_S
    return Mission(
        f"crossing, {100.0 * load_pu:+.0f} %",
        [[0.0, 0.0], [UP_S, CROSSING_PU], [start, CROSSING_PU], [end, -CROSSING_PU]],
        [[begin, 0.0], [begin + LOAD_S, load_pu]],
        [[0.0, 1.0]],
        ((start, end + HOLD_S),),
    )


MISSIONS = (_loads(0.05), _loads(0.02), _drift(), _crossing(-1.0), _crossing(1.0))


def run_slow(
    folder: Path,
    rig: Path,
    seed: int = 1,
    asked: Nameplate | None = None,
    slowest_pu: float = 0.0,
) -> tuple[Seen, ...]:
    """Every mission that goes no slower than that, in a run of its own."""
    motor, parameters = asked_of(load_motor(folder), asked), stored_parameters(folder)
    start_s = times(motor, parameters).start_s
    seen = []
    for mission in (m for m in MISSIONS if m.slowest_pu >= slowest_pu):
        record = run(
            Job(
                scenario=_scenario(mission, motor.nameplate, start_s),
                rig=rig,
                board=folder / BOARD,
                motor_dir=folder,
                firmware=parameters,
                seed=seed,
                decimate=5,
            )
        )
        seen.append(judge(record, mission, start_s, motor.nameplate.speed_rpm))
    return tuple(seen)


def judge(record: Record, mission: Mission, start_s: float, rated_rpm: float) -> Seen:
    since_s = record.t_s - start_s
    judged = np.zeros(len(since_s), dtype=bool)
    for begin_s, end_s in mission.judged:
        judged |= (since_s >= begin_s) & (since_s < end_s)
    off_pu = np.abs(record["speed_rpm"] - record["speed_ref_rpm"])[judged] / rated_rpm
    complete = bool(since_s[-1] >= mission.duration_s - JUDGED_S)
    worst_pu = float(np.max(off_pu)) if len(off_pu) else np.inf
    angles = np.abs(record["flux_angle_err_deg"])[judged]
    return Seen(
        mission=mission.name,
        held=complete and record.first_fault == 0 and worst_pu <= SPEED_PU,
        fault=record.first_fault,
        speed_err_pu=worst_pu,
        angle_err_deg=float(np.max(angles)) if len(angles) else np.inf,
        takeover=bool(np.any(record["confidence"] >= IMPRESSED)),
    )


def _scenario(mission: Mission, plate: Nameplate, start_s: float) -> str:
    def later(points: Points, scale: float) -> Points:
        return [[round(start_s + t_s, 6), scale * value] for t_s, value in points]

    return f"""\
[scenario]
name = "slow"
duration_s = {start_s + mission.duration_s}
run_on_s = 0.3
[profiles]
speed_ref_rpm = {[[0.0, 0.0], *later(mission.speed_pu, plate.speed_rpm)]}
load_torque_Nm = {[[0.0, 0.0], *later(mission.load_pu, plate.torque_Nm)]}
rs_factor = {[[0.0, 1.0], *later(mission.rs_factor, 1.0)]}
"""
