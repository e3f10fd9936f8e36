"""The atlas' test bench for single experiments: one job, one judged record.

t = 0 of an experiment is BEGIN_S: by then the drive has done its own start (offsets, a measurement
of Rs, flux) and run up without load. Load torque > 0 opposes positive rotation.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from zerohertz import sim
from zerohertz.drive import State
from zerohertz.scenario.setup import Setup

RIG = sim.HOST_SIM / "rigs" / "atlas.toml"
NAMEPLATE_RS_OHM = 0.930
RR_OHM = 0.50
POLE_PAIRS = 2
RATED_TORQUE_NM = 8.4
RATED_SPEED_RPM = 1710.0
COULOMB_NM = 0.4
RS_RATIOS = (0.67, 0.8, 1.0, 1.25, 1.5)

BEGIN_S = 10.0
_RUN_UP_S = 6.0  # the reference leaves zero; a start takes less
_RUN_UP_RPM_PER_S = 600.0
STARTED_RPM = 30.0
# The load has the shaft, whatever the firmware says.
LOST_RPM = 150.0
IMPRESSED = 2  # column `confidence`: the declared take-over

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
    """What is asked of the drive and done to the bench; times count from BEGIN_S."""

    duration_s: float
    speed_rpm: Points  # the first point is the speed it has run up to
    load_Nm: Points = ((0.0, 0.0),)
    rs_ratio: float = 1.0  # true over nameplate
    rs_drift: Points = ((0.0, 1.0),)  # times that
    decimate: int = 25
    seed: int = 1
    firmware: Mapping[str, float] = dataclasses.field(default_factory=dict)


@dataclasses.dataclass(frozen=True)
class Judged:
    """Numbers of one experiment; limit_rpm decided between held and not."""

    verdict: Verdict
    worst_rpm: float | None  # |w - w*| outside a take-over; None: nothing was outside
    lost_s: float | None  # from BEGIN_S to the loss or the stop
    takeover_pu: float  # share of the time
    flux_angle_worst_deg: float
    f_s_abs_min_Hz: float


def run(setup: Setup, what: Experiment) -> sim.Record:
    """The record from BEGIN_S on is `after`'s; before that the drive starts."""
    first_rpm = what.speed_rpm[0][1]
    run_up = [(0.0, 0.0), (_RUN_UP_S, 0.0)]
    run_up.append((_RUN_UP_S + max(abs(first_rpm), 1.0) / _RUN_UP_RPM_PER_S, first_rpm))
    profiles = {
        "speed_ref_rpm": run_up + _later(what.speed_rpm),
        "load_torque_Nm": [(0.0, 0.0), (BEGIN_S, 0.0), *_later(what.load_Nm)],
        "rs_factor": [(0.0, 1.0), *_later(what.rs_drift)],
    }
    lines = [f"{name} = {_polyline(points)}" for name, points in profiles.items()]
    head = f'[scenario]\nname = "bench"\nduration_s = {BEGIN_S + what.duration_s}\nrun_on_s = 0.1\n'
    return sim.run(
        sim.Job(
            scenario=head + "[profiles]\n" + "\n".join(lines) + "\n",
            rig=RIG,
            board=setup.board,
            motor_dir=setup.motor_dir,
            firmware_config=setup.params,
            firmware=what.firmware,
            rig_overrides={
                **setup.rig_overrides,
                "motor.Rs_ohm": what.rs_ratio * NAMEPLATE_RS_OHM,
            },
            gain=setup.gain,
            seed=what.seed,
            decimate=what.decimate,
        )
    )


def _later(points: Points) -> list[tuple[float, float]]:
    return [(BEGIN_S + t_s, value) for t_s, value in points]


def _polyline(points: Points) -> str:
    return "[" + ", ".join(f"[{t_s:.9g}, {value:.9g}]" for t_s, value in points) + "]"


def window(record: sim.Record, start_s: float, end_s: float = np.inf) -> NDArray[np.bool_]:
    """Rows from start_s to end_s, counted from BEGIN_S."""
    t_s = record.t_s - BEGIN_S
    return (t_s >= start_s) & (t_s <= end_s)


def error_rpm(record: sim.Record) -> NDArray[np.float64]:
    return record["speed_rpm"].astype(np.float64) - record["speed_ref_rpm"]


def impressed(record: sim.Record) -> NDArray[np.bool_]:
    """Rows with a declared take-over; a firmware without a supervisor declares none."""
    declared: Any = record.columns.get("confidence")
    return np.zeros(len(record.t_s), bool) if declared is None else declared == IMPRESSED


def started(record: sim.Record) -> bool:
    """Running, and near the reference, when the experiment begins."""
    before = (record.t_s > BEGIN_S - 0.5) & (record.t_s < BEGIN_S)
    running = record["state"][before] == State.RUN
    return bool(running.any() and running.all()) and bool(
        np.all(np.abs(error_rpm(record)[before]) < STARTED_RPM)
    )


def judge(record: sim.Record, duration_s: float, limit_rpm: float, from_s: float = 0.0) -> Judged:
    """Held: |w - w*| <= limit from from_s on. Lost: beyond LOST_RPM, or no torque, at any time."""
    on = window(record, 0.0)
    t_s = record.t_s[on] - BEGIN_S
    error = np.abs(error_rpm(record))[on]
    declared = impressed(record)[on]
    off = record["gates_on"][on] == 0
    gone = np.flatnonzero((error > LOST_RPM) | off)
    ends_early = len(t_s) == 0 or t_s[-1] < duration_s - 0.1
    watched = (t_s >= from_s) & ~declared
    worst = float(error[watched].max()) if watched.any() else None
    within = bool(np.all(error[watched] <= limit_rpm))
    if not started(record):
        verdict = Verdict.FAILED_START
    elif len(gone) and off[gone[0]] and record.first_fault:
        verdict = Verdict.SAFE_STOP
    elif len(gone) or ends_early:
        verdict = Verdict.LOST
    elif not within:
        verdict = Verdict.OFF_LIMIT
    else:
        verdict = Verdict.TAKEOVER if declared.any() else Verdict.HELD
    return Judged(
        verdict=verdict,
        worst_rpm=worst,
        lost_s=float(t_s[gone[0]]) if len(gone) else None,
        takeover_pu=float(declared.mean()) if len(t_s) else 0.0,
        flux_angle_worst_deg=float(np.abs(record["flux_angle_err_deg"][on]).max(initial=0.0)),
        f_s_abs_min_Hz=float(np.abs(record["f_s_Hz"][on]).min(initial=np.inf)),
    )
