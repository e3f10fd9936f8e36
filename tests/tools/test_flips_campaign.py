"""`zh campaign flips`: which byte is what, the classes, and a sample."""

from __future__ import annotations

import contextlib
import dataclasses
import json
import os
import signal
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from zerohertz import sim
from zerohertz.atlas.run import RunOptions
from zerohertz.campaign import fork
from zerohertz.campaign.faults import judge
from zerohertz.campaign.flips import campaign, cases, layout, modes, page, run
from zerohertz.cli import make_app
from zerohertz.errors import UserError
from zerohertz.sim_steps import Steps, unit_bytes

KNOWN = Path(__file__).parent / "data" / "flips_known.txt"
RUNS = 98


def test_every_member_of_a_drive_has_bytes_of_its_own() -> None:
    leaves = layout.leaves()
    ends = [leaf.offset + leaf.size for leaf in leaves]
    assert all(end <= leaf.offset for end, leaf in zip(ends, leaves[1:], strict=False))
    assert ends[-1] <= unit_bytes()
    # The rest is padding.
    assert sum(leaf.size for leaf in leaves) > 0.95 * unit_bytes()
    assert len({leaf.path for leaf in leaves}) == len(leaves)
    assert layout.leaf_of("machine.faults").kind == "integer"
    assert layout.leaf_of("config[1].stop_speed_rad_s").owner == "config[]"


def test_a_flip_changes_the_word_of_that_name() -> None:
    """Debug information and library agree: the flipped bit of `machine.faults` is seen."""
    leaf = layout.leaf_of("machine.faults")
    with Steps(dataclasses.replace(modes.MODES["ready"].job(modes.bench()), max_steps=10)) as steps:
        steps.advance(5)
        assert steps.faults() == 0
        steps.flip(leaf.offset + 2, 3)
        assert steps.faults() == 1 << 19
        with pytest.raises(UserError, match="no such bit"):
            steps.flip(unit_bytes(), 0)
        assert len(steps.take().t_s) == 5


def test_stopping_on_the_way_changes_no_bit() -> None:
    job = dataclasses.replace(modes.MODES["run_900"].job(modes.bench()), max_steps=30_000)
    whole = sim.run(job)
    with Steps(job) as steps:
        for at in (1, 2, 777, 25_000, 40_000):
            steps.advance(at)
        parts = steps.take()
    assert run.PERIOD_S == pytest.approx(whole.period_s)
    for name, column in whole.columns.items():
        assert np.array_equal(column, parts[name]), name


def test_a_case_is_what_its_name_says() -> None:
    for mode in modes.MODES:
        span = modes.MODES[mode].when(modes.bench())
        for case in cases.cases(mode, 20, 7):
            again = cases.case_of(case.name)
            assert dataclasses.replace(again, index=case.index) == case
            assert span.first_s <= case.at_s(span) <= span.last_s < span.fault_s
    assert cases.cases("i_f", 5, 1) != cases.cases("i_f", 5, 2)
    assert len(cases.cases("i_f", 0, 1)) == sum(8 * leaf.size for leaf in layout.leaves())
    only = cases.cases("i_f", 9, 1, "machine.")
    assert {case.path.split(".")[0] for case in only} == {"machine"}


@pytest.mark.parametrize(
    "name",
    ["machine.faults", "machine.faults/32@i_f", "machine.faults/x@i_f", "machine.faults/3@sleep"],
)
def test_a_name_that_is_none_is_a_mistake(name: str) -> None:
    with pytest.raises(UserError, match="--case"):
        cases.case_of(name)


def test_a_process_tells_how_it_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    def forever() -> dict[str, Any]:
        while True:
            time.process_time()

    def broken() -> dict[str, Any]:
        raise ValueError("by itself")

    assert fork.answer_of(lambda: {"pid": os.getpid()}) != {"pid": os.getpid()}
    killed = fork.answer_of(lambda: os.kill(os.getpid(), signal.SIGSEGV) or {})
    assert killed == fork.EXCEPTION
    monkeypatch.setattr(fork, "LONGEST_S", 0.1)
    assert fork.answer_of(forever) == fork.HANG
    with pytest.raises(RuntimeError, match="by itself"):
        fork.answer_of(broken)


@pytest.mark.parametrize("mode", modes.MODES)
def test_without_a_flip_nothing_happens_and_plain_faults_trip(mode: str) -> None:
    base = run.usual(modes.bench(), modes.MODES[mode])
    assert base.undeclared == frozenset()
    assert {"short", "over_voltage", "i_u_at_its_end", "u_dc_at_its_end"} <= set(base.trips)
    assert all(trip.at_s < trip.until_s for trip in base.trips.values())


def made(gates_on: list[int]) -> sim.Record:
    """A run of which only the gates matter."""
    n = len(gates_on)
    columns = {"gates_on": np.array(gates_on, np.float32), "t_s": np.zeros(n, np.float32)}
    return sim.Record(columns, n, 2e-4, sim.Trip(0), None, 0, None, 0.0, 0.0, 0.0)


def test_classes_of_made_up_runs() -> None:
    base = run.Usual(made([0, 0, 1, 1, 1, 1]), frozenset({"deviation"}), {})
    fine = {"undeclared": "", "verdict": judge.HARMLESS}

    def found(gates_on: list[int], run_on: int = 0, **row: str) -> tuple[str, str]:
        return run.class_of(made(gates_on), base, fine | row, 1, run_on)

    assert found([0, 0, 1, 1, 1, 1]) == (run.HEALED, "")
    assert found([0, 0, 1, 1, 0, 0]) == (run.STOPPED, "")
    assert found([0, 0, 1, 1]) == (run.STOPPED, "")
    assert found([0, 0, 1, 1, 0, 0], verdict=judge.BEFORE) == (run.DECLARED, "")
    assert found([0, 0, 1, 1, 1, 1], undeclared="deviation") == (run.HEALED, "")
    harmed = found([0, 0, 1, 1, 1, 1], undeclared="deviation current", verdict=judge.UNDECLARED)
    assert harmed == (run.UNDECLARED, "current")
    assert found([0, 1, 1, 1, 1, 1], run_on=2) == (run.HEALED, "")
    assert found([0, 1, 1, 1, 1, 1], run_on=3) == (run.UNDECLARED, run.GATES)


def test_a_latched_bit_is_declared_and_a_dead_word_is_harmless() -> None:
    names = ("machine.faults/19@run_60", "link.parser.byte[7]/0@run_60")
    rows = run.run_cases(modes.bench(), [cases.case_of(name) for name in names])
    assert [row["class"] for row in rows] == [run.DECLARED, run.HARMLESS]
    assert [row["lost"] for row in rows] == ["", ""]


def test_a_drive_that_does_not_look_has_lost_a_protection() -> None:
    """The negative control. Two protections see a locked rotor at 60 min^-1, 12.6 rad/s electrical:
    STALL, and SPEED_DEVIATION from half of its 18 rad/s on, for the torque is at its limit."""
    off = {"open_phase_A": 0.0, "stall_s": 0.0, "speed_deviation_rad_s": 30.0}
    blind = dataclasses.replace(modes.bench(), firmware=off)
    assert "open_phase" in run.usual(modes.bench(), modes.MODES["run_60"]).trips
    assert "locked_rotor" not in run.usual(blind, modes.MODES["run_60"]).trips


@contextlib.contextmanager
def no_bar(_text: str, _total: int) -> Any:
    yield lambda _done: None


@pytest.fixture(scope="module")
def sample(tmp_path_factory: pytest.TempPathFactory) -> campaign.Result:
    how = RunOptions(tmp_path_factory.mktemp("flips"), workers=2)
    asked = campaign.Asked(tuple(modes.MODES), RUNS, 2005)
    return campaign.run_all(asked, how, lambda _text: None, no_bar)


def test_no_flip_of_the_sample_does_harm_that_none_did_before(sample: campaign.Result) -> None:
    """The list is what is still open; it only ever gets shorter."""
    known = set(KNOWN.read_text(encoding="utf-8").split())
    bad = {row["name"] for row in sample.bad}
    assert bad <= known, "\n".join(sorted(bad - known))
    assert len(sample.every) == RUNS


def test_rows_are_summed_up(sample: campaign.Result) -> None:
    total = campaign.as_dict(sample)
    parts = ("harmless", "healed", "declared", "stopped_without_reason", "undeclared_harm")
    assert sum(total[key] for key in parts) == total["runs"] == RUNS
    json.dumps(total)
    text = page.page_text(sample, page.command_of(sample.asked))
    assert f"tools/zh campaign flips --runs {RUNS} --seed 2005 --write" in text
    assert all(f"| {mode} |" in text for mode in modes.MODES)


def test_one_case_on_the_command_line() -> None:
    app = CliRunner()
    name = "machine.faults/19@ready"
    done = app.invoke(make_app(), ["campaign", "flips", "--case", name])
    assert done.exit_code == 0
    assert done.stdout.startswith("declared: STALL")
    listed = app.invoke(make_app(), ["campaign", "flips", "--list"]).stdout.split()
    assert {"machine.faults", "ready"} <= set(listed)
    refused = app.invoke(make_app(), ["campaign", "flips", "--member", "link", "--write"])
    assert isinstance(refused.exception, UserError)
