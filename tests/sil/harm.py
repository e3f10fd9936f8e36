"""A run of the atlas' bench with something broken, in the words of the campaign's judge."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Mapping
from typing import Any

from zerohertz import param_list, sim
from zerohertz.atlas.points import BOARD_DEAD_TIME_S, Point
from zerohertz.atlas.simulate import Bench, begin_s, job_of, make_bench
from zerohertz.campaign.faults.judge import RPM, Limits, judge
from zerohertz.campaign.faults.run import maximum_rpm, torque_limit_Nm
from zerohertz.campaign.rig import OVER_PU
from zerohertz.scenario.setup import load_setup

FAULT_S = 1.5


@functools.cache
def recommended() -> Bench:
    return make_bench(load_setup("recommended"))


def point_at(speed_rpm: float, load_pu: float, seed: int, after_s: float) -> Point:
    """Something breaks FAULT_S after the load begins; the run goes on for after_s."""
    known = {"dead_time_s": BOARD_DEAD_TIME_S, "told_dead_time_s": BOARD_DEAD_TIME_S}
    end_s = FAULT_S + 0.02 + after_s
    return Point("", 0, seed, speed_rpm, load_pu, rs_ratio=1.0, loaded_s=end_s, **known)


def fault_at_s(bench: Bench, point: Point) -> float:
    """At any phase of the current."""
    return begin_s(bench, point) + FAULT_S + 0.02 * ((0.381966 * point.seed) % 1.0)


def judged(
    bench: Bench, job: sim.Job, since_s: float, truth: Mapping[str, Any]
) -> tuple[dict[str, Any], sim.Record]:
    """The judge's row; truth: what of the limits is the plant's own."""
    record = sim.run(dataclasses.replace(job, decimate=1))
    known = param_list.defaults() | dict(job.firmware_config) | dict(job.firmware)
    slew_rpm_s = known["speed_slew_rad_s2"] / known["pole_pairs"] / RPM
    limits = Limits(
        over_A=OVER_PU * bench.i_trip_A,
        maximum_rpm=maximum_rpm(known),
        torque_Nm=torque_limit_Nm(known),
        slew_rpm_s=slew_rpm_s,
        J_kg_m2=job.rig_overrides["mechanics.J_kg_m2"],
        friction_Nm=job.rig_overrides["mechanics.coulomb_Nm"],
        **truth,
    )
    return judge(record, limits, since_s), record


def broken(
    fault: Mapping[str, Any],
    speed_rpm: float,
    load_pu: float,
    *,
    seed: int = 1,
    after_s: float = 4.0,
    **firmware: float,
) -> tuple[dict[str, Any], sim.Record]:
    """One run; None in `fault` is the moment at which it breaks."""
    bench = dataclasses.replace(recommended(), firmware=firmware)
    point = point_at(speed_rpm, load_pu, seed, after_s)
    at_s = fault_at_s(bench, point)
    keys = {name: at_s if value is None else value for name, value in fault.items()}
    job = dataclasses.replace(job_of(bench, point), scenario_overrides=keys)
    jam = {"jam_s": keys.get("faults.jam_s", math.inf), "jam_Nm": 100.0}
    return judged(bench, job, at_s, jam)
