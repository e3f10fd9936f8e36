"""A recording without end that keeps the last seconds of rows, and the drive's state before them.

The firmware of this machine runs along on the rows. Its state, taken now and then, is where a file
can begin; older rows are dropped. The memory needed depends on the seconds alone.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from zerohertz import __version__
from zerohertz.drive import State
from zerohertz.flight.file import PARAMETER, Ending, FlightWriter, Head, Middle
from zerohertz.flight.replay import ENDED, ReplayedDrive, signal_numbers
from zerohertz.link.flight import ROW_BYTES
from zerohertz.report.versions import source

_PARTS = 8  # of the seconds: one more than is asked for is kept
_PART_MIN_PERIODS = 500
_BATCH_BYTES = 250 * ROW_BYTES


@dataclass
class _Part:
    """Rows from one taken state to the next."""

    head: Head
    first_period: int
    rows: list[bytes] = field(default_factory=list)


class LastSeconds:
    """Takes rows as FlightWriter does; the file is written when the recording ends.

    objection: why the state beside is not the drive's; empty: it is.
    """

    def __init__(self, path: Path, head: Head, seconds: float) -> None:
        self._path, self._head = path, head
        self._keep = max(round(seconds / head.period_s), 1)
        self._part = max(self._keep // _PARTS, _PART_MIN_PERIODS)
        self._beside = ReplayedDrive(head)
        self._state = [signal_numbers()["state"]]
        self._parameters = dict(head.parameters)
        self._parts = deque([_Part(head, 0)])
        self._periods = 0
        self._fault_at: int | None = None
        self._source = f"zerohertz {__version__}, {source()}"
        self._waiting = b""
        self.objection = ""
        path.parent.mkdir(parents=True, exist_ok=True)

    def put(self, rows: bytes) -> None:
        self._waiting += rows
        if len(self._waiting) >= _BATCH_BYTES:
            self._take()

    def _take(self) -> None:
        """What waits; an answer of the link at a time would cost ten times as much."""
        rows, self._waiting = self._waiting, b""
        if not rows:
            return
        words = np.frombuffer(rows, "<u4").reshape(-1, 3)
        self._note_parameters(words)
        states = self._beside.run(words, self._state)[:, 0]
        faults = np.flatnonzero(states == State.FAULT)
        if len(faults) and self._fault_at is None:
            self._fault_at = self._periods + int(faults[0])
        self._periods += len(states)
        self._parts[-1].rows.append(rows)
        if self._periods - self._parts[-1].first_period >= self._part:
            self._begin_part()
        self._drop()
        self._object()

    def _object(self) -> None:
        now = self._beside.state
        if now.differs:
            self.objection = (
                "the firmware here is not the drive's: their outputs differ after period "
                f"{now.equal}. Record with the tools of its version, or without --before-fault"
            )
        elif now.ended:
            self.objection = (
                f"the recording {ENDED.get(now.ended, 'cannot be followed')}; start it again"
            )

    def _note_parameters(self, words: np.ndarray) -> None:
        names = list(self._head.parameters)
        for row in words[(words[:, 0] & 0xFFFF) == PARAMETER]:
            number = int(row[0]) >> 16
            if number < len(names):
                self._parameters[names[number]] = float(row[1:2].view(np.float32)[0])

    def _begin_part(self) -> None:
        state = self._beside.snapshot()
        if state is not None:
            middle = Middle(state, self._periods, self._source)
            head = replace(self._head, parameters=dict(self._parameters), middle=middle)
            self._parts.append(_Part(head, self._periods))

    def _drop(self) -> None:
        """What lies before the seconds that are asked for, back from the fault or from now."""
        until = self._periods if self._fault_at is None else self._fault_at
        while len(self._parts) > 1 and until - self._parts[1].first_period >= self._keep:
            self._parts.popleft()

    @property
    def kept_periods(self) -> int:
        return self._periods - self._parts[0].first_period

    @property
    def memory_bytes(self) -> int:
        """Of rows and states."""
        states = sum(len(p.head.middle.state) for p in self._parts if p.head.middle)
        return states + sum(len(rows) for part in self._parts for rows in part.rows)

    def close(self, why: Ending, lost_periods: int) -> None:
        self._take()
        writer = FlightWriter(self._path, self._parts[0].head)
        for part in self._parts:
            for rows in part.rows:
                writer.put(rows)
        writer.close(why, lost_periods)
        self._beside.close()
