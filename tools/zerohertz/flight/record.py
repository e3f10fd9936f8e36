"""A drive's flight into a file, over the link."""

from __future__ import annotations

import struct
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from zerohertz.errors import UserError
from zerohertz.flight.file import MARK, Ending, Head, find_table
from zerohertz.link.client import Client, RefusedError
from zerohertz.link.flight import (
    ROW_BYTES,
    FlightState,
    Recorder,
    arm_flight,
    flight_state,
    read_flight,
)

_POLL_S = 0.05
_LOOK_S = 0.25  # at faults and at how far the drive is ahead
_TRIES = 5
_NOT_NOW, _REFUSED, _NO_SUCH_OP = 8, 10, 5
_FAULT = 8  # state of the drive


@dataclass(frozen=True)
class Progress:
    """Of a recording that goes on."""

    periods: int
    behind: int  # rows that wait in the drive
    room: int  # of its memory, rows
    rows_per_s: float  # that came over the link since the last look
    faults: int


@dataclass(frozen=True)
class Recorded:
    """A recording that has ended."""

    periods: int
    ending: Ending
    lost_periods: int
    period_s: float
    rows_per_s: float  # of all of it
    why: str  # the link's complaint, if it was the link
    fault: bool  # one opened the gates


def start(drive: Client, wait_s: float, say: Callable[[str], None]) -> tuple[Head, bytes]:
    """Arms at the next standstill; the head, and the first rows of the recording."""
    names = list(drive.parameters)
    who = drive.identity
    for _ in range(_TRIES):
        _arm(drive, wait_s, say)
        first = _first_rows(drive)
        if not first:
            continue  # somebody started the drive in between
        values = drive.get(names)
        # The values are those of the start only if nobody has changed one since.
        if flight_state(drive).changes & 0xFFFF == struct.unpack_from("<H", first, 2)[0]:
            gain = find_table(who.table_crc32c) if who.table_crc32c else None
            return Head(
                *(who.text, who.motor_id, who.table_crc32c, who.period_s), values, gain
            ), first
    raise UserError("parameters change all the time, or the drive is started; record when it rests")


def _arm(drive: Client, wait_s: float, say: Callable[[str], None]) -> None:
    until_s = time.monotonic() + wait_s
    told = False
    while True:
        try:
            arm_flight(drive, True)
            return
        except RefusedError as refused:
            if refused.status == _REFUSED:
                raise UserError("this drive's board has no memory for a flight") from None
            if refused.status == _NO_SUCH_OP:
                raise UserError("this drive's firmware has no flight recorder") from None
            if refused.status != _NOT_NOW or time.monotonic() > until_s:
                raise
        if not told:
            say("waits until the drive is READY, with no start command standing")
            told = True
        time.sleep(_POLL_S)


def _first_rows(drive: Client) -> bytes:
    """Empty when the drive did not begin: it had been started."""
    while True:
        state, rows = read_flight(drive, 0)
        if rows or state not in (Recorder.ASKED, Recorder.ON):
            return rows


class Sink(Protocol):
    """Where rows go: all of them into a file (FlightWriter), or the last seconds (LastSeconds)."""

    def put(self, rows: bytes) -> None: ...

    def close(self, why: Ending, lost_periods: int) -> None: ...


class Recording:
    """Rows from a drive that was armed into a sink, until somebody says stop."""

    def __init__(self, drive: Client, sink: Sink, head: Head, first: bytes) -> None:
        self._drive, self._head = drive, head
        self._sink = sink
        self._row = self._periods = 0
        self._begun_s = time.monotonic()
        self._fault_period: int | None = None
        self._put(first)

    def run(
        self,
        going_on: Callable[[Progress], bool],
        after_fault_s: float | None = None,
    ) -> Recorded:
        """after_fault_s: ends so long after a fault that opened the gates."""
        ending, lost, why = Ending.STOPPED, 0, ""
        try:
            ending = self._drain(going_on, after_fault_s)
            lost = self._lost() if ending is Ending.GAP else 0
            arm_flight(self._drive, False)
        except KeyboardInterrupt:
            arm_flight(self._drive, False)
        except UserError as error:
            ending, why = Ending.LINK, str(error)
        self._sink.close(ending, lost)
        spent_s = time.monotonic() - self._begun_s
        rate = self._row / spent_s if spent_s > 0.0 else 0.0
        fault = self._fault_period is not None
        return Recorded(self._periods, ending, lost, self._head.period_s, rate, why, fault)

    def _lost(self) -> int:
        """Periods so far; a fault may be among them."""
        self._look(0.0)
        return flight_state(self._drive).lost

    def _drain(self, going_on: Callable[[Progress], bool], after_fault_s: float | None) -> Ending:
        looked_s, looked_row = time.monotonic(), self._row
        while True:
            state, rows = read_flight(self._drive, self._row)
            self._put(rows)
            if not rows and state != Recorder.ON:
                return Ending.GAP if state == Recorder.LOST else Ending.STOPPED
            now_s = time.monotonic()
            if now_s - looked_s < _LOOK_S:
                if not rows:
                    time.sleep(_POLL_S / 10.0)
                continue
            rate = (self._row - looked_row) / (now_s - looked_s)
            looked_s, looked_row = now_s, self._row
            if not going_on(self._look(rate)):
                return Ending.STOPPED
            if after_fault_s is not None and self._past_fault(after_fault_s):
                return Ending.FAULT

    def _look(self, rate: float) -> Progress:
        told: FlightState = flight_state(self._drive)
        status = self._drive.status()
        if status.state == _FAULT and self._fault_period is None:
            self._fault_period = self._periods + told.written - self._row
        return Progress(self._periods, told.written - self._row, told.rows, rate, status.faults)

    def _past_fault(self, after_fault_s: float) -> bool:
        if self._fault_period is None:
            return False
        return (self._periods - self._fault_period) * self._head.period_s >= after_fault_s

    def _put(self, rows: bytes) -> None:
        self._sink.put(rows)
        self._row += len(rows) // ROW_BYTES
        for at in range(0, len(rows), ROW_BYTES):
            self._periods += not struct.unpack_from("<H", rows, at)[0] & MARK
