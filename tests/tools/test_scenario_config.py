"""Configurations, results as JSON, and the pieces of the identification that need no simulation."""

from __future__ import annotations

import json
import math
import tomllib
from pathlib import Path

import numpy as np
import pytest

from zerohertz import param_list
from zerohertz.errors import UserError
from zerohertz.scenario import figures, identify, propose, sensitivity, setup, space
from zerohertz.scenario.evaluate import Result
from zerohertz.scenario.predicates import Clause, Judgement, at_least, at_most

GOOD = '[config]\nname = "x"\nmotor = "hasegawa2005"\nboard = "paper"\nrig = "hasegawa2005"\n'


def config(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "x.toml"
    path.write_text(text)
    return path


def test_a_configuration_names_its_files_and_parameters(tmp_path):
    found = setup.load_setup(config(tmp_path, GOOD + "[params]\nadapt_kp = 7.5\n"))
    assert found.name == "x"
    assert found.params == {"adapt_kp": 7.5}
    assert (found.motor_dir / "l_gain.json").is_file()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (GOOD + "[params]\nadapt_kq = 1\n", "params.adapt_kq: no such parameter"),
        (GOOD + '[params]\nadapt_kp = "1"\n', "params.adapt_kp: is '1'; a number"),
        (GOOD + "[params]\nadapt_kp = nan\n", "params.adapt_kp: is nan; a finite"),
        (GOOD + "[parms]\n", "[parms]: unknown section"),
        (GOOD.replace('"paper"', '"papper"'), "config.board: there is no"),
        (GOOD.replace('name = "x"\n', ""), "config.name: a text is needed"),
        (GOOD + 'rigg = "x"\n', "config.rigg: unknown key"),
        ("[config\n", "not valid TOML"),
    ],
)
def test_a_bad_configuration_is_named_with_its_key(tmp_path, text, words):
    path = config(tmp_path, text)
    with pytest.raises(UserError) as caught:
        setup.load_setup(path)
    assert str(path) in str(caught.value)
    assert words in str(caught.value)


def test_a_missing_configuration_is_named():
    with pytest.raises(UserError, match="no 'nothere'; there are no_gain, paper, recommended"):
        setup.load_setup("nothere")
    with pytest.raises(UserError, match="no such file"):
        setup.load_setup("nothere.toml")


def test_the_current_limit_gives_i_d_priority(tmp_path):
    limit_A = setup.load_setup(config(tmp_path, GOOD + "[params]\ni_d_A = 5.3\n")).i_q_limit_A()
    assert limit_A == pytest.approx(math.sqrt(15.8**2 - 5.3**2))
    limit_A = setup.load_setup(config(tmp_path, GOOD + "[params]\ni_d_A = 4.0\n")).i_q_limit_A()
    assert limit_A == 15.0


def test_the_defaults_are_read_for_every_parameter():
    known = param_list.defaults()
    text = "".join(file.read_text() for file in param_list.FILES)
    lines = [
        line for line in text.splitlines() if line.startswith(("PARAM_F(", "PARAM_U(", "PARAM_E("))
    ]
    assert len(known) == len(lines)
    assert known["current_full_scale_A"] == 25.0
    assert known["adc_bits"] == 14


@pytest.mark.parametrize("figure", range(6, 19))
def test_every_figure_has_its_scenario_and_event(figure):
    path = setup.scenario_file(setup.figure_scenario(figure))
    assert setup.event_s(path) == (10.0 if figure < 17 else 5.0)


# ---- results ----------------------------------------------------------------------------------


def judgement(value: float) -> Judgement:
    return Judgement((at_most("a", value, 10.0, 0.02), at_least("b", 5.0, 1.0, 0.02)), {"a": value})


def test_a_match_needs_every_seed():
    result = Result("10", "STABLE", (judgement(9.0), judgement(9.9), judgement(1.0)))
    assert result.seeds_matched == 2
    assert not result.match
    assert result.reason == "a: 9.9 (threshold 9.8)"
    assert Result("10", "STABLE", (judgement(9.0),)).match


def test_the_json_has_the_promised_keys_and_is_json():
    result = Result("10", "STABLE", (judgement(9.0), judgement(math.inf)))
    content = figures.result_json(setup.load_setup("paper"), [result], {"1%": 8.5}, "here")
    assert content == json.loads(json.dumps(content, allow_nan=False))
    assert {"config", "score", "figures", "sensitivity"} <= set(content)
    assert content["score"] == 0
    one = content["figures"]["10"]
    assert set(one) == {"match", "seeds_matched", "seeds", "predicate", "measured"}
    assert (one["match"], one["seeds_matched"], one["seeds"]) == (False, 1, 2)


def test_a_committed_sensitivity_holds_only_for_its_inputs(tmp_path, monkeypatch):
    monkeypatch.setattr(figures, "DOCS", figures.ROOT / "build" / f"test_docs_{tmp_path.name}")
    of_paper = setup.load_setup("paper")
    content = figures.result_json(of_paper, [], {"1%": 8.5}, "now")
    path = figures.write_committed(of_paper, content)
    try:
        assert figures.committed_sensitivity(of_paper)[0] == {"1%": 8.5}
        stored = json.loads(path.read_text())
        path.write_text(json.dumps(stored | {"inputs_sha256": "0" * 64}))
        found, why = figures.committed_sensitivity(of_paper)
        assert found is None
        assert "another rig or tuning" in why
    finally:
        path.unlink()
        path.parent.rmdir()


# ---- search -----------------------------------------------------------------------------------


def test_starts_are_inside_the_ranges():
    for name in space.STARTS:
        point = space.start_point(name)
        assert set(point) == set(space.BY_NAME)
        for unknown in space.UNKNOWNS:
            assert unknown.low <= point[unknown.name] <= unknown.high, (name, unknown.name)


def test_a_perturbed_point_stays_inside_the_ranges():
    rng = np.random.default_rng(1)
    point = space.start_point("paper_outcomes")
    for _ in range(200):
        point = space.perturbed(point, rng, 0.5, 8)
    assert set(point) == set(space.BY_NAME)
    for unknown in space.UNKNOWNS:
        assert -1e-9 <= unknown.unit_of(point[unknown.name]) <= 1.0 + 1e-9, unknown.name
    assert point["L.method"] in (0.0, 1.0, 2.0)


def test_unit_and_value_are_inverse():
    for unknown in space.UNKNOWNS:
        assert unknown.value_of(unknown.unit_of(unknown.start)) == pytest.approx(unknown.start)


def test_nothing_the_paper_states_is_searched():
    params = space.firmware_params(space.start_point("paper_outcomes"))
    fixed = ("Rs_ohm", "Rr_ohm", "Ls_H", "Lr_H", "M_H", "i_q_max_A", "period_s")
    assert not set(params) & set(fixed)
    # Nor is anything that the paper's law does not have.
    assert params["phi_factor"] == 0
    assert set(params) <= set(param_list.defaults())


def clause(margin: float) -> Judgement:
    return Judgement((at_most("x", 1.0 - margin, 1.0, 0.0),))


def test_the_objective_climbs_and_jumps_at_the_match():
    values = [identify.figure_value(clause(m)) for m in (-30.0, -1.0, -0.1, 0.0, 0.05, 0.1, 0.5)]
    assert values == sorted(values)
    assert values[0] == -1.0
    assert values[3] == 1.0
    assert values[5] == values[6] == identify.FIGURE_BEST


def test_a_value_that_is_no_number_is_the_worst():
    broken = Judgement((Clause("x", math.nan, 1.0, -1e3),))
    assert identify.figure_value(broken) == -1.0


def trial(value: float | None) -> identify.Trial:
    return identify.Trial(space.start_point("paper_outcomes"), value, {"6": 1.1}, "test")


def test_a_search_resumes_from_its_log(tmp_path):
    first = identify.Search(tmp_path / "log.jsonl", 1)
    assert first.absorb(trial(3.0))
    assert not first.absorb(trial(None))
    assert first.absorb(trial(4.0))
    second = identify.Search(tmp_path / "log.jsonl", 2)
    assert (second.tried, second.full, second.best.value) == (3, 2, 4.0)
    point, _ = second.propose()
    assert set(point) == set(space.BY_NAME)


def test_a_log_that_is_none_is_refused(tmp_path):
    (tmp_path / "log.jsonl").write_text("{}\n")
    with pytest.raises(UserError, match="line 1"):
        identify.Search(tmp_path / "log.jsonl", 1)


def test_a_point_is_given_up_when_it_cannot_reach_the_bar(monkeypatch):
    judged = []
    monkeypatch.setattr(identify, "setup_of", lambda point: None)
    monkeypatch.setattr(identify, "measure_run", lambda run: judged.append(run.figure))
    monkeypatch.setattr(identify, "judge", lambda figure, needed: clause(-30.0))
    found = identify.assess(space.start_point("paper_outcomes"), 10.0, "test")
    assert found.value is None
    # 13 x 1.15 = 14.95; every failure costs 2.15: the third leaves less than 10.
    assert judged == list(identify.CASCADE[:3])


def test_the_cascade_judges_every_figure_after_its_reference():
    assert sorted(identify.CASCADE) == list(range(6, 19))
    for figure, needs in identify.NEEDS.items():
        for other in needs:
            assert identify.CASCADE.index(other) < identify.CASCADE.index(figure)


def test_a_proposal_is_valid_files(tmp_path):
    point = space.start_point("paper_outcomes")
    paths = propose.write_proposal(point, tmp_path)
    rig = tomllib.loads(paths[0].read_text())
    assert rig["motor"]["Ls_H"] == pytest.approx(0.1263)
    assert sum(rig["sensors"]["current_offset_A"]) == pytest.approx(0.0)
    assert tomllib.loads(paths[1].read_text())["params"]["adapt_kp"] == 51.9
    assert tomllib.loads(paths[2].read_text())["design"]["method"] == "pole_shift"


# ---- sensitivity ------------------------------------------------------------------------------


def test_a_draw_spreads_every_parameter_and_stays_a_rig():
    rig = tomllib.loads(setup.load_setup("paper").rig.read_text())
    rng = np.random.default_rng(3)
    draws = [sensitivity.drawn_rig(rig, 0.1, rng) for _ in range(400)]
    keys = {k for d in draws for k in d}
    assert "inverter.model" in keys
    assert not any("pole_pairs" in k or "carrier" in k for k in keys)
    for name in ("motor.Rs_ohm", "motor.M_H", "mechanics.J_kg_m2", "inverter.dead_time_s"):
        section, key = name.split(".")
        logs = np.log([d[name] / rig[section][key] for d in draws])
        assert np.std(logs) == pytest.approx(0.1, rel=0.15), name
        assert abs(np.mean(logs)) < 0.03
    leakage_H = rig["motor"]["Ls_H"] - rig["motor"]["M_H"]
    drawn_H = np.array([d["motor.Ls_H"] - d["motor.M_H"] for d in draws])
    assert np.std(np.log(drawn_H / leakage_H)) == pytest.approx(0.1, rel=0.15)
    assert all(d["mechanics.static_Nm"] >= d["mechanics.coulomb_Nm"] for d in draws)


def test_sensor_gains_spread_by_their_error():
    rig = {"sensors": {"current_gain": [1.01, 1.01, 1.01]}, "motor": {}, "mechanics": {}}
    rig["motor"] = {"M_H": 0.1, "Ls_H": 0.11, "Lr_H": 0.1}
    rig["mechanics"] = {"static_Nm": 0.5, "coulomb_Nm": 0.4}
    rng = np.random.default_rng(3)
    gains = [sensitivity.drawn_rig(rig, 0.1, rng)["sensors.current_gain"][0] for _ in range(400)]
    assert np.std(gains) == pytest.approx(0.001, rel=0.15)
