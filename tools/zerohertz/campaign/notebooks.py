"""`zh campaign notebooks`: all of tools/notebooks, in the checkout and from the wheel."""

from __future__ import annotations

import os
import subprocess
import sys

import typer

from zerohertz.paths import ROOT


def notebooks() -> None:
    """Run every notebook from top to bottom, in the checkout and from the wheel.

    Exit 1 if a cell fails.
    """
    folder, config = ROOT / "tests" / "tools", ROOT / "tools" / "pyproject.toml"
    tests = (folder / "test_notebooks.py", folder / "test_wheel.py", "-k", "notebook")
    command = (sys.executable, "-m", "pytest", "-q", "-c", config, "--durations=7", *tests)
    done = subprocess.run(command, env=os.environ | {"ZH_ALL_NOTEBOOKS": "1"}, check=False)
    raise typer.Exit(0 if done.returncode == 0 else 1)
