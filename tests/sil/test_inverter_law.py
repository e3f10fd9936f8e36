"""An inverter that obeys another law than the firmware's (FINDINGS A4), voltage from the duty.

The plant's errors fade below THRESHOLDS_A, the firmware's below .25 A; it has 2 us of dead time,
.7 V and .05 ohm that the firmware is not told, and an ADC of 12 bits.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from typing import Any

import pytest
from harm import judged

from zerohertz.atlas.points import Point, standard_map
from zerohertz.atlas.simulate import begin_s, job_of, make_bench
from zerohertz.atlas.variations import VARIATIONS
from zerohertz.campaign.faults.judge import BEFORE, HARMLESS
from zerohertz.scenario.setup import load_setup

THRESHOLDS_A = (0.05, 0.6)
OHM = 0.05
SETUP = load_setup("recommended")
# Where the drive was lost and said nothing: light regeneration next to zero frequency.
LOST = [p for p in standard_map("ii") if (p.speed_rpm, p.load_pu) == (15.0, -0.33)]
BLEND, DUTY = 2.0, 1.0
# Not mended: the shaft runs away from a field that is believed to stand, and the drive is only
# DEGRADED. Threshold, speed, load and Rs of the point.
OPEN = {(0.05, 0.0, 0.33, 0.67)}


def rows(points: Iterable[Point], threshold_A: float, **firmware: float) -> list[dict[str, Any]]:
    twelve_bit = next(v for v in VARIATIONS if v.name == "adc_12_bit")
    law = {"inverter.drop_V": 0.7, "inverter.i_threshold_A": threshold_A}
    told = {"voltage_source": 1.0, "dead_time_s": 0.0} | firmware
    bench = make_bench(SETUP, told, {**twelve_bit.rig, **twelve_bit.board, **law})
    found = []
    for point in points:
        job = job_of(bench, point)
        rig = {**job.rig_overrides, "motor.Rs_ohm": job.rig_overrides["motor.Rs_ohm"] + OHM}
        done = dataclasses.replace(job, rig_overrides=rig)
        found.append(judged(bench, done, begin_s(bench, point), {})[0])
    return found


@pytest.mark.parametrize("source", [BLEND, DUTY], ids=["as_shipped", "duty"])
@pytest.mark.parametrize("threshold_A", THRESHOLDS_A)
def test_no_point_of_the_map_is_lost_without_a_word(threshold_A: float, source: float) -> None:
    points = standard_map("ii")
    verdicts = [row["verdict"] for row in rows(points, threshold_A, voltage_source=source)]
    lost = {
        (threshold_A, point.speed_rpm, point.load_pu, point.rs_ratio)
        for point, verdict in zip(points, verdicts, strict=True)
        if verdict not in (HARMLESS, BEFORE)
    }
    assert lost <= (OPEN if source == DUTY else set())
    assert verdicts.count(HARMLESS) >= 240


@pytest.mark.parametrize("threshold_A", THRESHOLDS_A)
def test_where_it_was_lost_the_word_comes_before_the_harm(threshold_A: float) -> None:
    for row in rows([dataclasses.replace(p, loaded_s=12.0) for p in LOST], threshold_A):
        assert row["verdict"] in (HARMLESS, BEFORE), row
        assert not row["over_current"]


def test_a_load_beyond_the_torque_is_told() -> None:
    """The judge sees a loss where there is one."""
    heavy = [dataclasses.replace(standard_map("ii")[0], speed_rpm=300.0, load_pu=2.5)]
    assert [row["verdict"] for row in rows(heavy, 0.6)] == [BEFORE]
