"""Commands of `zh` that the tests of the page start, and where the pictures go."""

from __future__ import annotations

import os
import re
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path

from playwright.sync_api import Page

ROOT = Path(__file__).resolve().parents[2]
PICTURES = ROOT / "build" / "test-logs" / "web"
_ADDRESS = re.compile(r"studio at (http://\S+)")
_SERVING = re.compile(r"serving on 127\.0\.0\.1:(\d+)")

Opener = Callable[..., AbstractContextManager[Page]]


@contextmanager
def zh(*words: str, said: re.Pattern[str]) -> Iterator[str]:
    """A command of `zh` in its own process; what the pattern finds in what it says."""
    command = (sys.executable, "-m", "zerohertz", *words)
    environment = os.environ | {"PYTHONPATH": str(ROOT / "tools")}
    process = subprocess.Popen(command, env=environment, stderr=subprocess.PIPE, text=True)
    assert process.stderr is not None
    heard = []
    try:
        for line in process.stderr:
            heard.append(line)
            if found := said.search(line):
                break
        else:
            raise AssertionError("".join(heard))
        threading.Thread(target=process.stderr.read, daemon=True).start()
        yield found[1]
    finally:
        process.terminate()
        assert process.wait(120.0) is not None


@contextmanager
def served(*options: str) -> Iterator[int]:
    """Port of a `zh serve`."""
    with zh("serve", "--tcp", free_port(), *options, said=_SERVING) as port:
        yield int(port)


@contextmanager
def studio(*options: str, page: str = "0") -> Iterator[str]:
    """Address of a `zh studio`."""
    with zh("studio", "--no-browser", "--page", page, *options, said=_ADDRESS) as address:
        yield address


def free_port() -> str:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return str(probe.getsockname()[1])


def local(url: str) -> bool:
    return url.startswith(("http://127.0.0.1", "ws://127.0.0.1", "blob:", "data:"))
