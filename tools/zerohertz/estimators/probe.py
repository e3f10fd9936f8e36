"""The first second and a half of a drive, run as `python -m zerohertz.estimators.probe LIBRARY`.

What crashes or does not end ends this process, and says where on stderr: a line `frame OFFSET` for
each call within LIBRARY, innermost first, or Python's own words for a class. It is a program of its
own because its handler of a crash does what no program that goes on may do.
"""

from __future__ import annotations

import ctypes
import faulthandler
import os
import re
import resource
import signal
import subprocess
import sys
from pathlib import Path

from zerohertz.build import PYTHON

CPU_S = 8  # 1.5 s of a drive takes 10 ms, of a class a second; the start of Python takes another
SECONDS = 1.5
_DEEP = 200
_CRASHES = (signal.SIGSEGV, signal.SIGBUS, signal.SIGFPE, signal.SIGILL)
_HANDLER = ctypes.CFUNCTYPE(None, ctypes.c_int)
_C_LINE = re.compile(r"^(?P<path>/.+\.[ch]):(?P<line>\d+)", re.MULTILINE)
_PYTHON_LINE = re.compile(r'^  File "(?P<path>.+)", line (?P<line>\d+) in', re.MULTILINE)


def where(said: str, library: Path, folder: Path, python: str | None) -> str:
    """FILE:LINE of the innermost call in the estimator's own sources; empty: not known."""
    if python:
        lines, home = said, Path(python.rpartition(":")[0])
    else:
        frames = re.findall(r"^frame (0x[0-9a-f]+)$", said, re.MULTILINE)
        command = ("addr2line", "-i", "-e", str(library), *frames)
        try:
            found = subprocess.run(command, capture_output=True, text=True) if frames else None
        except FileNotFoundError:
            found = None
        lines, home = found.stdout if found else "", folder
    for line in (_PYTHON_LINE if python else _C_LINE).finditer(lines):
        if Path(line["path"]).resolve().is_relative_to(home):
            return f"{line['path']}:{line['line']}"
    return ""


def _base_of(library: str) -> int:
    """Where the library begins in memory; 0 before it is loaded."""
    with open("/proc/self/maps") as maps:
        return next((int(line.split("-")[0], 16) for line in maps if line.endswith(library)), 0)


def _frames(libc: ctypes.CDLL, library: str) -> None:
    found = (ctypes.c_void_p * _DEEP)()
    count = libc.backtrace(found, _DEEP)
    base = _base_of(f"{library}\n")
    size = os.stat(library).st_size
    offsets = [address - base for address in found[:count] if base and address]
    for number, offset in enumerate(each for each in offsets if 0 <= each < size):
        # The first is where it was; the others are returns, perhaps of the next line.
        os.write(2, f"frame {offset - min(number, 1):#x}\n".encode())


def _watch(library: str) -> object:
    """Say where when it crashes or its time is over, then end as it would have; to be kept."""
    if os.environ.get(PYTHON):
        faulthandler.enable()
        faulthandler.register(signal.SIGXCPU, chain=True)
        return None
    libc = ctypes.CDLL(None)

    def end(number: int) -> None:
        _frames(libc, library)
        libc.signal(number, None)  # SIG_DFL
        libc.raise_(number) if number == signal.SIGXCPU else None

    libc.raise_ = libc["raise"]
    kept = _HANDLER(end)
    libc.signal.argtypes = (ctypes.c_int, ctypes.c_void_p)
    for number in (*_CRASHES, signal.SIGXCPU):
        libc.signal(number, ctypes.cast(kept, ctypes.c_void_p))
    return kept


def main(library: str) -> None:
    from zerohertz import sim

    kept = _watch(library)
    resource.setrlimit(resource.RLIMIT_CPU, (CPU_S, CPU_S + 5))
    sim.run(sim.Job(scenario_overrides={"scenario.duration_s": SECONDS}, decimate=500))
    del kept


if __name__ == "__main__":
    main(sys.argv[1])
