"""zerohertz.atlas: the special tests' judgement, and floors that any tuning of the firmware keeps.

The floors use a fixed tuning without any means against wrong parameters, on a motor whose Rs is 2 %
below the nameplate's where that matters (what it needs at zero stator frequency): they hold the
bench, the plant and the measuring, and not the configuration of the day.
"""

from __future__ import annotations

import dataclasses
import json
import math

import numpy as np
import pytest
import typer

from zerohertz import sim
from zerohertz.atlas import bench_run, performance, special, special_command
from zerohertz.atlas.bench_run import Experiment, Verdict, judge
from zerohertz.atlas.points import Point
from zerohertz.atlas.simulate import RIG, job_of
from zerohertz.atlas.variations import VARIATIONS, benches, variations
from zerohertz.errors import UserError
from zerohertz.paths import ROOT
from zerohertz.scenario.setup import Setup

FIXED = Setup(
    name="fixed",
    motor_dir=ROOT / "gain_tables" / "hasegawa2005_recommended",
    board=ROOT / "host_sim" / "boards" / "paper.toml",
    rig=RIG,
    params={
        "adapt_kp": 1.95,
        "adapt_ki": 2468.0,
        "phi_factor": 0.576,
        "speed_bandwidth_rad_s": 20.0,
        "i_d_A": 5.3,
    },
)


RS_RATIO = 0.98


def record(duration_s=10.0, **columns) -> sim.Record:
    """A made-up record, 10 ms rows, holding 60 min^-1; columns are values or functions of t."""
    t_s = np.arange(-1.0, duration_s, 0.01)
    made = {
        "t_s": t_s,
        "speed_rpm": 60.0,
        "speed_ref_rpm": 60.0,
        "state": 4.0,
        "gates_on": 1.0,
        "flux_angle_err_deg": 1.0,
        "f_s_Hz": 1.0,
    } | columns
    first_fault = made.pop("first_fault", 0)
    arrays = {
        name: np.broadcast_to(v(t_s) if callable(v) else v, t_s.shape) for name, v in made.items()
    }
    return sim.Record(arrays, len(t_s), 2e-4, sim.Trip(0), None, first_fault, None, 0.0, 0.0, 0.0)


def after(start_s, value, before):
    return lambda t_s: np.where(t_s >= start_s, value, before)


@pytest.mark.parametrize(
    ("columns", "verdict"),
    [
        ({}, Verdict.HELD),
        ({"speed_rpm": 69.9}, Verdict.HELD),
        ({"speed_rpm": after(5.0, 71.0, 60.0)}, Verdict.OFF_LIMIT),
        # Declared, and the load not lost: a take-over; declared too late is not.
        (
            {"speed_rpm": after(5.0, 90.0, 60.0), "confidence": after(5.0, 2.0, 0.0)},
            Verdict.TAKEOVER,
        ),
        (
            {"speed_rpm": after(5.0, 90.0, 60.0), "confidence": after(6.0, 2.0, 0.0)},
            Verdict.OFF_LIMIT,
        ),
        ({"speed_rpm": after(5.0, 90.0, 60.0), "confidence": 1.0}, Verdict.OFF_LIMIT),
        ({"speed_rpm": after(5.0, -91.0, 60.0), "confidence": 2.0}, Verdict.LOST),
        ({"gates_on": after(5.0, 0.0, 1.0), "first_fault": 64}, Verdict.SAFE_STOP),
        ({"gates_on": after(5.0, 0.0, 1.0)}, Verdict.LOST),
        # A fault after the load has gone is no safe stop any more.
        (
            {
                "speed_rpm": after(5.0, 300.0, 60.0),
                "gates_on": after(6.0, 0.0, 1.0),
                "first_fault": 64,
            },
            Verdict.LOST,
        ),
        ({"speed_rpm": after(-0.1, 95.0, 60.0)}, Verdict.FAILED_START),
        ({"state": after(0.0, 4.0, 3.0)}, Verdict.FAILED_START),
    ],
)
def test_an_experiment_is_judged_by_what_the_shaft_did(columns, verdict):
    assert judge(record(**columns), 10.0, 10.0).verdict is verdict


def test_a_record_that_ends_early_is_lost():
    assert judge(record(duration_s=5.0), 10.0, 10.0).verdict is Verdict.LOST


def test_the_time_of_the_loss_counts_from_the_beginning():
    judged = judge(record(speed_rpm=after(5.0, 300.0, 60.0)), 10.0, 10.0)
    assert judged.lost_s == pytest.approx(5.0, abs=0.02)
    assert judged.takeover_pu == 0.0


def test_rise_of_a_first_order_torque():
    """10 to 90 % of an exponential: ln 9 of its time constant."""
    tau_s = 2e-3
    t_s = np.arange(-1.0, 2.0, 2e-4)
    since = np.maximum(t_s - 1.0, 0.0)
    made = record(1.0).columns | {
        "t_s": t_s,
        "torque_Nm": 1.0 - 9.0 * np.expm1(-since / tau_s),
    }
    rise_s, change_Nm = performance.rise(dataclasses.replace(record(), columns=made), 1.0)
    assert rise_s == pytest.approx(math.log(9.0) * tau_s, rel=0.01)
    assert change_Nm == pytest.approx(9.0, rel=1e-3)


def test_minus_3_dB_of_a_first_order_loop():
    sweep_Hz = np.array(performance.SWEEP_HZ)
    gains = 1.0 / np.sqrt(1.0 + (sweep_Hz / 7.0) ** 2)
    assert performance.minus_3_dB_Hz(sweep_Hz, gains) == pytest.approx(7.0, rel=0.02)
    assert performance.minus_3_dB_Hz(sweep_Hz, np.ones_like(gains)) == sweep_Hz[-1]
    assert performance.minus_3_dB_Hz(sweep_Hz, np.full_like(gains, 0.1)) == 0.0
    assert math.isnan(performance.minus_3_dB_Hz(sweep_Hz, np.where(sweep_Hz > 9, np.nan, gains)))


def test_the_dwell_is_at_zero_stator_frequency():
    """The load of the dwell against a run: while the drive holds, the flux stands still."""
    what = Experiment(
        duration_s=8.0,
        speed_rpm=[(0.0, special.DWELL_RPM)],
        rs_ratio=RS_RATIO,
        load_Nm=[(0.0, 0.0), (5.0, special.dwell_load_Nm(0.5397, special.DWELL_RPM))],
    )
    run = bench_run.run(FIXED, what)
    assert judge(run, 8.0, 30.0).verdict is Verdict.HELD
    arrived = bench_run.window(run, 5.0, 6.0)
    assert abs(run["f_s_Hz"][arrived].mean()) < 0.15
    assert run["f_s_Hz"][bench_run.window(run, 0.0, 0.5)].mean() > 0.9


def test_floors_of_the_holds():
    held = special.hold(FIXED, RS_RATIO, drift=False, ramp_s=10.0, hold_s=20.0)
    assert held.met
    assert held.verdict is Verdict.HELD
    assert held.measured["worst_rpm"] < 10.0
    # Told 30 % too little and nothing done about it, the point cannot be held: it must show.
    lost = special.hold(FIXED, 1.5, drift=False, ramp_s=10.0, hold_s=20.0)
    assert not lost.met
    assert lost.verdict in (Verdict.LOST, Verdict.SAFE_STOP)


def test_floors_of_the_performance():
    assert performance.static_accuracy(FIXED, 300.0, 0.5).met
    assert performance.starting_torque(FIXED).measured["mean_torque_pu"] > 1.4
    rise = performance.torque_rise(FIXED, 300.0, 600.0).measured
    # A current loop of 400 rad/s: ln 9 / 400 = 5.5 ms and the delay.
    assert 4.0 < rise["rise_ms"] < 8.0
    assert rise["torque_change_Nm"] > 12.0


@pytest.mark.parametrize("f_Hz", [1.0, 3.0, 8.0])
def test_the_sine_sees_the_loop_as_designed(f_Hz):
    """The speed PI on an inertia, estimate and speed filter in the feedback, current loop as one
    pole. Estimate: s^2 + (|p1| + g kp) s + g ki, g = lambda^2/(sigma Ls), with the p1 of the table
    at 450 min^-1."""
    s = 2j * np.pi * f_Hz
    kp, ki = FIXED.params["adapt_kp"], FIXED.params["adapt_ki"]
    g = (0.102 * FIXED.params["i_d_A"]) ** 2 / 0.008
    estimate = g * (kp * s + ki) / (s * s + (335.0 + g * kp) * s + g * ki)
    bandwidth = FIXED.params["speed_bandwidth_rad_s"]
    forward = bandwidth * (1.0 + 0.25 * bandwidth / s) / s / (1.0 + s / 400.0)
    truth = abs(forward / (1.0 + forward * estimate / (1.0 + 3e-3 * s)))
    assert performance.sine_gain(FIXED, 450.0, 0.0, f_Hz) == pytest.approx(truth, rel=0.05)


def test_findings_are_json_whatever_they_measured():
    lost = special.hold(FIXED, 1.5, drift=False, ramp_s=1.0, hold_s=2.0)
    odd = dataclasses.replace(lost, measured=dict(lost.measured) | {"x": math.inf, "y": None})
    assert json.loads(json.dumps(odd.as_json(), allow_nan=False))["x"] is None


def test_the_cases_are_those_of_the_goals():
    count = {name: len(test.cases(FIXED)) for name, test in special.TESTS.items()}
    assert count["test_R"] == 10  # five errors, without and with drift
    assert count["slow_crossing"] == 10  # five errors, both loads
    assert count["dwell"] == 5
    assert count["situations"] == 4
    assert set(performance.GOALS) < set(count)
    assert special.chosen(["dwell", "test_R"]) == ["test_R", "dwell"]
    assert special.chosen([]) == list(special.TESTS)
    with pytest.raises(UserError, match="dwel' is unknown"):
        special.chosen(["dwel"])


def test_results_come_in_the_order_of_the_tests():
    results = special.run_tests(FIXED, ["starting_torque", "speed_range"], workers=2)
    assert [r.name for r in results] == ["speed_range", "starting_torque"]
    assert [len(r.findings) for r in results] == [2, 1]
    for result in results:
        assert result.met == all(f.met for f in result.findings)
        assert sum(result.as_json()["verdicts"].values()) == len(result.findings)


@pytest.fixture(scope="module")
def nominal():
    return easy_point("nominal")


def easy_point(name):
    """300 min^-1 and half load, as a point of the atlas runs it."""
    (bench,) = benches(FIXED, {}, {}, name).values()
    point = Point(map="x", index=0, seed=1, speed_rpm=300.0, load_pu=0.5, rs_ratio=1.0)
    return sim.run(job_of(bench, point))


@pytest.mark.parametrize("name", [v.name for v in VARIATIONS])
def test_every_variation_is_another_plant_and_holds_an_easy_point(name, nominal):
    run = easy_point(name)
    late = run.t_s > run.t_s[-1] - 1.0
    assert run.first_fault == 0
    assert abs(run["speed_rpm"][late].mean() - 300.0) < 8.55
    assert np.array_equal(run["i_q_A"], nominal["i_q_A"]) == (name == "nominal")


@pytest.mark.parametrize("name", ["fine_steps", "heun"])
def test_finer_steps_change_next_to_nothing(name, nominal):
    """The integrator is not what the results depend on."""
    assert np.abs(easy_point(name)["speed_rpm"] - nominal["speed_rpm"]).max() < 0.1


def test_what_the_user_sets_has_the_last_word():
    found = benches(FIXED, {"delay_comp_periods": 2.0}, {"mechanics.J_kg_m2": 0.05}, "all")
    assert list(found) == [v.name for v in VARIATIONS]
    assert found["inertia_low"].plant == {"mechanics.J_kg_m2": 0.05}
    assert found["delay_2"].firmware == {"delay_comp_periods": 2.0}
    assert found["delay_2"].plant["control.delay_periods"] == 2
    (usual,) = benches(FIXED, {}, {}, None).values()
    assert usual.plant == {}


def test_unknown_variations_are_refused_by_name():
    with pytest.raises(UserError, match="--variation: 'heum' is unknown"):
        variations("heum")
    names = [v.name for v in variations("all")]
    assert len(set(names)) == len(names)


CONFIG = """
[config]
name = "fixed"
motor = "hasegawa2005_recommended"
board = "paper"
rig = "atlas"
[params]
speed_bandwidth_rad_s = {}
i_d_A = 5.3
phi_factor = 0.576
"""


@pytest.mark.parametrize(("bandwidth_rad_s", "met"), [(31.0, True), (4.0, False)])
def test_the_command_says_what_it_measured_and_fails_with_the_goal(
    bandwidth_rad_s, met, tmp_path, capsys
):
    """A speed loop this slow falls back by far more than the starting torque's goal allows."""
    path = tmp_path / "fixed.toml"
    path.write_text(CONFIG.format(bandwidth_rad_s))
    code = 0
    try:
        special_command.special(["starting_torque"], str(path), workers=1, as_json=True)
    except typer.Exit as exit:
        code = exit.exit_code
    said = json.loads(capsys.readouterr().out)
    assert said["config"] == "fixed"
    assert said["starting_torque"]["met"] is met
    assert said["starting_torque"]["findings"][0]["backwards_rpm"] > 0.0
    assert code == (0 if met else 1)
