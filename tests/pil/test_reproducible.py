"""Two clean builds of one source in different folders give the same bytes."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from zerohertz.image.ports import ports
from zerohertz.paths import ROOT


def checkout(folder: Path) -> Path:
    """The files git knows, as they stand, in a folder of its own and under one and the same git."""
    listed = subprocess.run(("git", "ls-files", "-z"), cwd=ROOT, check=True, capture_output=True)
    for name in listed.stdout.decode().split("\0"):
        source = ROOT / name
        if name and source.is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(source, folder / name)
    return folder


def built(folder: Path, port: str) -> dict[str, bytes]:
    command = ("cmake", "--preset", port)
    subprocess.run(command, cwd=folder, check=True, capture_output=True)
    command = ("cmake", "--build", "--preset", port)
    subprocess.run(command, cwd=folder, check=True, capture_output=True)
    files = ("firmware.bin", "firmware.hex", "firmware.elf")
    return {name: (folder / "build" / port / name).read_bytes() for name in files}


@pytest.mark.parametrize("port", sorted(ports()))
def test_two_builds_in_different_folders_are_the_same_bytes(port: str, tmp_path: Path) -> None:
    one = built(checkout(tmp_path / "a"), port)
    other = built(checkout(tmp_path / "some" / "where" / "else"), port)
    assert [name for name in one if one[name] != other[name]] == []
    assert str(tmp_path).encode() not in one["firmware.elf"]


def test_another_source_is_another_image(tmp_path: Path) -> None:
    """Negative control: one constant of the control law changed in its last place."""
    one = built(checkout(tmp_path / "a"), "qemu_mps2")
    changed = checkout(tmp_path / "b")
    source = changed / "firmware" / "law" / "base" / "num.h"
    text = source.read_text()
    assert "0.70710678118654752440f" in text
    source.write_text(text.replace("0.70710678118654752440f", "0.7071067f"))
    assert built(changed, "qemu_mps2")["firmware.bin"] != one["firmware.bin"]
