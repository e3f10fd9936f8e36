"""What mypy --strict tells a program that uses the Python interface: its types are no Any."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

from zerohertz.paths import ROOT
from zerohertz.testing.stages import MYPY

PROGRAM = """
from zerohertz import Drive, Plant, estimators
from zerohertz.gym import Setup

drive, plant = Drive("motor", "board.toml"), Plant("rig.toml", "board.toml")
words: tuple[int, ...] = plant.sample()
out = drive.step(1, 2, 3, 4, 5, 6, speed_ref_rpm=60.0, run=True)
plant.advance(out.duties, out.gates_on)
speed_rpm: float = plant.run(drive, 10).truth["speed_rpm"][-1]
kept: bytes = drive.snapshot()

drive.step(1, 2, 3, 4, 5, 6, run="yes")  # wrong: arg-type
gates: str = out.gates_on  # wrong: assignment
plant.run(plant, 10)  # wrong: arg-type
drive.restore("text")  # wrong: arg-type
drive["adapt_kp"] = "fast"  # wrong: assignment
drive.telemetry().no_such  # wrong: attr-defined
Setup(periods="ten")  # wrong: arg-type
estimators.use(5)  # wrong: arg-type
drive.fit_terminals().wire(inputs="all")  # wrong: arg-type
"""


def test_a_wrong_use_is_seen_and_a_right_one_is_not(tmp_path: Path) -> None:
    file = tmp_path / "program.py"
    file.write_text(PROGRAM)
    done = subprocess.run([*map(str, MYPY), str(file)], cwd=ROOT, capture_output=True, text=True)
    found = re.findall(r"program\.py:(\d+): error: .*\[([a-z-]+)\]$", done.stdout, re.MULTILINE)
    expected = [
        (str(number), mark[1])
        for number, line in enumerate(PROGRAM.splitlines(), 1)
        if (mark := re.search(r"# wrong: ([a-z-]+)$", line))
    ]
    assert found == expected, done.stdout + done.stderr
