#!/usr/bin/env python3
"""Writes the CRC-32C of a linked image into its last word, then makes .bin and .hex beside it.

Python's standard library alone: the build of an image needs nothing of tools/requirements.txt.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
from zerohertz.gain_design.crc32c import crc32c

CRC_SECTION = ".image_crc"


def stamp(elf: Path, objcopy: str) -> int:
    """Fills the section; the image is everything before it, without gaps."""
    binary = elf.with_suffix(".bin")
    _run(objcopy, "-O", "binary", elf, binary)
    image = binary.read_bytes()
    crc = crc32c(image[:-4])
    word = elf.with_suffix(".crc")
    word.write_bytes(crc.to_bytes(4, "little"))
    _run(objcopy, "--update-section", f"{CRC_SECTION}={word}", elf)
    word.unlink()
    _run(objcopy, "-O", "binary", elf, binary)
    _run(objcopy, "-O", "ihex", elf, elf.with_suffix(".hex"))
    if binary.read_bytes() != image[:-4] + crc.to_bytes(4, "little"):
        raise SystemExit(
            f"error: {elf}: {CRC_SECTION} is not the image's last word; see sections.ld"
        )
    return crc


def _run(*command: str | Path) -> None:
    subprocess.run([str(word) for word in command], check=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--objcopy", default="arm-none-eabi-objcopy")
    parser.add_argument("elf", type=Path)
    given = parser.parse_args()
    print(f"{given.elf.name}: CRC-32C {stamp(given.elf, given.objcopy):08x}")
