"""Terminals in the loop: contacts, reference, brake of a hoist, sensors, contactor, brake resistor.

Everything is judged by the plant, the brake and the contacts around the drive.
"""

from __future__ import annotations

import math

import pytest
from hoist import LOAD_NM, Hoist

from zerohertz.drive import Drive, State
from zerohertz.drive import Fault as DriveFault
from zerohertz.errors import UserError
from zerohertz.plant import Plant
from zerohertz.scenario.setup import load_setup
from zerohertz.terminals import Brake, Fault, Input, Output, Precharge, Terminals

QUIET = Output.READY | Output.NO_FAULT


class Bench:
    """A drive on its rig, with terminals."""

    def __init__(self, settings: dict[str, float | str], **overrides: float) -> None:
        setup = load_setup("recommended")
        self.drive = Drive(setup.motor_dir, setup.board, setup.parameters() | overrides)
        self.plant = Plant(setup.rig, setup.board)
        self.terminals: Terminals = self.drive.fit_terminals(**settings)
        self.dt_s = self.drive["period_s"]

    def run(self, duration_s: float, run: bool = False, speed_ref_rpm: float = 0.0) -> None:
        periods = round(duration_s / self.dt_s)
        self.plant.run(self.drive, periods, run=run, speed_ref_rpm=speed_ref_rpm)
        self.out = self.drive.telemetry()

    def start(self, *contacts: Input) -> None:
        """Seen open, closed, magnetised and measured."""
        self.run(0.3)
        self.wire(Input.START, *contacts)
        self.run(5.5)

    def wire(self, *contacts: Input, **values: float) -> None:
        inputs = Input(0)
        for contact in contacts:
            inputs |= contact
        self.terminals.wire(inputs=inputs, **values)

    @property
    def speed_rad_s(self) -> float:
        return self.plant.truth().speed_rpm * math.pi / 30.0


def test_start_reverse_and_stop_by_contacts() -> None:
    bench = Bench({"start_control": "two_wire", "full_speed_rad_s": 30.0}, stop_mode=1)
    bench.wire(Input.START)
    bench.run(0.3)
    assert bench.out.state == State.READY  # closed at power-up: has to open
    bench.wire()
    bench.start()
    assert bench.speed_rad_s == pytest.approx(30.0, abs=0.5)
    assert bench.terminals.look().outputs == QUIET
    bench.wire(Input.START, Input.REVERSE)
    bench.run(2.0)
    assert bench.speed_rad_s == pytest.approx(-30.0, abs=0.5)
    bench.wire()
    bench.run(1.5)
    assert bench.out.state == State.READY
    assert abs(bench.speed_rad_s) < 1.0


def test_a_bounce_shorter_than_the_debounce_is_nothing() -> None:
    bench = Bench({"start_control": "two_wire", "full_speed_rad_s": 30.0})
    bench.run(0.3)
    for _ in range(20):
        bench.wire(Input.START)
        bench.run(0.008)
        bench.wire()
        bench.run(0.002)
    assert bench.out.state == State.READY


def test_wire_break_stops_the_drive_within_its_time() -> None:
    settings = {
        "start_control": "two_wire",
        "full_speed_rad_s": 60.0,
        "analog_reference": "current",
    }
    bench = Bench(settings, stop_mode=1)
    bench.wire(analog_A=12e-3)
    bench.start()
    assert bench.speed_rad_s == pytest.approx(30.0, abs=0.5)
    bench.wire(Input.START, analog_A=0.0)
    bench.run(0.09)
    assert bench.out.state == State.RUN
    bench.run(0.03)
    assert bench.out.state == State.RAMP_DOWN
    assert bench.terminals.look().faults == Fault.REFERENCE_LOST
    assert not bench.terminals.look().outputs & Output.NO_FAULT
    bench.run(1.0)
    bench.wire(Input.START, analog_A=12e-3)
    bench.run(0.1)
    bench.wire(Input.START, Input.RESET)
    bench.run(0.2)
    assert bench.terminals.look().faults == 0
    assert bench.out.state == State.READY  # START has to open
    bench.wire()
    bench.run(0.05)
    bench.wire(Input.START)
    bench.run(0.1)
    assert bench.out.gates_on


def test_voltage_sets_the_speed_and_inputs_that_do_not_answer_stop() -> None:
    settings = {
        "start_control": "two_wire",
        "full_speed_rad_s": 60.0,
        "analog_reference": "voltage",
    }
    bench = Bench(settings)
    bench.wire(analog_V=2.5)
    bench.start()
    assert bench.speed_rad_s == pytest.approx(15.0, abs=0.5)
    bench.terminals.wire(unreadable=True)
    bench.run(0.09)
    assert bench.out.gates_on
    bench.run(0.03)
    assert not bench.out.gates_on
    assert bench.terminals.look().faults == Fault.INPUTS_LOST


def test_a_host_takes_the_drive_and_an_open_stop_holds_against_it() -> None:
    bench = Bench({"start_control": "three_wire", "full_speed_rad_s": 30.0})
    bench.wire(Input.STOP)
    bench.run(0.3)
    bench.run(5.5, run=True, speed_ref_rpm=100.0)
    assert bench.plant.truth().speed_rpm == pytest.approx(100.0, abs=5.0)
    bench.wire()
    bench.run(0.02, run=True, speed_ref_rpm=100.0)
    assert not bench.out.gates_on
    bench.wire(Input.STOP)
    bench.run(0.5, run=True, speed_ref_rpm=100.0)
    assert not bench.out.gates_on  # the host's run has to drop


# --- hoist ---
# Measured: the table of tools/docs/terminals.md.


@pytest.mark.parametrize("load_pu", [0.8, 1.0, 1.6])
def test_the_load_does_not_drop_at_release_and_stop(load_pu: float) -> None:
    """More or less of it than the torque that is proven."""
    hoist = Hoist(load_pu * LOAD_NM)
    hoist.lift()
    assert hoist.dropped_deg < 2.0
    hoist.run(0.6)
    assert hoist.dropped_deg < 2.0
    assert hoist.travel_rad > 8.0
    hoist.contacts = Input(0)
    hoist.until(Brake.CLOSING)
    hoist.mark()
    hoist.run(0.3)
    assert hoist.seen().brake == Brake.CLOSED
    assert not hoist.out.gates_on
    assert hoist.dropped_deg < 5.0
    assert abs(hoist.plant.truth().speed_rpm) < 0.1


def test_torque_that_is_not_there_never_releases() -> None:
    """The limit of the current is below what has to be proven."""
    hoist = Hoist(brake_torque_Nm=5.0 * LOAD_NM, i_q_max_A=6.0)
    hoist.run(0.2)
    hoist.contacts = Input.START
    hoist.run(6.0)
    assert hoist.seen().faults == Fault.BRAKE_TORQUE
    assert not hoist.was_energised
    assert hoist.dropped_deg < 1.0


def test_a_brake_that_does_not_release_ends_with_a_closed_brake() -> None:
    hoist = Hoist()
    hoist.brake.stuck = True
    hoist.run(0.2)
    hoist.contacts = Input.START
    hoist.until(Brake.RELEASING)
    hoist.run(0.5)
    assert hoist.seen().faults == Fault.BRAKE_NOT_RELEASED
    assert not hoist.out.gates_on
    assert hoist.dropped_deg < 1.0


def test_a_broken_wire_of_the_switch_closes_the_brake() -> None:
    hoist = Hoist()
    hoist.lift()
    hoist.run(0.3)
    hoist.feedback_wire = False
    hoist.run(0.007)  # of its debounce, and a step
    assert not hoist.seen().outputs & Output.BRAKE_RELEASE
    hoist.run(0.043)
    hoist.mark()
    hoist.run(0.5)
    assert hoist.seen().faults == Fault.BRAKE_FEEDBACK
    assert not hoist.out.gates_on
    assert hoist.plant.truth().speed_rpm == pytest.approx(0.0, abs=0.1)


def test_a_fault_of_the_drive_drops_the_load_by_no_more_than_the_brake_takes() -> None:
    """Gates off at standstill, where the load falls until the brake has closed."""
    hoist = Hoist(full_speed_rad_s=2.5)  # slow, so that nothing of the lift is left
    hoist.lift()
    hoist.run(0.3)
    hoist.mark()
    hoist.step_options = {"torque_off": True}
    hoist.run(0.5)
    assert not hoist.out.gates_on
    assert hoist.seen().brake == Brake.CLOSED
    assert hoist.seen().faults == 0  # the magnet takes its time: no contradiction
    falls_rad = 0.5 * LOAD_NM / 0.038 * 0.05**2
    assert hoist.dropped_deg < 1.5 * math.degrees(falls_rad)


def test_a_brake_that_does_not_close_is_held_by_the_motor() -> None:
    hoist = Hoist()
    hoist.lift()
    hoist.run(0.3)
    hoist.brake.stuck = True
    hoist.contacts = Input(0)
    hoist.until(Brake.CLOSING)
    hoist.mark()
    hoist.run(2.0)
    assert hoist.seen().faults == Fault.BRAKE_NOT_CLOSED
    assert hoist.out.state == State.RUN
    # A sensorless drive creeps at standstill under load: 27 degrees a second, measured.
    assert hoist.dropped_deg < 110.0
    assert abs(hoist.plant.truth().speed_rpm) < 10.0
    hoist.brake.stuck = False
    hoist.run(0.3)
    assert hoist.seen().brake == Brake.CLOSED
    assert not hoist.out.gates_on


def test_a_hoist_is_not_commissioned() -> None:
    """Nothing is energised, and the reason is told."""
    hoist = Hoist()
    hoist.run(0.2)
    hoist.step_options = {"commission": True}
    for _ in range(200):
        assert not hoist.step().gates_on
    assert hoist.seen().faults == Fault.COMMISSION_REFUSED
    assert hoist.seen().brake == Brake.CLOSED
    assert not hoist.was_energised


# --- temperatures, contactor, resistor ---


def pt1000_ohm(degC: float) -> float:
    return 1000.0 * (1.0 + 3.9083e-3 * degC - 5.775e-7 * degC**2)


def test_a_warm_heat_sink_derates_and_a_hot_one_trips() -> None:
    settings = {
        "sink_sensor": "pt1000",
        "sink_derate_degC": 70.0,
        "sink_trip_degC": 90.0,
    }
    bench = Bench(settings)
    bench.wire(sink_ohm=pt1000_ohm(40.0))
    bench.run(0.3)
    bench.run(5.5, run=True, speed_ref_rpm=300.0)
    bench.plant.disturb(load_torque_Nm=11.0)
    bench.run(1.0, run=True, speed_ref_rpm=300.0)
    assert bench.plant.truth().speed_rpm == pytest.approx(300.0, abs=15.0)
    full_A = abs(bench.out.i_q_A)
    limit_A = bench.drive["i_q_max_A"]
    for degC in range(70, 90):
        bench.wire(sink_ohm=pt1000_ohm(degC))
        bench.run(0.03, run=True, speed_ref_rpm=300.0)
    bench.run(0.15, run=True, speed_ref_rpm=300.0)
    look = bench.terminals.look()
    assert look.current_pu == pytest.approx(0.5, abs=0.06)
    assert abs(bench.out.i_q_A) < min(full_A, 0.6 * limit_A)
    assert bench.drive["i_q_max_A"] == limit_A  # the owner's stays
    assert bench.out.gates_on
    bench.wire(sink_ohm=pt1000_ohm(90.5))
    bench.run(0.05, run=True, speed_ref_rpm=300.0)
    assert bench.terminals.look().faults == Fault.SINK_HOT
    assert not bench.out.gates_on


@pytest.mark.parametrize("bad_degC", [-30.0, 120.0, 300.0])
def test_one_bad_word_of_a_sensor_neither_trips_nor_resets(bad_degC: float) -> None:
    settings = {"sink_sensor": "pt1000", "sink_derate_degC": 70.0, "sink_trip_degC": 90.0}
    bench = Bench(settings)
    for degC, fault in ((85.0, 0), (95.0, Fault.SINK_HOT)):
        bench.wire(sink_ohm=pt1000_ohm(degC))
        bench.run(0.3)
        assert bench.terminals.look().faults == fault
        before = bench.terminals.look().current_pu
        bench.wire(sink_ohm=pt1000_ohm(bad_degC))
        bench.run(0.001)
        bench.wire(Input.RESET, sink_ohm=pt1000_ohm(degC))
        bench.run(0.2)
        assert bench.terminals.look().faults == fault
        assert bench.terminals.look().current_pu == before
        bench.wire(sink_ohm=pt1000_ohm(degC))


@pytest.mark.parametrize("ohm", [0.0, math.inf])
@pytest.mark.parametrize("kind", ["ntc", "kty84", "pt1000"])
def test_open_and_shorted_sensors_are_told(kind: str, ohm: float) -> None:
    good = {"ntc": 5000.0, "kty84": 700.0, "pt1000": 1150.0}[kind]
    bench = Bench({"sink_sensor": kind, "motor_sensor": kind})
    bench.wire(sink_ohm=good, motor_ohm=good)
    bench.run(0.3)
    assert bench.terminals.look().faults == 0
    bench.wire(motor_ohm=ohm)
    bench.run(0.51)
    short = math.isfinite(ohm)
    motor = Fault.MOTOR_SENSOR | (Fault.MOTOR_SHORT if short else 0)
    assert bench.terminals.look().faults == motor  # a warning
    assert bench.terminals.look().outputs == QUIET
    bench.wire(sink_ohm=ohm)
    bench.run(0.51)
    sink = Fault.SINK_SENSOR | (Fault.SINK_SHORT if short else 0)
    assert bench.terminals.look().faults == motor | sink
    assert bench.terminals.look().outputs == 0


def test_a_warm_winding_gives_rs_at_the_start() -> None:
    """Without a measurement at the start, on a motor that is 80 K warmer than its parameter."""
    bench = Bench({"motor_sensor": "pt1000"}, rs_measure=0)
    bench.wire(motor_ohm=pt1000_ohm(100.0))
    bench.run(0.5)
    assert bench.terminals.look().motor_degC == pytest.approx(100.0, abs=0.2)
    warm_pu = (234.5 + 100.0) / 254.5
    assert bench.terminals.look().Rs_pu == pytest.approx(warm_pu, abs=0.01)
    bench.run(0.3, run=True)
    cold = Bench({}, rs_measure=0)
    cold.run(0.5)
    cold.run(0.3, run=True)
    assert bench.out.gates_on
    share = bench.out.Rs_hat_ohm / cold.out.Rs_hat_ohm
    assert share == pytest.approx(warm_pu, abs=0.02)


def test_the_contactor_closes_on_a_charged_link_and_the_drive_becomes_ready() -> None:
    settings = {
        "precharge": "on",
        "precharge_ready_V": 200.0,
        "contactor_feedback": "on",
    }
    bench = Bench(settings)
    u_dc_V, closed_at_V = 0.0, None
    for _ in range(300):
        look = bench.terminals.look()
        closed = bool(look.outputs & Output.CONTACTOR)
        if closed and closed_at_V is None:
            closed_at_V = u_dc_V
        u_dc_V += (283.0 - u_dc_V) * (0.5 if closed else 0.05)  # resistor and link: 80 ms
        bench.plant.disturb(u_dc_V=u_dc_V)
        bench.wire(*([Input.CONTACTOR_ON] if closed else []))
        bench.run(0.004)
    assert closed_at_V is not None
    assert closed_at_V > 0.97 * 283.0
    look = bench.terminals.look()
    assert look.precharge == Precharge.CLOSED
    assert look.outputs == QUIET | Output.CONTACTOR
    assert bench.out.state == State.READY
    assert not bench.out.faults & DriveFault.DC_UNDER_VOLTAGE
    bench.wire()  # it falls off
    bench.run(0.05, run=True)
    assert bench.terminals.look().faults == Fault.CONTACTOR
    assert not bench.out.gates_on
    assert not bench.terminals.look().outputs & Output.CONTACTOR


@pytest.mark.parametrize("cause", ["link", "contact", "chopper"])
def test_the_contactor_never_opens_under_load(cause: str) -> None:
    """The gates are off, and the motor's current is gone, before its coil drops."""
    settings = {
        "precharge": "on",
        "precharge_ready_V": 200.0,
        "contactor_feedback": "on",
    }
    settings |= {"chopper_ohm": 50.0, "chopper_W": 100.0, "chopper_feedback": "on"}
    bench = Bench(settings, u_dc_min_V=50.0, stop_mode=1)
    bench.run(0.2)
    bench.wire(Input.CONTACTOR_ON)
    bench.run(0.2)
    bench.run(6.5, run=True, speed_ref_rpm=120.0)
    assert bench.out.state == State.RUN
    link_V = bench.plant.truth().u_dc_V
    contacts = {
        "contact": Input(0),
        "chopper": Input.CONTACTOR_ON | Input.CHOPPER_LEADS,
    }
    bench.wire(contacts.get(cause, Input.CONTACTOR_ON))
    worst_A, closed = 0.0, True
    for _ in range(500):
        before_A = bench.plant.truth().i_peak_A
        if cause == "link":  # 15 V/ms; at once it would be a wrong sensor (link_drop.h)
            link_V = max(138.0, link_V - 3.0)
            bench.plant.disturb(u_dc_V=link_V)
        bench.run(bench.dt_s, run=True, speed_ref_rpm=120.0)
        was, closed = closed, bool(bench.terminals.look().outputs & Output.CONTACTOR)
        if was and not closed:
            worst_A = max(worst_A, before_A)
            assert not bench.out.gates_on
            bench.wire()
    assert not closed
    assert worst_A < 0.5
    faults = {
        "link": Fault.LINK_LOW,
        "contact": Fault.CONTACTOR,
        "chopper": Fault.CHOPPER_SHORT,
    }
    assert bench.terminals.look().faults == faults[cause]


def test_a_link_that_does_not_charge_is_a_fault() -> None:
    bench = Bench({"precharge": "on", "precharge_ready_V": 200.0, "precharge_s": 0.5})
    bench.plant.disturb(u_dc_V=150.0)
    bench.run(0.7, run=True)
    assert bench.terminals.look().faults == Fault.PRECHARGE
    assert not bench.terminals.look().outputs & Output.CONTACTOR
    assert not bench.out.gates_on


def test_a_shorted_brake_transistor_opens_the_contactor() -> None:
    settings = {"precharge": "on", "precharge_ready_V": 200.0}
    settings |= {"chopper_ohm": 50.0, "chopper_W": 100.0, "chopper_feedback": "on"}
    bench = Bench(settings)
    bench.run(0.6)
    assert bench.terminals.look().outputs & Output.CONTACTOR
    bench.wire(Input.CHOPPER_LEADS)
    bench.run(0.05)
    look = bench.terminals.look()
    assert look.faults == Fault.CHOPPER_SHORT
    assert not look.outputs & (Output.CONTACTOR | Output.CHOPPER)


# --- the interface ---


def test_what_is_refused_is_named() -> None:
    bench = Bench({})
    for settings, word in (
        ({"start_control": "one_wire"}, "two_wire"),
        ({"no_such": 1.0}, "no_such"),
        ({"brake_close_rad_s": 1e6}, "brake_close_rad_s"),
        ({"start_control": "two_wire"}, "full_speed_rad_s"),
        ({"brake_control": "on"}, "brake_torque_Nm"),
        ({"precharge": "on"}, "precharge_ready_V"),
    ):
        with pytest.raises(UserError, match=word):
            bench.drive.fit_terminals(**settings)
    with pytest.raises(UserError, match="negative"):
        bench.terminals.wire(sink_ohm=-1.0)


def test_a_drive_with_terminals_has_no_snapshot_until_a_reset() -> None:
    bench = Bench({})
    with pytest.raises(UserError, match="snapshots"):
        bench.drive.snapshot()
    bench.drive.reset()
    bench.drive.snapshot()
    with pytest.raises(UserError, match="fitted"):
        bench.terminals.look()


def test_fitted_and_off_they_change_no_bit() -> None:
    setup = load_setup("recommended")
    rows = []
    for fitted in (False, True):
        drive = Drive(setup.motor_dir, setup.board, setup.parameters())
        if fitted:
            drive.fit_terminals()
        plant = Plant(setup.rig, setup.board)
        rows.append(plant.run(drive, 5000, speed_ref_rpm=60.0, run=True).out)
        drive.close()
    assert (rows[0]["duty_u"] == rows[1]["duty_u"]).all()
    assert (rows[0]["duty_w"] == rows[1]["duty_w"]).all()
