"""A real browser, a served drive and the studio in front of it."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect, sync_playwright

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tools"), str(ROOT / "tests" / "tools")]

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
        assert process.wait(20.0) is not None


@contextmanager
def served(*options: str) -> Iterator[int]:
    """Port of a `zh serve`."""
    with zh("serve", "--tcp", _free_port(), *options, said=_SERVING) as port:
        yield int(port)


@contextmanager
def studio(*options: str) -> Iterator[str]:
    """Address of a `zh studio`."""
    with zh("studio", "--no-browser", "--page", "0", *options, said=_ADDRESS) as address:
        yield address


def _free_port() -> str:
    import socket

    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return str(probe.getsockname()[1])


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    chromium = shutil.which("chromium")
    if chromium is None:
        pytest.fail("no chromium; tools/zh test --only web installs it")
    PICTURES.mkdir(parents=True, exist_ok=True)
    with sync_playwright() as playwright:
        # Root in a container has no sandbox; the pages are ours.
        sandbox = [] if os.getuid() else ["--no-sandbox"]
        found = playwright.chromium.launch(executable_path=chromium, args=sandbox)
        yield found
        found.close()


@pytest.fixture
def opened(browser: Browser) -> Opener:
    """Opens a connected page; what the browser complains of fails the test."""

    @contextmanager
    def open_page(
        address: str, width: int = 1280, height: int = 800, **more: str
    ) -> Iterator[Page]:
        context = browser.new_context(viewport={"width": width, "height": height}, **more)
        page = context.new_page()
        trouble: list[str] = []
        page.on("pageerror", lambda error: trouble.append(str(error)))
        page.on("console", lambda m: trouble.append(m.text) if m.type == "error" else None)
        page.on("request", lambda r: None if _local(r.url) else trouble.append(r.url))
        page.goto(address)
        expect(page.locator("#link-state")).to_have_attribute("data-state", "connected")
        try:
            yield page
        finally:
            context.close()
        assert trouble == []

    return open_page


def _local(url: str) -> bool:
    return url.startswith(("http://127.0.0.1", "ws://127.0.0.1", "blob:", "data:"))
