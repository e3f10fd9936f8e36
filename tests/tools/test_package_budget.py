"""What a first command fetches: `zh demo`, `serve`, `studio`, `set` and `run` do with little."""

from __future__ import annotations

import importlib.metadata
import os
import re
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from zerohertz.cli import LIST_OF
from zerohertz.paths import ROOT

TOOLS = ROOT / "tools"
MOST_MB = 150.0
NAMES = ("", "-design", "-draw", "-campaign", "-mdf")
HEAVY = sorted({*LIST_OF, "pandas", "pytest"})
DEMO = """
from pathlib import Path
import sys
from rich.console import Console
from zerohertz.report import demo
from zerohertz.scenario.setup import load_setup
demo.check_tables = lambda *_: []  # the proof has tests of its own, of half a minute
if __name__ == "__main__":
    made = demo.make_report(
        load_setup("paper"), load_setup("recommended"), Path(sys.argv[1]), seeds=1, workers=2,
        console=Console(),
    )
    assert len(made.pictures) == 17
"""


@pytest.fixture
def bare(tmp_path: Path) -> dict[str, str]:
    """The environment of Pythons, and of their workers, that have none of the heavy packages."""
    lines = "".join(f"sys.modules[{name!r}] = None\n" for name in HEAVY)
    (tmp_path / "sitecustomize.py").write_text(f"import sys\n{lines}")
    return os.environ | {"PYTHONPATH": f"{tmp_path}:{TOOLS}"}


def zh(bare: dict[str, str], *words: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "zerohertz", *words]
    return subprocess.run(command, env=bare, cwd=ROOT, capture_output=True, text=True, timeout=300)


@pytest.fixture
def served(bare: dict[str, str]) -> Iterator[str]:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = str(free.getsockname()[1])
    command = [sys.executable, "-m", "zerohertz", "serve", "--tcp", port]
    with subprocess.Popen(command, env=bare, cwd=ROOT, stderr=subprocess.PIPE, text=True) as server:
        for _ in range(300):
            with socket.socket() as probe:
                if probe.connect_ex(("127.0.0.1", int(port))) == 0:
                    break
            assert server.poll() is None, server.stderr.read()
            time.sleep(0.1)
        yield port
        server.terminate()


def test_serve_set_and_run_need_no_heavy_package(bare: dict[str, str], served: str) -> None:
    run = ("run", "--rpm", "60", "--seconds", "1")
    for words in (("get", "Rs_ohm"), ("set", "i_d_A", "5.0"), run):
        done = zh(bare, *words, "--sil", "--tcp", served)
        assert done.returncode == 0, done.stderr


def test_the_studio_and_its_commissioning_need_no_heavy_package(bare: dict[str, str]) -> None:
    code = "import zerohertz.studio.pages, zerohertz.studio.tools, zerohertz.commission.finding"
    code += ", zerohertz.commission.trial, zerohertz.gain_design.table, zerohertz.studio.command"
    subprocess.run([sys.executable, "-c", code], env=bare, cwd=ROOT, check=True)


def test_the_demo_needs_no_heavy_package(bare: dict[str, str], tmp_path: Path) -> None:
    script = tmp_path / "demo.py"
    script.write_text(DEMO)
    command = [sys.executable, str(script), str(tmp_path / "report")]
    done = subprocess.run(command, env=bare, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "report" / "index.html").is_file()


def test_what_is_not_there_is_named_with_its_remedy(bare: dict[str, str], tmp_path: Path) -> None:
    done = zh(bare, "animate", "--gif", str(tmp_path / "a.gif"))
    assert done.returncode == 2
    assert "error: matplotlib: not installed; run tools/zh setup draw" in done.stderr


def installed_MB(name: str) -> float:
    """Of the packages of a list that no shorter list has."""
    found = importlib.metadata.files(name) or []
    places = (Path(str(path.locate())) for path in found)
    return sum(path.stat().st_size for path in places if path.is_file()) / 1e6


def packages(part: str) -> list[str]:
    text = (TOOLS / f"requirements{part}.txt").read_text(encoding="utf-8")
    return re.findall(r"^([\w.-]+)==", text, re.MULTILINE)


@pytest.mark.parametrize("part", NAMES)
def test_a_list_says_how_large_it_is(part: str) -> None:
    text = (TOOLS / f"requirements{part}.txt").read_text(encoding="utf-8")
    said = re.search(r"^# Size: \d+ MB to fetch, (\d+) MB on disk$", text, re.MULTILINE)
    assert said
    skipped = {"importlib-metadata", "zipp", "lazy-importer"}  # of some platforms alone
    measured = sum(installed_MB(name) for name in packages(part) if name not in skipped)
    assert float(said[1]) == pytest.approx(measured, rel=0.15, abs=5.0)
    assert part or measured < MOST_MB
