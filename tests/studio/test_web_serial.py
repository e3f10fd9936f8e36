"""The page on a board at a serial port, without a broker: run it, close the tab, watch it stop."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from contextlib import closing

import pytest
from playwright.sync_api import Browser, Page, expect
from studio_setup import ROOT, free_port, served, studio
from test_broker import serving, until

from zerohertz.link.client import RUN, Client
from zerohertz.link.line import SerialLine
from zerohertz.link.server import PtyEnd

sys.path.append(str(ROOT / "tests" / "web"))
from serial_port import bridged

PATIENCE_MS = 60_000
PATIENCE_S = 60.0


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    tcp = free_port()
    with served("--tcp", tcp), studio("--sil", "--tcp", tcp) as found:
        yield found


@pytest.fixture
def board() -> Iterator[SerialLine]:
    """Half as fast as a real drive: a page held up for a second by others' load is no dead host."""
    end = PtyEnd()
    with serving(end, speed=0.5), closing(SerialLine(end.name)) as line:
        yield line


def choose_port(page: Page, address: str) -> None:
    page.goto(address)
    page.click("text=Board over Web Serial")
    page.click("#choose-port")
    expect(page.locator("#link-state")).to_have_text("connected", timeout=PATIENCE_MS)


def test_a_board_runs_and_stops_by_itself_when_the_tab_is_closed(
    address: str, board: SerialLine, browser: Browser
) -> None:
    with bridged(board) as fake:
        context = browser.new_context(bypass_csp=True)  # the fake port is a WebSocket
        page = context.new_page()
        page.add_init_script(fake)
        choose_port(page, address)
        assert page.evaluate("serialCalls") == [{"baudRate": 115200}]
        expect(page.locator("#tab-commissioning")).to_have_count(0)  # it needs this computer
        page.fill("#speed-box", "120")
        page.press("#speed-box", "Enter")
        near = re.compile(r"^1(19|20|21)\.")
        expect(page.locator("#speed")).to_have_text(near, timeout=PATIENCE_MS)
        context.close()
    # From here on nobody else reads the line.
    assert_stops_in_time(Client(board, timeout_s=5.0))


def assert_stops_in_time(drive: Client) -> None:
    """On its own clock, from when the tab has gone."""
    timeout_s = drive.get(["command_timeout_s"])["command_timeout_s"]
    begun = drive.status()
    until("stopped", lambda: drive.status().command & RUN == 0 or drive.status().faults, PATIENCE_S)
    took_s = (drive.status().period - begun.period) * drive.identity.period_s
    assert took_s <= timeout_s + 0.2, f"{took_s} s"
    until("at rest", lambda: abs(drive.status().speed_hat_rad_s) < 1.0, PATIENCE_S)
    assert drive.status().command & RUN == 0


def test_a_port_that_is_unplugged_is_said(
    address: str, board: SerialLine, browser: Browser
) -> None:
    with bridged(board) as fake:
        context = browser.new_context(bypass_csp=True)
        page = context.new_page()
        page.add_init_script(fake)
        choose_port(page, address)
    expect(page.locator("#link-state")).to_contain_text("serial port", timeout=PATIENCE_MS)
    context.close()


def test_without_web_serial_the_page_says_so(address: str, browser: Browser) -> None:
    context = browser.new_context()
    page = context.new_page()
    page.add_init_script("delete Navigator.prototype.serial")
    page.goto(address)
    expect(page.locator("#link-state")).to_have_attribute("data-state", "connected")
    expect(page.locator("#other-drive")).to_have_count(0)
    page.goto(f"{address}?serial")
    expect(page.locator("#studio")).to_contain_text("This browser has no Web Serial")
    expect(page.locator("#choose-port")).to_be_disabled()
    context.close()
