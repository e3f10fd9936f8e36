"""A recording that keeps the last seconds: its replay is that of the whole recording."""

from __future__ import annotations

import contextlib
import dataclasses
import json
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from test_flight import LOCKED_S, NOBODY_SAYS, QUICK, broker_of, client, run_up, zh

from zerohertz.drive import State
from zerohertz.errors import UserError
from zerohertz.flight import last_seconds
from zerohertz.flight.file import Ending, Flight, FlightWriter, Head, Middle
from zerohertz.flight.last_seconds import LastSeconds
from zerohertz.flight.record import Recorded, Recording, start
from zerohertz.flight.replay import replay
from zerohertz.flight.wanted import Wanted
from zerohertz.link.client import RUN, Client
from zerohertz.link.command import sil_job
from zerohertz.link.server import DirectLine, LinkedDrive
from zerohertz.studio.flights import Flights

KEEP_S = 0.2


class Both:
    """All rows into one file, the last seconds into another."""

    def __init__(self, folder: Path, head: Head, keep_s: float) -> None:
        self.whole, self.last = folder / "whole.flight", folder / "last.flight"
        self.sinks = FlightWriter(self.whole, head), LastSeconds(self.last, head, keep_s)
        self.most_bytes = 0

    def put(self, rows: bytes) -> None:
        for sink in self.sinks:
            sink.put(rows)
        self.most_bytes = max(self.most_bytes, self.sinks[1].memory_bytes)

    def close(self, why: Ending, lost_periods: int) -> None:
        for sink in self.sinks:
            sink.close(why, lost_periods)


@dataclasses.dataclass
class Desk:
    """A SIL drive, a host at its line, and both recordings of it."""

    line: DirectLine
    client: Client
    folder: Path
    both: Both = dataclasses.field(init=False)

    def record(
        self,
        work: Callable[[Client, int], bool],
        after_fault_s: float | None = None,
        keep_s: float = KEEP_S,
    ) -> Recorded:
        head, first = start(self.client, 10.0, NOBODY_SAYS)
        self.both = Both(self.folder, head, keep_s)
        recording = Recording(self.client, self.both, head, first)
        return recording.run(lambda p: work(self.client, p.periods), after_fault_s)

    def flights(self) -> tuple[Flight, Flight]:
        return Flight.read(self.both.whole), Flight.read(self.both.last)


@pytest.fixture
def desk(
    request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[Desk]:
    monkeypatch.setattr("zerohertz.flight.record._LOOK_S", 0.0)
    changed = [*QUICK, *getattr(request, "param", ())]
    with LinkedDrive(sil_job("recommended", "0", changed)) as drive:
        line = DirectLine(drive, 5)
        line.pause(LOCKED_S)
        yield Desk(line, Client(line), tmp_path)


def differing_bits(whole: Flight, last: Flight) -> int:
    """Of every signal of every period that both have."""
    a, b = replay(whole), replay(last)
    assert (b.ended, b.differs, b.periods) == ("", False, last.periods)
    first = whole.periods - last.periods
    assert last.head.middle is not None
    assert last.head.middle.dropped_periods == first > 0
    pairs = zip(a.signals.values(), b.signals.values(), strict=True)
    return sum(
        int(np.bitwise_count(x[first:].view(np.uint32) ^ y.view(np.uint32)).sum()) for x, y in pairs
    )


def overspeed(client: Client, period: int) -> bool:
    client.command(RUN, 157.0)
    return period < 20_000


@pytest.mark.parametrize("desk", [["i_trip_A=13"]], indirect=True)
def test_the_seconds_before_a_fault_are_those_of_the_whole_recording(desk: Desk) -> None:
    told = desk.record(overspeed, after_fault_s=0.05)
    assert told.ending is Ending.FAULT
    whole, last = desk.flights()
    assert differing_bits(whole, last) == 0
    again = replay(last, ["state"])
    assert again.checks > 0
    assert State.FAULT in again.signals["state"]
    assert KEEP_S <= again.fault_period * 200e-6 <= 1.0


def test_parameters_that_changed_before_the_kept_seconds_are_in_its_head(desk: Desk) -> None:
    speed = {2000: 40.0, 5700: 25.0}

    def work(drive: Client, period: int) -> bool:
        for at in [at for at in speed if at < period]:
            drive.set("speed_bandwidth_rad_s", speed.pop(at))
        return run_up(drive, period)

    desk.record(work)
    whole, last = desk.flights()
    assert not speed
    assert last.head.parameters["speed_bandwidth_rad_s"] == 40.0
    assert differing_bits(whole, last) == 0
    # Another value of a parameter that only watches changes nothing before the fault.
    assert not replay(last, [], {"i_trip_A": 14.0}).differs


def test_what_is_kept_does_not_grow(desk: Desk) -> None:
    desk.record(lambda drive, period: run_up(drive, period) or period < 12_000)
    early = desk.both.most_bytes
    whole, last = desk.flights()
    assert whole.periods >= 12_000
    assert KEEP_S <= last.periods * 200e-6 <= 2.0 * KEEP_S + 0.1
    rows = 12 * last.periods * 1.1
    states = 5 * 8 * 1024
    assert early <= rows + states


def test_at_a_gap_the_file_holds_what_came_before_it(desk: Desk) -> None:
    pauses = [5.0]

    def work(drive: Client, period: int) -> bool:
        if period > 4000 and pauses:
            desk.line.pause(pauses.pop())
        return True

    told = desk.record(work)
    assert (told.ending, told.fault) == (Ending.GAP, False)
    whole, last = desk.flights()
    assert (last.ending, last.lost_periods) == (Ending.GAP, told.lost_periods)
    assert differing_bits(whole, last) == 0


def test_another_firmware_refuses_and_says_whose_it_is(desk: Desk) -> None:
    desk.record(run_up)
    _, last = desk.flights()
    middle = last.head.middle
    assert middle is not None

    def opened(state: bytes) -> None:
        other = Middle(state, middle.dropped_periods, "commit 0123456789ab")
        replay(dataclasses.replace(last, head=dataclasses.replace(last.head, middle=other)), [])

    firmware = bytearray(middle.state)
    firmware[8] ^= 1
    with pytest.raises(UserError, match=r"another firmware than the one here.*0123456789ab"):
        opened(bytes(firmware))
    damaged = bytearray(middle.state)
    damaged[-100] ^= 1
    with pytest.raises(UserError, match="is damaged"):
        opened(bytes(damaged))
    with pytest.raises(UserError, match="size"):
        opened(middle.state[:-1])
    with pytest.raises(UserError, match="no state of a flight"):
        opened(bytes(len(middle.state)))


def test_a_drive_of_another_firmware_is_not_followed(desk: Desk) -> None:
    head, first = start(desk.client, 10.0, NOBODY_SAYS)
    other = dataclasses.replace(head, parameters=head.parameters | {"premagnetise_s": 0.1})
    last = LastSeconds(desk.folder / "a.flight", other, KEEP_S)
    Recording(desk.client, last, head, first).run(
        lambda p: not last.objection and run_up(desk.client, p.periods)
    )
    assert "the firmware here is not the drive's" in last.objection


@pytest.fixture
def tripping() -> Iterator[int]:
    """Port of a broker whose drive trips when it runs up."""
    yield from broker_of([*QUICK, "i_trip_A=13"])


def test_the_command_begins_again_behind_a_gap_and_ends_at_the_fault(
    tripping: int,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    file = tmp_path / "c.flight"
    drain, gaps = Recording._drain, [True]

    def with_a_gap(recording: Recording, *arguments: object) -> Ending:
        if not gaps:
            return drain(recording, *arguments)
        gaps.clear()
        return Ending.GAP

    monkeypatch.setattr(Recording, "_drain", with_a_gap)

    def work() -> None:
        with client(tripping, "runner") as runner:
            runner.command(RUN, 157.0, 60.0)
            while runner.status().state != State.FAULT:
                pass

    runner = threading.Thread(target=work, daemon=True)
    monkeypatch.setattr(last_seconds, "_PART_MIN_PERIODS", 300)
    begun = []

    def told(text: str) -> None:
        begun.append(text)
        if text.startswith("records") and not gaps:
            runner.start()

    monkeypatch.setattr("zerohertz.flight.command._say", told)
    line = ("--sil", "--tcp", str(tripping), "--json")
    assert zh("record", str(file), "--before-fault", "0.3", *line) == 0
    said = json.loads(capsys.readouterr().out)
    assert any("begins again when the drive is READY" in text for text in begun)
    assert said["ending"] == "FAULT"
    assert zh("replay", "--flight", str(file)) == 0
    out = capsys.readouterr().out
    assert "equal to the drive in every bit" in out
    assert "the last seconds only" in out
    runner.join()


@pytest.mark.parametrize(
    ("options", "after_s"),
    [((), None), (("--until-fault",), 0.1), (("--before-fault", "0"), 0.1)],
)
def test_the_command_ends_at_a_fault_if_it_is_told_so(
    options: tuple[str, ...], after_s: float | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    wanted: list[Wanted] = []

    def stop(self: Wanted, *_: object) -> None:
        wanted.append(self)
        raise UserError("seen")

    monkeypatch.setattr(Wanted, "record", stop)
    monkeypatch.setattr(
        "zerohertz.flight.command.open_client", lambda *_, **__: contextlib.nullcontext()
    )
    with pytest.raises(UserError, match="seen"):
        zh("record", "a.flight", "--sil", *options)
    assert wanted[0].after_fault_s == after_s


def test_who_ends_a_recording_of_the_page_keeps_its_last_seconds(
    tripping: int, tmp_path: Path
) -> None:
    flights = Flights(lambda: client(tripping, "studio tools"), tmp_path)
    told = flights.record(lambda text: text.startswith("records") and flights.cancel())
    assert (told["fault"], told["why"]) == (False, "")
    flight = Flight.read(Path(told["file"]))
    assert flight.ending is Ending.STOPPED
    assert flight.periods * flight.head.period_s == pytest.approx(told["seconds"])
    assert not replay(flight, []).differs
