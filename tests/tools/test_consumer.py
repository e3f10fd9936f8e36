"""A project outside, five lines of CMake: with this one inside it, and with this one installed."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from zerohertz.build import ensure_built
from zerohertz.paths import ROOT

CONSUMER = ROOT / "tests" / "consumer"


def run(*command: str | Path) -> str:
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture
def consumer(tmp_path: Path) -> Path:
    """Its sources, away from this checkout."""
    return Path(shutil.copytree(CONSUMER, tmp_path / "consumer"))


def built(project: Path, *arguments: str) -> Path:
    folder = project.parent / "build"
    run("cmake", "-S", project, "-B", folder, "-G", "Ninja", *arguments)
    run("cmake", "--build", folder, "--parallel", "2", "--target", "consumer")
    return folder


def test_added_as_a_subdirectory_it_brings_its_libraries_and_nothing_else(consumer: Path) -> None:
    folder = built(consumer / "inside", f"-DZEROHERTZ={ROOT}")
    assert run(folder / "consumer") == "steps 2000, trip 0\n"

    # Targets of ours begin like this, so they meet none of the project's own; no tests among them.
    listed = run("cmake", "--build", folder, "--target", "help")
    names = set(re.findall(r"^(\w+): phony$", listed, flags=re.MULTILINE))
    assert {"zh_law", "zh_gain_tables", "zerohertz_sil"} <= names
    others = {name for name in names if not re.match(r"(cmake_.*_)?(zh|zerohertz)_", name)}
    assert others <= {"consumer", "all", "clean", "help", "edit_cache", "rebuild_cache"}
    assert not (folder / "compile_commands.json").exists()


def test_installed_and_moved_it_is_found(consumer: Path, tmp_path: Path) -> None:
    made = ensure_built("zh_unit", "zh_gain_tables", "zerohertz_sil").folder
    run("cmake", "--install", made, "--prefix", tmp_path / "first")
    installed = (tmp_path / "first").rename(tmp_path / "installed")
    folder = built(consumer / "installed", f"-DCMAKE_PREFIX_PATH={installed}")
    assert run(folder / "consumer") == "steps 2000, trip 0\n"
    files = [path.read_text() for path in installed.rglob("*.cmake")]
    assert files
    assert not [text for text in files if str(ROOT) in text]
