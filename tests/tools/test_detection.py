"""The judge of the supervisor, and a seeded sample of what it judges."""

import dataclasses

import numpy as np
import pytest

from zerohertz import sim
from zerohertz.atlas import detection
from zerohertz.paths import ROOT
from zerohertz.scenario.setup import load_setup

STEP_S = 1e-3


def record_of(trip: int = 0, **columns: object) -> sim.Record:
    """A record of 15.5 s in RUN that is oriented and CLOSED, but for the columns given."""
    n = round(detection.MISSION_S / STEP_S)
    plain = {
        "state": 4.0,
        "speed_ref_rpm": 300.0,
        "speed_rpm": 300.0,
        "speed_hat_rpm": 302.0,
        "omega_bound_rpm": 5.0,
        "lambda_Wb": 0.5,
        "lambda_hat_Wb": 0.5,
        "flux_angle_err_deg": 3.0,
        "f_s_Hz": 10.0,
        "confidence": 0.0,
        "supervisor_reasons": 0.0,
    }
    full = {"t_s": STEP_S * np.arange(n, dtype=np.float32)}
    for name, value in (plain | columns).items():
        full[name] = np.broadcast_to(np.float32(value), (n,)).copy()
    return sim.Record(full, n, STEP_S, sim.Trip(trip), None, 0, None, 0.0, 0.0, 0.0)


def during(start_s: float, end_s: float, inside: float, outside: float) -> np.ndarray:
    t_s = STEP_S * np.arange(round(detection.MISSION_S / STEP_S))
    return np.where((t_s >= start_s) & (t_s < end_s), inside, outside)


def test_a_delay_counts_from_25_degrees_to_the_first_doubt():
    angle = during(8.0, 9.0, -40.0, 3.0)
    seen = detection.find(
        record_of(flux_angle_err_deg=angle, confidence=during(8.03, 9.0, 1.0, 0.0)), "x"
    )
    assert [d.seen for d in seen.delays] == [True]
    assert seen.delays[0].seconds == pytest.approx(0.03, abs=1.5e-3)
    assert seen.silent_s == pytest.approx(0.03, abs=1.5e-3)
    assert seen.indicated_s is None
    unseen = detection.find(record_of(flux_angle_err_deg=angle), "x")
    assert [d.seen for d in unseen.delays] == [False]
    assert unseen.delays[0].seconds == pytest.approx(1.0, abs=2e-3)


def test_a_wrong_flux_magnitude_is_lost_as_well():
    found = detection.find(record_of(lambda_hat_Wb=during(8.0, 8.2, 0.63, 0.5)), "x")
    assert found.delays == ()
    assert found.silent_s == pytest.approx(0.2, abs=2e-3)
    assert found.first_lost_s == pytest.approx(8.0, abs=2e-3)


def test_a_false_alarm_counts_by_its_reason():
    doubt = during(8.0, 9.0, 1.0, 0.0)
    unsure = detection.judge_mission(record_of(confidence=doubt, supervisor_reasons=doubt))
    assert (unsure.loss_alarms, unsure.unsure_alarms) == (0, 1)
    loss = detection.judge_mission(record_of(confidence=doubt, supervisor_reasons=2.0 * doubt))
    assert (loss.loss_alarms, loss.unsure_alarms) == (1, 0)
    slow = detection.judge_mission(
        record_of(confidence=doubt, supervisor_reasons=2.0 * doubt, f_s_Hz=-0.9)
    )
    assert slow.loss_alarms == 0
    asked = detection.judge_mission(record_of(confidence=2.0 * doubt, f_s_Hz=0.1))
    assert asked.impressed == 1


def test_only_missions_that_stayed_oriented_and_held_count():
    assert detection.judge_mission(record_of()).oriented
    assert not detection.judge_mission(record_of(speed_rpm=335.0)).oriented
    assert not detection.judge_mission(record_of(trip=1)).oriented
    turned = record_of(flux_angle_err_deg=during(7.0, 7.1, 26.0, 0.0))
    assert not detection.judge_mission(turned).oriented


def test_the_speed_bound_is_compared_while_closed():
    half = during(0.0, 11.0, 302.0, 310.0)
    quiet = detection.judge_mission(record_of(speed_hat_rpm=half))
    assert quiet.closed_s == pytest.approx(9.0, abs=5e-3)
    assert quiet.bound_held_s == pytest.approx(4.5, abs=5e-3)


def test_a_result_that_misses_one_requirement_does_not_meet():
    found = [detection.find(record_of(flux_angle_err_deg=during(8.0, 9.0, 40.0, 0.0)), "x")]
    quiet = detection.summary_of_missions([detection.judge_mission(record_of())])
    silent = {"losses": detection.summary_of_losses(found), "missions": quiet}
    assert silent["losses"]["silent"] == 1
    assert not detection.meets(silent)
    told = record_of(flux_angle_err_deg=during(8.0, 9.0, 40.0, 0.0), confidence=1.0)
    good = {
        "losses": detection.summary_of_losses([detection.find(told, "x")]),
        "missions": quiet,
    }
    assert detection.meets(good)
    assert not detection.meets(good | {"missions": quiet | {"impressed": 1}})
    assert not detection.meets(good | {"missions": quiet | {"closed_share_above_1Hz": 0.89}})


@pytest.mark.parametrize("figure", detection.LOSING_FIGURES)
def test_the_papers_losing_experiments_are_told_in_time(figure):
    losses = detection.summary_of_losses([detection.losing_run((load_setup("paper"), figure, 7))])
    assert losses["not_lost"] == 0
    assert losses["silent"] == 0
    assert losses["above_1Hz"]["worst_ms"] <= 50.0
    assert (losses["below_1Hz"]["worst_ms"] or 0.0) <= 1000.0
    name = f"fig{figure:02d}"
    assert losses["figures"][name]["never_impressed"] == 0


def test_a_sample_of_missions_has_no_false_alarm():
    setup = load_setup("recommended")
    quiet = detection.summary_of_missions(
        [detection.mission((setup, seed)) for seed in range(9001, 9013)]
    )
    assert quiet["oriented"] >= 6
    assert quiet["loss_alarms"] == quiet["impressed"] == quiet["silent"] == 0
    assert quiet["closed_share_above_1Hz"] >= 0.9
    assert quiet["bound_held_share"] >= 0.9


@pytest.mark.parametrize("Rs_factor", [1.0, 0.4])
def test_the_second_machine_needs_no_thresholds_of_its_own(Rs_factor):
    """20 rad/s under half load: kept CLOSED with Rs right, told when it is lost by a wrong one."""
    base = detection.mission_job(load_setup("recommended"), 1)
    scenario = (
        '[scenario]\nname = "second"\nduration_s = 6.0\nrun_on_s = 0.1\n[profiles]\n'
        "speed_ref_rpm = [[0, 0], [1.5, 0], [2.0, 120]]\n"
        "load_torque_Nm = [[0, 0], [3.0, 0], [3.5, -13.0]]\n"
        f"[controller_motor]\nRs_factor = {Rs_factor}\n"
    )
    job = dataclasses.replace(
        base,
        scenario=scenario,
        rig=ROOT / "host_sim" / "rigs" / "im_4kw_400v.toml",
        board=ROOT / "host_sim" / "boards" / "board_540V.toml",
        motor_dir=ROOT / "gain_tables" / "im_4kw_400v",
        firmware_config={},
        rig_overrides={},
        decimate=1,
    )
    record = sim.run(job)
    lost = detection.lost(record)
    late = record.t_s > 2.5
    if Rs_factor == 1.0:
        assert not lost[late].any()
        assert (record["confidence"][late] == 0).all()
    else:
        assert lost[late].any()
        assert detection.find(record, "second").silent_s <= detection.SILENT_S
