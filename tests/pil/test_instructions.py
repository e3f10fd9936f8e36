"""Counting inside the control interrupt: exact, complete, and the committed page is today's."""

from __future__ import annotations

import pytest

from zerohertz.build import build_image
from zerohertz.errors import UserError
from zerohertz.image import budget, cycles, histogram, instruction_page, loop
from zerohertz.image.command import PRESETS, Experiment, job_of, measure
from zerohertz.image.interrupt import Interrupt
from zerohertz.image.loop import End, Inject

CALL_MAX = 12  # instructions
FIG07 = Experiment("fig07", "paper")


@pytest.fixture(scope="module")
def interrupts() -> list[Interrupt]:
    return budget.measure_interrupts()


def test_no_addition_costs_more_than_committed(interrupts: list[Interrupt]) -> None:
    """Where it does, `zh bench --image --write` and a commit that says why."""
    assert budget.grown(budget.added_figures(interrupts), budget.committed()["added"]) == []


def test_the_page_is_that_of_the_image(interrupts: list[Interrupt]) -> None:
    """Where it is not, `zh bench --functions`. The page is one compiler's; what another executes
    is bound by its row of the budget, and without a row this fails and says how to make one."""
    row = budget.committed()
    if budget.compiler() in instruction_page.PAGE.read_text():
        page = instruction_page.PAGE.read_text(encoding="utf-8")
        assert page == instruction_page.page_text(interrupts), "zh bench --functions"
    else:
        assert set(row["added"]) == {each.config for each in interrupts}


def test_a_compiler_without_a_row_fails_with_the_remedy(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(budget, "compiler", lambda: "gcc 99")
    with pytest.raises(UserError, match=r"nothing of gcc 99.*zh bench --image --write"):
        test_the_page_is_that_of_the_image([])


def test_timer_and_plugin_agree_in_every_period() -> None:
    """Two ways to count: from inside by a timer, from outside instruction by instruction."""
    calls = set()
    for period in (0, 517, 12_000, 12_001):
        found = histogram.count(job_of(FIG07, None), PRESETS[FIG07.config], period, period)
        calls.add(int(found.run.each.instructions[period]) - round(found.instructions))
    assert len(calls) == 1  # the call and the readings themselves: the same in each
    assert 0 < calls.pop() < CALL_MAX


def test_every_instruction_belongs_to_a_function() -> None:
    found = histogram.count(job_of(FIG07, None), PRESETS[FIG07.config], 12_000, 12_015)
    assert [row for row in found.rows if "?" in row.function] == []
    names = {row.function: row.instructions for row in found.rows}
    assert names["counted_interrupt"] > 0
    # Inlined by the linker, named all the same.
    assert names["observer_step"] > 0


def test_a_live_change_to_the_same_values_changes_no_bit() -> None:
    run = loop.run(job_of(FIG07, 12_000), build_image("qemu_mps2_paper"), inject=Inject.LIVE_CHANGE)
    plain = measure(FIG07, "mps2-an386", 12_000)
    assert (run.end, run.differing_bits) == (End.EQUAL, 0)
    # No addition before it is asked for, none in a period that takes no change.
    assert (run.each.instructions >= plain.each.instructions).all()


LISTING = """
00000000 <f>:
   0:\tpush\t{r4, r5, r6, lr}
   2:\tvldr\ts0, [r0]
   6:\tvmul.f32\ts1, s0, s0
   a:\tvadd.f32\ts2, s1, s0
   e:\tvstr\ts2, [r0]
  12:\tvdiv.f32\ts3, s2, s1
  16:\tvmla.f32\ts4, s3, s3
  1a:\tldr\tr1, [r0, #4]
  1c:\tsdiv\tr1, r1, r2
  20:\tbne.n\t2 <f+0x2>
  22:\tldmia.w\tr0!, {r1-r3}
  26:\tpop\t{r4, r5, r6, pc}
"""


def test_cycles_of_a_listing() -> None:
    code = cycles.instructions(LISTING)
    once = cycles.cycles(code, dict.fromkeys(code, (1.0, 0.0)))
    assert once == {
        0x00: 5.0,
        0x02: 2.0,
        0x06: 1.0,  # behind a load: that is no arithmetic
        0x0A: 2.0,  # needs the product
        0x0E: 3.0,  # stores the sum
        0x12: 14.0,
        0x16: 4.0,
        0x1A: 2.0,
        0x1C: 12.0,
        0x20: 1.0,
        0x22: 4.0,
        0x26: 5.0,
    }
    taken = cycles.cycles(code, {0x20: (4.0, 3.0), 0x26: (1.0, 1.0)})
    assert taken == {0x20: 4.0 + 3 * 2, 0x26: 5.0 + 2}
