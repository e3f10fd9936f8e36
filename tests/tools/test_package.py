"""What `pip install ./tools` takes: the modules, what they read beside them, their dependencies."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from zerohertz.paths import ROOT

TOOLS = ROOT / "tools"
SETUP = "import setuptools; setuptools.setup()"


def test_every_module_is_packed_and_the_dependencies_are_named(tmp_path: Path) -> None:
    pytest.importorskip("setuptools", reason="pip would fetch it")
    copy = shutil.copytree(TOOLS, tmp_path / "tools")  # it leaves files where it works
    command = (sys.executable, "-c", SETUP, "--quiet", "build", "--build-lib", "out", "egg_info")
    done = subprocess.run(command, cwd=copy, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr

    packed = {p.relative_to(copy / "out") for p in (copy / "out").rglob("*") if p.is_file()}
    modules = {p.relative_to(TOOLS) for p in TOOLS.rglob("zerohertz/**/*.py")}
    report = Path("zerohertz", "report")
    assert packed == modules | {report / "report.css", report / "chart.js"}
    requires = (copy / "zerohertz.egg-info" / "requires.txt").read_text()
    assert "numpy==" in requires
