"""`zh campaign fieldbus`: random frames and a PLC's traffic on both buses of the SIL drive.

The tests of the same names (tests/tools) run samples of them; the masters are pymodbus and
python-canopen, which only tests have.
"""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Iterator

from zerohertz.campaign.fuzz import Part
from zerohertz.paths import ROOT

TESTS = ROOT / "tests" / "tools"


def run_all(modbus: int, can: int, hours: float, seed: int) -> Iterator[Part]:
    """Each part that was asked for (0: none), as it ends."""
    seconds = round(3600 * hours)
    for name, wanted, program in (
        ("frames on Modbus", modbus, "test_modbus_fuzz.py"),
        ("frames on CAN", can, "test_canopen_fuzz.py"),
        ("seconds of a PLC's traffic", seconds, "test_plc.py"),
    ):
        if wanted:
            yield _part(name, wanted, program, seed)


def _part(name: str, wanted: int, program: str, seed: int) -> Part:
    start_s = time.monotonic()
    command = (sys.executable, str(TESTS / program), str(wanted), str(seed))
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    good = done.returncode == 0
    note = done.stdout.strip() + ("" if good else f"\n{done.stderr[-2000:]}")
    return Part(name, wanted, wanted if good else 0, good, time.monotonic() - start_s, note.strip())
