"""Defects in the running image on the emulated core: each ends with the gates off and its own code.

The image is told to misbehave in control period 12 000 of a run: loaded, at 300 min^-1, gates on.
Codes: hal/cortex_m/cm_fault.h.
"""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

from zerohertz import sim
from zerohertz.build import build_image
from zerohertz.drive import Fault
from zerohertz.image import loop
from zerohertz.image.emulator import EXIT_DONE, emulator
from zerohertz.image.loop import End, Inject

PERIOD = 10_000  # the running check takes some 3000 for a pass over the image
PERIODS = 15_000

WILD_ACCESS, STACK_OVERFLOW, DIVISION_BY_ZERO, UNDEFINED = 110, 111, 112, 113
CONTROL_STUCK, BACKGROUND_STUCK, TABLE_CHANGED, IMAGE_CHANGED = 116, 117, 118, 119

ENDS = {
    Inject.WILD_WRITE: WILD_ACCESS,
    Inject.NULL_WRITE: WILD_ACCESS,
    Inject.CODE_WRITE: WILD_ACCESS,
    Inject.EXECUTE_RAM: WILD_ACCESS,
    Inject.STACK_OVERFLOW: STACK_OVERFLOW,
    Inject.DIVISION_BY_ZERO: DIVISION_BY_ZERO,
    Inject.UNDEFINED_INSTRUCTION: UNDEFINED,
    Inject.STUCK_CONTROL: CONTROL_STUCK,
    Inject.DEAD_CONTROL: CONTROL_STUCK,
    Inject.STUCK_BACKGROUND: BACKGROUND_STUCK,
    Inject.TABLE_BIT: TABLE_CHANGED,
    Inject.IMAGE_BIT: IMAGE_CHANGED,
}


@pytest.fixture(scope="session")
def image() -> Path:
    """The image with the configuration `recommended`."""
    return build_image("qemu_mps2")


def run(image: Path, inject: Inject) -> loop.PilRun:
    job = sim.Job(
        motor_dir=sim.ROOT / "gain_tables" / "hasegawa2005_recommended",
        decimate=PERIODS,
        max_steps=PERIODS,
    )
    return loop.run(job, image, inject=inject, inject_at=PERIOD)


def test_every_defect_is_tested() -> None:
    elsewhere = {Inject.OVERRUN, Inject.OVERRUNS, Inject.HANG, Inject.SKIP}
    assert {*ENDS, *elsewhere, Inject.NONE, Inject.LIVE_CHANGE, Inject.TRACE} == set(Inject)


def test_without_a_defect_the_run_goes_through_with_the_gates_on(image: Path) -> None:
    result = run(image, Inject.NONE)
    assert (result.end, result.exit_code) == (End.EQUAL, EXIT_DONE)
    assert result.gates_on
    assert result.periods == PERIODS
    assert result.late_periods == 0


@pytest.mark.parametrize("inject", ENDS, ids=lambda inject: inject.name.lower())
def test_defect_ends_with_the_gates_off_and_its_own_code(image: Path, inject: Inject) -> None:
    result = run(image, inject)
    assert result.end == End.LEFT
    assert result.exit_code == ENDS[inject], result.text
    assert re.search(rf"^end {ENDS[inject]:08x} gates off ", result.text, re.MULTILINE)
    # It was running, and did nothing odd before; of the table the drive itself takes notice.
    assert result.periods >= PERIOD
    assert result.difference == "" or "gates_on: image 00000000" in result.difference


def test_faults_name_the_place(image: Path) -> None:
    """The address of a wild write is told, and a pc inside the image."""
    text = run(image, Inject.WILD_WRITE).text
    found = re.search(r"pc ([0-9a-f]{8}) address ([0-9a-f]{8})", text)
    assert found is not None
    assert found[2] == "30000000"
    assert 0x00400000 <= int(found[1], 16) < 0x00420000


def test_a_stuck_control_interrupt_ends_within_the_watchdog_time(image: Path) -> None:
    """100 ms are 500 periods, counted from the last round of the background: one takes 9 here."""
    assert run(image, Inject.STUCK_CONTROL).periods == PERIOD
    assert run(image, Inject.STUCK_BACKGROUND).periods <= PERIOD + 500 + 10


# One second of 25 MHz (hal/qemu_mps2/mps2_registers.h) has 5000 control periods.
TICKS_PER_PERIOD = 25_000_000 // 5000


@pytest.mark.parametrize("inject", [Inject.STUCK_CONTROL, Inject.DEAD_CONTROL])
def test_a_control_interrupt_that_hangs_loses_its_gates_in_three_periods(
    image: Path, inject: Inject
) -> None:
    """By a more urgent timer; the watchdog ends the run much later. Ticks since the last control
    interrupt began, when the gates went off."""
    found = re.search(r" hang ([0-9a-f]{8})$", run(image, inject).text, re.MULTILINE)
    assert found is not None
    assert TICKS_PER_PERIOD < int(found[1], 16) <= 3 * TICKS_PER_PERIOD


def test_no_other_defect_is_taken_for_a_hang(image: Path) -> None:
    assert " hang 00000000" in run(image, Inject.WILD_WRITE).text
    assert " hang 00000000" in run(image, Inject.STUCK_BACKGROUND).text


def test_one_late_period_is_told_and_the_drive_goes_on(image: Path) -> None:
    result = run(image, Inject.OVERRUN)
    assert result.end == End.EQUAL
    assert result.gates_on
    assert result.late_periods == 1
    assert Fault(result.faults) == Fault.PERIOD_LATE


def test_two_late_periods_in_a_row_open_the_gates(image: Path) -> None:
    result = run(image, Inject.OVERRUNS)
    assert result.end == End.EQUAL
    assert not result.gates_on
    assert result.late_periods >= 2
    assert Fault(result.faults) == Fault.PERIOD_LATE | Fault.PERIOD_OVERRUN


def test_one_period_as_long_as_three_opens_the_gates(image: Path) -> None:
    result = run(image, Inject.HANG)
    assert result.end == End.EQUAL
    assert not result.gates_on
    assert result.late_periods >= 3
    assert Fault(result.faults) == Fault.PERIOD_LATE | Fault.PERIOD_OVERRUN


@pytest.mark.parametrize("offset", [0x1000, 0x4000, -0x1000])
def test_an_image_with_a_flipped_bit_does_not_start(
    image: Path, tmp_path: Path, offset: int
) -> None:
    """Code, the middle of the gain table, constants near the end."""
    elf = tmp_path / "firmware.elf"
    shutil.copy(image, elf)
    code = (image.with_suffix(".bin")).read_bytes()
    at = offset if offset >= 0 else len(code) + offset
    content = bytearray(elf.read_bytes())
    where = content.find(code[at : at + 64])
    assert where > 0
    content[where + 5] ^= 1 << 3
    elf.write_bytes(content)
    with emulator(elf) as core:
        assert core.wait() == IMAGE_CHANGED, core.text
    assert "gates off" in core.text
    assert "ZeroHertz" not in core.text
