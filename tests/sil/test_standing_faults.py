"""What breaks while the shaft stands or creeps, judged by the plant's true numbers: FINDINGS A7."""

from __future__ import annotations

import numpy as np
import pytest
from harm import broken

from zerohertz.campaign.faults.judge import AFTER, BEFORE, HARMLESS
from zerohertz.drive import Fault

DUTY = {"voltage_source": 1.0}
OPEN_BITS = Fault.OPEN_PHASE | Fault.VOLTAGE_SENSOR | Fault.CURRENT_SENSOR


def open_phase(phase: str) -> dict[str, str | None]:
    return {"faults.open_phase": phase, "faults.open_s": None}


@pytest.mark.parametrize("phase", "uvw")
@pytest.mark.parametrize("load_pu", [0.0, 0.5])
def test_a_phase_opened_at_standstill_is_told_within_200_ms(phase: str, load_pu: float) -> None:
    for seed in range(1, 8):
        row, _ = broken(open_phase(phase), 0.0, load_pu, seed=seed, after_s=1.0)
        assert Fault(row["bits"]) & OPEN_BITS, row
        assert row["word_ms"] < 200.0  # .15 s where the phase lies across a standing field
        assert not row["over_current"]


@pytest.mark.parametrize("phase", "uvw")
@pytest.mark.parametrize("load_pu", [0.0, 0.5])
def test_with_the_voltage_from_the_duty_it_does_no_harm_unsaid(phase: str, load_pu: float) -> None:
    """It is not always told: nothing is asked of a phase across the current of a standing field."""
    for seed in (1, 2, 3):
        row, _ = broken(open_phase(phase), 0.0, load_pu, seed=seed, after_s=10.0, **DUTY)
        assert row["verdict"] in (HARMLESS, BEFORE), row
        assert not row["over_current"]


@pytest.mark.parametrize("speed_rpm", [5.0, 10.0, 20.0, -10.0])
@pytest.mark.parametrize("source", [0.0, 1.0])
@pytest.mark.parametrize("jam_s", [0.0, None])
def test_a_locked_rotor_is_a_stall(speed_rpm: float, source: float, jam_s: float | None) -> None:
    """2 s after the torque has come to its limit; the slow speed loop takes up to 7 s to it."""
    jam = {"faults.jam_s": jam_s}
    row, record = broken(jam, speed_rpm, 0.0, after_s=11.0, voltage_source=source)
    assert Fault(row["bits"]) == Fault.STALL
    limited = float(record.t_s[np.argmax(np.abs(record["i_q_ref_A"]) > 0.95 * 14.9)])
    told_s = float(record.t_s[np.argmax(record["faults"] > 0)])
    assert told_s - limited < 3.0


@pytest.mark.parametrize("speed_rpm", [5.0, 9.0])
@pytest.mark.parametrize("load_pu", [-1.0, 1.0])
def test_a_slow_shaft_under_load_is_none(speed_rpm: float, load_pu: float) -> None:
    row, _ = broken({}, speed_rpm, load_pu, after_s=8.0)
    assert (row["verdict"], row["bits"]) == (HARMLESS, 0)


def drift(A: float, seconds: float) -> dict[str, str | float | None]:
    """Two offsets that part, so that the sum stays."""
    per_s = A / 25.0 / seconds
    at_fault = dict.fromkeys(("faults.start_s", "faults.second.start_s"))
    return at_fault | {
        "faults.sensor": "i_u",
        "faults.kind": "drift",
        "faults.severity": per_s,
        "faults.second.sensor": "i_v",
        "faults.second.kind": "drift",
        "faults.second.severity": -per_s,
    }


@pytest.mark.parametrize("load_pu", [0.0, 0.5, 1.0])
def test_offsets_that_part_do_no_harm_unsaid(load_pu: float) -> None:
    """1 to 3 A within 24 s, at 9 min^-1, with line-voltage sensors. At full load the word comes up
    to 79 ms after the harm begins, of 100 that count as said."""
    for end_A in (1.0, 2.0, 3.0):
        row, _ = broken(drift(end_A, 24.0), 9.0, load_pu, after_s=24.0)
        assert row["verdict"] in (HARMLESS, BEFORE, AFTER), row
        assert not row["over_current"]
