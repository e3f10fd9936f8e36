"""zerohertz.atlas.ensembles: draws that can be repeated, what counts as lost, quantiles with it."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from test_special import record
from typer.testing import CliRunner

from zerohertz.atlas import ensembles
from zerohertz.atlas.ensembles import ENSEMBLES
from zerohertz.cli import make_app
from zerohertz.errors import UserError
from zerohertz.scenario.setup import load_setup


@pytest.mark.parametrize("name", ENSEMBLES)
def test_a_run_is_drawn_the_same_again_and_no_other_is_like_it(name):
    draw = ENSEMBLES[name].draw
    first, again, other = (draw(np.random.default_rng((7, k))) for k in (3, 3, 4))
    assert first == again
    assert first.plant != other.plant
    assert first.what.seed != other.what.seed


def test_the_draws_fill_their_ranges():
    drawn = [ENSEMBLES["crossings"].draw(np.random.default_rng((1, k))) for k in range(300)]
    rates = [d.numbers["rpm_per_s"] for d in drawn]
    loads = [d.numbers["load_Nm"] / 8.4 for d in drawn]
    assert 2.0 <= min(rates) < 3.0 < 19.0 < max(rates) <= 20.0
    assert -1.0 <= min(loads) < -0.95 < 0.95 < max(loads) <= 1.0
    assert 100 < sum(d.numbers["duty"] for d in drawn) < 200


def test_lost_is_no_torque_a_run_that_ends_early_or_a_shaft_far_away_at_the_end():
    assert not ensembles.is_lost(record(), 10.0)
    assert ensembles.is_lost(record(gates_on=lambda t: (t < 5.0) | (t > 5.1)), 10.0)
    assert ensembles.is_lost(record(duration_s=8.0), 10.0)
    assert ensembles.is_lost(record(speed_rpm=lambda t: np.where(t > 9.5, 300.0, 60.0)), 10.0)
    assert not ensembles.is_lost(record(speed_rpm=lambda t: np.where(t < 5.0, 60.0, 70.0)), 10.0)


def test_measures_look_at_the_run_from_its_event_on():
    drawn = ENSEMBLES["reversals"].draw(np.random.default_rng((1, 1)))
    drawn = dataclasses.replace(drawn, from_s=5.0, numbers={"speed_rpm": 200.0})
    turned = {"speed_ref_rpm": lambda t: np.where(t < 5.0, 200.0, -200.0)}
    swings = record(speed_rpm=lambda t: np.where(t < 5.0, 200.0, -212.0), **turned)
    assert ENSEMBLES["reversals"].measure(swings, drawn) == pytest.approx(12.0 / 400.0)
    late = record(speed_rpm=lambda t: np.where(t < 2.0, 0.0, 67.0))
    assert ENSEMBLES["crossings"].measure(late, drawn) == pytest.approx(7.0)
    pulsates = record(torque_Nm=lambda t: np.where(t < 5.0, 100.0, np.sign(np.sin(40.0 * t))))
    assert ENSEMBLES["ripple"].measure(pulsates, drawn) == pytest.approx(1.0 / 8.4, rel=0.01)


def test_a_lost_run_is_beyond_every_limit():
    rows = [{"run": k, "value": float(k), "lost": False, "fault": 0} for k in range(98)]
    rows += [{"run": 98, "value": math.inf, "lost": True, "fault": 4}]
    rows += [{"run": 99, "value": math.inf, "lost": True, "fault": 0}]
    found = ensembles.summary("crossings", rows)
    assert (found["lost"], found["lost_undeclared"]) == (2, 1)
    assert (found["median"], found["p95"], found["p99"], found["worst"]) == (50.0, 95.0, None, None)
    assert found["within"] == pytest.approx(0.31)  # 0 .. 30 min^-1
    assert not found["met"]
    assert set(found["worst_runs"][:2]) == {98, 99}


def test_a_run_alone_is_that_of_the_ensemble():
    setup = load_setup("recommended")
    row, _ = ensembles.one(setup, "load_steps", seed=5, k=1)
    assert row == ensembles.rows_of(setup, "load_steps", runs=2, seed=5)[1]
    assert 0.0 < row["value"] < 100.0


def test_an_unknown_name_is_refused_with_the_known_ones():
    with pytest.raises(UserError, match=r"'crossing' is unknown; known are crossings, load_steps"):
        ensembles.chosen(["crossing"])
    assert ensembles.chosen([]) == list(ENSEMBLES)


@pytest.mark.parametrize(("limit", "ends"), [(1e-3, 1), (1e3, 0)])
def test_the_command_ends_with_1_where_a_goal_is_missed(monkeypatch, limit, ends):
    bounded = dataclasses.replace(ENSEMBLES["load_steps"], limit=limit)
    monkeypatch.setitem(ENSEMBLES, "load_steps", bounded)
    done = CliRunner().invoke(make_app(), ["ensemble", "load_steps", "--runs", "2", "--seed", "2"])
    assert done.exit_code == ends, done.stdout
