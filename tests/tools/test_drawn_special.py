"""`zh special hot_motor` and `torque`: what is drawn, how a motor warms up, what counts."""

from __future__ import annotations

import dataclasses
import json
import math

import numpy as np
import pytest
from test_special import record
from typer.testing import CliRunner

from zerohertz.atlas import hot_motor, torque
from zerohertz.atlas.bench_run import NAMEPLATE_RS_OHM, RATED_TORQUE_NM
from zerohertz.cli import make_app
from zerohertz.scenario.setup import load_setup

SEED = 4


@pytest.fixture(scope="module")
def setup():
    return load_setup("recommended")


def cold(setup):
    return dataclasses.replace(setup, params={**setup.params, "heat_rise": 0.0})


def test_a_run_is_drawn_the_same_again_and_no_other_is_like_it(setup):
    first, again, other = (hot_motor.draw(setup, SEED, k, False, 60.0) for k in (4, 4, 5))
    assert first == again
    assert first.bodies != other.bodies
    band = torque.BANDS["slow"]
    first, again, other = (torque.draw(SEED, k, band) for k in (4, 4, 5))
    assert first == again
    assert first.rig != other.rig


def test_the_draws_fill_their_ranges(setup):
    drawn = [hot_motor.draw(setup, 1, k, False, 60.0) for k in range(200)]
    speeds = [abs(d.speed_rpm) for d in drawn]
    assert 300.0 <= min(speeds) < 340.0
    assert 1670.0 < max(speeds) <= 1710.0
    for name, spread in hot_motor.SPREAD.items():
        shares = [d.bodies[name] / hot_motor.GROUND[name] for d in drawn]
        assert 1.0 - spread <= min(shares) < 1.0 - 0.9 * spread
        assert 1.0 + 0.9 * spread < max(shares) <= 1.0 + spread
    band = torque.BANDS["slow"]
    draws = [torque.draw(1, k, band) for k in range(200)]
    assert {math.copysign(1.0, t) for d in draws for t in d.torques_Nm} == {-1.0, 1.0}
    assert all(30.0 <= abs(d.speed_rpm) <= 60.0 for d in draws)
    assert 20 < sum("motor.saturation.law" in d.rig for d in draws) < 90


def test_saturation_leaves_the_drawn_m_at_rated_flux():
    for law in torque.SATURATIONS[1:]:
        knee_Wb = law["motor.saturation.flux_knee_Wb"]
        assert torque.unsaturated(law, knee_Wb / torque.RATED_FLUX_WB) == pytest.approx(2.0)
    assert torque.unsaturated({}, 1.0) == 1.0


def heated(setup, **bodies):
    """The motor as it is meant, in steady state at these currents, without iron loss."""
    drawn = hot_motor.draw(setup, SEED, 0, False, 60.0)
    same = {**hot_motor.GROUND, "iron_W": 0.0, **bodies}
    rig = {**drawn.rig, "motor.Rr_ohm": 0.5}
    drawn = dataclasses.replace(drawn, bodies=same, rig=rig)
    # 9 A across .5 Wb
    pilot = record(4.0, i_abs_A=10.0, torque_Nm=9.0, lambda_Wb=0.5)
    return drawn, hot_motor.warm(drawn, pilot)


def test_bodies_warm_up_as_their_losses_say(setup):
    quick = {name: 1.0 for name in hot_motor.GROUND if name.endswith("J_per_K")}
    quick = dict.fromkeys(quick, 20.0)
    drawn, (Rs, Rr) = heated(setup, **quick)
    b = drawn.bodies
    stator_W = drawn.what.rs_ratio * 0.93 * 100.0 * Rs[-1]
    rotor_W = 0.5 * 81.0 * Rr[-1]
    frame_K = (stator_W + rotor_W) / b["frame_W_per_K"]
    assert (Rs[-1] - 1.0) / 0.0039 == pytest.approx(
        frame_K + stator_W / b["winding_W_per_K"], rel=1e-3
    )
    assert (Rr[-1] - 1.0) / b["cage_per_K"] == pytest.approx(
        frame_K + rotor_W / b["rotor_W_per_K"], rel=1e-3
    )
    assert (Rs[0], Rr[0]) == (1.0, 1.0)
    assert len(Rs) == hot_motor.POINTS + 1


@pytest.mark.parametrize("k", [0, 3])
def test_the_speed_of_a_warm_motor_is_right_and_was_not(setup, k):
    row, _ = hot_motor.one(setup, SEED, k)
    assert not row["lost"]
    assert row["value"] <= hot_motor.LIMIT_RPM, row
    before, _ = hot_motor.one(cold(setup), SEED, k)
    assert before["value"] > 1.5 * hot_motor.LIMIT_RPM, before
    assert math.copysign(1.0, before["error_rpm"]) == -1.0  # it slips more than it says


@pytest.mark.parametrize("k", [0, 1, 2])
def test_torque_at_speed_is_right(setup, k):
    rows, _ = torque.one(setup, SEED, k, torque.BANDS["fast"])
    assert [abs(row["torque_Nm"]) / RATED_TORQUE_NM for row in rows] == [1.0, 0.5, 0.75]
    assert all(row["value"] <= 0.01 for row in rows), rows


def test_m_that_is_found_at_speed_mends_the_torque_at_low_speed(setup):
    band = torque.BANDS["slow"]
    blind = dataclasses.replace(setup, params={**setup.params, "m_track": 0})
    driving, unmended = (
        [row["value"] for k in (1, 3, 5) for row in torque.one(s, 7, k, band)[0] if row["driving"]]
        for s in (setup, blind)
    )
    assert max(driving) <= band.limit_pu
    assert max(unmended) > 1.5 * max(driving)


def test_summaries_count_what_was_lost():
    rows = [
        {"run": k, "value": v, "worst_of_hour_rpm": v, "lost": math.isinf(v), "Rr_pu": 1.2}
        | {"Rs_hat_pu": 1.0 + k / 10.0, "crossed": True, "crossing_worst_rpm": 10.0 * v}
        for k, v in enumerate((1.0, 4.4, 4.6, math.inf))
    ]
    found = hot_motor.summary(rows)
    assert (found["crossing_median_rpm"], found["crossing_worst_rpm"]) == (46.0, None)
    assert found["crossing_lost"] == [3]
    assert found["Rs_hat_worst_pu"] == 1.3
    assert found["within"] == 2
    assert found["lost"] == [3]
    assert found["error_median_rpm"] == 4.6
    assert found["error_worst_rpm"] is None
    some = [
        {"run": k, "value": v, "lost": math.isinf(v), "driving": k != 3}
        for k, v in enumerate((0.01, 0.05, 0.051, math.inf))
    ]
    result = torque.summary(torque.BANDS["slow"], some)
    assert result["within"] == 2
    assert (result["driving_within"], result["driving_torques"]) == (2, 3)
    assert (result["braking_within"], result["braking_p95_pu"]) == (0, None)
    assert result["lost"] == [3]


def test_the_commands_print_one_json_object_and_fail_when_a_goal_is_missed():
    options = ["--runs", "1", "--seed", "4", "-j", "1", "--json"]
    done = CliRunner().invoke(make_app(), ["special", "hot_motor", *options])
    assert done.exit_code == 0, done.output
    said = json.loads(done.stdout)
    assert said["met"] == {"averaged": True, "switched": True}
    assert said["averaged"]["runs"] == said["switched"]["runs"] == 1
    done = CliRunner().invoke(make_app(), ["special", "torque", *options, "--config", "paper"])
    assert done.exit_code == 1, done.output
    assert json.loads(done.stdout)["met"]["slow"] is False


def test_a_warm_start_has_the_last_values_from_the_beginning(setup):
    row, record = hot_motor.one(setup, SEED, 0, thermal=hot_motor.Thermal.WARM)
    drawn = hot_motor.draw(setup, SEED, 0, False, 60.0)
    Rs_pu = record["Rs_true_ohm"] / (drawn.what.rs_ratio * NAMEPLATE_RS_OHM)
    Rs_pu = Rs_pu[record.t_s < drawn.what.duration_s]
    assert Rs_pu == pytest.approx(row["Rs_pu"], rel=1e-5)
    assert row["Rs_pu"] > 1.2
    assert row["crossing_worst_rpm"] > 30.0  # Rs in use is a quarter too high
    end_s = drawn.what.duration_s
    assert abs(record["speed_ref_rpm"][record.t_s > end_s + 20.0]).max() == pytest.approx(150.0)


def test_a_motor_that_stays_cool_gets_an_Rs_that_is_too_high(setup):
    row, record = hot_motor.one(setup, SEED, 0, thermal=hot_motor.Thermal.COOL)
    assert np.ptp(record["Rs_true_ohm"]) == 0.0
    assert row["Rs_hat_pu"] > 1.15
