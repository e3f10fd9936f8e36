"""One drive, several clients: what the broker lets each of them do."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from zerohertz import sim
from zerohertz.drive import State
from zerohertz.errors import UserError
from zerohertz.link import client as link
from zerohertz.link import guest, ports
from zerohertz.link.client import Client, RefusedError
from zerohertz.link.command import take
from zerohertz.link.line import SerialLine, TcpLine, UnixLine
from zerohertz.link.ports import BrokerEnd, Hub, line_to, socket_beside
from zerohertz.link.server import LinkedDrive, PtyEnd, serve
from zerohertz.link.siphash import DEVELOPMENT_KEY
from zerohertz.paths import ROOT

QUICK = {"offset_calibration_s": 0.02, "premagnetise_s": 0.5, "observer_gain_enable": 1}
NOW = {"trigger": "duty_u", "edge": 0, "level": 0.0}


def job() -> sim.Job:
    flat = {"profiles.load_torque_Nm": [[0.0, 0.0]]}
    return sim.Job(firmware=QUICK, scenario_overrides=flat, seed=1)


@contextlib.contextmanager
def serving(end: BrokerEnd | PtyEnd, speed: float = 4.0, periods: int = 5300) -> Iterator[None]:
    """The drive in a thread; speed: drive seconds per second; periods: how long it is powered up,
    as a rule for the offsets and the second without a challenge."""
    stop = threading.Event()
    with LinkedDrive(job()) as drive, contextlib.closing(end):
        drive.run(periods)
        arguments = (drive, end, speed, lambda: not stop.is_set())
        thread = threading.Thread(target=serve, args=arguments, daemon=True)
        thread.start()
        try:
            yield
        finally:
            stop.set()
            thread.join(10.0)


@pytest.fixture
def port() -> Iterator[int]:
    end = BrokerEnd(0)
    with serving(end):
        yield end.port


def joined(port: int, name: str, key: bytes = DEVELOPMENT_KEY) -> Client:
    client = Client(TcpLine(port), timeout_s=1.0, key=key)
    client.introduce(name)
    return client


def until(what: str, holds: object, patience_s: float = 10.0) -> None:
    end_s = time.monotonic() + patience_s
    while not holds():  # type: ignore[operator]
        assert time.monotonic() < end_s, f"not {what} within {patience_s} s"
        time.sleep(0.02)


def test_one_runs_the_drive_while_others_watch_set_and_trace(port: int) -> None:
    with joined(port, "runner") as runner, joined(port, "watcher") as watcher:
        runner.command(link.RUN, 10.0, valid_s=20.0)
        until("RUN", lambda: watcher.status().state == State.RUN)
        watcher.set("i_d_A", 4.0)
        assert runner.get(["i_d_A"]) == {"i_d_A": 4.0}
        record = take(watcher, ["i_d_A"], NOW, before=0.0, every=1, rows=50, wait_s=5.0)
        assert len(record.t_s) == 50
        assert watcher.faults()[0] == 0
        assert {"runner", "watcher"} <= set(watcher.roles().names.values())
        assert watcher.roles().names[watcher.roles().commander] == "runner"
        runner.command(link.RUN, 12.0, valid_s=20.0)  # is still the one who runs it
        assert watcher.status().state == State.RUN
        runner.stop()
        assert watcher.roles().commander == 0


def test_a_second_one_who_wants_to_run_it_is_told_who_does(port: int) -> None:
    with joined(port, "first") as first, joined(port, "second") as second:
        first.command(link.RUN, 10.0, valid_s=20.0)
        for bits in (link.RUN, link.COMMISSION, link.RESET):
            with pytest.raises(RefusedError, match="first runs the drive; stop it first"):
                second.command(bits, -50.0)
        assert second.status().speed_ref_rad_s == 10.0
        first.stop()
        second.command(link.RUN, 5.0, valid_s=1.0)
        assert first.status().speed_ref_rad_s == 5.0
        second.stop()


def test_anybody_may_stop_and_who_ran_it_has_to_connect_anew(port: int) -> None:
    with joined(port, "runner") as runner, joined(port, "stopper", key=bytes(16)) as stopper:
        runner.command(link.RUN, 10.0, valid_s=20.0)
        stopper.command(0)  # without the key
        assert stopper.status().command == 0
        with pytest.raises(RefusedError, match="somebody else has taken over"):
            runner.command(link.RUN, 10.0)
        assert stopper.status().command == 0


def test_who_runs_it_and_goes_away_stops_it(port: int) -> None:
    with joined(port, "watcher") as watcher:
        with joined(port, "runner") as runner:
            runner.command(link.RUN, 10.0, valid_s=60.0)
            until("RUN", lambda: watcher.status().state == State.RUN)
        until("stopped", lambda: watcher.status().command == 0, 1.0)
        until("READY", lambda: watcher.status().state == State.READY)
        assert watcher.roles().commander == 0


def test_who_runs_it_and_falls_silent_stops_it(port: int) -> None:
    """The connection stands, as that of a page whose tab hangs."""
    with joined(port, "watcher") as watcher, joined(port, "runner") as runner:
        runner.command(link.RUN, 10.0, valid_s=1.0)
        until("run out", lambda: watcher.status().command_ran_out == 1, 3.0)
        watcher.command(link.RUN, 5.0, valid_s=1.0)  # free for the next
        watcher.stop()


def test_a_fault_frees_the_drive_for_who_resets_it(port: int) -> None:
    with joined(port, "runner") as runner, joined(port, "other") as other:
        runner.command(link.RUN, 10.0)  # stands until command_timeout_s
        until("FAULT", lambda: other.status().state == State.FAULT)
        assert other.status().command == link.RUN
        other.command(link.RESET)
        until("READY", lambda: other.status().state == State.READY)


def test_a_killed_run_stops_the_drive(port: int) -> None:
    words = ("run", "--rpm", "100", "--valid", "60", "--sil", "--tcp", str(port))
    command = (sys.executable, "-m", "zerohertz", *words)
    environment = os.environ | {"PYTHONPATH": str(ROOT / "tools")}
    with joined(port, "watcher") as watcher:
        process = subprocess.Popen(
            command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        until("RUN", lambda: watcher.status().state == State.RUN, 30.0)
        assert any(name.startswith("zh run") for name in watcher.roles().names.values())
        process.send_signal(signal.SIGKILL)
        process.wait(10.0)
        until("READY", lambda: watcher.status().state == State.READY)


def test_the_key_is_asked_for_as_by_a_drive(port: int) -> None:
    with joined(port, "stranger", key=bytes(range(16))) as stranger, joined(port, "ours") as ours:
        with pytest.raises(UserError, match="the key is not this drive's"):
            stranger.set("i_d_A", 4.0)
        with pytest.raises(RefusedError, match="needs the key"):
            stranger.request(link.Op.COMMAND, stranger._acting + bytes((1, *bytes(9))))
        with pytest.raises(RefusedError, match="protected"):
            ours.set("Rs_ohm", 1.2)
        ours.unlock(DEVELOPMENT_KEY)
        ours.set("Rs_ohm", 1.2)
        with joined(port, "third") as third, pytest.raises(RefusedError, match="protected"):
            third.set("Rs_ohm", 1.3)  # the drive is unlocked, this client is not
        with pytest.raises(RefusedError, match="has to be at most 8 A with i_d_max_A"):
            ours.set("i_d_A", 5000.0)


def test_a_drive_just_powered_up_is_waited_for() -> None:
    end = BrokerEnd(0)
    with serving(end, periods=100), joined(end.port, "early") as early:
        early.unlock(DEVELOPMENT_KEY)
        early.set("Rs_ohm", 1.2)


def test_three_wrong_keys_lock_out(port: int) -> None:
    with joined(port, "guesser", key=bytes(range(16))) as guesser:
        for _ in range(3):
            with pytest.raises(UserError, match="the key is not"):
                guesser.set("i_d_A", 4.0)
        with pytest.raises(RefusedError, match="locked out"):
            guesser.request(link.Op.CHALLENGE, guesser._acting)


def test_a_request_heard_and_sent_again_is_refused(port: int) -> None:
    with joined(port, "client") as client:
        client.set("i_d_A", 4.0)
        assert client._seal is not None
        body = client._acting + bytes(6)
        sealed = client._seal.of(bytes((link.Op.SET,)) + body)
        with contextlib.suppress(RefusedError):
            client.request(link.Op.SEALED, sealed)
        with pytest.raises(RefusedError, match="needs the key"):
            client.request(link.Op.SEALED, sealed)


def test_a_seal_ends_after_silence(port: int, monkeypatch: pytest.MonkeyPatch) -> None:
    with joined(port, "client") as client:
        client.set("i_d_A", 4.0)
        seal = client._seal
        monkeypatch.setattr(guest, "_OPEN_S", 0.1)
        time.sleep(0.2)
        client.set("i_d_A", 4.25)  # opens another by itself
        assert client._seal is not seal
        assert client.get(["i_d_A"]) == {"i_d_A": 4.25}


def test_the_trace_memory_is_one_clients_at_a_time(port: int) -> None:
    never = {"trigger": "u_dc_V", "edge": 1, "level": 1e6}
    with joined(port, "first") as first, joined(port, "second") as second:
        arm = {"before": 0.0, "decimation": 1, "rows": 20}
        first.arm(["u_dc_V"], **never, **arm)
        with pytest.raises(RefusedError, match="first's at the moment"):
            second.arm(["i_d_A"], **NOW, **arm)
        with pytest.raises(RefusedError, match="second's at the moment"):
            first.arm(["u_dc_V"], **never, **arm)  # who waited comes first
        second.arm(["i_d_A"], **NOW, **arm)
        until("recorded", lambda: second.trace_state().state == 3)
        assert len(second.trace_words(second.trace_state())) == 20
        first.arm(["u_dc_V"], **never, **arm)  # what was read is free
        first.stop_trace()


def test_a_serial_port_is_shared_by_who_runs_the_drive(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    end = PtyEnd()
    with serving(end):
        line, hub = line_to(end.name, 115200, DEVELOPMENT_KEY, share=True)
        assert hub is not None
        with hub, Client(line) as runner:
            with pytest.raises(UserError, match="cannot be opened"):
                SerialLine(end.name)
            beside, none = line_to(end.name, 115200, DEVELOPMENT_KEY, share=False)
            assert isinstance(beside, UnixLine)
            assert none is None
            with Client(beside) as watcher:
                runner.command(link.RUN, 10.0, valid_s=5.0)
                assert watcher.status().command == link.RUN
        assert not socket_beside(end.name).exists()
        alone, none = line_to(end.name, 115200, DEVELOPMENT_KEY, share=False)
        assert isinstance(alone, SerialLine)
        with Client(alone) as last:
            assert last.status().command == 0  # the broker's end stopped the drive


def test_a_socket_that_nobody_serves_is_no_broker(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    end = PtyEnd()
    socket_beside(end.name).touch()
    with serving(end):
        line, _ = line_to(end.name, 115200, DEVELOPMENT_KEY, share=False)
        assert isinstance(line, SerialLine)
        line.close()


def test_a_port_that_is_busy_for_a_moment_is_waited_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    end = PtyEnd()
    with serving(end):
        first = SerialLine(end.name)
        threading.Timer(0.3, first.close).start()
        second, _ = line_to(end.name, 115200, DEVELOPMENT_KEY, share=False)
        with Client(second) as drive:
            assert drive.status().command == 0


def test_a_folder_that_others_can_enter_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    (tmp_path / "zerohertz").mkdir(mode=0o755)
    with pytest.raises(UserError, match="has to be this user's alone"):
        ports.socket_beside("/dev/ttyX")


def test_a_silent_drive_is_told_as_such() -> None:
    class Dead:
        def send(self, data: bytes) -> None: ...

        def receive(self, timeout_s: float) -> bytes:
            time.sleep(timeout_s)
            return b""

        def close(self) -> None: ...

    with (
        Hub(Dead()) as hub,
        Client(hub.line(), timeout_s=3.0) as client,
        pytest.raises(RefusedError, match="is the drive powered"),
    ):
        client.status()
