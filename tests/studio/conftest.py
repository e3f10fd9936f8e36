"""A real browser, a served drive and the studio in front of it."""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect, sync_playwright

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tools"), str(ROOT / "tests" / "tools")]

from studio_setup import PICTURES, Opener, local  # noqa: E402

# Longer than a loaded machine needs; a check that holds returns at once.
expect.set_options(timeout=60_000)


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    chromium = shutil.which("chromium")
    if chromium is None:
        pytest.fail("no chromium; tools/zh test --only studio installs it")
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
        address: str, width: int = 1280, height: int = 800, quiet: bool = True, **more: str
    ) -> Iterator[Page]:
        context = browser.new_context(viewport={"width": width, "height": height}, **more)
        page = context.new_page()
        trouble: list[str] = []
        page.on("pageerror", lambda error: trouble.append(str(error)))
        page.on("console", lambda m: trouble.append(m.text) if m.type == "error" else None)
        page.on("request", lambda r: None if local(r.url) else trouble.append(r.url))
        page.goto(address)
        expect(page.locator("#link-state")).to_have_attribute("data-state", "connected")
        try:
            yield page
        finally:
            context.close()
        assert trouble == [] or not quiet

    return open_page
