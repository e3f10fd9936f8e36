"""A port may live outside the tree: -DZH_PORT=<path> of a copy of hal/template."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from zerohertz.build import build_image
from zerohertz.paths import ROOT


@pytest.fixture
def port(tmp_path: Path) -> Path:
    """Named like the original, so that the image may have the same bytes."""
    return Path(shutil.copytree(ROOT / "hal" / "template", tmp_path / "my ports" / "template"))


def configure(port: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run in the folder, as a path may be relative to it."""
    command = ("cmake", "-S", ROOT, "--preset", "template", "-B", folder / "build")
    return subprocess.run(
        (*command, f"-DZH_PORT={port}"), cwd=folder, capture_output=True, text=True
    )


def test_a_copy_of_the_template_is_the_same_image(port: Path, tmp_path: Path) -> None:
    configured = configure("my ports/template", tmp_path)
    assert configured.returncode == 0, configured.stderr
    subprocess.run(("cmake", "--build", tmp_path / "build"), check=True, capture_output=True)
    inside = build_image("template")
    built = (tmp_path / "build" / "firmware.bin").read_bytes()
    assert built == inside.with_suffix(".bin").read_bytes()
    assert str(tmp_path).encode() not in (tmp_path / "build" / "firmware.elf").read_bytes()


@pytest.mark.parametrize("file", ["CMakeLists.txt", "main.c", "memory.ld"])
def test_a_missing_file_is_named_with_where_to_take_it_from(
    port: Path, tmp_path: Path, file: str
) -> None:
    (port / file).unlink()
    configured = configure(str(port), tmp_path)
    assert configured.returncode != 0
    said = " ".join(configured.stderr.split())
    assert f"ZH_PORT: no {port}/{file}; start from {ROOT}/hal/template/{file}" in said


@pytest.mark.parametrize("port", ["nosuch", "./nosuch"])
def test_a_missing_folder_is_named(port: str, tmp_path: Path) -> None:
    configured = configure(port, tmp_path)
    assert configured.returncode != 0
    folder = tmp_path if "/" in port else ROOT / "hal"
    assert f"ZH_PORT: no folder {folder}/nosuch; give" in " ".join(configured.stderr.split())
