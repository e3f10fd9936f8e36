"""What the report was made with."""

from __future__ import annotations

import importlib.metadata
import importlib.util
import platform
import subprocess
from collections.abc import Sequence

from zerohertz import __version__
from zerohertz.paths import ROOT


def versions() -> list[tuple[str, str]]:
    """Name and version of everything that could change a result."""
    libraries = [f"numpy {importlib.metadata.version('numpy')}"]
    libraries += [
        f"{name} {importlib.metadata.version(name)}"
        for name in ("scipy", "clarabel")  # of the design
        if importlib.util.find_spec(name)
    ]
    return [
        ("zerohertz", __version__),
        ("source", source()),
        ("compiler", _first_line("gcc", "--version")),
        ("Python", f"{platform.python_version()}; {', '.join(libraries)}"),
        ("system", f"{platform.system()} {platform.machine()}"),
    ]


def source() -> str:
    """The checkout, by its commit."""
    commit = _first_line("git", "-C", str(ROOT), "rev-parse", "--short=12", "HEAD")
    if not commit:
        return "not a git checkout"
    changed = _first_line("git", "-C", str(ROOT), "status", "--porcelain", "--untracked-files=no")
    return f"commit {commit}" + (", with local changes" if changed else "")


def _first_line(*command: str) -> str:
    done = _run(command)
    return done.splitlines()[0] if done.strip() else ""


def _run(command: Sequence[str]) -> str:
    try:
        return subprocess.run(
            command, capture_output=True, text=True, check=False, timeout=20
        ).stdout
    except (OSError, subprocess.TimeoutExpired):
        return ""
