"""The flight recorder from SIL and through a broker, its file, `zh record`, `zh replay --flight`.

Every recording in tests/flights is a test: a failure in the field, and what became of it.
"""

from __future__ import annotations

import dataclasses
import json
import threading
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from zerohertz import cli
from zerohertz.drive import Fault, State
from zerohertz.errors import UserError
from zerohertz.flight.file import Ending, Flight, FlightWriter, Head, find_table, table_crc
from zerohertz.flight.record import Progress, Recorded, Recording, start
from zerohertz.flight.replay import former_lines, replay, signal_numbers
from zerohertz.link import broker, server
from zerohertz.link.client import RUN, Client, RefusedError
from zerohertz.link.command import sil_job
from zerohertz.link.flight import Recorder, arm_flight, flight_state, read_flight
from zerohertz.link.line import TcpLine
from zerohertz.link.ports import BrokerEnd
from zerohertz.link.server import DirectLine, LinkedDrive
from zerohertz.paths import ROOT

FLIGHTS = sorted((ROOT / "tests" / "flights").glob("*.flight"))
QUICK = ["rs_measure=0", "premagnetise_s=0.3"]
LOCKED_S = 1.1  # from power-up
NOBODY_SAYS: Callable[[str], None] = lambda text: None  # noqa: E731


class Desk:
    """A SIL drive, a host at its line, and a recording."""

    def __init__(self, drive: LinkedDrive, file: Path) -> None:
        self.line = DirectLine(drive, 5)
        self.line.pause(LOCKED_S)
        self.client = Client(self.line)
        self.file = file

    def record(
        self, work: Callable[[Client, int], bool], after_fault_s: float | None = None
    ) -> Recorded:
        """`work` is given the period, again and again, until it says no."""
        head, first = start(self.client, 10.0, NOBODY_SAYS)
        recording = Recording(self.client, FlightWriter(self.file, head), head, first)
        return recording.run(lambda p: work(self.client, p.periods), after_fault_s)


@pytest.fixture
def desk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Desk]:
    monkeypatch.setattr("zerohertz.flight.record._LOOK_S", 0.0)
    with LinkedDrive(sil_job("recommended", "0", QUICK)) as drive:
        yield Desk(drive, tmp_path / "a.flight")


def run_up(client: Client, period: int) -> bool:
    client.command(RUN, 60.0)
    return period < 6000


def test_a_flight_of_the_sil_is_replayed_to_the_same_outputs(desk: Desk) -> None:
    told = desk.record(run_up)
    assert (told.ending, told.lost_periods) == (Ending.STOPPED, 0)
    flight = Flight.read(desk.file)
    assert flight.periods == told.periods >= 6000
    again = replay(flight)
    assert (again.differs, again.ended, again.first_fault) == (False, "", 0)
    assert again.checks == again.periods // 256
    assert list(again.signals) == list(signal_numbers())
    assert again.signals["state"][-1] == State.RUN
    assert again.signals["omega_e_hat_rad_s"].dtype == np.float32


def test_parameters_that_change_on_the_way_change_in_the_replay(desk: Desk) -> None:
    speed = {2000: 40.0, 3000: 25.0}

    def work(client: Client, period: int) -> bool:
        for at in [at for at in speed if at < period]:
            client.set("speed_bandwidth_rad_s", speed.pop(at))
        return run_up(client, period)

    desk.record(work)
    flight = Flight.read(desk.file)
    assert not speed
    kinds = [int(word) for word in flight.rows[:, 0] & 0xFFFF if word & 0x8000]
    assert kinds.count(0x8002) == 2
    assert not replay(flight, []).differs
    # Negative control: the same flight without its parameter changes is another one.
    kept = flight.rows[(flight.rows[:, 0] & 0xFFFF) != 0x8002]
    assert replay(dataclasses.replace(flight, rows=kept), []).differs


def test_one_other_bit_of_one_sample_is_found(desk: Desk) -> None:
    desk.record(run_up)
    flight = Flight.read(desk.file)
    rows = flight.rows.copy()
    running = np.flatnonzero((rows[:, 0] & 0x8000) == 0)[5000]
    rows[running, 0] ^= 1
    again = replay(dataclasses.replace(flight, rows=rows), [])
    assert again.differs
    assert again.equal_periods <= 5000 < again.equal_periods + 256


def test_a_host_that_comes_too_late_finds_the_gap(desk: Desk) -> None:
    pauses = [5.0]

    def work(client: Client, period: int) -> bool:
        if period > 1000 and pauses:
            desk.line.pause(pauses.pop())
        return True

    told = desk.record(work)
    assert told.ending is Ending.GAP
    assert told.lost_periods > 5.0 / 200e-6 - 16384
    flight = Flight.read(desk.file)
    assert (flight.ending, flight.lost_periods) == (Ending.GAP, told.lost_periods)
    assert 1000 < flight.periods < 25_000
    again = replay(flight, [])
    assert (again.periods, again.differs) == (flight.periods, False)


def test_a_drive_that_runs_is_not_started_anew(desk: Desk) -> None:
    desk.client.command(RUN, 10.0)
    with pytest.raises(RefusedError, match="not now"):
        start(desk.client, 0.0, NOBODY_SAYS)
    assert flight_state(desk.client).state == Recorder.OFF
    assert desk.client.status().state == State.PREMAGNETISE


def test_a_parameter_set_while_the_head_is_read_begins_the_recording_again(
    desk: Desk, monkeypatch: pytest.MonkeyPatch
) -> None:
    get, changed = Client.get, [30.0]

    def get_late(client: Client, names: list[str]) -> dict[str, float]:
        if changed:
            client.set("speed_bandwidth_rad_s", changed.pop())
        return get(client, names)

    monkeypatch.setattr(Client, "get", get_late)
    desk.record(run_up)
    flight = Flight.read(desk.file)
    assert flight.head.parameters["speed_bandwidth_rad_s"] == 30.0
    assert not replay(flight, []).differs


def test_a_file_that_was_cut_off_is_read_as_far_as_it_goes(desk: Desk, tmp_path: Path) -> None:
    desk.record(run_up)
    data = desk.file.read_bytes()
    cut = tmp_path / "cut.flight"
    cut.write_bytes(data[: len(data) * 2 // 3])
    flight = Flight.read(cut)
    assert flight.ending is Ending.DIED
    assert 0 < flight.periods < Flight.read(desk.file).periods
    assert not replay(flight, []).differs


@pytest.mark.parametrize("data", [b"", b"ZHFLIGHT", b"t_s,i_A\n0,1\n", b"ZHFLIGHTxxxxxxxx"])
def test_what_is_no_flight_is_refused(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / "no.flight"
    path.write_bytes(data)
    with pytest.raises(UserError, match="is no flight"):
        Flight.read(path)


def head(**changes: object) -> Head:
    flight = Flight.read(FLIGHTS[0])
    return dataclasses.replace(flight.head, **changes)


@pytest.mark.parametrize(
    ("rows", "why"),
    [
        ([[5, 5, 5]], "does not begin with a start"),
        ([[0x8000, 0, 0], [0x8000, 0, 0]], "two recordings"),
        ([[0x8000, 0, 0], [0x8077, 0, 0]], "does not know"),
        ([[0x8000, 0, 0], [0xFFFF8002, 0, 2]], "only the second"),
        ([[0x8000, 0, 0], [0x00008002, 0x7FC00000, 1]], "refuses"),
    ],
)
def test_rows_that_make_no_sense_end_the_replay(rows: list[list[int]], why: str) -> None:
    flight = Flight(head(), np.array([*rows, [1, 2, 3]], np.uint32), Ending.STOPPED, 0)
    again = replay(flight, [])
    assert why in again.ended
    assert again.periods == 0


def test_a_parameter_of_a_former_list_is_named_and_left_out() -> None:
    """Renamed: under its name of today. The recording has flux_mode, which is gone."""
    flight = Flight.read(FLIGHTS[0])
    lines = former_lines(flight.head)
    assert lines == ["flux_mode = 0 is derived now: i_d follows the flux reference"]
    parameters = {k: v for k, v in flight.head.parameters.items() if k != "i_f_A"}
    renamed = head(parameters=parameters | {"impressed_A": 3.5})
    assert "impressed_A = 3.5 is called i_f_A now" in former_lines(renamed)
    shown = replay(Flight(renamed, flight.rows[:20], Ending.STOPPED, 0), [])
    assert shown.periods > 0


def test_a_parameter_that_is_gone_and_a_table_that_is_missing_are_named() -> None:
    flight = Flight.read(FLIGHTS[0])
    other = head(parameters=flight.head.parameters | {"warp_factor": 9.0})
    with pytest.raises(UserError, match="warp_factor, which this firmware does not know"):
        replay(dataclasses.replace(flight, head=other))
    with pytest.raises(UserError, match="gain table 12345678 is neither in the file nor"):
        replay(dataclasses.replace(flight, head=head(table_crc32c=0x12345678, gain=None)))
    with pytest.raises(UserError, match="is damaged"):
        replay(dataclasses.replace(flight, head=head(table_crc32c=0x12345678)))
    with pytest.raises(UserError, match="no such signal"):
        replay(flight, ["warp"])


def test_the_table_is_found_by_its_crc() -> None:
    kept = Flight.read(FLIGHTS[0]).head
    assert kept.gain is not None
    assert table_crc(kept.gain) == kept.table_crc32c
    assert find_table(0) is None


# --- the broker ---------------------------------------------------------------------------------


@pytest.fixture
def served() -> Iterator[int]:
    yield from broker_of(QUICK)


def broker_of(changed: list[str]) -> Iterator[int]:
    """A drive behind a broker, in real time; its port."""
    going_on = [True]
    end = BrokerEnd(0)
    with LinkedDrive(sil_job("recommended", "0", changed)) as drive:
        thread = threading.Thread(
            target=server.serve, args=(drive, end, 1.0, lambda: going_on[0]), daemon=True
        )
        thread.start()
        yield end.port
        going_on[0] = False
        thread.join()
    end.close()


def client(port: int, name: str) -> Client:
    there = Client(TcpLine(port), timeout_s=5.0)
    there.introduce(name)
    return there


def test_one_client_records_while_another_runs_the_drive(served: int, tmp_path: Path) -> None:
    file = tmp_path / "b.flight"
    with client(served, "recorder") as recorder, client(served, "studio") as studio:
        assert studio.session
        head, first = start(recorder, 20.0, NOBODY_SAYS)
        recording = Recording(recorder, FlightWriter(file, head), head, first)

        def work(progress: Progress) -> bool:
            studio.command(RUN, 60.0, 5.0)
            now = studio.status()
            assert now.faults == 0
            return progress.periods < 6000 or now.state != State.RUN

        told = recording.run(work)
        studio.stop()
    assert told.ending is Ending.STOPPED
    again = replay(Flight.read(file), ["state"])
    assert (again.differs, again.periods) == (False, told.periods)
    assert State.RUN in again.signals["state"]


def test_the_recorder_is_one_clients_until_it_goes_away(served: int) -> None:
    with client(served, "second") as second:
        with client(served, "first") as first:
            start(first, 20.0, NOBODY_SAYS)
            with pytest.raises(RefusedError, match="first records a flight"):
                arm_flight(second, True)
            with pytest.raises(RefusedError, match="a recording of its own"):
                read_flight(second, 0)
            assert flight_state(second).state == Recorder.ON
        while flight_state(second).state != Recorder.OFF:
            pass
        start(second, 20.0, NOBODY_SAYS)
        arm_flight(second, False)


def test_a_recorder_that_asks_for_nothing_loses_its_place(
    served: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(broker, "_FLIGHT_LEASE_S", 0.0)
    with client(served, "first") as first, client(served, "second") as second:
        start(first, 20.0, NOBODY_SAYS)
        start(second, 20.0, NOBODY_SAYS)
        with pytest.raises(RefusedError, match="a recording of its own"):
            read_flight(first, 0)


# --- the commands, and the failures that are kept -----------------------------------------------


def zh(*arguments: str) -> int:
    return int(cli.make_app()(arguments, standalone_mode=False) or 0)


def test_record_and_replay_as_commands(
    served: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, table = tmp_path / "c.flight", tmp_path / "c.csv"
    line = ("--sil", "--tcp", str(served))
    assert zh("record", str(file), "--seconds", "0.5", "--json", *line) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["ending"] == "STOPPED"
    assert told["periods"] >= 2500
    names = "state,omega_e_hat_rad_s"
    assert zh("replay", "--flight", str(file), "--signals", names, "--out", str(table)) == 0
    assert "equal to the drive in every bit of its outputs" in capsys.readouterr().out
    lines = table.read_text().splitlines()
    assert lines[0] == "t_s,state,omega_e_hat_rad_s"
    assert len(lines) == 1 + told["periods"]


def test_replay_says_what_another_parameter_would_have_done(
    capsys: pytest.CaptureFixture[str],
) -> None:
    example = str(ROOT / "tests" / "flights" / "over_current.flight")
    zh("replay", "--flight", example, "--set", "i_trip_A=15", "--json")
    told = json.loads(capsys.readouterr().out)
    at = told["changed"]["parts_at_period"]
    assert at * 200e-6 == pytest.approx(told["fault_s"], abs=1e-6)
    assert "OVER_CURRENT" not in told["changed"]["first_fault"]
    zh("replay", "--flight", example, "--set", "i_trip_A=15")
    assert "answer to the old ones" in capsys.readouterr().out


def test_replay_wants_a_log_or_a_flight() -> None:
    with pytest.raises(UserError, match="or --flight FILE"):
        zh("replay")
    with pytest.raises(UserError, match="--set warp_factor: no such parameter"):
        zh("replay", "--flight", str(FLIGHTS[0]), "--set", "warp_factor=9")


@pytest.mark.parametrize("path", FLIGHTS, ids=lambda path: path.stem)
def test_a_failure_that_was_recorded_ends_as_it_should(path: Path) -> None:
    wanted = tomllib.loads(path.with_suffix(".toml").read_text(encoding="utf-8"))
    flight = Flight.read(path)
    again = replay(flight, [])
    assert (again.ended, again.periods) == ("", flight.periods)
    fault = Fault[wanted["first_fault"]] if wanted["first_fault"] else Fault(0)
    assert again.first_fault == fault
    if fault:
        low_s, high_s = wanted["fault_s"]
        assert low_s <= again.fault_period * flight.head.period_s <= high_s
    if changed := wanted.get("changed"):
        assert not replay(flight, [], changed).first_fault & fault


def test_a_file_that_cannot_be_written_is_said(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="cannot be written"):
        FlightWriter(tmp_path / "no" / "a.flight", head())
