"""The page of `zh demo` in a real browser: nothing cut off at 1280 pixels, charts that zoom."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page
from studio_setup import PICTURES
from test_report import report  # noqa: F401  (a fixture)

from zerohertz.report.page import Report, build_page

CUT_OFF = """[...document.querySelectorAll('body *')]
  .filter((e) => e.getBoundingClientRect().right > innerWidth + 1
    || e.scrollWidth > e.clientWidth + 1)
  .filter((e) => getComputedStyle(e).display !== 'inline' && e.tagName !== 'PRE')
  .map((e) => `${e.tagName} ${e.className} ${e.textContent.slice(0, 40)}`)"""


@pytest.fixture
def page(report: Report, browser: Browser, tmp_path: Path) -> Iterator[Page]:  # noqa: F811
    file = tmp_path / "index.html"
    file.write_text(build_page(report), encoding="utf-8")
    context = browser.new_context(viewport={"width": 1280, "height": 900}, offline=True)
    found = context.new_page()
    trouble: list[str] = []
    found.on("pageerror", lambda error: trouble.append(str(error)))
    found.goto(file.as_uri())
    yield found
    context.close()
    assert trouble == []


def test_nothing_is_cut_off_on_a_laptop(page: Page) -> None:
    assert page.evaluate("document.documentElement.scrollWidth") == 1280
    assert page.evaluate(CUT_OFF) == []
    page.screenshot(path=PICTURES / "report.png", full_page=True)


def test_a_chart_zooms_by_mouse_and_by_keyboard(page: Page) -> None:
    assert page.evaluate("charts.length") == 17
    canvas = page.locator("#recommended ~ .grid canvas").first
    canvas.scroll_into_view_if_needed()
    before = canvas.screenshot()
    box = canvas.bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + 200, box["y"] + 80)
    page.mouse.down()
    page.mouse.move(box["x"] + 400, box["y"] + 80, steps=4)
    page.mouse.up()
    low, high = page.evaluate("charts[0].x_view")
    assert -4.0 < low < high < 30.0
    page.mouse.move(5, 5)
    assert canvas.screenshot() != before
    canvas.dblclick()
    assert page.evaluate("charts[0].x_view") == [-4, 30]
    canvas.focus()
    page.keyboard.press("+")
    low, high = page.evaluate("charts[0].x_view")
    assert high - low == pytest.approx(0.6 * 34.0)
    page.keyboard.press("ArrowRight")
    assert page.evaluate("charts[0].x_view")[0] > low
    page.keyboard.press("0")
    assert page.evaluate("charts[0].x_view") == [-4, 30]
