"""Flash, RAM and stack of the linked images, and what must not be in them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from zerohertz.build import build_image
from zerohertz.errors import UserError
from zerohertz.image import budget, sizes, stack
from zerohertz.image.ports import ports

PORTS = sorted(ports())


@pytest.mark.parametrize("port", PORTS)
def test_no_image_is_larger_than_committed(port: str) -> None:
    """Where it is, `zh bench --write` and a commit that says why."""
    known = budget.committed()
    assert budget.grown(budget.measure_images([port]), known["images"]) == []


@pytest.mark.parametrize("port", PORTS)
def test_image_keeps_the_limits(port: str) -> None:
    found = sizes.measure(build_image(port), port)
    assert 0 < found.table_bytes <= sizes.TABLE_MAX_BYTES
    assert found.ram_bytes <= sizes.RAM_MAX_BYTES
    assert found.stack_bound_bytes <= found.stack_bytes


def test_every_feature_fits_96_KiB_of_the_reference_board() -> None:
    assert sizes.measure(build_image("stm32f405"), "stm32f405").flash_bytes <= 96 * 1024


@pytest.mark.parametrize("port", PORTS)
def test_image_has_no_heap_no_double_and_no_mathematics_library(port: str) -> None:
    assert sizes.forbidden_symbols(build_image(port)) == []


def test_another_compiler_is_told_how_to_make_its_row(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(budget, "compiler", lambda: "gcc 99")
    with pytest.raises(UserError, match=r"nothing of gcc 99.*zh bench --image --write"):
        budget.committed()


def test_a_row_leaves_those_of_other_compilers(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    file = tmp_path / "budget.json"
    file.write_text(json.dumps({"gcc 98": {"images": {}}}))
    monkeypatch.setattr(budget, "COMMITTED", file)
    monkeypatch.setattr(budget, "compiler", lambda: "gcc 99")
    budget.write({}, {}, {})
    assert set(budget.rows()) == {"gcc 98", "gcc 99"}
    assert budget.committed() == {"images": {}, "periods": {}, "added": {}}


def test_overall_worst_has_a_live_change_in_it() -> None:
    periods = {
        "fig07 paper": {"mean": 500.0, "worst": 700, "latency": 4},
        "fig08 paper": {"mean": 600.0, "worst": 650, "latency": 5},
    }
    found = budget.overall(periods, {"paper": {"live_change": 50, "trace": 200}})
    assert found == {
        "paper": {
            "mean": 550.0,
            "worst": 750,
            "worst_without_live_change": 700,
            "live_change": 50,
            "trace": 200,
        },
        "latency": 5,
    }


def test_forbidden_symbols_are_recognised() -> None:
    bad = "malloc _sbrk _malloc_r __aeabi_dadd __aeabi_f2d __adddf3 sinf atan2f sqrt printf"
    good = "svpwm_step trig_unit memcpy memset __aeabi_uldivmod free_running speed_control_step"
    assert all(sizes._FORBIDDEN.fullmatch(name) for name in bad.split())
    assert not any(sizes._FORBIDDEN.fullmatch(name) for name in good.split())


LISTING = """
00000000 <leaf>:
   0:\tpush\t{r4, r5}
   2:\tvpush\t{d8-d11}
   6:\tsub\tsp, #20
   8:\tbx\tlr

00000010 <middle>:
  10:\tstmdb\tsp!, {r4, r5, r6, r7, r8, lr}
  14:\tbl\t0 <leaf>
  18:\tsub.w\tsp, sp, #1024\t@ 0x400
  1c:\tb.n\t30 <tail>

00000030 <tail>:
  30:\tstr.w\tr3, [sp, #-8]!
  34:\tbne.n\t32 <tail+0x2>
  36:\tblx\tr3

00000040 <loop>:
  40:\tpush\t{lr}
  42:\tbl\t50 <back>

00000050 <back>:
  50:\tpop\t{lr}
  52:\tb.w\t40 <loop>
"""


def test_stack_depth_of_a_listing() -> None:
    graph = stack.functions(LISTING)
    assert graph["leaf"].frame_bytes == 2 * 4 + 4 * 8 + 20
    assert graph["middle"].frame_bytes == 6 * 4 + 1024
    assert graph["middle"].calls == {"leaf", "tail"}
    assert stack.depth(graph, "middle", {"tail": ("leaf",)}) == 6 * 4 + 1024 + 8 + 60


def test_a_way_to_far_code_calls_what_its_address_says() -> None:
    """Two names of one function: the listing has one of them, the veneer perhaps the other."""
    graph = stack.functions(
        """
08000000 <near>:
 8000000:\tpush\t{r4, lr}
 8000002:\tbl\t8000010 <__far.lto_priv.1_veneer>

08000010 <__far.lto_priv.1_veneer>:
 8000010:\tldr.w\tpc, [pc]\t@ 8000014 <__far.lto_priv.1_veneer+0x4>
 8000014:\t.word\t0x10000801
 8000018:\t.word\t0x00000072

10000800 <far.lto_priv.0>:
10000800:\tsub\tsp, #40
"""
    )
    assert stack.depth(graph, "near", {}) == 2 * 4 + 40


def test_frames_and_calls_under_a_condition_count_too() -> None:
    graph = stack.functions(
        """
00000000 <leaf>:
   0:\tpusheq\t{r4}
   2:\tstrd\tr4, r5, [sp, #-16]!
   4:\tblne\t10 <other>
   6:\tbxeq\tlr

00000010 <other>:
  10:\tvpush\t{s16-s19}
"""
    )
    assert graph["leaf"].frame_bytes == 4 + 16
    assert stack.depth(graph, "leaf", {}) == 20 + 16


@pytest.mark.parametrize("line", ["sub\tsp, r4", "bic\tsp, sp, #7", "mls\tsp, r0, r1, r2"])
def test_a_stack_pointer_that_is_computed_is_refused(line: str) -> None:
    with pytest.raises(UserError, match="no bound exists"):
        stack.functions(f"\n00000000 <f>:\n   0:\t{line}\n")


@pytest.mark.parametrize("line", ["mov\tpc, r3", "bx\tr3", "blxne\tr3"])
def test_a_jump_through_a_register_is_indirect(line: str) -> None:
    assert stack.functions(f"\n00000000 <f>:\n   0:\t{line}\n")["f"].indirect


def test_what_has_no_bound_is_refused() -> None:
    graph = stack.functions(LISTING)
    with pytest.raises(UserError, match="calls through a register"):
        stack.depth(graph, "middle", {})
    with pytest.raises(UserError, match="recursion, loop -> back -> loop"):
        stack.depth(graph, "loop", {})
    with pytest.raises(UserError, match="not in the image"):
        stack.depth(graph, "absent", {})
