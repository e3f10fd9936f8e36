"""A flight recording of one step, as `zh record` writes it: attach it to a bug report."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path

from zerohertz.bringup.bench import Bench
from zerohertz.errors import UserError
from zerohertz.flight.file import Ending, FlightWriter
from zerohertz.flight.record import start
from zerohertz.link.flight import ROW_BYTES, Recorder, arm_flight, flight_state, read_flight

_WAIT_S = 5.0


class _Tape:
    """Drained between two commands, as far as the drive has come."""

    def __init__(self, bench: Bench, path: Path) -> None:
        self._drive = bench.drive
        head, first = start(bench.drive, _WAIT_S, lambda _: None)
        self._writer = FlightWriter(path, head)
        self._row, self._on = 0, True
        self._put(first)

    def _put(self, rows: bytes) -> None:
        self._writer.put(rows)
        self._row += len(rows) // ROW_BYTES

    def drain(self) -> None:
        while self._on:
            state, rows = read_flight(self._drive, self._row)
            self._put(rows)
            self._on = state == Recorder.ON
            if len(rows) < 8 * ROW_BYTES:
                return

    def close(self) -> None:
        self.drain()
        lost = flight_state(self._drive)
        gap = lost.state == Recorder.LOST
        arm_flight(self._drive, False)
        self._writer.close(Ending.GAP if gap else Ending.STOPPED, lost.lost if gap else 0)


@contextlib.contextmanager
def recorded(bench: Bench, path: Path | None) -> Iterator[str]:
    """The file's name, '' when there is none: not asked for, or a board without that memory."""
    if path is None:
        yield ""
        return
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        tape = _Tape(bench, path)
    except UserError:
        yield ""
        return
    while bench.ready():
        bench.rest(0.1)
    bench.watch = tape.drain
    try:
        yield path.name
    finally:
        bench.watch = lambda: None
        tape.close()
