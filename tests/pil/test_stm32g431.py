"""Both STM32G431 images: where their code lies, and their objects on the emulated core."""

from __future__ import annotations

import struct
import subprocess
from pathlib import Path

import pytest

from zerohertz.build import build_image
from zerohertz.errors import UserError
from zerohertz.image import command, sizes
from zerohertz.image.command import BOARDS, Experiment, measure
from zerohertz.image.loop import End

FLASH, CORE_COUPLED, RAM = 0x08000000, 0x10000000, 0x20000000
IMAGE_MAX = 120 * 1024  # pages 0 to 59
PERIOD = ("drive_step", "estimate", "observe", "trig_unit_small", "current_jump_look")  # fast.ld


@pytest.fixture(scope="module", params=BOARDS)
def board(request: pytest.FixtureRequest) -> str:
    return request.param


def symbols(elf: Path) -> dict[str, int]:
    """Addresses, by name without what the compiler appends to a clone."""
    return {name.split(".")[0]: at for name, (at, _) in sizes._symbols(elf).items()}


def sections(elf: Path) -> dict[str, tuple[int, int]]:
    """Name -> address and size."""
    text = subprocess.run(
        ("arm-none-eabi-size", "-A", elf), check=True, capture_output=True, text=True
    ).stdout
    rows = [line.split() for line in text.splitlines() if line.startswith(".")]
    return {row[0]: (int(row[2]), int(row[1])) for row in rows}


def test_image_and_data_keep_to_their_memories(board: str) -> None:
    elf = build_image(board)
    found = sections(elf)
    assert elf.with_suffix(".bin").stat().st_size <= IMAGE_MAX
    assert found[".vectors"][0] == FLASH
    at, size = found[".fast"]
    assert CORE_COUPLED + 2 * 1024 <= at
    assert at + size <= CORE_COUPLED + 10 * 1024
    for name in (".stack", ".data", ".bss", ".noinit"):
        at, size = found[name]
        assert RAM <= at <= at + size <= RAM + 24 * 1024


def test_the_period_runs_from_the_core_coupled_memory_and_is_copied_there(board: str) -> None:
    elf = build_image(board)
    known = symbols(elf)
    assert all(known[name] >> 16 == CORE_COUPLED >> 16 for name in PERIOD)
    start, end = known["cm_fast_start"], known["cm_fast_end"]
    loaded = known["cm_fast_load"] - FLASH
    kept = elf.with_suffix(".bin").read_bytes()[loaded : loaded + end - start]
    objcopy = ("arm-none-eabi-objcopy", "-O", "binary", "--only-section=.fast")
    code = elf.with_name("fast.bin")
    subprocess.run((*objcopy, elf, code), check=True)
    assert kept == code.read_bytes()


def test_vectors_are_where_the_part_looks(board: str) -> None:
    elf = build_image(board)
    known = sizes._symbols(elf)
    vectors = struct.unpack_from("<72I", elf.with_suffix(".bin").read_bytes())
    assert vectors[0] == known["cm_stack_top"][0]
    assert vectors[1] == known["cm_reset"][0] | 1
    assert vectors[16 + 18] == known["control_interrupt"][0] | 1
    assert vectors[16 + 38] == known["usart_interrupt"][0] | 1
    assert vectors[16 + 55] == known["hang_interrupt"][0] | 1


def test_its_objects_agree_with_the_sil_in_every_bit(board: str) -> None:
    """With the hot functions in a memory of their own there too (hal/stm32g431/mps2)."""
    known = symbols(build_image(board, "zh_mps2"))
    assert all(known[name] >> 16 == 0x2100 for name in PERIOD)
    for scenario in ("fig07", "fig17"):
        run = measure(Experiment(scenario, "recommended"), "mps2-an386", 60_000, board)
        assert (run.end, run.periods, run.differing_bits) == (End.EQUAL, 60_000, 0)
        assert run.late_periods == 0


@pytest.mark.parametrize(
    ("board", "config", "text"),
    [
        ("abacus", None, "--board: no 'abacus'; there are stm32g431_esc"),
        (BOARDS[0], "paper", "has no gain table of 'paper'"),
    ],
)
def test_a_board_or_configuration_that_has_no_image_is_named(
    board: str, config: str | None, text: str
) -> None:
    with pytest.raises(UserError, match=text):
        command.pil("smoke", config, board=board)
