"""zerohertz.atlas.zero_hertz: a load that keeps the stator frequency at zero, and who holds."""

from __future__ import annotations

import dataclasses
import json
import math

import numpy as np
import pytest
from test_special import record
from typer.testing import CliRunner

from zerohertz.atlas import zero_hertz, zero_hertz_animation, zero_hertz_picture
from zerohertz.atlas.zero_hertz import Dwell
from zerohertz.cli import make_app
from zerohertz.scenario.setup import load_setup
from zerohertz.stability import dwell

SEED = 5
SHORT = Dwell(speeds_rpm=(30.0,), seconds=60.0, arrival_pu=0.03)


@pytest.fixture(scope="module")
def setup():
    return load_setup("recommended")


def test_a_run_is_drawn_the_same_again_and_no_other_is_like_it():
    first, again, other = (zero_hertz.draw(Dwell(), SEED, k) for k in (4, 4, 5))
    assert first == again
    assert first.rig != other.rig
    assert first.what.seed != other.what.seed


def test_the_draws_fill_their_ranges():
    drawn = [zero_hertz.draw(Dwell(), 1, k).numbers for k in range(300)]
    arrivals = [d["arrival"] for d in drawn]
    assert 0.8 <= min(arrivals) < 0.82
    assert 1.18 < max(arrivals) <= 1.2
    assert {abs(d["speed_rpm"]) for d in drawn} == {0.0, 15.0, 30.0}
    assert {math.copysign(1.0, d["speed_rpm"]) for d in drawn} == {-1.0, 1.0}
    assert {round(d["drift"], 6) for d in drawn} == {0.8, 1.2}
    assert 40 < sum(d["switched"] for d in drawn) < 110
    assert {d["inverter"] for d in drawn} == set(range(len(zero_hertz.INVERTERS)))


def test_load_steps_go_on_and_off_every_minute():
    what = zero_hertz.draw(dataclasses.replace(SHORT, seconds=200.0, load_step_pu=0.25), 1, 0).what
    values = [value for _, value in what.load_Nm]
    assert values[3:] == pytest.approx([values[2], 1.25 * values[2], 1.25 * values[2], values[2]])


def test_it_dwells_where_it_is_lost_without_the_modulation(setup):
    row, held = zero_hertz.one(setup, SHORT, SEED, 0)
    assert row["held"], row
    assert row["error_rpm"] < 16.0
    assert row["angle_deg"] < 15.0
    assert row["mean_frequency_Hz"] < 0.1
    assert row["bound_kept_pu"] > 0.99 or row["closed_pu"] == 0.0
    late = held.t_s > 60.0
    assert np.abs(held["f_s_Hz"][late].mean()) < 0.02
    off = dataclasses.replace(SHORT, firmware={"dwell": 0})
    lost = zero_hertz.one(setup, off, SEED, 0)[0]
    assert not lost["held"] or lost["angle_deg"] > 25.0


def test_the_inverters_curve_holds_what_its_loss_alone_loses(setup):
    """Voltage from the duty, and an inverter whose loss falls at .05 A, not at .25."""
    ask = dataclasses.replace(zero_hertz.RATED, seconds=60.0, arrival_pu=0.04)
    loss = dataclasses.replace(setup, params={**setup.params, "dead_time_identify": 1})
    seed = 3342257134
    drawn = [(k, zero_hertz.draw(ask, seed, k).numbers) for k in range(96)]
    runs = [k for k, numbers in drawn if numbers["duty"] == 1.0 and numbers["inverter"] == 1]
    assert len(runs) > 8  # one run alone changes sides with every change of the law
    rows = [zero_hertz.one(setup, ask, seed, k)[0] for k in runs]
    assert all(row["held"] for row in rows), rows
    assert np.median([row["error_rpm"] for row in rows]) < 30.0
    assert sum(not zero_hertz.one(loss, ask, seed, k)[0]["held"] for k in runs) >= 3


def test_held_is_torque_to_the_end_without_a_take_over():
    whole = {
        "omega_bound_rpm": 9.0,
        "confidence": 0.0,
        "speed_hat_rpm": 60.0,
        "torque_Nm": 1.0,
    }
    whole |= {
        "i_peak_A": 5.0,
        "i_abs_A": 5.0,
        "Rs_hat_ohm": 1.0,
        "Rs_true_ohm": 1.0,
        "f_s_Hz": 0.01,
    }
    row = zero_hertz.judge(record(60.0, **whole), 5.0, 60.0)
    assert row["held"]
    assert row["mean_frequency_Hz"] == pytest.approx(0.01)
    assert row["bound_kept_pu"] == 1.0
    taken = {**whole, "confidence": lambda t: np.where(t > 50.0, 2.0, 0.0)}
    assert not zero_hertz.judge(record(60.0, **taken), 5.0, 60.0)["held"]
    gone = {**whole, "gates_on": lambda t: (t < 50.0) * 1.0}
    row = zero_hertz.judge(record(60.0, **gone), 5.0, 60.0)
    assert not row["held"]
    assert row["lost_s"] == pytest.approx(45.0, abs=0.02)
    assert not zero_hertz.judge(record(50.0, **whole), 5.0, 60.0)["held"]


def test_the_summary_counts_and_takes_the_worst():
    good = dict.fromkeys(zero_hertz.MEASURED, 1.0) | {
        "held": True,
        "within": True,
        "run": 0,
    }
    bad = dict.fromkeys(zero_hertz.MEASURED, math.nan)
    bad |= {"held": False, "within": False, "run": 1, "fault": 0}
    found = zero_hertz.summary(Dwell(), [good | {"error_rpm": 7.0}, good, bad])
    assert (found["runs"], found["held"], found["within"]) == (3, 2, 2)
    assert found["error_worst_rpm"] == 7.0
    assert (found["lost_undeclared"], found["lost_runs"]) == (1, [1])


def test_the_command_prints_what_the_issue_asks_for():
    asked = [
        "special",
        "zero_hertz",
        "--runs",
        "1",
        "--seconds",
        "40",
        "--arrival",
        "0.02",
    ]
    done = CliRunner().invoke(make_app(), [*asked, "--seed", "3", "--json", "-j", "1"])
    said = json.loads(done.stdout)
    assert {"runs", "held", "error_worst_rpm", "angle_worst_deg"} < set(said)
    assert {"mean_frequency_worst_Hz", "torque_rms_worst_Nm", "i_peak_worst_A"} < set(said)
    assert said["rated"]["runs"] == 1
    refused = CliRunner().invoke(make_app(), ["special", "zero_hertz", "--modulation", "square"])
    assert refused.exit_code != 0
    refused = CliRunner().invoke(make_app(), ["special", "zero_hertz", "--identify", "all"])
    assert "'all' is unknown; known are configured, off, loss, curve" in str(refused.exception)


def test_the_picture_shows_the_run(setup, tmp_path):
    path = tmp_path / "dwell.png"
    row, run = zero_hertz.one(setup, dataclasses.replace(SHORT, seconds=30.0), SEED, 0)
    zero_hertz_picture.write_png(path, row, run)
    assert path.read_bytes()[:4] == b"\x89PNG"


def test_the_animation_grows_to_the_whole_run(setup, tmp_path):
    from PIL import Image

    path = tmp_path / "dwell.gif"
    row, run = zero_hertz.one(setup, dataclasses.replace(SHORT, seconds=30.0), SEED, 0)
    zero_hertz_animation.write_gif(path, row, run)
    with Image.open(path) as image:
        assert image.n_frames == zero_hertz_animation.FRAMES
    assert path.stat().st_size < 1_500_000


@pytest.mark.parametrize(("kind", "amplitude"), [("speed", 1.0), ("flux", 0.1)])
def test_a_modulation_tells_the_speed_that_constant_flux_hides(kind, amplitude):
    motor = dwell.machine()
    still = dwell.deviations(motor, 6.28, 5.1, kind, 0.0, 1.3)
    moved = dwell.deviations(motor, 6.28, 5.1, kind, amplitude, 1.3)
    assert still.speed > 50.0
    assert moved.speed < 0.05
    assert moved.flux < 0.5
    assert still.Rs < 0.02  # the easy parameter
    twice = dwell.deviations(motor, 6.28, 5.1, "speed", 2.0, 1.3)
    assert twice.speed < dwell.deviations(motor, 6.28, 5.1, "speed", 1.0, 1.3).speed


def test_a_swing_of_the_speed_tells_a_wrong_rr_from_a_wrong_speed_no_better_than_none():
    motor = dwell.machine()
    together = dwell.deviations(motor, 6.28, 5.1, "speed", 1.3, 1.3, Rr_known=False)
    assert together.speed > 10.0
    assert together.Rr > 500.0
    # Along the direction that nothing tells, 1 % of Rr is 1 % of the slip.
    assert together.speed / together.Rr == pytest.approx(0.01 * 6.28, rel=0.05)
    apart = dwell.deviations(motor, 6.28, 5.1, "flux", 0.2, 1.3, Rr_known=False)
    assert apart.speed < 0.1
    assert apart.Rr < 1.0
