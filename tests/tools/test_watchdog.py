"""The test run ends a command that hangs, and waits for one that is slow."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

from zerohertz.testing import watchdog
from zerohertz.testing.watchdog import StoppedError, limit_cpu, wait

LOOP = "while True: pass"
# Computes for twice the stall limit below without a word.
SLOW = "import time\nuntil = time.process_time() + 2.0\nwhile time.process_time() < until: pass"
SLEEP = "import time; time.sleep(600)"


def python(code: str) -> subprocess.Popen:
    return subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.DEVNULL)


@pytest.fixture
def log(tmp_path) -> Path:
    path = tmp_path / "log"
    path.write_text("")
    return path


@pytest.fixture(autouse=True)
def a_hundredth_of_a_core_is_progress(monkeypatch):
    monkeypatch.setattr(watchdog, "STALL_CPU_S", 0.01)


def test_the_exit_code_is_handed_on(log):
    assert wait(python("raise SystemExit(3)"), log) == 3


def test_a_command_that_waits_for_ever_is_ended_with_its_children(log):
    code = f"import subprocess, sys; subprocess.run([sys.executable, '-c', {SLEEP!r}])"
    process = python(code)
    while not (children := psutil.Process(process.pid).children()):
        time.sleep(0.01)
    with pytest.raises(StoppedError, match="neither computed nor wrote anything for 1 s"):
        wait(process, log, stall_s=1.0)
    psutil.wait_procs(children, timeout=60)
    assert not any(child.is_running() for child in children)


def test_a_command_that_computes_is_not_ended(log):
    assert wait(python(SLOW), log, stall_s=1.0) == 0


def test_what_a_child_computes_counts(log):
    code = f"import subprocess, sys; subprocess.run([sys.executable, '-c', {SLOW!r}])"
    assert wait(python(code), log, stall_s=1.0) == 0


def test_a_command_that_writes_is_not_ended(log):
    code = f"import time\nfor _ in range(10): time.sleep(0.2); open({str(log)!r}, 'a').write('.')"
    assert wait(python(code), log, stall_s=1.0) == 0


def test_an_endless_loop_is_ended_after_its_computing_time(log):
    with pytest.raises(StoppedError, match="stopped after 1 s of computing"):
        wait(python(LOOP), log, stall_s=60.0, cpu_limit_s=1)


def test_the_limit_on_computing_holds_for_children(log):
    code = f"""
import subprocess, sys
input()
sys.exit(subprocess.run([sys.executable, "-c", {LOOP!r}]).returncode)
"""
    process = subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE)
    limit_cpu(process, 1)
    process.communicate(b"\n")
    assert process.returncode == 256 - signal.SIGXCPU


def test_a_process_that_is_gone_has_no_limit():
    process = python("")
    os.waitpid(process.pid, 0)
    limit_cpu(process, 1)
