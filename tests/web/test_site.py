"""The documentation of `zh site`, opened from a folder: search, links, the way to the twin."""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from conftest import LAPTOP
from serial_port import bridged

from zerohertz.errors import UserError
from zerohertz.link.client import Client
from zerohertz.link.line import SerialLine
from zerohertz.link.server import PtyEnd
from zerohertz.paths import ROOT
from zerohertz.site import docs, pages

sys.path.append(str(ROOT / "tests" / "tools"))
from test_broker import serving, until


def test_start_page_leads_to_a_simulator_that_runs(open_page: Callable[..., Any]) -> None:
    page = open_page("index.html")
    page.click("nav.md-tabs >> text=Simulator")
    page.wait_for_function("window.runs.length >= 1")
    assert "real time" in page.inner_text("#status")
    page.click("text=Documentation")
    assert page.title() == "ZeroHertz" or "Start" in page.title()


def test_the_studio_runs_a_drive_in_the_page_and_shows_its_fault(
    open_page: Callable[..., Any],
) -> None:
    page = open_page("studio.html")
    page.click("#simulated")
    page.wait_for_function("document.getElementById('link-state')?.innerText === 'connected'")
    page.fill("#speed-box", "60")
    page.press("#speed-box", "Enter")
    page.click("#run")
    page.wait_for_function("/^(59|60)/.test(document.getElementById('speed').innerText)")
    page.click("#tab-rig")
    page.click("text=Unplug current sensor u")
    page.wait_for_function("/stopped by/.test(document.body.innerText)")
    page.click("#tab-parameters")
    assert "steer_min_Hz" in page.inner_text("main")


def test_search_works_without_a_network(open_page: Callable[..., Any]) -> None:
    page = open_page("index.html")
    page.click(".md-search__input")
    page.keyboard.type("steer_min_Hz")
    page.wait_for_selector(".md-search-result__item")
    assert "Parameters" in page.inner_text(".md-search-result__list")


def test_a_link_that_leads_nowhere_is_found(site: Path, tmp_path: Path) -> None:
    wrong, count = docs.broken_links(site)
    assert wrong == []
    assert count > 1000
    (tmp_path / "a.html").write_text('<a href="b.html">b</a><a href="a.html#c">c</a>')
    assert docs.broken_links(tmp_path) == (["a.html: b.html", "a.html: a.html#c"], 2)


def test_every_page_is_on_the_site(site: Path) -> None:
    assert pages.unlisted([{"Start": "tools/docs/start.md"}])[0]["More"]
    for folder in pages.PAGE_FOLDERS:
        for path in (ROOT / folder).rglob("*.md"):
            made = (site / pages.place(str(path.relative_to(ROOT)))).with_suffix(".html")
            made = made.with_name("index.html") if path.name == "README.md" else made
            assert made.is_file(), path


def test_a_section_becomes_a_page() -> None:
    text = "# a\n\nx\n\n## B, c\n\ny\n\n### d\n\n## e\n"
    assert pages.section_of(text, "b-c") == "# B, c\n\n\ny\n\n### d\n\n"
    with pytest.raises(UserError, match="no heading #z"):
        pages.section_of(text, "z")


def test_the_studio_of_the_site_talks_to_a_board_by_web_serial(browser: Any, site: Path) -> None:
    end = PtyEnd()
    with (
        serving(end),
        closing(SerialLine(end.name)) as line,
        bridged(line) as fake,
        closing(browser.new_context(viewport=LAPTOP)) as context,
    ):
        page = context.new_page()
        page.add_init_script(fake)
        page.goto(f"{site.as_uri()}/studio.html")
        page.click("#board")
        page.wait_for_function("document.getElementById('link-state')?.innerText === 'connected'")
        page.fill("#speed-box", "60")
        page.press("#speed-box", "Enter")
        page.wait_for_function("/^(59|60)/.test(document.getElementById('speed').innerText)")
        context.close()
        drive = Client(line, timeout_s=1.0)
        until("stopped", lambda: drive.status().command == 0 or drive.status().faults)
