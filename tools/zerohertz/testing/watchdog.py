"""Ends a command of the test run that hangs, and no other.

How long a command takes by the clock says more about the machine and its load than about the
command. So there is no limit on that: a command is ended when its processes neither compute nor
write for STALL_S, and the kernel ends a single process after CPU_LIMIT_S of its own computing.
"""

from __future__ import annotations

import contextlib
import resource
import signal
import subprocess
import time
from pathlib import Path

STALL_S = 300.0
# Less than this in STALL_S is waiting: one in a hundred processes of a core still gets three times
# as much, a loop that looks ten times a second uses a tenth.
STALL_CPU_S = 1.0
# Far beyond the longest process of the run (cppcheck and pytest: minutes), on a slow machine too.
CPU_LIMIT_S = 3600


class StoppedError(Exception):
    """The command did not end by itself."""


def limit_cpu(process: subprocess.Popen, seconds: int) -> None:
    """Let the kernel end the process, and each that it starts from now on, by SIGXCPU."""
    with contextlib.suppress(ProcessLookupError):  # it has ended already
        resource.prlimit(process.pid, resource.RLIMIT_CPU, (seconds, seconds + 5))


def wait(
    process: subprocess.Popen,
    output: Path,
    stall_s: float = STALL_S,
    cpu_limit_s: int = CPU_LIMIT_S,
) -> int:
    """Exit code of a process that writes to `output`; StoppedError when a limit ended it."""
    limit_cpu(process, cpu_limit_s)
    progress, since = (0.0, 0), time.monotonic()
    while True:
        with contextlib.suppress(subprocess.TimeoutExpired):
            code = process.wait(timeout=stall_s / 30.0)
            if code == -signal.SIGXCPU:
                raise StoppedError(f"stopped after {cpu_limit_s} s of computing")
            return code
        now = _cpu_s(process.pid), output.stat().st_size
        if abs(now[0] - progress[0]) >= STALL_CPU_S or now[1] != progress[1]:
            progress, since = now, time.monotonic()
        elif time.monotonic() - since > stall_s:
            _kill_tree(process)
            raise StoppedError(
                f"stopped: it neither computed nor wrote anything for {stall_s:.0f} s"
            )


def _cpu_s(pid: int) -> float:
    """CPU time of a process and its descendants, those that have ended included."""
    import psutil  # of the packages; `zh test --only` is read before they are installed

    total = 0.0
    with contextlib.suppress(psutil.NoSuchProcess):
        root = psutil.Process(pid)
        for process in (root, *root.children(recursive=True)):
            with contextlib.suppress(psutil.NoSuchProcess):
                total += sum(process.cpu_times()[:4])  # its own and of children that have ended
    return total


def _kill_tree(process: subprocess.Popen) -> None:
    import psutil

    with contextlib.suppress(psutil.NoSuchProcess):
        for child in psutil.Process(process.pid).children(recursive=True):
            with contextlib.suppress(psutil.NoSuchProcess):
                child.kill()
    process.kill()
    process.wait()
