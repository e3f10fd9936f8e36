"""The atlas' test bench for single experiments: one job, one judged record.

Start and t = 0 are those of the maps (simulate.py): the drive has done its own start (offsets, a
measurement of Rs, flux) and run up without load. Load torque > 0 opposes positive rotation.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from zerohertz import sim
from zerohertz.atlas.classes import FAR_RPM, START_CHECK_S, START_ERROR_RPM, Confidence
from zerohertz.atlas.simulate import RIG, RPM_PER_S, RUN_ON_S, SETTLE_S, make_bench
from zerohertz.drive import State
from zerohertz.scenario.setup import Setup

NAMEPLATE_RS_OHM = 0.930
RR_OHM = 0.50
POLE_PAIRS = 2
RATED_TORQUE_NM = 8.4
RATED_SPEED_RPM = 1710.0
COULOMB_NM = 0.4
I_D_A = 5.1  # of the nameplate, and of recommended
RS_RATIOS = (0.67, 0.8, 1.0, 1.25, 1.5)


Points = Sequence[tuple[float, float]]


class Verdict(StrEnum):
    """How an experiment on the bench ended."""

    HELD = "held"
    TAKEOVER = "takeover"  # declared IMPRESSED where it was not within its limit; load not lost
    OFF_LIMIT = "off_limit"  # load not lost, but beyond the limit without a word
    SAFE_STOP = "safe_stop"  # a fault of the firmware, gates off
    LOST = "lost"
    FAILED_START = "failed_start"


@dataclasses.dataclass(frozen=True)
class Experiment:
    """What is asked of the drive and done to the bench; times count from t = 0."""

    duration_s: float
    speed_rpm: Points  # the first point is the speed it has run up to
    load_Nm: Points = ((0.0, 0.0),)
    rs_ratio: float = 1.0  # true over nameplate
    rs_drift: Points = ((0.0, 1.0),)  # times that
    rr_drift: Points = ((0.0, 1.0),)  # times the rig's
    torque_Nm: Points = ()  # torque mode from the first of these on
    servo_Nm_per_turn: float = 0.0  # of the load, until the stator frequency is zero on average
    servo_from_s: float = 0.0
    decimate: int = 25
    seed: int = 1
    firmware: Mapping[str, float] = dataclasses.field(default_factory=dict)


@dataclasses.dataclass(frozen=True)
class Judged:
    """Numbers of one experiment; limit_rpm decided between held and not."""

    verdict: Verdict
    worst_rpm: float | None  # |w - w*| outside a take-over; None: nothing was outside
    lost_s: float | None  # when it was lost or stopped
    takeover_pu: float  # share of the time
    flux_angle_worst_deg: float
    f_s_abs_min_Hz: float


def job(setup: Setup, what: Experiment) -> tuple[sim.Job, float]:
    """The job of an experiment, and when its t = 0 is in the run.

    The firmware is told what it is told on the maps: the nameplate, and no dead time.
    """
    bench = make_bench(setup)
    first_rpm = what.speed_rpm[0][1]
    top_s = bench.run_s + max(0.2, abs(first_rpm) / RPM_PER_S)
    begin_s = top_s + SETTLE_S
    profiles = {
        "speed_ref_rpm": [
            (0.0, 0.0),
            (bench.run_s, 0.0),
            (top_s, first_rpm),
            *_later(begin_s, what.speed_rpm),
        ],
        "load_torque_Nm": [(0.0, 0.0), (begin_s, 0.0), *_later(begin_s, what.load_Nm)],
        "rs_factor": [(0.0, 1.0), *_later(begin_s, what.rs_drift)],
        "rr_factor": [(0.0, 1.0), *_later(begin_s, what.rr_drift)],
    }
    mode = ""
    if what.torque_Nm:
        profiles["torque_ref_Nm"] = _later(begin_s, what.torque_Nm)
        mode = f"torque_mode_on_s = {begin_s + what.torque_Nm[0][0]:.6f}\n"
    lines = [f"{name} = {_polyline(points)}" for name, points in profiles.items()]
    head = (
        f'[scenario]\nname = "bench"\nduration_s = {begin_s + what.duration_s:.6f}\n'
        f"run_on_s = {RUN_ON_S}\n{mode}"
        f"[load]\nservo_Nm_per_turn = {what.servo_Nm_per_turn!r}\n"
        f"servo_from_s = {begin_s + what.servo_from_s:.6f}\n[profiles]\n"
    )
    job = sim.Job(
        scenario=head + "\n".join(lines) + "\n",
        rig=RIG,
        board=setup.board,
        motor_dir=setup.motor_dir,
        firmware_config=bench.params,
        firmware={"dead_time_s": 0.0, **what.firmware},
        rig_overrides={
            **setup.rig_overrides,
            "motor.Rs_ohm": what.rs_ratio * NAMEPLATE_RS_OHM,
        },
        gain=setup.gain,
        seed=what.seed,
        decimate=what.decimate,
    )
    return job, begin_s


def run(setup: Setup, what: Experiment) -> sim.Record:
    """The record with t_s from the beginning of the experiment; rows before it are the start."""
    asked, begin_s = job(setup, what)
    record = sim.run(asked)
    t_s = record.t_s.astype(np.float64) - begin_s
    return dataclasses.replace(record, columns=record.columns | {"t_s": t_s})


def _later(begin_s: float, points: Points) -> list[tuple[float, float]]:
    return [(begin_s + t_s, value) for t_s, value in points]


def _polyline(points: Points) -> str:
    return "[" + ", ".join(f"[{t_s:.9g}, {value:.9g}]" for t_s, value in points) + "]"


def window(record: sim.Record, start_s: float, end_s: float = np.inf) -> NDArray[np.bool_]:
    """Rows from start_s to end_s."""
    return (record.t_s >= start_s) & (record.t_s <= end_s)


def error_rpm(record: sim.Record) -> NDArray[np.float64]:
    return record["speed_rpm"].astype(np.float64) - record["speed_ref_rpm"]


def impressed(record: sim.Record) -> NDArray[np.bool_]:
    """Rows with a declared take-over; a firmware without a supervisor declares none."""
    declared: Any = record.columns.get("confidence")
    return np.zeros(len(record.t_s), bool) if declared is None else declared == Confidence.IMPRESSED


def started(record: sim.Record) -> bool:
    """Running, and near the reference, when the experiment begins."""
    before = (record.t_s < 0.0) & (record.t_s >= -START_CHECK_S)
    running = bool(before.any()) and bool(np.all(record["state"][before] == State.RUN))
    return running and abs(float(error_rpm(record)[before].mean())) < START_ERROR_RPM


def judge(record: sim.Record, duration_s: float, limit_rpm: float, from_s: float = 0.0) -> Judged:
    """Held: |w - w*| <= limit from from_s on. Lost: beyond FAR_RPM, or no torque, at any time."""
    on = window(record, 0.0)
    t_s = record.t_s[on]
    error = np.abs(error_rpm(record))[on]
    declared = impressed(record)[on]
    off = record["gates_on"][on] == 0
    gone = np.flatnonzero((error > FAR_RPM) | off)
    ends_early = len(t_s) == 0 or t_s[-1] < duration_s - 0.1
    watched = (t_s >= from_s) & ~declared
    worst = float(error[watched].max()) if watched.any() else None
    if not started(record):
        verdict = Verdict.FAILED_START
    elif len(gone) and off[gone[0]] and record.first_fault:
        verdict = Verdict.SAFE_STOP
    elif len(gone) or ends_early:
        verdict = Verdict.LOST
    else:
        verdict = _not_lost(error[watched], limit_rpm, declared)
    return Judged(
        verdict=verdict,
        worst_rpm=worst,
        lost_s=float(t_s[gone[0]]) if len(gone) else None,
        takeover_pu=float(declared.mean()) if len(t_s) else 0.0,
        flux_angle_worst_deg=float(np.abs(record["flux_angle_err_deg"][on]).max(initial=0.0)),
        f_s_abs_min_Hz=float(np.abs(record["f_s_Hz"][on]).min(initial=np.inf)),
    )


def _not_lost(
    error_rpm: NDArray[np.float64], limit_rpm: float, declared: NDArray[np.bool_]
) -> Verdict:
    """Of a run with torque to its end: the errors that count, and where a take-over is declared."""
    if not np.all(error_rpm <= limit_rpm):
        return Verdict.OFF_LIMIT
    return Verdict.TAKEOVER if declared.any() else Verdict.HELD
