"""Stop, command, torque and direction in the closed loop: the recommended drive on its rig.

Times are seconds after READY_S: resistance measured, flux built up.
"""

from __future__ import annotations

import json

import numpy as np
import pytest

from zerohertz.drive import Fault, State
from zerohertz.scenario.setup import load_setup
from zerohertz.sim import Job, Record, run

READY_S = 6.0
RUN_UP = [[0, 0], [0.5, 600]]
RATED_NM = 7.6
# The speed ramp moves every fourth period (firmware/law/base/slots.h).
RAMP_PERIODS = 4
RAMP_S = RAMP_PERIODS * 200e-6
JERK = {"speed_slew_rad_s2": 400.0, "speed_jerk_rad_s3": 4000.0}


def go(
    duration_s: float,
    times: dict[str, float] | None = None,
    firmware: dict[str, float] | None = None,
    decimate: int = 5,
    **profiles: list[list[float]],
) -> Record:
    """A run from power-on; profiles and times count from READY_S."""
    setup = load_setup("recommended")
    lines = [f"{name} = {READY_S + t_s}" for name, t_s in (times or {}).items()]
    shown = {"speed_ref_rpm": [[0, 0]]} | profiles
    moved = {k: [[READY_S + t, v] for t, v in points] for k, points in shown.items()}
    text = "\n".join(
        [
            f'[scenario]\nname = "states"\nduration_s = {READY_S + duration_s}\nrun_on_s = 0.12',
            *lines,
            "[profiles]",
            *(f"{name} = {json.dumps(points)}" for name, points in moved.items()),
        ]
    )
    job = Job(
        motor_dir=setup.motor_dir,
        board=setup.board,
        rig=setup.rig,
        firmware_config=dict(setup.params),
        scenario=text,
        firmware=firmware or {},
        decimate=decimate,
    )
    record = run(job)
    assert at(record, -0.01, "state") == State.RUN
    return record


def ramp(record: Record, from_s: float, to_s: float) -> np.ndarray:
    """Electrical, rad/s: the reference where it has reached the ramp; needs a row per period."""
    reached = np.arange(len(record.t_s)) % RAMP_PERIODS == RAMP_PERIODS - 1
    return record["speed_ramp_rpm"][reached & between(record, from_s, to_s)] * np.pi / 15


def between(record: Record, from_s: float, to_s: float) -> np.ndarray:
    return (record.t_s > READY_S + from_s) & (record.t_s < READY_S + to_s)


def at(record: Record, t_s: float, column: str) -> float:
    return float(record[column][np.searchsorted(record.t_s, READY_S + t_s)])


def first(record: Record, state: State, after_s: float = 0.0) -> float:
    """Time at which the drive is in this state, at or after a time."""
    rows = np.flatnonzero((record["state"] == state) & (record.t_s >= READY_S + after_s))
    assert len(rows) > 0, f"never in {state.name}"
    return float(record.t_s[rows[0]]) - READY_S


def states(record: Record) -> list[State]:
    """In the order of their coming."""
    found = record["state"].astype(int)
    return [State(s) for k, s in enumerate(found) if k == 0 or s != found[k - 1]]


def test_a_stop_takes_the_gates_off_at_once_by_default():
    record = go(1.5, {"run_off_s": 1.0}, speed_ref_rpm=RUN_UP)
    assert at(record, 0.99, "gates_on") == 1
    assert at(record, 1.002, "gates_on") == 0
    assert states(record)[-2:] == [State.RUN, State.READY]


def test_a_stop_by_ramp_brings_the_speed_down_first():
    firmware = {"stop_mode": 1, "ramp_down_rad_s2": 200.0}
    record = go(2.5, {"run_off_s": 1.0}, firmware, decimate=1, speed_ref_rpm=RUN_UP)
    ready_s = first(record, State.READY, 1.0)
    # 600 min^-1 are 126 rad/s: .63 s, and a little for the controller.
    assert ready_s == pytest.approx(1.0 + 126 / 200, abs=0.1)
    on = between(record, 1.0, ready_s)
    assert record["gates_on"][on].all()
    assert abs(at(record, ready_s, "speed_rpm")) < 40.0
    assert states(record)[-3:] == [State.RUN, State.RAMP_DOWN, State.READY]
    slope = np.gradient(ramp(record, 1.01, 1.58), RAMP_S)
    assert slope == pytest.approx(-200.0, rel=0.02)


def test_a_stop_on_the_ramp_can_be_taken_back():
    firmware = {"stop_mode": 1, "ramp_down_rad_s2": 100.0, "speed_slew_rad_s2": 200.0}
    times = {"run_off_s": 1.0, "run_again_s": 1.4}
    record = go(2.5, times, firmware, speed_ref_rpm=RUN_UP)
    assert states(record)[-3:] == [State.RUN, State.RAMP_DOWN, State.RUN]
    assert record["gates_on"][between(record, 0.0, 2.5)].all()
    assert record["speed_rpm"][between(record, 1.3, 1.5)].min() < 450.0
    assert at(record, 2.4, "speed_rpm") == pytest.approx(600.0, abs=10.0)


def test_a_stop_against_a_load_that_pulls_is_cut_off_in_time():
    """The torque limit is below the load: the speed cannot come down."""
    record = go(
        2.0,
        {"run_off_s": 1.0},
        {"stop_mode": 1, "ramp_down_s": 0.5, "i_q_max_A": 3.0},
        speed_ref_rpm=RUN_UP,
        load_torque_Nm=[[0.9, 0.0], [1.0, -5.0]],
    )
    ready_s = first(record, State.READY, 1.0)
    assert ready_s == pytest.approx(1.5, abs=0.003)
    assert at(record, ready_s, "speed_rpm") > 300.0


def test_coast_keeps_the_gates_off_for_its_time():
    times = {"torque_off_s": 1.0, "torque_off_end_s": 1.1, "run_off_s": 1.05}
    record = go(2.0, times, {"coast_s": 0.4}, speed_ref_rpm=RUN_UP)
    assert first(record, State.COAST, 1.0) == pytest.approx(1.1, abs=0.002)
    assert first(record, State.READY, 1.1) == pytest.approx(1.5, abs=0.002)


def test_coast_waits_for_the_voltage_of_the_turning_motor():
    """What the rotor flux induces dies with Tr = .2 s; the shaft turns on."""
    record = go(2.5, {"run_off_s": 1.0}, {"coast_s": 0.01, "coast_V": 10.0}, speed_ref_rpm=RUN_UP)
    ready_s = first(record, State.READY, 1.0)
    assert 1.1 < ready_s < 2.0
    induced_V = at(record, ready_s, "lambda_Wb") * at(record, ready_s, "speed_rpm") * np.pi / 15
    assert induced_V == pytest.approx(10.0, rel=0.15)


# A silent command is looked for once in sixteen periods, twice until it is told, and the record has
# a row each millisecond.
SILENCE_S = 2 * 16 * 200e-6 + 0.001


def test_silence_brings_the_speed_down_and_latches():
    firmware = {"command_timeout_s": 0.2}
    record = go(3.0, {"silent_from_s": 1.0}, firmware, speed_ref_rpm=RUN_UP)
    assert first(record, State.RAMP_DOWN) == pytest.approx(1.2, abs=SILENCE_S)
    assert record.first_fault == Fault.COMMAND_TIMEOUT
    fault_s = first(record, State.FAULT)
    assert abs(at(record, fault_s, "speed_rpm")) < 40.0
    assert states(record)[-3:] == [State.RUN, State.RAMP_DOWN, State.FAULT]
    assert at(record, 2.9, "gates_on") == 0


def test_silence_is_nobodys_business_without_a_limit():
    firmware = {"command_timeout_s": 0.0}
    record = go(3.5, {"silent_from_s": 1.0}, firmware, speed_ref_rpm=RUN_UP)
    assert record.first_fault == 0
    assert record["state"][-1] == State.RUN


def test_silence_is_watched_unless_somebody_turns_it_off():
    record = go(3.5, {"silent_from_s": 1.0}, speed_ref_rpm=RUN_UP)
    assert first(record, State.RAMP_DOWN) == pytest.approx(3.0, abs=SILENCE_S)
    assert record.first_fault == Fault.COMMAND_TIMEOUT


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_torque_mode_gives_its_torque_and_holds_the_speed_limit(way):
    """3 Nm on a free shaft, then a load that drives it: the limit brakes with all it needs."""
    record = go(
        4.0,
        {"torque_mode_on_s": -READY_S},
        {"torque_speed_max_rad_s": 100.0},
        torque_ref_Nm=[[0.0, 0.0], [0.01, 3.0 * way]],
        load_torque_Nm=[[1.5, 0.0], [2.0, -5.0 * way]],
    )
    limit_rpm = 100.0 * 15 / np.pi
    assert record.first_fault == 0
    rising = between(record, 0.1, 0.4)
    # This motor's flux is 12 % above that of the nameplate's inductance; the estimate knows it.
    assert record["torque_Nm"][rising].mean() == pytest.approx(3.0 * way, rel=0.05)
    assert np.abs(record["speed_rpm"][rising]).max() < 0.8 * limit_rpm
    # While the load comes the limit gives by what a speed controller gives.
    held = between(record, 1.0, 4.0)
    assert np.abs(way * record["speed_rpm"][held] - limit_rpm).max() < 0.06 * limit_rpm
    settled = between(record, 3.5, 4.0)
    # All but what the rig's own friction takes.
    assert record["torque_Nm"][settled].mean() == pytest.approx(-4.5 * way, abs=0.3)


def test_speed_and_torque_take_over_without_a_jolt():
    record = go(
        2.5,
        {"torque_mode_on_s": 1.0, "torque_mode_off_s": 1.3},
        {"torque_slew_Nm_s": 20.0, "speed_slew_rad_s2": 250.0},
        speed_ref_rpm=RUN_UP,
        load_torque_Nm=[[0.6, 0.0], [0.7, 2.0]],
        torque_ref_Nm=[[0.0, 3.0]],
    )
    assert record.first_fault == 0
    calm = np.abs(np.diff(record["i_q_ref_A"][between(record, 0.9, 0.99)])).max()
    for t_s, more_A in ((1.0, 0.1), (1.3, 0.4)):
        over = np.abs(np.diff(record["i_q_ref_A"][between(record, t_s - 0.005, t_s + 0.01)])).max()
        # A row is 1 ms: .02 A of torque slew; then the speed controller, whose reference starts to
        # move from where the speed is.
        assert over < calm + more_A
    assert at(record, 1.28, "torque_Nm") == pytest.approx(3.0, abs=0.3)
    assert at(record, 2.4, "speed_rpm") == pytest.approx(600.0, abs=10.0)


@pytest.mark.parametrize(("direction", "way"), [(1, 1.0), (2, -1.0)])
def test_a_forbidden_direction_is_zero_speed(direction, way):
    wanted = [[0.0, 0.0], [0.3, 300 * way], [1.0, 300 * way], [1.3, -300 * way]]
    record = go(3.5, None, {"direction": direction}, speed_ref_rpm=wanted)
    assert record.first_fault == 0
    assert at(record, 0.95, "speed_rpm") == pytest.approx(300.0 * way, abs=10.0)
    # The ramp ends in 19 to 21 min^-1 the other way, by what the start found of the inverter.
    assert (way * record["speed_rpm"]).min() > -25.0
    assert abs(at(record, 3.4, "speed_rpm")) < 10.0


def test_torque_does_not_turn_the_shaft_into_a_forbidden_direction():
    record = go(
        3.0,
        {"torque_mode_on_s": -READY_S},
        {"direction": 1},
        torque_ref_Nm=[[0.0, 0.0], [0.01, 3.0], [0.4, 3.0], [0.41, -3.0]],
    )
    top_rpm = record["speed_rpm"].max()
    assert top_rpm > 200.0
    assert record["speed_rpm"].min() > -0.1 * top_rpm
    assert abs(at(record, 2.9, "speed_rpm")) < 15.0


def test_a_reversal_with_jerk_limit_is_followed():
    wanted = [[0.0, 0.0], [0.001, 600.0], [1.5, 600.0], [1.501, -600.0]]
    record = go(3.0, None, JERK, decimate=1, speed_ref_rpm=wanted)
    assert record.first_fault == 0
    slope = np.diff(ramp(record, -READY_S, 3.0)) / RAMP_S
    assert np.abs(slope).max() == pytest.approx(400.0, rel=0.02)
    # Rows are float32 of min^-1: 6e-5 of them twice differenced.
    assert np.abs(np.diff(slope) / RAMP_S).max() < 4000.0 + 200.0
    assert np.abs(record["speed_ramp_rpm"]).max() <= 600.0
    reversing = between(record, 1.5, 2.5)
    error_rpm = np.abs(record["speed_rpm"] - record["speed_ramp_rpm"])[reversing]
    assert error_rpm.max() < 60.0
    assert at(record, 2.95, "speed_rpm") == pytest.approx(-600.0, abs=10.0)


def test_zero_reference_holds_the_shaft():
    """The speed control of zero is the hold, under a sixth of the rated torque as well."""
    record = go(
        5.0,
        speed_ref_rpm=[[0.0, 0.0], [0.2, 200.0], [0.7, 200.0], [1.0, 0.0]],
        load_torque_Nm=[[2.0, 0.0], [2.5, RATED_NM / 6]],
    )
    assert record.first_fault == 0
    held = between(record, 1.5, 5.0)
    assert record["gates_on"][held].all()
    turned = np.cumsum(record["speed_rpm"][held]) * 1e-3 / 60.0
    assert np.ptp(turned) < 0.5  # turns in 3.5 s
