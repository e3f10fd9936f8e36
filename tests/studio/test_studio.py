"""The studio in a real browser, against `zh serve`: what a user does, and sees."""

from __future__ import annotations

import csv
import itertools
import math
import re
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from asammdf import MDF
from playwright.sync_api import Page, expect
from studio_setup import PICTURES, Opener, free_port, served, studio
from test_broker import joined, serving, until

from zerohertz.commission.board_run import at_rest
from zerohertz.drive import State
from zerohertz.flight.file import Flight
from zerohertz.flight.replay import replay
from zerohertz.link import client as link
from zerohertz.link.client import RefusedError
from zerohertz.link.command import take
from zerohertz.link.recording import unit_of
from zerohertz.link.server import PtyEnd

RPM_PER_RAD_S = 30.0 / math.pi
RUN_S = 90_000  # ms of patience: offsets, resistance, flux, then the ramp
KEY = "00112233445566778899aabbccddeeff"


@pytest.fixture(scope="module")
def drive() -> Iterator[int]:
    # A loaded machine may keep the browser from speaking for longer than the usual 2 s; and the
    # shaft may still turn from the test before.
    settings = ("--set", "command_timeout_s=20", "--set", "flying_start=1")
    with served("--speed", "2", *settings) as port:
        yield port


@pytest.fixture(scope="module")
def address(drive: int) -> Iterator[str]:
    with studio("--sil", "--tcp", str(drive)) as found:
        yield found


@pytest.fixture
def page(address: str, opened: Opener, drive: int) -> Iterator[Page]:
    """At rest, with the parameters of the image, and left so."""
    with opened(address) as found:
        expect(found.locator("#state")).to_have_text("READY", timeout=RUN_S)
        yield found
        found.click("#stop")
        expect(found.locator("#link-state")).not_to_contain_text("run by")
    with joined(drive, "after") as client:
        client.command(link.RESET)
        at_rest(client)
        client.set("i_d_A", client.parameter("i_d_A").initial)


def run_at(page: Page, rpm: float) -> None:
    page.fill("#speed-box", str(rpm))
    page.press("#speed-box", "Enter")


def reaches(page: Page, rpm: float) -> None:
    """Within a few min^-1, as the page shows it."""
    sign = "-" if rpm < 0 else ""
    near = "|".join(str(abs(round(rpm)) + k) for k in range(-2, 3))
    try:
        text = re.compile(rf"^{sign}({near})\.")
        expect(page.locator("#speed")).to_have_text(text, timeout=RUN_S)
        expect(page.locator("#state")).to_have_text("RUN")
    except AssertionError as failed:
        picture(page, "failed")
        raise AssertionError(page.inner_text(".messages, #state")) from failed


def rows_of(page: Page, button: str) -> list[dict[str, str]]:
    with page.expect_download() as waiting:
        page.click(button)
    with open(waiting.value.path(), newline="") as file:
        return list(csv.DictReader(file))


def picture(page: Page, name: str) -> Path:
    path = PICTURES / f"{name}.png"
    page.screenshot(path=path)
    assert path.stat().st_size > 10_000
    return path


def test_a_speed_is_set_and_seen_in_the_scope(page: Page, drive: int) -> None:
    run_at(page, 300)
    reaches(page, 300)
    page.wait_for_timeout(600)
    last = rows_of(page, "#csv")[-1]
    assert float(last["omega_e_hat_rad_s"]) * RPM_PER_RAD_S / 2 == pytest.approx(300, abs=5)
    assert 3.0 < float(last["i_d_A"]) < 6.0
    expect(page.locator("#link-state")).to_contain_text("run by this page")
    with joined(drive, "beside") as client:
        assert client.status().speed_ref_rad_s * RPM_PER_RAD_S == pytest.approx(300, abs=0.1)
    page.click("#pause")
    rows = rows_of(page, "#csv")
    times = [float(row["t_s"]) for row in rows]
    assert len(rows) > 50
    assert all(a < b for a, b in itertools.pairwise(times))
    page.click("#pause")
    page.keyboard.press("Escape")
    expect(page.locator("#state")).to_have_text("READY", timeout=RUN_S)


def test_the_scope_as_mdf4_holds_what_the_csv_has(page: Page, tmp_path: Path) -> None:
    page.wait_for_timeout(500)
    page.click("#pause")
    rows = rows_of(page, "#csv")
    with page.expect_download() as waiting:
        page.click("#mdf4")
    path = tmp_path / "scope.mf4"
    waiting.value.save_as(path)
    with MDF(path) as file:
        for name in ("omega_e_hat_rad_s", "i_d_A"):
            signal = file.get(name)
            assert list(signal.timestamps) == pytest.approx([float(row["t_s"]) for row in rows])
            assert list(signal.samples) == pytest.approx([float(row[name]) for row in rows])
            assert signal.unit == unit_of(name)


def numbers(page: Page, row: str) -> list[float]:
    return [float(text) for text in re.findall(r"-?[\d.]+", page.inner_text(row))]


def test_what_the_sensors_read_is_shown(page: Page, drive: int) -> None:
    run_at(page, 60)
    reaches(page, 60)
    page.wait_for_timeout(500)
    phases, lines = numbers(page, "#status-phases"), numbers(page, "#status-lines")
    assert abs(sum(phases)) < 0.03  # rounded
    assert 1.0 < max(map(abs, phases)) < 8.0
    assert len(lines) == 2
    assert 5.0 < max(map(abs, lines)) < 60.0
    expect(page.locator("#status-temperature")).to_have_text("no sensor")


def test_torque_is_asked_for_within_its_limits(page: Page, drive: int) -> None:
    page.select_option("#drive-mode", "torque")
    expect(page.locator("#torque-hint")).to_contain_text("reduced above 1499 min")
    most = float(page.get_attribute("#speed-box", "max"))
    assert 8.4 < most < 40.0  # more than rated
    run_at(page, 1000)
    assert float(page.input_value("#speed-box")) == most
    page.click("#stop")
    expect(page.locator("#state")).to_have_text("READY", timeout=RUN_S)
    run_at(page, 2)
    expect(page.locator("#status-torque")).to_have_text(
        re.compile(r"^(1\.9|2\.[01])"), timeout=RUN_S
    )
    expect(page.locator("#drive-mode")).to_be_disabled()
    page.click("#reverse")
    negative = re.compile(r"^-(1\.9|2\.[01])")
    expect(page.locator("#status-torque")).to_have_text(negative, timeout=RUN_S)
    page.click("#stop")
    expect(page.locator("#state")).to_have_text("READY", timeout=RUN_S)
    page.select_option("#drive-mode", "speed")
    assert page.input_value("#speed-box") == "0"


def test_the_other_direction_by_a_button_where_it_is_allowed(page: Page, drive: int) -> None:
    run_at(page, 90)
    reaches(page, 90)
    page.click("#reverse")
    reaches(page, -90)
    page.click("#stop")
    expect(page.locator("#state")).to_have_text("READY", timeout=RUN_S)
    with joined(drive, "beside") as client:
        client.set("direction", 1.0)
        try:
            expect(page.locator("#reverse")).to_be_disabled()
            expect(page.locator("#speed-slider")).to_have_attribute("min", "0")
            page.fill("#speed-box", "-50")
            page.press("#speed-box", "Tab")
            assert page.input_value("#speed-box") == "0"
        finally:
            client.set("direction", 0.0)


def test_a_drive_in_open_loop_claims_no_orientation(page: Page, drive: int) -> None:
    orientation = page.locator("#status-confidence")
    expect(orientation).to_have_text("closed loop")
    with joined(drive, "beside") as client:
        client.set("control_mode", 1.0)
        try:
            expect(orientation).to_have_text("none: open loop")
        finally:
            client.set("control_mode", 0.0)
    expect(orientation).to_have_text("closed loop")


def test_a_stop_right_behind_a_run_wins(page: Page, drive: int) -> None:
    for pause_ms in (0, 1, 3, 10, 30, 150):
        page.click("#run")
        page.wait_for_timeout(pause_ms)
        page.keyboard.press("Escape")
        page.wait_for_timeout(250)
        with joined(drive, "beside") as client:
            assert client.status().command == 0
            assert client.roles().commander == 0


def test_the_passage_through_zero(page: Page) -> None:
    run_at(page, -60)
    reaches(page, -60)
    for rpm in range(-60, 61, 4):  # the reference alone: it runs already
        page.fill("#speed-box", str(rpm))
        page.press("#speed-box", "Tab")
        page.wait_for_timeout(100)
        if rpm == 0:
            picture(page, "studio_zero")
    reaches(page, 60)
    picture(page, "studio_scope")


def test_a_refused_parameter_says_why(page: Page, drive: int) -> None:
    page.click("#tab-parameters")
    page.fill("#param-search", "magnetising")
    refusals = page.locator(".refusal:visible")
    page.fill("#p-i_d_A", "9")
    page.press("#p-i_d_A", "Enter")
    expect(refusals).to_contain_text("i_d_A = 9 A has to be at most 8 A with i_d_max_A = 8 A")
    picture(page, "studio_parameters")
    page.fill("#p-i_d_A", "4.25")
    page.press("#p-i_d_A", "Enter")
    expect(refusals).to_have_count(0)
    expect(page.locator(".param.changed:visible .param-name")).to_contain_text(["i_d_A"])
    with joined(drive, "beside") as client:
        assert client.get(["i_d_A"]) == {"i_d_A": 4.25}
    page.fill("#param-search", "speed_filter_s")
    page.fill("#p-speed_filter_s", "1e9")
    page.press("#p-speed_filter_s", "Enter")
    expect(refusals).to_contain_text("is out of range; it may be")
    page.fill("#param-search", "Rs_ohm")
    page.fill("#p-Rs_ohm", "1.1")
    page.press("#p-Rs_ohm", "Enter")
    expect(refusals).to_contain_text("protected; unlock first")


def test_a_set_is_exported_compared_and_imported(page: Page, drive: int, tmp_path: Path) -> None:
    page.click("#tab-parameters")
    with page.expect_download() as waiting:
        page.click("#param-export")
    text = Path(waiting.value.path()).read_text()
    assert "\nlost_action = " in text
    changed = tmp_path / "set.toml"
    changed.write_text(text.replace("\ni_d_A = 5.1\n", "\ni_d_A = 4.5\n") + "no_such = 1\n")
    page.set_input_files("input[type=file]", changed)
    expect(page.locator(".import")).to_contain_text("1 differ from the drive")
    expect(page.locator(".import")).to_contain_text("not understood: no_such")
    page.click(".import button.run")
    expect(page.locator(".import [role=status]")).to_contain_text("1 set")
    with joined(drive, "beside") as client:
        assert client.get(["i_d_A"]) == {"i_d_A": 4.5}


def test_a_fault_is_explained_and_its_record_opened(page: Page, drive: int) -> None:
    with joined(drive, "test") as client:
        before = client.faults()[0]
        client.command(link.RUN, 5.0)  # and no word more: command_timeout_s
        expect(page.locator("#state")).to_have_text("FAULT", timeout=RUN_S)
    page.click("#tab-faults")
    expect(page.locator("#fault-list")).to_contain_text("COMMAND_TIMEOUT")
    expect(page.locator("#fault-list")).to_contain_text("Remedy")
    picture(page, "studio_faults")
    page.click("#fault-open")
    expect(page.locator("#scope-title")).to_contain_text(f"fault {before + 1}")
    expect(page.locator(".pane")).not_to_have_count(0)
    rows = rows_of(page, "#csv")
    assert len(rows) == 48
    assert float(rows[32]["t_s"]) == 0.0
    picture(page, "studio_fault_record")
    page.click("#live")
    expect(page.locator(".chip").first).to_contain_text("speed_ref_rpm")


def test_the_seconds_before_a_fault_become_a_flight(opened: Opener) -> None:
    # Slow, so that a loaded machine reads what the drive writes.
    slow = served("--speed", "0.3", "--set", "command_timeout_s=1")
    with slow as port, studio("--sil", "--tcp", str(port)) as address, opened(address) as page:
        page.click("#tab-faults")
        page.click("#flight-begin")
        expect(page.locator("#flight-said")).to_contain_text("records ZeroHertz", timeout=RUN_S)
        with joined(port, "test") as client:
            # The recording has started the drive's state anew: offsets are measured again.
            until("READY", lambda: client.status().state == State.READY, 60.0)
            client.command(link.RUN, 5.0)  # and no word more: command_timeout_s
            expect(page.locator("#state")).to_have_text("FAULT", timeout=RUN_S)
        expect(page.locator("#flight-said")).to_contain_text("s to the fault", timeout=RUN_S)
        picture(page, "studio_flight")
        said = page.inner_text("#flight-said")
    file = re.search(r"--flight (\S+)", said)
    assert file is not None
    again = replay(Flight.read(Path(file[1])), ["state"])
    assert (again.differs, again.ended) == (False, "")
    assert State.FAULT in again.signals["state"]


def test_a_trigger_records_every_period_round_the_start(page: Page) -> None:
    page.select_option("#scope-mode", "single")
    page.fill("#trigger-level", "4")
    page.click("#arm")
    expect(page.locator("#scope-say")).to_contain_text("armed")
    run_at(page, 0)
    expect(page.locator("#scope-say")).to_have_text("recorded", timeout=RUN_S)
    rows = rows_of(page, "#csv")
    steps = [float(b["t_s"]) - float(a["t_s"]) for a, b in itertools.pairwise(rows)]
    assert max(steps) == pytest.approx(200e-6)
    assert sum(float(row["t_s"]) < 0.0 for row in rows) == pytest.approx(len(rows) / 4, abs=2)


def test_another_trace_gets_its_turn_beside_a_normal_trigger(page: Page, drive: int) -> None:
    page.select_option("#scope-mode", "normal")
    page.select_option("#trigger-edge", "now")
    page.fill("#trigger-every", "1")
    page.click("#arm")
    expect(page.locator("#scope-title")).to_have_text("triggered recording", timeout=RUN_S)
    now = {"trigger": "u_dc_V", "edge": 0, "level": 0.0}
    with joined(drive, "zh trace (1)") as client:
        for _ in range(3):
            record = take(client, ["u_dc_V"], now, before=0.0, every=1, rows=100, wait_s=90.0)
            assert len(record.t_s) == 100
    assert len(rows_of(page, "#csv")) > 1000
    page.click("#live")
    expect(page.locator("#scope-title")).to_have_text("")


def test_a_studio_that_ends_is_told_and_found_again(drive: int, opened: Opener) -> None:
    port = free_port()
    options = ("--sil", "--tcp", str(drive))
    with studio(*options, page=port) as address:
        reopened = opened(address, quiet=False)
        page = reopened.__enter__()
    expect(page.locator("#link-state")).to_have_text("zh studio has ended")
    assert page.locator("#run").is_disabled()
    with studio(*options, page=port):
        page.click("text=Connect again")
        expect(page.locator("#link-state")).to_have_attribute("data-state", "connected")
        expect(page.locator("#state")).to_have_text("READY")
    reopened.__exit__(None, None, None)


@contextmanager
def running(drive: int, name: str, rad_s: float) -> Iterator[list[str]]:
    """Another client that runs the drive, as `zh run` does; why it had to end."""
    ended: list[str] = []
    stop = threading.Event()

    def keep_on() -> None:
        with joined(drive, name) as runner:
            while not stop.wait(0.1) and not ended:
                try:
                    runner.command(link.RUN, rad_s, valid_s=2.0)
                except RefusedError as refused:
                    ended.append(str(refused))

    thread = threading.Thread(target=keep_on, daemon=True)
    thread.start()
    try:
        yield ended
    finally:
        stop.set()
        thread.join(10.0)


def test_who_runs_the_drive_is_seen_and_refused_and_stopped(page: Page, drive: int) -> None:
    with running(drive, "zh run (1)", 5.0) as ended:
        expect(page.locator("#link-state")).to_contain_text("run by zh run (1)")
        page.click("#run")
        expect(page.locator(".messages")).to_contain_text("zh run (1) runs the drive; stop it")
        page.click("#stop")
        expect(page.locator("#link-state")).not_to_contain_text("run by")
        with joined(drive, "beside") as client:
            assert client.status().command == 0
    assert "somebody else has taken over" in ended[0]


def test_a_closed_tab_stops_the_drive(address: str, opened: Opener, drive: int) -> None:
    with joined(drive, "watcher") as watcher:
        with opened(address) as page:
            run_at(page, 60)
            expect(page.locator("#state")).to_have_text("RUN", timeout=RUN_S)
            assert watcher.status().command == link.RUN
        for _ in range(20):  # within a second, command_timeout_s being twenty
            if watcher.status().command == 0:
                break
            time.sleep(0.05)
        assert watcher.status().command == 0


def test_commissioning_to_the_trial(opened: Opener) -> None:
    motor = ("--rig", "im_1kw5_200v", "--speed", "3", "--tcp", "0")
    with studio(*motor) as address, opened(address) as page:
        page.click("#tab-commissioning")
        expect(page.locator("#plate-speed_rpm")).to_have_value("1755")  # the rig's own
        page.check("#commission-rotate")
        page.click("#commission-start")
        expect(page.locator("#commission-log")).to_contain_text("rotor", timeout=90_000)
        result = page.locator("#commission-result")
        expect(result).to_contain_text("Magnetising curve", timeout=60_000)
        measured = float(result.locator("tr", has_text="Rs").locator("td").first.inner_text()[:5])
        assert measured == pytest.approx(0.93, rel=0.05)
        page.set_viewport_size({"width": 1280, "height": 1040})
        picture(page, "studio_commissioning")
        page.click("#keep-start")
        expect(page.locator("#commission-keep .answer")).to_contain_text("set and saved")
        page.click("#design-start")
        design = page.locator("#commission-design .answer")
        expect(design).to_contain_text("2048 entries", timeout=60_000)
        page.click("#trial-start")
        trial = page.locator("#commission-trial .answer")
        expect(trial).to_contain_text("Held: speed step", timeout=60_000)
        picture(page, "studio_trial")


def test_the_key_is_asked_for_and_left_nowhere(
    opened: Opener, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    file = tmp_path / "key"
    file.write_text(KEY)
    end = PtyEnd()
    with (
        serving(end),
        studio("--port", end.name, "--key", str(file)) as address,
        opened(address) as page,
    ):
        page.click("#run")
        expect(page.locator("dialog")).to_contain_text("the key is not this drive's")
        page.fill("dialog input", "1234")
        page.click("dialog button.run")
        expect(page.locator("dialog")).to_contain_text("A key has 32 hexadecimal digits")
        page.fill("dialog input", KEY)
        page.click("dialog button.run")
        # The broker knows this key; the simulated drive has another one.
        expect(page.locator(".messages")).to_contain_text("the key is not this drive's")
        kept = page.evaluate(
            "JSON.stringify([location.href, {...localStorage}, {...sessionStorage},"
            " document.cookie, document.documentElement.outerHTML,"
            " [...document.querySelectorAll('input')].map((i) => i.value)])"
        )
        assert KEY not in kept


def test_a_page_of_another_origin_gets_nothing(address: str, opened: Opener) -> None:
    with opened(address) as page:
        socket = address.replace("http", "ws") + "link"
        alone = page.context.new_page()  # about:blank: a foreign origin
        outcome = alone.evaluate(
            "(at) => new Promise((done) => { const s = new WebSocket(at);"
            " s.onopen = () => done('open'); s.onerror = () => done('refused'); })",
            socket,
        )
        assert outcome == "refused"


@pytest.mark.parametrize(("width", "height", "scheme"), [(390, 844, "dark"), (1280, 800, "dark")])
def test_it_fits_a_phone_and_a_laptop(
    address: str, opened: Opener, width: int, height: int, scheme: str
) -> None:
    with opened(address, width, height, color_scheme=scheme) as page:
        for tab in ("scope", "parameters", "commissioning", "faults"):
            page.click(f"#tab-{tab}")
            page.wait_for_timeout(200)
            wide = page.evaluate("document.documentElement.scrollWidth - innerWidth")
            assert wide <= 0, f"{tab} is {wide} pixels too wide"
            picture(page, f"studio_{tab}_{width}_{scheme}")


def test_everything_is_reached_with_the_keyboard(address: str, opened: Opener) -> None:
    with opened(address) as page:
        reached = set()
        for _ in range(40):
            page.keyboard.press("Tab")
            reached.add(page.evaluate("document.activeElement.id"))
        assert {"tab-scope", "speed-slider", "speed-box", "run", "stop", "torque-off"} <= reached
        assert {"scope-mode", "pause", "last-fault", "csv"} <= reached
        page.focus("#tab-scope")
        page.keyboard.press("ArrowRight")
        expect(page.locator("#param-search")).to_be_visible()
