"""What `zh figures` says about a run, and the rules around its numbers."""

from __future__ import annotations

import dataclasses
import shutil
import tomllib

import numpy as np
import pytest

from zerohertz import param_list
from zerohertz.errors import UserError
from zerohertz.scenario import evaluate, figures, sensitivity, setup
from zerohertz.scenario.evaluate import Result, Run
from zerohertz.scenario.predicates import Judgement, at_most

PAPER = setup.load_setup("paper")


def with_params(**params: float) -> setup.Setup:
    return dataclasses.replace(PAPER, params=dict(PAPER.params) | params)


# ---- limits in force --------------------------------------------------------------------------


def test_the_limit_is_the_one_in_force():
    assert with_params(i_max_A=15.8, i_d_A=6.0).i_q_limit_A() == pytest.approx(14.617, abs=1e-3)
    assert with_params(i_max_A=16.0, i_d_A=5.0).i_q_limit_A() == 15.0
    assert with_params(i_max_A=4.0, i_d_A=5.0).i_q_limit_A() == 0.0


def test_the_firmware_runs_into_the_limit_that_is_judged_by():
    """Fig. 17 ends with i_q* at its limit: that is where the firmware clamps."""
    small = with_params(i_max_A=8.0, i_d_A=5.0)
    record = evaluate.sim.run(evaluate.job(Run(small, 17, 1)))
    assert np.max(np.abs(record["i_q_ref_A"])) == pytest.approx(small.i_q_limit_A(), rel=1e-5)
    seen = evaluate.signals(record, 5.0, small)
    assert seen.at_limit.any()
    assert seen.trip == int(record.stopping_trip)


def test_no_figure_moves_a_limit_of_its_own():
    limits = {"i_q_max_A", "i_max_A", "i_d_A", "lambda_max_Wb", "omega_max_rad_s"}
    for figure in range(6, 19):
        text = setup.scenario_file(setup.figure_scenario(figure)).read_text(encoding="utf-8")
        assert not limits & set(tomllib.loads(text)["firmware"])


def test_the_bound_of_the_speed_estimate_is_mechanical():
    found = with_params(omega_max_rad_s=2.0 * np.pi * 50.0).speed_hat_max_rpm()
    assert found == pytest.approx(1500.0)


# ---- words ------------------------------------------------------------------------------------

RUN = {
    "sustained_error_rpm": 650.0,
    "ripple_w_hat_rpm": 2.0,
    "pre_error_rpm": 1.0,
    "trip": None,
    "trip_s": None,
    "hold_error_rpm": 700.0,
    "worst_second_limit_share": 0.72,
    "standstill_limit_share": 0.0,
    "flux_bound_share": 0.0,
    "ripple_w_rpm": 1.0,
    "ripple_i_q_A": 0.1,
}


def said(key: str, **change: object) -> str:
    judgement = Judgement((at_most("a", 1.0, 2.0, 0.0),), RUN | change)
    return figures.our_verdict(Result(key, "P", (judgement,)))


def test_an_instability_says_how():
    away = "runs away, off by up to 700 min^-1, i_q* at its limit 72 % of its worst second"
    assert said("13") == away
    assert said("6", sustained_error_rpm=40.0, hold_error_rpm=82.0).startswith(
        "swings, off by up to 82"
    )
    assert said("15", trip="over speed", trip_s=1.84, worst_second_limit_share=0.0) == (
        "trips (over speed) 1.8 s after the step"
    )
    assert said("14", hold_error_rpm=None, worst_second_limit_share=None) == "ends early"


@pytest.mark.parametrize("key", ["8", "9"])
def test_an_instability_unlike_the_papers_says_so(key):
    assert said(key).endswith("the paper shows i_q* at its limit at standstill, ours does not")
    assert said(key, standstill_limit_share=0.2).endswith("ours only for 20 % of hold")
    like = said(key, standstill_limit_share=0.9)
    assert like.endswith("as in the paper, i_q* at its limit at standstill (90 % of hold)")


def test_a_hold_by_the_bound_says_so():
    held = said("10", hold_error_rpm=5.0, flux_bound_share=0.5, worst_second_limit_share=0.0)
    assert held.endswith("estimate at its bounds 50 % of hold")
    jumps = said("16", hold_error_rpm=5.0, ripple_w_hat_rpm=2998.0, flux_bound_share=0.0)
    assert jumps == "shaft stands, estimate jumps, 2998 min^-1 rms"


def test_the_json_says_how_each_run_went_and_what_is_ours():
    result = Result("13", "P", (Judgement((at_most("a", 1.0, 2.0, 0.0),), RUN),))
    content = figures.result_json(PAPER, [result], None, "never")
    assert content["ours"] == {"13": said("13")}
    assert content["own_condition"] == (
        "estimate not held by its bounds: at most 5 % of hold, if STABLE"
    )


# ---- hash of the inputs -----------------------------------------------------------------------


@pytest.mark.parametrize("name", ["rig", "board", "motor.toml", "l_gain.json", "fig18", "default"])
def test_every_input_is_in_the_hash(tmp_path, monkeypatch, name):
    shutil.copytree(PAPER.motor_dir, tmp_path / "motor")
    shutil.copytree(setup.SCENARIOS, tmp_path / "scenarios")
    for kind in ("rig", "board"):
        shutil.copy(getattr(PAPER, kind), tmp_path / f"{kind}.toml")
    for file in param_list.FILES:
        shutil.copy(file, tmp_path)
    monkeypatch.setattr(setup, "SCENARIOS", tmp_path / "scenarios")
    monkeypatch.setattr(param_list, "FOLDER", tmp_path)
    copied = dataclasses.replace(
        PAPER,
        motor_dir=tmp_path / "motor",
        rig=tmp_path / "rig.toml",
        board=tmp_path / "board.toml",
    )
    before = figures.inputs_sha256(copied)
    assert before == figures.inputs_sha256(PAPER)
    path = {
        "rig": copied.rig,
        "board": copied.board,
        "fig18": tmp_path / "scenarios" / "fig18.toml",
        "default": tmp_path / "param_list.def",
    }.get(name, copied.motor_dir / name)
    text = path.read_text(encoding="utf-8")
    changed = text.replace("628.0f", "629.0f", 1) if name == "default" else text + "\n"
    assert changed != text
    path.write_text(changed, encoding="utf-8")
    assert figures.inputs_sha256(copied) != before


# ---- redrawn rigs -----------------------------------------------------------------------------


def test_a_rig_that_the_plant_refuses_is_drawn_again_and_counted(monkeypatch):
    drawn, judged = [], []

    def draws(rig, spread, rng):
        drawn.append({"inverter.i_threshold_A": 1e-9 if len(drawn) in (0, 1) else 0.4})
        return drawn[-1]

    def measure_all(runs, workers, progress):
        judged.extend(run.setup.rig_overrides["inverter.i_threshold_A"] for run in runs)
        return [None] * len(runs)

    monkeypatch.setattr(sensitivity, "drawn_rig", draws)
    monkeypatch.setattr(sensitivity, "measure_all", measure_all)
    yes = Judgement((at_most("a", 1.0, 2.0, 0.0),))
    monkeypatch.setattr(sensitivity, "judge", lambda figure, needed: yes)
    means, redrawn = sensitivity.sensitivity(PAPER, draws=2)
    assert means == {"1%": 13.0, "3%": 13.0, "10%": 13.0}
    assert redrawn == 2
    assert len(drawn) == 3 * 2 + 2
    assert set(judged) == {0.4}
    assert sensitivity.redraw_note(2) == "; 2 draws refused by the plant and drawn again"
    assert sensitivity.redraw_note(0) == ""


def test_a_rig_of_which_every_draw_is_refused_is_an_error(monkeypatch):
    refused = {"inverter.i_threshold_A": 1e-9}
    monkeypatch.setattr(sensitivity, "drawn_rig", lambda rig, spread, rng: refused)
    with pytest.raises(UserError, match="i_threshold_A"):
        sensitivity.sensitivity(PAPER, draws=1)


def test_the_number_of_redraws_stays_with_the_committed_result(tmp_path, monkeypatch):
    docs = figures.ROOT / "build" / f"test_redraws_{tmp_path.name}"
    monkeypatch.setattr(figures, "DOCS", docs)
    note = sensitivity.redraw_note(3)
    source = figures.COMPUTED_NOW + note
    content = figures.result_json(PAPER, [], {"1%": 8.5}, source)
    path = figures.write_committed(PAPER, content)
    try:
        named = f"committed result, {path.relative_to(figures.ROOT)}{note}"
        assert figures.committed_sensitivity(PAPER) == ({"1%": 8.5}, named)
        # Written again with the sensitivity taken over.
        figures.write_committed(PAPER, figures.result_json(PAPER, [], {"1%": 8.5}, named))
        assert figures.committed_sensitivity(PAPER) == ({"1%": 8.5}, named)
    finally:
        path.unlink()
        docs.rmdir()
