"""The thirteen experiments: the committed verdicts are what the firmware does.

Seed 1 of every figure is run again and judged: the verdict must be that of
tools/docs/figures_<config>.json. Numbers are not compared: a run that is lost is chaotic, and
another C library's exponential in the plant is enough to change it; verdicts have margins.
"""

from __future__ import annotations

import json

import pytest

from zerohertz.scenario.evaluate import (
    SITUATIONS,
    evaluate_figures,
    evaluate_situations,
)
from zerohertz.scenario.figures import committed_path, inputs_sha256
from zerohertz.scenario.predicates import FIGURES
from zerohertz.scenario.setup import load_setup


def committed(name: str) -> dict:
    return json.loads(committed_path(load_setup(name)).read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def paper():
    return {r.key: r for r in evaluate_figures(load_setup("paper"), seeds=1)}


@pytest.fixture(scope="module")
def recommended():
    return {r.key: r for r in evaluate_situations(load_setup("recommended"), seeds=1)}


@pytest.mark.parametrize("name", ["paper", "recommended"])
def test_the_committed_result_is_of_this_rig_and_tuning(name):
    assert committed(name)["inputs_sha256"] == inputs_sha256(load_setup(name))


def test_the_committed_score_is_the_number_of_matches():
    stored = committed("paper")
    assert stored["score"] == sum(f["match"] for f in stored["figures"].values())
    assert stored["score_by_eye"] == sum(f["by_eye"]["match"] for f in stored["figures"].values())
    assert stored["score"] >= 9
    assert set(stored["figures"]) == {str(n) for n in FIGURES}
    assert all(f["seeds"] == 6 for f in stored["figures"].values())
    assert set(stored["sensitivity"]) == {"1%", "3%", "10%"}


@pytest.mark.parametrize("figure", [str(n) for n in FIGURES])
def test_a_figure_is_what_the_committed_result_says(paper, figure):
    same_verdict(paper[figure], committed("paper")["figures"][figure])


@pytest.mark.parametrize("situation", SITUATIONS)
def test_a_situation_is_what_the_committed_result_says(recommended, situation):
    same_verdict(recommended[situation], committed("recommended")["figures"][situation])


def same_verdict(result, stored):
    if stored["match"]:
        assert result.match, result.reason
    elif stored["seeds_matched"] == 0:
        assert not result.match, "better than committed: run zh figures --sensitivity --write"
    assert set(result.as_json()["measured"]) == set(stored["measured"])
    if "by_eye" in stored and stored["by_eye"]["match"]:
        assert result.match_by_eye, result.reason_by_eye
    elif "by_eye" in stored and stored["by_eye"]["seeds_matched"] == 0:
        assert not result.match_by_eye, "better than committed, by eye: run zh figures --write"
