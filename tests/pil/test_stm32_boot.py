"""The STM32F405 image as far as an emulated part goes that has neither clock tree nor TIM1.

QEMU's netduinoplus2 has core, MPU, NVIC and serial ports; clock, flash controller, pins and TIM1
read as 0, so every time-out of the start is met.
"""

from __future__ import annotations

import shutil
import struct
import subprocess
import threading
from pathlib import Path

import pytest

from zerohertz.build import build_image
from zerohertz.gain_design.stored import read_table_json
from zerohertz.gain_design.table import gains_of
from zerohertz.image import sizes
from zerohertz.paths import ROOT
from zerohertz.scenario.setup import load_setup

FLASH, RAM = 0x08000000, 0x20000000
IRQ_ADC = 18


@pytest.fixture(scope="module")
def image() -> Path:
    return build_image("stm32f405")


def boot(elf: Path, until: str, patience_s: float = 30.0) -> str:
    """What the third serial port says up to and with `until`, or within the patience."""
    command = (
        *("qemu-system-arm", "-M", "netduinoplus2", "-nographic", "-monitor", "none"),
        *("-serial", "null", "-serial", "null", "-serial", "stdio", "-kernel", str(elf)),
    )
    with subprocess.Popen(
        command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
    ) as core:
        assert core.stdout is not None
        alarm = threading.Timer(patience_s, core.kill)
        alarm.start()
        text = b""
        while until.encode() not in text and (more := core.stdout.read1(4096)):
            text += more
        alarm.cancel()
        core.kill()
    return text.decode(errors="replace")


def patched(image: Path, folder: Path, at: int, content: bytes, stamp: bool) -> Path:
    """A copy with other bytes at a flash address; with a matching CRC, or with the old one."""
    elf = folder / "firmware.elf"
    shutil.copy(image, elf)
    original = image.with_suffix(".bin").read_bytes()
    data = bytearray(elf.read_bytes())
    start = data.find(original[:256])
    assert start > 0
    data[start + at - FLASH : start + at - FLASH + len(content)] = content
    elf.write_bytes(data)
    if stamp:
        subprocess.run((ROOT / "tools" / "stamp_image.py", elf), check=True, capture_output=True)
    return elf


def symbol(elf: Path, name: str) -> int:
    return sizes._symbols(elf)[name][0]


def test_it_boots_tells_what_it_is_and_stays_off_without_its_clock(image: Path) -> None:
    text = boot(image, "drive off")
    assert text.startswith("ZeroHertz ")
    crc = int.from_bytes(image.with_suffix(".bin").read_bytes()[-4:], "little")
    assert "port=stm32f405 config=recommended motor=hasegawa2005_recommended" in text
    assert f"image={crc:08x}\r\n" in text
    assert "\nno PLL; drive off" in text


def test_the_image_carries_the_gains_of_the_json(image: Path) -> None:
    table = read_table_json(load_setup("recommended").motor_dir / "l_gain.json")
    at = symbol(image, "gain_entry") - FLASH
    words = gains_of(table).astype("<f4").tobytes()
    assert image.with_suffix(".bin").read_bytes()[at : at + len(words)] == words


def test_a_flipped_bit_of_the_image_is_found_before_anything_runs(
    image: Path, tmp_path: Path
) -> None:
    at = symbol(image, "gain_entry") + 4000
    byte = image.with_suffix(".bin").read_bytes()[at - FLASH]
    elf = patched(image, tmp_path, at, bytes([byte ^ 4]), stamp=False)
    assert "end 00000077 gates off" in boot(elf, "address")


def test_a_fault_is_told_with_its_code_and_place(image: Path, tmp_path: Path) -> None:
    """An undefined instruction where the pins are set up, with a CRC that says it is meant."""
    at = symbol(image, "stm32_gpio_configure") & ~1
    elf = patched(image, tmp_path, at, b"\x00\xde", stamp=True)
    assert f"end 00000071 gates off pc {at:08x}" in boot(elf, "address")


def test_vectors_entry_and_sections_are_where_the_part_looks(image: Path) -> None:
    binary = image.with_suffix(".bin").read_bytes()
    symbols = sizes._symbols(image)
    vectors = struct.unpack_from("<35I", binary)
    assert vectors[0] == symbols["cm_stack_top"][0]
    assert RAM < vectors[0] < RAM + 128 * 1024
    assert vectors[1] == symbols["cm_reset"][0] | 1
    assert vectors[16 + IRQ_ADC] == symbols["control_interrupt"][0] | 1
    assert all(v & 1 and FLASH < v < FLASH + len(binary) for v in vectors[1:16])
    header = subprocess.run(
        ("arm-none-eabi-readelf", "-hl", image), check=True, capture_output=True, text=True
    ).stdout
    assert f"{symbols['cm_reset'][0] | 1:#x}" in header.lower()
    assert "hard-float" in header


def test_the_image_header_lies_behind_the_vectors(image: Path) -> None:
    binary = image.with_suffix(".bin").read_bytes()
    at = symbol(image, "cm_image_info") - FLASH
    magic, size = struct.unpack_from("<2I", binary, at)
    assert (magic, size) == (0x5A48494D, len(binary))
    assert at <= 1024


def test_hex_and_map_are_there(image: Path) -> None:
    assert image.with_suffix(".hex").read_text().startswith(":020000040800F2")
    assert ".vectors.irq" in image.with_suffix(".map").read_text()
