"""Version 4 of the SIL interface from Python: arrays, signals, snapshots, and the plant beside."""

import hashlib
import math
import pickle
import re
import subprocess
import sys

import numpy as np
import pytest

from zerohertz.drive import (
    Commissioning,
    Confidence,
    Drive,
    Reason,
    Refusal,
    State,
    signal_list,
    step_many,
)
from zerohertz.errors import UserError
from zerohertz.paths import ROOT
from zerohertz.plant import Plant

MOTOR = ROOT / "gain_tables" / "hasegawa2005"
BOARD = ROOT / "host_sim" / "boards" / "paper.toml"
RIG = ROOT / "host_sim" / "rigs" / "ideal.toml"
NOISY = ROOT / "host_sim" / "rigs" / "hasegawa2005.toml"
QUIET = (8192, 8192, 8192, 8192, 8192, 11592)
SECOND = 5000


@pytest.fixture
def drive():
    with Drive(MOTOR, BOARD) as d:
        yield d


@pytest.fixture
def plant():
    with Plant(NOISY, BOARD) as p:
        yield p


def turning(drive, plant, periods=3 * SECOND):
    return plant.run(drive, periods, speed_ref_rpm=300.0, run=np.arange(periods) > 600)


def test_an_array_of_words_gives_what_single_steps_give(drive):
    rng = np.random.default_rng(1)
    words = np.column_stack([rng.integers(8100, 8300, (1500, 5)), np.full(1500, 11592)])
    run = np.arange(1500) > 600
    names = ["x_rad_s", "rs_track_delta_ohm"]
    rows = drive.run(words, speed_ref_rpm=50.0, run=run, signals=names)
    with Drive(MOTOR, BOARD) as other:
        for k, row in enumerate(words):
            out = other.step(*map(int, row), speed_ref_rpm=50.0, run=bool(run[k]))
            for name in ("duty_u", "gates_on", "state", "Rs_hat_ohm", "lambda_Wb"):
                assert rows[name][k] == np.float32(getattr(out, name))
        assert other.telemetry() == drive.telemetry() == out
    assert rows.dtype["rs_track_delta_ohm"] == np.float64
    assert rows["x_rad_s"].dtype == np.float32  # an output: not twice
    assert rows["state"][-1] in (State.PREMAGNETISE, State.FAULT)


def test_many_drives_step_at_once():
    with Drive(MOTOR, BOARD) as a, Drive(MOTOR, BOARD, {"i_d_A": 3.0}) as b:
        for k in range(604):
            rows = step_many([a, b], [QUIET, QUIET], run=k > 600)
        assert rows["duty_u"][0] > rows["duty_u"][1] > 0.5
        with pytest.raises(UserError, match=r"step_many: words: has 1 rows for 2 drives"):
            step_many([a, b], [QUIET])


def test_telemetry_tells_what_the_drive_thinks_of_itself(drive):
    plant = Plant(RIG, BOARD)
    turning(drive, plant)
    out = drive.telemetry()
    assert out.confidence == Confidence.CLOSED
    assert Reason(out.reasons) == Reason(0)
    assert out.commissioning == Commissioning.NONE
    assert out.speed_ref_rpm == 300.0
    assert out.lambda_ref_Wb == pytest.approx(0.102 * 4.5)
    assert out.lambda_Wb == pytest.approx(out.lambda_ref_Wb, rel=0.05)
    assert out.Rs_hat_ohm == pytest.approx(0.93)
    assert out.duties == (out.duty_u, out.duty_v, out.duty_w)
    truth = plant.truth()
    assert truth.speed_rpm == pytest.approx(300.0, abs=3.0)
    assert math.hypot(truth.psi_r_alpha_Wb, truth.psi_r_beta_Wb) == pytest.approx(0.459, abs=0.03)


def test_torque_mode_gives_the_torque(drive, plant):
    turning(drive, plant)
    plant.disturb(load_torque_Nm=2.0)
    done = plant.run(drive, SECOND // 5, torque_ref_Nm=2.0)
    assert done.truth["torque_Nm"][-200:].mean() == pytest.approx(2.0, rel=0.15)
    out = drive.step(*plant.sample(), torque_ref_Nm=2.0, run=True)
    assert out.i_q_ref_A == pytest.approx(done.out["i_q_ref_A"][-1], rel=0.1)


def test_signals_have_names_units_and_texts(drive, plant):
    listed = {s.name: s for s in signal_list()}
    assert listed["omega_e_hat_rad_s"].unit == "rad/s"
    assert listed["steer_out_rate_Wb_per_s"].unit == "Wb/s"
    assert listed["state"].whole
    assert not listed["i_q_A"].whole
    turning(drive, plant)
    values = drive.signals()
    assert list(values) == list(listed)
    out = drive.telemetry()
    assert values["duty_v"] == out.duty_v
    assert values["i_q_A"] == out.i_q_A
    assert drive.signals(["state", "i_d_A"]) == {"state": out.state, "i_d_A": out.i_d_A}
    with pytest.raises(UserError, match=r"Drive.signals: names: 'nothing'"):
        drive.signals(["nothing"])
    with pytest.raises(UserError, match="names: is one text"):
        drive.signals("state")


def test_a_snapshot_of_both_continues_bit_for_bit(drive, plant):
    turning(drive, plant)
    drive["i_d_A"] = 4.0
    kept = drive.snapshot(), plant.snapshot()
    first = plant.run(drive, SECOND, speed_ref_rpm=100.0)
    with Drive(MOTOR, BOARD) as heir:
        heir.restore(pickle.loads(pickle.dumps(kept[0])))
        plant.restore(kept[1])
        again = plant.run(heir, SECOND, speed_ref_rpm=100.0)
        assert heir["i_d_A"] == 4.0
    assert (first.out == again.out).all()
    assert (first.truth == again.truth).all()
    plant.restore(kept[1])
    plant.reseed(99)
    drive.restore(kept[0])
    other = plant.run(drive, SECOND, speed_ref_rpm=100.0)
    assert (first.out != other.out).any()  # another noise
    assert abs(other.truth["speed_rpm"][-1] - 100.0) < 5.0


CHILD = """
import hashlib, sys
from zerohertz import Drive
with Drive(sys.argv[1], sys.argv[2]) as drive:
    drive.restore(sys.stdin.buffer.read())
    rows = drive.run([[8200, 8190, 8188, 8300, 8100, 11592]] * 3000, speed_ref_rpm=50.0, run=True)
print(hashlib.sha256(rows.tobytes()).hexdigest())
"""


def test_a_snapshot_goes_on_in_another_process(drive, plant):
    turning(drive, plant)
    kept = drive.snapshot()
    words = [[8200, 8190, 8188, 8300, 8100, 11592]] * 3000
    rows = drive.run(words, speed_ref_rpm=50.0, run=True)
    done = subprocess.run(
        (sys.executable, "-c", CHILD, MOTOR, BOARD), input=kept, capture_output=True, check=True
    )
    assert done.stdout.decode().strip() == hashlib.sha256(rows.tobytes()).hexdigest()


def test_other_snapshots_are_refused(drive, plant):
    tuned = Drive(MOTOR, BOARD, {"adapt_kp": 5.0})
    with pytest.raises(UserError, match="motor, board or overrides"):
        drive.restore(tuned.snapshot())
    kept = bytearray(drive.snapshot())
    kept[500] ^= 1
    with pytest.raises(UserError, match="buffer: is damaged"):
        drive.restore(bytes(kept))
    with pytest.raises(UserError, match="bytes: not those"):
        drive.restore(b"")
    with pytest.raises(UserError, match=r"Drive.restore: snapshot: is no bytes"):
        drive.restore(None)
    with Plant(RIG, BOARD) as other, pytest.raises(UserError, match="from: was opened with"):
        plant.restore(other.snapshot())
    with pytest.raises(UserError, match=r"Plant.restore: snapshot"):
        plant.restore(drive.snapshot())


def test_reset_gives_the_drive_as_opened(drive, plant):
    with Drive(MOTOR, BOARD) as fresh:
        turning(drive, plant)
        drive["i_d_A"] = 3.0
        drive.reset()
        assert drive["i_d_A"] == 4.5
        words = [QUIET] * 1000
        assert (drive.run(words) == fresh.run(words)).all()


def test_a_drive_commissions_a_motor(drive):
    with Plant(RIG, BOARD) as ideal:
        found = drive.commission(ideal)
        assert found.done
        assert found.refusal == Refusal.NONE
        assert found.Rs_ohm == pytest.approx(0.93, rel=0.01)
        assert found.M_gamma_H == pytest.approx(0.102, rel=0.01)
        assert list(found.flux_Wb) == sorted(found.flux_Wb)
        assert drive.telemetry().commissioning == Commissioning.DONE
        assert drive.telemetry().gates_on is False


class NoMotor:
    """Nothing at the terminals."""

    def sample(self):
        return QUIET

    def advance(self, duties, gates_on):
        pass


def test_commissioning_nothing_is_refused_or_trips(drive):
    with pytest.raises(UserError, match=r"timeout_s: -1"):
        drive.commission(NoMotor(), timeout_s=-1)
    with pytest.raises(UserError, match=r"timeout_s: not done"):
        drive.commission(NoMotor(), timeout_s=0.05)
    try:
        assert not drive.commission(NoMotor()).done
    except UserError as error:
        assert "Drive.commission: plant: the drive tripped" in str(error)  # noqa: PT017


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda d: d.run([1, 2]), r"Drive.run: words: has shape \(2,\)"),
        (lambda d: d.run([[0.5] * 6]), "Drive.run: words: are of type float64"),
        (lambda d: d.run([[70000] * 6]), r"Drive.run: words: .* clip them"),
        (lambda d: d.run([QUIET] * 2, speed_ref_rpm=[1, 2, 3]), "speed_ref_rpm: "),
        (lambda d: d.run([QUIET] * 2, torque_ref_Nm="much"), "torque_ref_Nm: "),
        (lambda d: d.run([QUIET] * 2, run=[True] * 3), "run: "),
        (lambda d: d.run([QUIET], signals=["no"]), "signals: 'no': no such signal"),
        (lambda d: d.run([QUIET] * 3, speed_ref_rpm=[0, math.nan, 0]), "element 1: .*speed_ref"),
        (lambda d: d.step(*QUIET, torque_ref_Nm=math.inf), "torque_ref_Nm: is not a finite"),
    ],
)
def test_what_is_wrong_with_an_argument_is_named(drive, call, text):
    with pytest.raises(UserError, match=text):
        call(drive)


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda p: p.advance((0.5, 0.5), True), "duties: are 2; give three"),
        (lambda p: p.advance((0.5, 0.5, 1.5), True), r"duty: is not in 0 \.\. 1"),
        (lambda p: p.disturb(rs_factor=0.0), "rs_factor: is not in"),
        (lambda p: p.reseed(-1), "seed: -1"),
        (lambda p: Plant("/nowhere.toml", BOARD), "nowhere.toml"),
        (lambda p: Plant(RIG, BOARD, rig_overrides={"motor.Rs_ohm": -1}), "Rs_ohm"),
        (lambda p: Plant(RIG, BOARD, "/nowhere.toml"), "nowhere.toml"),
    ],
)
def test_what_is_wrong_with_a_plant_is_named(plant, call, text):
    with pytest.raises(UserError, match=text):
        call(plant)


def test_a_plant_can_start_turning():
    text = '[scenario]\nname = "s"\nduration_s = 1.0\ninitial_speed_rpm = 90\n'
    text += "[profiles]\nspeed_ref_rpm = [[0, 0]]\n"
    with Plant(RIG, BOARD, text) as p:
        assert p.truth().speed_rpm == pytest.approx(90.0)
        for _ in range(10):
            p.sample()
            p.advance((0.5, 0.5, 0.5), False)
        assert p.truth().t_s == pytest.approx(10 * 200e-6)


def test_the_page_says_what_works():
    page = (ROOT / "tools" / "docs" / "python.md").read_text()
    said = re.search(r"snapshot is bytes \(([\d ]+) of", page)
    with Drive(MOTOR, BOARD) as drive:
        assert int(said[1].replace(" ", "")) == len(drive.snapshot())
    first, _, monte_carlo = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    names = {}
    exec(first + monte_carlo.replace("1001", "4"), names)
    assert names["done"].truth["speed_rpm"][-1] == pytest.approx(300.0, abs=3.0)
    assert 0.0 < names["worst"] < 10.0
