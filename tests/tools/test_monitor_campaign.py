"""`zh campaign monitor`: its cases, its verdicts, and a sample of both."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from zerohertz import sim
from zerohertz.atlas.run import RunOptions
from zerohertz.atlas.simulate import Bench, make_bench
from zerohertz.campaign import monitor, monitor_cases, monitor_quiet, monitor_run
from zerohertz.campaign.rig import FIRMWARE, bit_names
from zerohertz.drive import Fault, State
from zerohertz.scenario.setup import load_setup

CASE = monitor_cases.groups()["sensor"][0]


@pytest.fixture(scope="module")
def bench() -> Bench:
    return make_bench(load_setup(monitor.CONFIG))


def test_there_are_504_sensor_cases_and_none_twice() -> None:
    cases = monitor_cases.groups()["sensor"]
    assert len(cases) == 6 * 7 * 12 == 504
    assert len({(c.what, c.kind, c.speed_rpm, c.load_pu) for c in cases}) == 504
    assert set(monitor_cases.SEVERITY) == {c.kind for c in cases}
    loads = [load for speed, load in monitor_cases.OPERATING_POINTS if speed > 0]
    assert min(loads) == -1.0
    assert max(loads) == 1.0
    assert any(speed == 0.0 for speed, _ in monitor_cases.OPERATING_POINTS)


def record(**changed: Any) -> sim.Record:
    """A run in which nothing happens, every 200 us from 1.4 s before t = 0 to its end."""
    t_s = np.arange(-1.4, CASE.loaded_s, 2e-4)
    columns: dict[str, Any] = dict.fromkeys(
        ("speed_rpm", "speed_ref_rpm", "faults", "confidence", "i_abs_A", "i_peak_A"), 0.0
    ) | {"state": 4.0, "gates_on": 1.0, "u_dc_V": 283.0, "t_s": t_s}
    for name, value in changed.items():
        columns[name] = value(t_s - CASE.fault_s) if callable(value) else value
    arrays = {n: np.broadcast_to(v, t_s.shape).astype(np.float32) for n, v in columns.items()}
    return sim.Record(arrays, len(t_s), 2e-4, sim.Trip(0), None, 0, None, 0.0, 0.0, 0.0)


def verdict(**changed: Any) -> str:
    return str(monitor_run.judge(CASE, record(**changed), 0.0)["verdict"])


def pulse(value: float, length_s: float) -> Any:
    return lambda t_s: np.where((t_s > 1.0) & (t_s < 1.0 + length_s), value, 0.0)


def test_a_run_in_which_nothing_happens_is_harmless() -> None:
    assert verdict() == "harmless"


def test_a_current_beyond_the_limit_fails_after_two_periods_whatever_is_said() -> None:
    said = {"faults": lambda t_s: np.where(t_s > 1.0, 1.0, 0.0)}
    assert verdict(i_peak_A=pulse(23.0, 4.1e-4), **said) == "detected"
    assert verdict(i_peak_A=pulse(23.0, 7e-4), **said) == "FAILED"


def test_nothing_said_fails_when_speed_or_current_is_wrong() -> None:
    assert verdict(speed_rpm=pulse(160.0, 0.05)) == "harmless"
    assert verdict(speed_rpm=pulse(160.0, 0.2)) == "FAILED"
    assert verdict(speed_rpm=lambda t_s: np.where(t_s > 2.5, 40.0, 0.0)) == "FAILED"
    assert verdict(i_abs_A=pulse(17.0, 0.01)) == "FAILED"
    assert verdict(state=lambda t_s: np.where(t_s > 1.0, 8.0, 4.0)) == "FAILED"


def test_warnings_and_a_fault_before_its_time_count_for_nothing() -> None:
    warned = {"faults": lambda t_s: np.where(t_s > 0.0, float(1 << 22), 0.0)}
    assert verdict(**warned) == "harmless"
    assert verdict(**warned, speed_rpm=pulse(160.0, 0.2)) == "FAILED"
    assert verdict(faults=lambda t_s: np.where(t_s > -0.1, 1.0, 0.0)) == "FAILED"


def test_a_lasting_take_over_is_declared_and_a_passing_one_is_not() -> None:
    lost = {"speed_rpm": pulse(160.0, 0.2)}
    assert verdict(confidence=lambda t_s: np.where(t_s > 1.0, 2.0, 0.0), **lost) == "detected"
    assert verdict(confidence=pulse(2.0, 0.5), **lost) == "FAILED"


def test_a_sag_has_to_be_ridden_through() -> None:
    sag = monitor_cases.groups()["sag"][0]
    tripped = record(faults=lambda t_s: np.where(t_s > 0.5, 4.0, 0.0))
    assert monitor_run.judge(sag, record(), 0.0)["verdict"] == "harmless"
    assert monitor_run.judge(sag, tripped, 0.0)["verdict"] == "FAILED"


def test_the_delay_is_that_of_the_first_fault() -> None:
    row = monitor_run.judge(CASE, record(faults=lambda t_s: np.where(t_s > 0.25, 33.0, 0.0)), 0.0)
    assert row["delay_s"] == pytest.approx(0.25, abs=3e-4)
    assert bit_names(row["bits"]) == "OVER_CURRENT CURRENT_SUM"


def test_a_sample_of_every_group_is_noticed_or_harmless(bench: Bench, tmp_path: Path) -> None:
    rows = {
        name: [monitor_run.run_case(bench, c) for c in monitor.sampled(cases, 6, 2005)]
        for name, cases in monitor_cases.groups().items()
    }
    failed = [row for group in rows.values() for row in group if row["verdict"] == "FAILED"]
    assert not failed
    assert max(row["over_periods"] for group in rows.values() for row in group) <= 2
    assert any(row["verdict"] == "detected" for row in rows["sensor"])
    assert all(row["verdict"] == "detected" for row in rows["short"] + rows["open_phase"])
    page = monitor.page_text(monitor.Result(rows, None), "a command")
    assert "6 cases" in page
    assert "a command" in page
    assert "None." in page


def test_without_its_detectors_the_same_drive_fails(bench: Bench) -> None:
    """The negative control: what the campaign can see of a firmware that does not look."""
    off = {"voltage_check_V": 0.0, "open_phase_A": 0.0, "current_sum_max_A": 6.0}
    blind = dataclasses.replace(bench, firmware={**bench.firmware, **off})
    cases = [
        c
        for c in monitor_cases.groups()["sensor"]
        if (c.what, c.kind) in {("u_dc", "gain"), ("i_u", "gain")} and c.speed_rpm >= 60.0
    ]
    assert any(monitor_run.run_case(blind, case)["verdict"] == "FAILED" for case in cases)


@pytest.mark.parametrize("config", ["paper", "recommended", "no_gain"])
def test_exchanged_current_sensors_have_a_name_before_anything_trips(config: str) -> None:
    bench = make_bench(load_setup(config))
    cases = monitor_cases.groups()[monitor_cases.AT_START]
    currents = {c.what: c for c in cases if c.what.startswith("i_")}
    for case in currents.values():
        row = monitor_run.run_case(bench, case)
        assert bit_names(row["bits"]) == "CURRENT_SENSOR", row
        assert row["peak_A"] < bench.i_trip_A


RESTART = """
[scenario]
name = "restart"
duration_s = 7.3
run_on_s = 0.1
run_off_s = 6.9
torque_off_s = 6.9
torque_off_end_s = 6.901
run_again_s = {again_s}
[profiles]
speed_ref_rpm = [[0.0, 0.0], [5.0, 0.0], [6.0, {speed_rpm}]]
"""


@pytest.mark.parametrize("config", ["paper", "recommended"])
@pytest.mark.parametrize("speed_rpm", [1500, 900, -1500])
def test_a_motor_that_turns_at_its_start_has_no_exchanged_sensors(
    config: str, speed_rpm: float
) -> None:
    """Flux of before makes more current than the trip allows; it is no mirror image for long."""
    setup = load_setup(config)
    largest_A = 0.0
    for away_s in (0.01, 0.03, 0.05, 0.1):
        record = sim.run(
            sim.Job(
                scenario=RESTART.format(again_s=6.9 + away_s, speed_rpm=speed_rpm),
                rig=setup.rig,
                board=setup.board,
                motor_dir=setup.motor_dir,
                firmware_config=setup.params,
            )
        )
        restarted = (record.t_s > 6.9) & (record["state"] == State.PREMAGNETISE)
        assert restarted.any()
        largest_A = max(largest_A, float(record["i_abs_A"][restarted].max()))
        said = int(np.bitwise_or.reduce(record["faults"].astype(np.int64)))
        assert Fault.CURRENT_SENSOR not in Fault(said)
    assert largest_A > 15.0  # 1.4 times overload_motor_A: a hard start


@pytest.mark.parametrize("seed", [162, 781])
def test_a_load_that_ran_away_in_the_wedge_is_held(seed: int) -> None:
    """With nobody looking: they went to 3000 min^-1 before Rs was tracked on slow ramps."""
    usual = monitor_quiet.job(load_setup(monitor.CONFIG), seed)
    blind = dataclasses.replace(
        usual,
        rig_overrides={**usual.rig_overrides, "inverter.model": "averaged"},
        firmware={**FIRMWARE, "observer_e1_A": 0.0},
        guard_recorded=True,
    )
    record = sim.run(blind)
    assert record.first_fault == 0
    assert float(np.abs(record["speed_rpm"]).max()) < 500.0


def test_rows_are_stored_and_the_quiet_hours_are_quiet(tmp_path: Path) -> None:
    def bar(_text: str, _total: int) -> Any:
        import contextlib

        return contextlib.nullcontext(lambda _done: None)

    told: list[str] = []
    how = RunOptions(tmp_path, workers=1)
    result = monitor.run_all(0.05, 2, 1, how, told.append, bar)
    assert result.good
    assert result.quiet is not None
    assert result.quiet["held"] > 0
    again = monitor.run_all(0.0, 2, 1, how, told.append, bar)
    assert again.rows == result.rows
    assert again.quiet is None
    assert any("2 of 2 points are stored" in line for line in told)


def test_an_alarm_in_a_mission_that_is_held_is_a_false_one() -> None:
    missions = [
        monitor_quiet.Quiet(1, True, 10.0, 0),
        monitor_quiet.Quiet(2, True, 10.0, 1 << 17),
        monitor_quiet.Quiet(3, False, 10.0, 1 << 13),
    ]
    summary = monitor_quiet.summary(missions)
    assert summary["false_alarms"] == 1
    assert summary["alarms_not_held"] == 1
    quiet = monitor_quiet.summary(missions[:1])
    assert monitor.Result({}, quiet).good
    assert not monitor.Result({}, summary).good


def test_a_speed_that_is_often_unknown_is_not_good() -> None:
    known = monitor_quiet.Quiet(1, True, 10.0, 0, "averaged, duty", 5.0, 0.05)
    lost = dataclasses.replace(known, unknown_s=0.051)
    not_held = dataclasses.replace(known, held=False, unknown_s=5.0)
    assert monitor.Result({}, monitor_quiet.summary([known, not_held])).good
    summary = monitor_quiet.summary([lost])
    assert summary["plants"]["averaged, duty"]["unknown_share"] == pytest.approx(0.0102)
    assert not monitor.Result({}, summary).good


def test_a_torque_that_swings_before_the_word_is_the_laws_doing() -> None:
    calm = record(torque_Nm=8.4)
    swing = record(torque_Nm=lambda t_s: 15.0 * np.sign(np.sin(40.0 * t_s)))
    told = calm.t_s > 3.0
    assert not monitor_quiet.swings_before(calm, told)
    assert monitor_quiet.swings_before(swing, told)
    assert not monitor_quiet.swings_before(swing, np.zeros(len(told), bool))


def test_the_quiet_hours_meet_both_inverters_and_both_voltages() -> None:
    setup = load_setup(monitor.CONFIG)
    jobs = [monitor_quiet.job(setup, seed) for seed in range(1, 5)]
    made = {(j.rig_overrides["inverter.model"], j.firmware.get("voltage_source")) for j in jobs}
    assert made == {(m, source) for m in ("averaged", "switched") for source in (None, 1)}
    assert {monitor_quiet.mission((setup, seed)).plant for seed in range(1, 5)} == {
        "averaged, sensors",
        "averaged, duty",
        "switched, sensors",
        "switched, duty",
    }
