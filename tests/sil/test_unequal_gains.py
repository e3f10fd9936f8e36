"""Sensors whose gains differ by as much as a percent each, in the closed loop."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from harm import point_at, recommended

from zerohertz import sim
from zerohertz.atlas.simulate import job_of

SENSORS, DUTY = 0.0, 1.0
EQUAL = {"sensors.voltage_gain": [1.0, 1.0], "sensors.current_gain": [1.0, 1.0, 1.0]}
LINES = EQUAL | {"sensors.voltage_gain": [1.01, 0.99]}
PHASES = EQUAL | {"sensors.current_gain": [1.01, 0.99, 1.0]}
SETTLED_S = 8.0


def swing_Nm(speed_rpm: float, source: float, gains: dict[str, list[float]], track: float) -> float:
    """Rms of the torque about its mean in the last 2 s, at half of the rated torque."""
    firmware = {"voltage_source": source, "offset_track": track}
    bench = dataclasses.replace(recommended(), firmware=firmware)
    job = job_of(bench, point_at(speed_rpm, 0.5, 1, SETTLED_S))
    job = dataclasses.replace(job, decimate=1, rig_overrides={**job.rig_overrides, **gains})
    record = sim.run(job)
    assert record["gates_on"][-1]
    return float(np.std(record["torque_Nm"][record.t_s > record.t_s[-1] - 2.0]))


@pytest.mark.parametrize("gains", [LINES, PHASES], ids=["lines", "phases"])
@pytest.mark.parametrize("speed_rpm", [-150.0, 300.0, 1200.0])
def test_followed_they_hardly_swing_the_torque(
    speed_rpm: float, gains: dict[str, list[float]]
) -> None:
    source = SENSORS if gains is LINES else DUTY
    still_Nm = swing_Nm(speed_rpm, source, EQUAL, 0.0)
    blind_Nm = swing_Nm(speed_rpm, source, gains, 0.0)
    assert blind_Nm > still_Nm + 0.05
    assert swing_Nm(speed_rpm, source, gains, 1.0) < still_Nm + 0.1 * (blind_Nm - still_Nm)
