"""`zh campaign skips` on the emulated core: the injection itself, and a sample."""

from __future__ import annotations

import contextlib
from typing import Any

import pytest

from zerohertz import sim
from zerohertz.atlas.run import RunOptions
from zerohertz.campaign.flips import campaign as flips
from zerohertz.campaign.flips.run import DECLARED, HARMLESS
from zerohertz.campaign.skips import campaign, cases, core, page, run
from zerohertz.errors import UserError
from zerohertz.image.emulator import EXIT_DONE
from zerohertz.image.loop import End

# The issue asks for 500; they take ten minutes, and a test has one.
RUNS = 16
MODES = ("run", "run+fault", "commissioning", "ready+fault")
SHORT = cases.skip_of("commissioning+fault")


@pytest.fixture(scope="module")
def executed() -> list[core.Instruction]:
    return cases.executed(SHORT)


def test_the_period_executes_what_it_should(executed: list[core.Instruction]) -> None:
    assert len(executed) > 500
    assert [found.address for found in executed] == sorted({found.address for found in executed})
    functions = {found.function for found in executed}
    assert {"counted_interrupt", "unit_control_period", "sequence_step"} <= functions


def test_with_nothing_skipped_image_and_simulation_agree(executed: list[core.Instruction]) -> None:
    """An instruction that no period executes is changed and changed back: no bit differs, and
    the image's check of itself finds nothing."""
    unused = max(found.address for found in executed) + 0x4000
    unused = min(unused, 0x0040_E000)
    ran = core.run_skipping(SHORT.job(), SHORT.period, unused)
    assert (ran.end, ran.exit_code, ran.differing_bits) == (End.EQUAL, EXIT_DONE, 0)
    assert ran.record is not None
    usual = sim.run(SHORT.job())
    assert (ran.record["faults"] == usual["faults"]).all()
    assert (ran.record["i_peak_A"] == usual["i_peak_A"]).all()
    row = run.row_of(ran, SHORT)
    assert (row["class"], row["lost"], row["died"]) == (DECLARED, "", "")


def test_a_skip_acts_in_one_period_only(executed: list[core.Instruction]) -> None:
    """Some of the skips change what the image says, and only from that period on."""
    some = [found for found in executed if found.function == "counted_interrupt"][4:12]
    ran = [core.run_skipping(SHORT.job(), SHORT.period, found.address) for found in some]
    assert any(result.end != End.EQUAL for result in ran)
    for result in ran:
        assert not result.difference or f"period {SHORT.period}" in result.difference


def test_a_name_that_is_none_is_a_mistake() -> None:
    for name in ("0x0@run", "run", "0x400514@sleep"):
        with pytest.raises(UserError, match="--case"):
            cases.case_of(name)


@contextlib.contextmanager
def no_bar(_text: str, _total: int) -> Any:
    yield lambda _done: None


def test_no_skip_of_the_sample_does_undeclared_harm(tmp_path: Any) -> None:
    how = RunOptions(tmp_path, workers=2)
    asked = flips.Asked(MODES, RUNS, 2005)
    result = campaign.run_all(asked, how, lambda _text: None, no_bar)
    assert len(result.every) == RUNS
    assert [row["name"] for row in result.bad] == []
    assert {row["class"] for row in result.every} > {HARMLESS}
    text = page.page_text(result, page.command_of(asked))
    assert f"tools/zh campaign skips --runs {RUNS} --seed 2005 --mode run" in text
