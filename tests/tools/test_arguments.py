"""Every complaint of the Python interface is a UserError that names the argument."""

from __future__ import annotations

import math
import types

import numpy as np
import pytest

from zerohertz import estimators, sim
from zerohertz.drive import Drive, step_many
from zerohertz.errors import UserError
from zerohertz.estimator import Estimator, built_library, events
from zerohertz.paths import ROOT
from zerohertz.plant import Plant

MOTOR = ROOT / "gain_tables" / "hasegawa2005"
BOARD = ROOT / "host_sim" / "boards" / "paper.toml"
RIG = ROOT / "host_sim" / "rigs" / "ideal.toml"
Q = (8192, 8192, 8192, 8192, 8192, 11592)
ROW = [Q]
PAIR = np.zeros(2)


@pytest.fixture(scope="module")
def d():
    with Drive(MOTOR, BOARD) as drive:
        yield drive


@pytest.fixture(scope="module")
def p():
    with Plant(RIG, BOARD) as plant:
        yield plant


@pytest.fixture(scope="module")
def e():
    with Estimator(MOTOR, period_s=200e-6) as estimator:
        yield estimator


def refused(call, text: str) -> None:
    with pytest.raises(UserError) as caught:
        call()
    assert str(caught.value).startswith(text), caught.value


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda: Drive(None, BOARD), "Drive: motor_dir: is None; give a path"),
        (lambda: Drive(MOTOR, 5), "Drive: board: is 5"),
        (lambda: Drive("a\0b", BOARD), "Drive: motor_dir: "),
        (lambda: Drive(MOTOR, BOARD, [1]), "Drive: overrides: is [1]; give a mapping"),
        (lambda: Drive(MOTOR, BOARD, {"adapt_kp": None}), "Drive: adapt_kp: is None"),
        (lambda: Drive(MOTOR, BOARD, {"adapt_kp": PAIR}), "Drive: adapt_kp: is array"),
        (lambda: Drive(MOTOR, BOARD, {"adapt_kp=1\ni_d_A": 1.0}), "Drive: overrides: "),
        (lambda: Plant(None, BOARD), "Plant: rig: is None"),
        (lambda: Plant(RIG, None), "Plant: board: is None"),
        (lambda: Plant(RIG, BOARD, 5), "Plant: scenario: is 5"),
        (lambda: Plant(RIG, BOARD, seed=1.5), "Plant: seed: is 1.5; give a whole number"),
        (lambda: Plant(RIG, BOARD, seed=2**64), "Plant: seed: 18446744073709551616 is outside"),
        (lambda: Plant(RIG, BOARD, rig_overrides=[1]), "Plant: rig_overrides: is [1]"),
        (lambda: Plant(RIG, BOARD, rig_overrides={"motor.Rs_ohm": None}), "Plant: motor.Rs_ohm: "),
        (lambda: Estimator(None, period_s=2e-4), "Estimator: motor_dir: is None"),
        (lambda: Estimator(MOTOR, period_s="x"), "Estimator: period_s: is 'x'"),
        (lambda: Estimator(MOTOR, period_s=2e-4, library=5), "Estimator: library: is 5"),
        (lambda: built_library("nothing"), "built_library: name: is 'nothing'; give one of comp"),
        (lambda: estimators.use(5), "use: made: is 5; give a class"),
        (lambda: events(-1), "events: count: -1 is outside"),
        (lambda: events(2, nothing=1), "events: nothing: no such column; give one of"),
        (lambda: events(2, u_alpha_V=[1, 2, 3]), "events: u_alpha_V: "),
        (lambda: events(2, verb=-1), "events: verb: "),
    ],
)
def test_what_cannot_be_made_names_the_argument(call, text):
    refused(call, text)


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda d: d.step(8192.5, *Q[1:]), "Drive.step: i_u: is 8192.5; give a whole number"),
        (lambda d: d.step(*Q[:5], math.nan), "Drive.step: u_dc: is nan"),
        (lambda d: d.step(*Q[:3], 70000, *Q[4:]), "Drive.step: u_uv: 70000 is outside 0 .. 65535"),
        (lambda d: d.step(*Q, speed_ref_rpm=None), "Drive.step: speed_ref_rpm: is None"),
        (lambda d: d.step(*Q, torque_ref_Nm="x"), "Drive.step: torque_ref_Nm: is 'x'"),
        (lambda d: d.step(*Q, run=2), "Drive.step: run: is 2; give True or False"),
        (lambda d: d.step(*Q, run="no"), "Drive.step: run: is 'no'"),
        (lambda d: d.step(*Q, torque_off=PAIR), "Drive.step: torque_off: is array"),
        (lambda d: d.run(None), "Drive.run: words: has shape ()"),
        (lambda d: d.run([[1, 2], [3]]), "Drive.run: words: "),
        (lambda d: d.run(ROW, run="no"), "Drive.run: run: is of type <U2; give True or False"),
        (lambda d: d.run(ROW, run=math.nan), "Drive.run: run: is of type float64"),
        (lambda d: d.run(ROW, run=2), "Drive.run: run: is not all 0 or 1"),
        (lambda d: d.run(ROW, speed_ref_rpm=None), "Drive.run: speed_ref_rpm: is of type object"),
        (lambda d: d.run(ROW, speed_ref_rpm=[[1.0]]), "Drive.run: speed_ref_rpm: has shape (1, 1)"),
        (lambda d: d.run(ROW, signals=3), "Drive.run: signals: is 3; give a list of names"),
        (lambda d: d.run(ROW, signals=[[]]), "Drive.run: signals: is [[]]"),
        (lambda d: d.signals(3), "Drive.signals: names: is 3"),
        (lambda d: d[3], "Drive: name: is 3; give a name"),
        (lambda d: d["adapt_kp\0x"], "Drive: name: is 'adapt_kp\\x00x'"),
        (lambda d: d.__setitem__("adapt_kp", "x"), "Drive: adapt_kp: is 'x'; give a number"),
        (lambda d: d.__setitem__("adapt_kp", PAIR), "Drive: adapt_kp: is array"),
        (lambda d: d.__setitem__(3, 1.0), "Drive: name: is 3"),
        (lambda d: d.commission(None), "Drive.commission: plant: is None"),
        (lambda d: d.commission(d, timeout_s=math.inf), "Drive.commission: timeout_s: is inf"),
        (lambda d: d.fit_terminals(start_control=None), "terminals: start_control: is None"),
        (lambda d: step_many(d, ROW), "step_many: drives: is <zerohertz.drive.Drive"),
        (lambda d: step_many([None], ROW), "step_many: drives: is [None]; give a list of drives"),
    ],
)
def test_a_drive_names_the_argument(d, call, text):
    refused(lambda: call(d), text)


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda p, d: p.advance(None, True), "Plant.advance: duties: is None"),
        (lambda p, d: p.advance("abc", True), "Plant.advance: duties: is 'abc'; give three"),
        (lambda p, d: p.advance((0.5, 0.5, 0.5), 2), "Plant.advance: gates_on: is 2"),
        (lambda p, d: p.advance((0.5, 0.5, 0.5), True, "x"), "Plant.advance: brake_on: is 'x'"),
        (lambda p, d: p.disturb(load_torque_Nm="x"), "Plant.disturb: load_torque_Nm: is 'x'"),
        (lambda p, d: p.disturb(rr_factor=10**400), "Plant.disturb: rr_factor: is a int"),
        (lambda p, d: p.reseed(None), "Plant.reseed: seed: is None"),
        (lambda p, d: p.run(d, 1.5), "Plant.run: periods: is 1.5"),
        (lambda p, d: p.run(d, 10**12), "Plant.run: periods: 1000000000000 is outside"),
        (lambda p, d: p.run(None, 3), "Plant.run: drive: is None; give a Drive"),
        # Each of these two ended the process: the library takes a pointer's word for it.
        (lambda p, d: p.run(p, 3), "Plant.run: drive: is <zerohertz.plant.Plant"),
        (lambda p, d: step_many([p], ROW), "step_many: drives: is [<zerohertz.plant.Plant"),
    ],
)
def test_a_plant_names_the_argument(p, d, call, text):
    refused(lambda: call(p, d), text)


@pytest.mark.parametrize("rows", [None, "abc", np.zeros((3, 4)), [1.0], events(4).reshape(2, 2)])
def test_an_estimator_takes_rows_of_events_alone(e, rows):
    refused(lambda: e.run(rows), "Estimator.run: rows: ")


@pytest.mark.parametrize(
    ("wrong", "text"),
    [
        ({"scenario": None}, "Job: scenario: is None"),
        ({"rig": 5}, "Job: rig: is 5"),
        ({"decimate": 1.5}, "Job: decimate: is 1.5; give a whole number, 1 .. 2^32 - 1"),
        ({"decimate": 2**32}, "Job: decimate: 4294967296 is outside"),
        ({"max_steps": 0}, "Job: max_steps: 0 is outside"),
        ({"seed": "x"}, "Job: seed: is 'x'"),
        ({"gain": "x"}, "Job: gain: "),
        ({"firmware": [1]}, "Job: firmware: is [1]; give a mapping"),
        ({"rig_overrides": {"motor.Rs_ohm": None}}, "Job: motor.Rs_ohm: is None"),
    ],
)
def test_a_job_names_the_argument(wrong, text):
    refused(lambda: sim.run(sim.Job(**wrong)), text)


def test_what_is_no_job_is_named():
    refused(lambda: sim.run_batch([sim.Job(max_steps=1), None]), "run: job: is None; give a Job")


def test_numbers_and_levels_of_numpy_are_taken(d, p):
    assert d.step(*np.array(Q), speed_ref_rpm=np.float32(1.0), run=np.bool_(False)).faults == 0
    p.advance(np.array([0.5, 0.5, 0.5]), np.bool_(True))
    assert len(p.run(d, np.int64(3), run=0).out) == 3
    names = ["rs_track_delta_ohm", "rs_track_delta_ohm", "state"]
    rows = p.run(d, 3, run=False, signals=(name for name in names)).out
    assert rows["rs_track_delta_ohm"].shape == (3,)


def test_drive_and_plant_have_one_period(p):
    with Drive(MOTOR, BOARD, {"period_s": 100e-6}) as other:
        refused(lambda: p.run(other, 3, run=False), "Plant.run: drive: its period is 0.0001 s")


def test_terminals_of_a_closed_drive_say_so():
    drive = Drive(MOTOR, BOARD)
    terminals = drive.fit_terminals(start_control="two_wire", full_speed_rad_s=60.0)
    terminals.wire(inputs=1, sink_ohm=math.inf)
    drive.close()
    refused(terminals.look, "Drive: is closed")
    refused(lambda: terminals.wire(inputs=1), "Drive: is closed")


@pytest.mark.parametrize(
    ("wrong", "text"),
    [
        ({"inputs": -1}, "Terminals.wire: inputs: -1 is outside 0 .. 127"),
        ({"inputs": 1 << 32}, "Terminals.wire: inputs: 4294967296 is outside"),
        ({"analog_V": math.nan}, "Terminals.wire: analog_V: is nan"),
        ({"sink_ohm": -1.0}, "Terminals.wire: sink_ohm: is -1.0; give a number that is not"),
        ({"unreadable": 7}, "Terminals.wire: unreadable: is 7; give True or False"),
    ],
)
def test_a_wire_is_named_and_the_old_one_stays(wrong, text):
    with Drive(MOTOR, BOARD) as drive:
        terminals = drive.fit_terminals()
        refused(lambda: terminals.wire(**wrong), text)
        terminals.wire(inputs=1)  # the refused value is not kept


def test_a_class_that_stands_in_no_file_is_refused():
    """A notebook's cell: workers and emulators could not find it."""
    made = types.new_class("Mine")
    for verb in ("init", "seed", "step", "hold"):
        setattr(made, verb, getattr(estimators.PythonEstimator, verb))
    made.__module__ = "__main__"
    with pytest.MonkeyPatch.context() as patch:
        patch.delattr("__main__.__file__", raising=False)
        refused(lambda: estimators.use(made), "use: made: Mine stands in no file; write it to one")
