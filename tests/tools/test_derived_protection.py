"""What commissioning derives guards every motor as Table 1's is guarded: `commission/tuning.py`."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import pytest

from zerohertz.commission.folder import BOARD, all_rigs, rig_file, stored_parameters
from zerohertz.commission.plate import guess, plate_from, read_plate
from zerohertz.commission.solve import identified
from zerohertz.commission.trial import times
from zerohertz.commission.tuning import firmware_parameters
from zerohertz.drive import Fault
from zerohertz.envelope.motors import rig_folder
from zerohertz.motor import load_motor
from zerohertz.scenario.setup import load_setup
from zerohertz.sim import Job, run_batch

NAMES = [rig.stem for rig in all_rigs()]
DERIVED = ("open_phase_A", "observer_e1_A", "observer_power_W", "stall_s")
STALLED_S = 6.0  # the slow speed loop has to come to the torque limit first
SLOW, HALF = 0.02, 0.5  # of rated speed


def broken(name: str, speed_pu: float, bits: int, fault: dict[str, Any]) -> Job:
    """A derived drive in whose run something breaks at the end; None is that moment."""
    rig = rig_file(name)
    folder = rig_folder(rig, 200e-6)
    motor, told = load_motor(folder), stored_parameters(folder)
    plate, start_s = motor.nameplate, times(motor, told).start_s
    rated_rad_s = plate.speed_rpm * plate.pole_pairs * math.pi / 30.0
    turning_s = start_s + 0.5 + speed_pu * rated_rad_s / told["speed_slew_rad_s2"]
    broken_s = turning_s + 1.5
    keys = {f"faults.{key}": broken_s if x is None else x for key, x in fault.items()}
    scenario = f"""\
[scenario]
name = "broken"
duration_s = {broken_s + STALLED_S}
run_on_s = 0.1
[profiles]
speed_ref_rpm = {[[0, 0], [start_s, 0], [turning_s, speed_pu * plate.speed_rpm]]}
load_torque_Nm = [[0.0, 0.0]]
"""
    return Job(
        scenario=scenario,
        scenario_overrides=keys,
        rig=rig,
        board=folder / BOARD,
        board_overrides={"adc.bits": bits},
        motor_dir=folder,
        firmware=told,
        seed=3,
        decimate=50,
        columns=("t_s", "faults"),
    )


def test_a_locked_rotor_of_every_motor_is_a_stall() -> None:
    """At 2 % of rated speed, where no other check trips within this time; coarse sensors. A slip
    below 6 rad/s under all torque is warned of as DERATED before: 45 and 75 kW."""
    jam = {"jam_s": 0.0, "jam_Nm": 1e4}
    records = run_batch([broken(name, SLOW, 10, jam) for name in NAMES])
    ends = [int(record["faults"][-1]) & ~Fault.DERATED for record in records]
    said = dict(zip(NAMES, ends, strict=True))
    assert said == dict.fromkeys(NAMES, Fault.STALL)


def test_the_speed_may_be_off_by_what_counts_as_harm() -> None:
    """5 % of rated speed, as in campaign/faults/judge.py."""
    for name in NAMES:
        folder = rig_folder(rig_file(name), 200e-6)
        plate = load_motor(folder).nameplate
        rated_rad_s = plate.speed_rpm * plate.pole_pairs * math.pi / 30.0
        told = stored_parameters(folder)["speed_deviation_rad_s"]
        assert told == pytest.approx(0.05 * rated_rad_s, rel=1e-4)


@pytest.mark.parametrize(
    ("phase", "by_the_rule"), [("u", ["im_45kw_400v"]), ("v", ["im_75kw_400v"]), ("w", [])]
)
def test_an_open_phase_of_every_motor_is_told(phase: str, by_the_rule: list[str]) -> None:
    """At half of rated speed without load: CURRENT_SENSOR where the current jumps to zero, else
    OPEN_PHASE by the rule for open_phase_A."""
    fault = {"open_phase": phase, "open_s": None}
    opened = [broken(name, HALF, 14, fault) for name in NAMES]
    said = {name: r.first_fault for name, r in zip(NAMES, run_batch(opened), strict=True)}
    told = Fault.OPEN_PHASE | Fault.CURRENT_SENSOR | Fault.OVER_CURRENT
    assert all(bits & told for bits in said.values()), said
    by = [name for name, bits in said.items() if bits == Fault.OPEN_PHASE]
    assert by == by_the_rule


def test_the_rule_gives_table_1_s_motor_what_recommended_has() -> None:
    setup = load_setup("recommended")
    motor = load_motor(setup.motor_dir)
    plate = plate_from(
        {
            "power_kW": 1e-3 * motor.nameplate.power_W,
            "voltage_V": motor.nameplate.voltage_V,
            "current_A": motor.nameplate.current_A,
            "connection": "star",
            "frequency_Hz": 60,
            "speed_rpm": motor.nameplate.speed_rpm,
            "cos_phi": 0.83,
        },
        "Table 1",
    )
    found = dataclasses.replace(
        identified(motor.circuit, plate), i_d_A=float(setup.params["i_d_A"])
    )
    derived = firmware_parameters(found, plate, motor.mechanics.J_kg_m2, 200e-6)
    for name in DERIVED:
        assert derived[name] == pytest.approx(setup.params[name], rel=0.01), name


@pytest.mark.parametrize("i_trip_max_A", [9.0, math.inf])
def test_the_residual_stays_below_a_trip_that_the_board_limits(i_trip_max_A: float) -> None:
    plate = read_plate(rig_file("im_4kw_400v"))
    found = identified(guess(plate), plate)
    told = firmware_parameters(found, plate, 0.013, 200e-6, i_trip_max_A)
    assert told["observer_e1_A"] < 0.6 * math.sqrt(1.5) * told["i_trip_A"]
    assert told["open_phase_A"] < math.sqrt(2.0 / 3.0) * told["i_d_A"]
