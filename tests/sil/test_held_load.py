"""A take-over that holds a load on, and what it says of the speed meanwhile."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from zerohertz import sim
from zerohertz.envelope.run import Sample, planned

JAM_S = 14.0


def held(jam_s: float) -> sim.Record:
    """The .19 kW motor's crossing of zero frequency, where a locked rotor lags by 31 degrees."""
    job = planned(Sample(3271890794).case(294)).job
    faults = {} if math.isinf(jam_s) else {"faults.jam_s": jam_s}
    overrides = dict(job.scenario_overrides) | faults
    return sim.run(dataclasses.replace(job, scenario_overrides=overrides, decimate=5))


def test_a_load_that_is_held_is_not_given_up():
    """It was a false OVER_SPEED, by an estimate that nothing used."""
    record = held(math.inf)
    assert record.first_fault == 0
    assert np.abs(record["speed_rpm"] - record["speed_ref_rpm"])[record.t_s > 10.0].max() < 60.0


def test_a_locked_rotor_that_looks_like_one_that_follows_leaves_the_speed_unknown():
    record = held(JAM_S)
    jammed = record.t_s > JAM_S + 0.5
    assert np.abs(record["speed_rpm"][jammed]).max() < 1.0
    assert np.all((record["speed_unknown"][jammed] == 1) | (record["gates_on"][jammed] == 0))
