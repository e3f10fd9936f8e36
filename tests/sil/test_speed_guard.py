"""The guard of the speed in the closed loop: what it finds, and how soon (A2, A3, A7, A8)."""

from __future__ import annotations

import math

import numpy as np
import pytest
from small_plant import simulate

from zerohertz.drive import Drive, Fault, State
from zerohertz.errors import UserError
from zerohertz.modes import cases
from zerohertz.paths import ROOT
from zerohertz.scenario.setup import load_setup
from zerohertz.sim import Record

LINK = {"dc_link.capacitance_F": 1e-3}
LOAD_S = 7.0


def fault_s(record: Record, bits: Fault) -> float:
    """When one of these bits is latched first; inf: never. Bits above 2^23 of a float32 column."""
    told = (record["faults"].astype(np.uint64).astype(np.uint32) & np.uint32(bits)) != 0
    return float(record.t_s[np.argmax(told)]) if told.any() else math.inf


def away_s(record: Record, rpm: float = 85.5) -> float:
    """When the true speed leaves its ramped reference by more than this, under load."""
    after = record.t_s > LOAD_S
    away = after & (np.abs(record["speed_rpm"] - record["speed_ramp_rpm"]) > rpm)
    return float(record.t_s[np.argmax(away)]) if away.any() else math.inf


def dragged(load_Nm: float, firmware: dict[str, float], link: dict[str, float]) -> Record:
    """600 min^-1; from 7 s on the load drives."""
    speed = [(0, 0), (5, 0), (6, 600)]
    load = [(0, 0), (LOAD_S, 0), (LOAD_S, load_Nm)]
    return cases.run("atlas", 12.0, speed, load, firmware, link=link)


def test_a_load_that_drives_without_a_chopper_is_told_and_tripped():
    record = dragged(-4.0, {}, LINK)
    begin_s = away_s(record)
    assert fault_s(record, Fault.REGENERATION) < begin_s + 0.2
    assert fault_s(record, Fault.SPEED_DEVIATION) < begin_s + 1.0
    on = record["gates_on"] > 0.5
    assert np.abs(record["speed_rpm"][on]).max() < 1300.0  # 2420 without the guard


@pytest.mark.parametrize("load_Nm", [-20.0, 20.0])
def test_a_load_beyond_the_torque_is_told_and_tripped(load_Nm: float):
    record = dragged(load_Nm, {"chopper_on_V": 350.0}, {})
    begin_s = away_s(record)
    assert fault_s(record, Fault.DERATED) < begin_s + 0.2
    assert fault_s(record, Fault.SPEED_DEVIATION) < begin_s + 1.0


@pytest.mark.parametrize("speed_rpm", [-1700, -600, -100, 100, 300, 1200])
@pytest.mark.parametrize("flux_Wb", [0.0, 0.4])
@pytest.mark.parametrize("rs_measure", [0, 1])
def test_a_start_on_a_turning_shaft_is_refused(speed_rpm: float, flux_Wb: float, rs_measure: int):
    record = cases.run(
        "atlas",
        4.0,
        [(0, speed_rpm)],
        firmware={"flying_start": 0, "rs_measure": rs_measure},
        scenario=f"initial_speed_rpm = {speed_rpm}\ninitial_flux_Wb = {flux_Wb}\n",
    )
    assert record.first_fault == Fault.FLYING_START
    begin_s = float(record.t_s[np.argmax(record["state"] == State.PREMAGNETISE)])
    assert fault_s(record, Fault.FLYING_START) < begin_s + 0.4
    assert not (record["state"] == State.RUN).any()


@pytest.mark.parametrize("flux_Wb", [0.0, 0.2, 0.4, 0.45])
def test_residual_flux_of_a_shaft_at_rest_is_no_reason(flux_Wb: float):
    """With three quarters of the flux the offsets of the voltage sensors are wrong, and the drive
    may lose and catch the shaft at zero afterwards (claims.md): DERATED, a warning."""
    record = cases.run("atlas", 6.0, [(0, 0)], scenario=f"initial_flux_Wb = {flux_Wb}\n")
    running = record["state"] == State.RUN
    assert not record["faults"][: np.argmax(running)].any()
    assert record["state"][-1] == State.RUN
    assert record.first_fault == 0 or flux_Wb >= 0.4


@pytest.mark.parametrize(("speed_rpm", "load_Nm"), [(60, 25), (300, 25), (300, -25), (900, 12)])
def test_a_rotor_that_i_f_lost_is_unknown_and_then_a_fault(speed_rpm: float, load_Nm: float):
    """A load beyond the pull-out torque of 15 A, or of what the voltage leaves of them."""
    record = cases.run(
        "atlas",
        14.0,
        [(0, 0), (5, 0), (5, speed_rpm)],
        [(0, 0), (12, 0), (12, load_Nm)],
        {"control_mode": 2, "i_f_A": 15.0},
    )
    held = (record["f_s_hat_Hz"] > 1.0) & (record.t_s < 12.0)
    assert record["speed_unknown"][held].mean() < 0.01
    near = (record["gates_on"] > 0.5) & (np.abs(record["speed_rpm"] - speed_rpm) < 85.5)
    lost_s = float(record.t_s[np.flatnonzero(near)[-1]])
    unknown = (record.t_s > 12.0) & (record["speed_unknown"] > 0.5)
    assert float(record.t_s[np.argmax(unknown)]) < lost_s + 0.15
    assert fault_s(record, Fault.SPEED_DEVIATION | Fault.OVER_CURRENT) < lost_s + 1.0


@pytest.mark.parametrize(
    ("firmware", "speed_rpm"),
    [
        ({"control_mode": 2, "i_f_A": 15.0}, 5.0),
        ({"control_mode": 1}, 30.0),
        ({"dc_brake_A": 10.0, "dc_brake_from_Hz": 1.0}, 0.0),
    ],
)
def test_below_what_the_emf_can_tell_there_is_a_limit_of_time(
    firmware: dict[str, float], speed_rpm: float
):
    given = firmware | {"speed_unknown_s": 3.0}
    record = cases.run("atlas", 12.0, [(0, 0), (5, 0), (5, speed_rpm)], firmware=given)
    begin_s = float(record.t_s[np.argmax(record["speed_unknown"] > 0.5)])
    assert fault_s(record, Fault.SPEED_DEVIATION) == pytest.approx(begin_s + 3.0, abs=0.02)


@pytest.mark.parametrize("control", [1, 2])
def test_an_open_loop_that_is_followed_is_known(control: int):
    record = cases.run(
        "atlas",
        17.0,
        [(0, 0), (5, 0), (5, 600)],
        [(0, 0), (13, 0), (14, 0.5 * cases.RATED_TORQUE_NM)],
        {"control_mode": control, "i_f_A": 15.0},
    )
    assert record.first_fault == 0
    fast = (record["f_s_hat_Hz"] > 3.0) & (record["gates_on"] > 0.5)
    assert record["speed_unknown"][fast].mean() < 0.01


def run_up_rpm(t_s):
    return min(max(t_s - 6.0, 0.0) * 1200.0, 1200.0)


def line_sensors_that_lose(share, firmware, reference_rpm=run_up_rpm):
    """From 11 s on, at 1200 min^-1 with 4 Nm."""
    return simulate(
        16.0,
        reference_rpm,
        lambda t_s, omega: (4.0 if t_s > 9.0 else 0.0) + 0.4 * max(-1.0, min(1.0, omega / 0.3)),
        firmware,
        lambda t_s: 1.0 - share if t_s > 11.0 else 1.0,
    )


@pytest.mark.parametrize(
    ("share", "firmware"), [(0.1, {}), (0.33, {}), (0.1, {"voltage_source": 0})]
)
def test_line_sensors_that_lose_a_share_do_no_harm_at_speed(share, firmware):
    """A drive of before went to 3719 min^-1 in I-f operation. As shipped the duty counts here."""
    off_rpm = [
        abs(now.speed_rpm - 1200.0)
        for now in line_sensors_that_lose(share, firmware)
        if now.t_s > 11.0
    ]
    assert max(off_rpm) < 30.0


@pytest.mark.parametrize(("share", "told"), [(0.25, False), (0.33, True), (0.5, True), (0.8, True)])
def test_line_sensors_that_lost_a_share_do_no_harm_when_the_drive_slows_down(share, told):
    """As shipped they do not count at 1200 min^-1, but at 60 they do. The drive follows with .28
    lost. With .3 the speed loop swings, and the guard sees that in the voltage. Before 23c1eb41,
    where an error of the speed does not raise the gain, it followed with .33 and swung with .36."""

    def reference_rpm(t_s):
        return run_up_rpm(t_s) if t_s < 13.0 else max(1200.0 - (t_s - 13.0) * 400.0, 60.0)

    off_rpm = 0.0
    for now in line_sensors_that_lose(share, {}, reference_rpm):
        if now.t_s > 13.0:
            off_rpm = max(off_rpm, abs(now.speed_rpm - reference_rpm(now.t_s)))
        if now.out.faults:
            break
    assert now.out.faults == (Fault.VOLTAGE_SENSOR if told else 0)
    assert off_rpm < 85.5  # the judge's limit, which it passes for 1 s before it calls it harm


def test_line_sensors_that_lose_a_third_end_in_a_fault_where_they_count():
    fastest_rpm = 0.0
    for now in line_sensors_that_lose(0.33, {"voltage_source": 0}):
        fastest_rpm = max(fastest_rpm, abs(now.speed_rpm))
        assert math.isnan(now.out.speed_hat_rpm) == now.out.speed_unknown
        if now.out.faults:
            break
    assert now.out.faults & Fault.VOLTAGE_SENSOR
    assert now.t_s < 11.1
    assert fastest_rpm < 1300.0


def test_a_speed_filter_that_makes_the_shaft_swing_is_refused_live():
    folder, board = (
        ROOT / "gain_tables" / "hasegawa2005_recommended",
        load_setup("paper").board,
    )
    with Drive(folder, board, dict(load_setup("recommended").params)) as drive:
        for value in (0.7, 1.0):
            with pytest.raises(UserError, match=r"speed_filter_s.*at most.*bandwidth_rad_s"):
                drive["speed_filter_s"] = value
        drive["speed_filter_s"] = 0.003


def test_every_reference_is_bounded():
    record = cases.run("atlas", 9.0, [(0, 0), (5, 0), (5, 1e5)], firmware=cases.WIDE)
    most_rpm = 750.0 / 2.0 * 30.0 / math.pi
    assert record["speed_ramp_rpm"].max() == pytest.approx(most_rpm, rel=1e-5)
    assert record["speed_rpm"].max() < 1.15 * most_rpm
