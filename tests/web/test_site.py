"""The documentation of `zh site`, opened from a folder: search, links, the way to the twin."""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from conftest import LAPTOP, WAIT_MS
from serial_port import bridged

from zerohertz.errors import UserError
from zerohertz.link.client import Client
from zerohertz.link.line import SerialLine
from zerohertz.link.server import PtyEnd
from zerohertz.paths import ROOT
from zerohertz.site import c_headers, c_reference, docs, pages

sys.path.append(str(ROOT / "tests" / "tools"))
from test_broker import serving, until

CONNECTED = "document.getElementById('link-state')?.innerText === 'connected'"
AT_60 = "/^(59|60)/.test(document.getElementById('speed').innerText)"


def run_simulated(page: Any) -> None:
    page.click("#simulated")
    page.wait_for_function(CONNECTED)
    page.fill("#speed-box", "60")
    page.press("#speed-box", "Enter")
    page.click("#run")
    try:
        page.wait_for_function(AT_60)
    except Exception as error:
        pytest.fail(f"{error}; the page shows:\n{page.inner_text('body')}")


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
    run_simulated(page)
    page.click("#tab-rig")
    page.click("text=Unplug current sensor u")
    page.wait_for_function("/stopped by/.test(document.body.innerText)")
    page.click("#tab-parameters")
    assert "steer_min_Hz" in page.inner_text("main")


def test_a_drive_waits_for_a_page_that_is_held_up(open_page: Callable[..., Any]) -> None:
    page = open_page("studio.html")
    run_simulated(page)
    # More than twice as long as a command is valid. A drive that went on would stop and start anew.
    page.evaluate("const t = performance.now(); while (performance.now() - t < 4000);")
    page.wait_for_timeout(200)
    assert page.evaluate(AT_60)


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


def test_the_c_reference_describes_every_header(
    site: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if not c_headers.installed():
        pytest.skip("no doxygen here: tools/zh test --only web installs it")
    for path in c_headers.headers():
        assert (site / "c" / f"{path.relative_to(ROOT)}.html").is_file(), path
    sil = (site / "c/host_sim/sil.h.html").read_text(encoding="utf-8")
    assert '<h3 id="zh_sil_open">' in sil
    assert 'const <a href="#zh_sil_in">zh_sil_in</a> *in' in sil
    assert "the parameter can only be changed with the gates off" in sil  # an enum's value
    assert "mechanical, min^-1" in sil  # a struct's field
    monkeypatch.setattr(c_headers.shutil, "which", lambda name: None)
    assert c_reference.write(tmp_path, tmp_path / "work") == 0
    assert "apt-get install doxygen" in (tmp_path / c_reference.INDEX).read_text(encoding="utf-8")


def test_a_comment_becomes_doxygens() -> None:
    header = ["/* What.", " *", " *   a  b", " */", "/* f", " * <g> */", "int f(void); /* h */"]
    told = c_headers.doxygen_comments("\n".join([*header, 'char s[] = "/* */";']))
    assert told.startswith("/** @file\n What.\n\n@verbatim\n  a  b\n")
    assert "@endverbatim\n*/" in told
    assert "/**  f\n\\<g\\>\n*/" in told
    assert "int f(void); /**<  h\n*/" in told
    assert '"/* */"' in told


def test_a_section_becomes_a_page() -> None:
    text = "# a\n\nx\n\n## B, c\n\ny\n\n### d\n\n## e\n"
    assert pages.section_of(text, "b-c") == "# B, c\n\n\ny\n\n### d\n\n"
    with pytest.raises(UserError, match="no heading #z"):
        pages.section_of(text, "z")


def test_the_studio_of_the_site_talks_to_a_board_by_web_serial(browser: Any, site: Path) -> None:
    end = PtyEnd()
    # Half as fast as a real drive: a page held up for a second by others' load is no dead host.
    with serving(end, speed=0.5), closing(SerialLine(end.name)) as line:
        with bridged(line) as fake, closing(browser.new_context(viewport=LAPTOP)) as context:
            page = context.new_page()
            page.set_default_timeout(WAIT_MS)
            page.add_init_script(fake)
            page.goto(f"{site.as_uri()}/studio.html")
            page.click("#board")
            page.wait_for_function(CONNECTED)
            page.fill("#speed-box", "60")
            page.press("#speed-box", "Enter")
            page.wait_for_function(AT_60)
        # The page is closed and the bridge has ended: nobody else reads the line.
        drive = Client(line, timeout_s=1.0)
        until("stopped", lambda: drive.status().command == 0 or drive.status().faults, 60.0)
