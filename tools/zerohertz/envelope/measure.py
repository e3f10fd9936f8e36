"""What a run is measured by, from the plant's true numbers. Pure functions of a record.

Windows come from the mission: holds, load steps, ends of ramps, stretches of torque mode. Limits in
min^-1 are the atlas', for two pole pairs; `unit` scales them to the motor's.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from zerohertz import sim
from zerohertz.atlas import classes
from zerohertz.envelope.mission import Change, Hold, Mission, TorqueWindow

Array = npt.NDArray[np.float64]
Span = TypeVar("Span", Hold, Change, TorqueWindow)
RIPPLE_HZ = (1.0, 1000.0)
DIP_S = 2.0
RECOVERED_RPM = 15.0
LEAST_RAMP_RPM = 100.0  # overshoot of less is none of the speed loop's


@dataclasses.dataclass(frozen=True)
class Scale:
    """Of the motor."""

    unit: float  # of speeds
    rated_Nm: float


def rows(record: sim.Record, begin_s: float, end_s: float) -> slice:
    begin, end = np.searchsorted(record.t_s, (begin_s, end_s))
    return slice(int(begin), int(end))


def error_rpm(record: sim.Record, part: slice) -> Array:
    return record["speed_rpm"][part].astype(np.float64) - record["speed_ref_rpm"][part]


def numbers(record: sim.Record, mission: Mission, scale: Scale) -> dict[str, Any]:
    """The row's columns; None where the mission has nothing of the kind."""
    above_s, oriented_s = oriented_time_s(record, mission)
    holds = driven(record, mission.holds)
    means = [mean_error_rpm(record, hold) for hold in holds]
    dips = [dip(record, step, scale.unit) for step in driven(record, mission.load_steps)]
    return {
        "held": held(record, mission, scale.unit),
        "held_s": sum(h.end_s - h.begin_s for h in mission.holds),
        "above_1Hz_s": above_s,
        "oriented_above_1Hz_s": oriented_s,
        "torque_ripple_pu": torque_ripple_pu(record, holds, scale),
        "torque_error_pu": torque_error_pu(record, driven(record, mission.torques), scale),
        "speed_error_rpm": max(map(abs, means), default=None),
        "dip_rpm": max((rpm for rpm, _ in dips), default=None),
        "recovery_s": max((seconds for _, seconds in dips), default=None),
        "overshoot": overshoot(record, driven(record, mission.ramps), scale.unit),
    }


def _driven(record: sim.Record, begin_s: float, end_s: float) -> bool:
    """The record has this stretch, with the gates on."""
    complete = record.t_s[-1] >= end_s - 2.0 * record.period_s
    on = record["gates_on"][rows(record, begin_s, end_s)] > 0
    return bool(complete and len(on) and on.all())


def driven(record: sim.Record, windows: Iterable[Span]) -> list[Span]:
    """Those in which the gates are on: of anything else there is no accuracy."""
    return [window for window in windows if _driven(record, window.begin_s, window.end_s)]


def mean_error_rpm(record: sim.Record, hold: Hold) -> float:
    return float(error_rpm(record, rows(record, hold.begin_s, hold.end_s)).mean())


def held(record: sim.Record, mission: Mission, unit: float) -> bool:
    """Torque on throughout, and in every hold the speed as the atlas asks for it."""
    begin_s = min((h.begin_s for h in mission.holds), default=0.0)
    if not _driven(record, begin_s, mission.end_s):
        return False
    return all(
        _held(error_rpm(record, rows(record, h.begin_s, h.end_s)) / unit) for h in mission.holds
    )


def _held(error: Array) -> bool:
    near = bool(np.all(np.abs(error) <= classes.FAR_RPM))
    steady = abs(float(error.mean())) < classes.MEAN_ERROR_RPM and error.std() < classes.STD_RPM
    return near and bool(steady)


def oriented_time_s(record: sim.Record, mission: Mission) -> tuple[float, float]:
    """Held time above 1 Hz, and how much of it the flux was where the drive thought it."""
    above = oriented = 0
    for window in (*mission.holds, *mission.torques):
        part = rows(record, window.begin_s, window.end_s)
        fast = (np.abs(record["f_s_Hz"][part]) > classes.LOW_FREQUENCY_HZ) & (
            record["gates_on"][part] > 0
        )
        flux = record["lambda_Wb"][part]
        angle = np.abs(record["flux_angle_err_deg"][part]) < classes.ANGLE_DEG
        size = np.abs(record["lambda_hat_Wb"][part] - flux) < classes.FLUX_PU * flux
        above += int(np.count_nonzero(fast))
        oriented += int(np.count_nonzero(fast & angle & size))
    return above * record.period_s, oriented * record.period_s


def torque_ripple_pu(record: sim.Record, holds: Iterable[Hold], scale: Scale) -> float | None:
    """The worst hold's rms of the air-gap torque between 1 Hz and 1 kHz."""
    found = []
    for hold in holds:
        part = rows(record, hold.begin_s, hold.end_s)
        torque = record["torque_Nm"][part].astype(np.float64)
        if len(torque) * record.period_s >= 1.0:
            found.append(band_rms(torque, record.period_s) / scale.rated_Nm)
    return max(found, default=None)


def band_rms(values: Array, step_s: float) -> float:
    """Of what lies inside RIPPLE_HZ; a straight line through the values is taken out first."""
    t = np.arange(len(values), dtype=np.float64)
    values = values - np.polyval(np.polyfit(t, values, 1), t)
    power = np.abs(np.fft.rfft(values)) ** 2
    f = np.fft.rfftfreq(len(values), step_s)
    inside = (f >= RIPPLE_HZ[0]) & (f <= RIPPLE_HZ[1])
    return float(np.sqrt(2.0 * power[inside].sum()) / len(values))


def torque_error_pu(
    record: sim.Record, windows: Iterable[TorqueWindow], scale: Scale
) -> float | None:
    """The worst mean torque against its reference, per rated torque."""
    found = []
    for window in windows:
        torque = record["torque_Nm"][rows(record, window.begin_s, window.end_s)]
        if len(torque):
            mean_Nm = float(torque.mean(dtype=np.float64))
            found.append(abs(mean_Nm - window.torque_Nm) / scale.rated_Nm)
    return max(found, default=None)


def dip(record: sim.Record, step: Change, unit: float) -> tuple[float, float]:
    """Largest error after a load step, and how long until it stays within RECOVERED_RPM."""
    part = rows(record, step.begin_s, step.end_s)
    error = np.abs(error_rpm(record, part))
    far = np.flatnonzero(error > RECOVERED_RPM * unit)
    first = rows(record, step.begin_s, step.begin_s + DIP_S)
    largest = float(np.abs(error_rpm(record, first)).max(initial=0.0))
    return largest, (float(far[-1] + 1) if len(far) else 0.0) * record.period_s


def overshoot(record: sim.Record, ramps: Iterable[Change], unit: float) -> float | None:
    """Beyond the end of a ramp, over its height: the worst."""
    found = []
    for ramp in ramps:
        error = error_rpm(record, rows(record, ramp.begin_s, ramp.end_s))
        if abs(ramp.ramp_rpm) >= LEAST_RAMP_RPM * unit and len(error):
            beyond = float((math.copysign(1.0, ramp.ramp_rpm) * error).max())
            found.append(max(beyond, 0.0) / abs(ramp.ramp_rpm))
    return max(found, default=None)
