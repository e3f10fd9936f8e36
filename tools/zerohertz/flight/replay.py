"""A flight run again through the SIL firmware: binding of host_sim/flight_replay.h."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping
from contextlib import closing
from ctypes import (
    POINTER,
    Structure,
    byref,
    c_char_p,
    c_float,
    c_int,
    c_size_t,
    c_uint32,
    c_uint64,
    c_void_p,
)
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from zerohertz.drive import check, last_error, library, override_lines, raise_last_error
from zerohertz.drive import parameters as parameters_of_today
from zerohertz.errors import UserError
from zerohertz.flight.file import MARK, PARAMETER, Flight, Head, Middle, find_table, table_crc
from zerohertz.param_list import Former, former

_NOBODY = 0xFFFF  # number of a parameter that is not to change
_CHUNK_ROWS = 50_000
_NOT_NOW = 5
ENDED = {
    1: "does not begin with a start of the drive",
    2: "has rows that this firmware does not know; replay it with its own version",
    3: "tells only the second of two parameters that changed at once; nothing behind is replayed",
    4: "has a parameter that this firmware refuses",
    5: "holds two recordings",
}


@dataclass(frozen=True)
class Replayed:
    """What the firmware made of a flight."""

    periods: int
    checks: int  # digests of the drive's own outputs that were compared
    equal_periods: int  # before the first digest that differs: as the drive, to the bit
    differs: bool
    first_fault: int
    fault_period: int
    ended: str  # why it stopped before the recording did; empty: it did not
    signals: dict[str, npt.NDArray[np.float32] | npt.NDArray[np.uint32]]  # a value per period


class _State(Structure):
    _fields_ = (
        ("struct_size", c_uint32),
        ("ended", c_uint32),
        ("periods", c_uint64),
        ("checks", c_uint64),
        ("equal", c_uint64),
        ("differs", c_uint32),
        ("first_fault", c_uint32),
        ("fault_at", c_uint64),
    )


def signal_numbers() -> dict[str, int]:
    """Every signal of the firmware, in its order."""
    lib = library()
    lib.zh_sim_signal_name.restype = c_char_p
    names: dict[str, int] = {}
    while (name := lib.zh_sim_signal_name(len(names))) is not None:
        names[name.decode()] = len(names)
    return names


def replay(
    flight: Flight,
    signals: list[str] | None = None,
    changed: Mapping[str, float] | None = None,
    folders: tuple[Path, ...] = (),
) -> Replayed:
    """signals: None for all. changed: parameters that have another value than in the recording,
    from its start to its end. folders: motors to look for the gain table."""
    numbers = signal_numbers()
    names = list(numbers) if signals is None else signals
    for name in names:
        if name not in numbers:
            raise UserError(f"{name}: no such signal; there are {', '.join(numbers)}")
    with closing(ReplayedDrive(flight.head, changed, folders)) as drive:
        words = drive.run(flight.rows, [numbers[name] for name in names])
        state = drive.state
    columns: dict[str, Any] = {}
    for k, name in enumerate(names):
        column = np.ascontiguousarray(words[:, k])
        is_float = _bound().zh_flight_signal_is_float(numbers[name])
        columns[name] = column.view(np.float32) if is_float else column
    return Replayed(
        *(state.periods, state.checks, state.equal, bool(state.differs)),
        *(state.first_fault, state.fault_at, ENDED.get(state.ended, ""), columns),
    )


class ReplayedDrive:
    """A drive that is given rows; `changed` and `folders` as for `replay`."""

    def __init__(
        self,
        head: Head,
        changed: Mapping[str, float] | None = None,
        folders: tuple[Path, ...] = (),
    ) -> None:
        self._names, self._changed = list(head.parameters), dict(changed or {})
        self._lib = _bound()
        self._handle = _open(head, self._changed, folders)
        if head.middle is not None:
            self._restore(head.middle)

    def _restore(self, middle: Middle) -> None:
        state = middle.state
        if self._lib.zh_flight_restore(self._handle, state, len(state)):
            why = last_error().removeprefix("zh_flight_restore: buffer: ")
            self.close()
            raise UserError(
                f"the flight holds the last seconds only, and what it begins with {why}; replay it "
                f"with the firmware that recorded it: {middle.source}"
            )

    def close(self) -> None:
        self._lib.zh_flight_close(self._handle)
        self._handle = 0

    @property
    def state(self) -> _State:
        state = _State(struct_size=ctypes.sizeof(_State))
        check(self._lib.zh_flight_get_state(self._handle, byref(state)))
        return state

    def snapshot(self) -> bytes | None:
        """The whole state; None while a parameter change waits for its period."""
        room = ctypes.create_string_buffer(self._lib.zh_flight_snapshot_bytes())
        status = self._lib.zh_flight_snapshot(self._handle, room, len(room))
        if status == _NOT_NOW:
            return None
        check(status)
        return room.raw

    def run(self, rows: npt.NDArray[np.uint32], signals: list[int]) -> npt.NDArray[np.uint32]:
        """Words of these signals, a row per period."""
        numbers = np.array(signals, np.uint32)
        parts = []
        rows = _todays_rows(rows, self._names, self._changed)
        for at in range(0, len(rows), _CHUNK_ROWS):
            some = np.ascontiguousarray(rows[at : at + _CHUNK_ROWS])
            room = c_uint32(int(np.count_nonzero((some[:, 0] & MARK) == 0)))
            words = np.empty((room.value, len(numbers)), np.uint32)
            arguments = (some.ctypes.data, len(some), numbers.ctypes.data, len(numbers))
            check(self._lib.zh_flight_run(self._handle, *arguments, words.ctypes.data, byref(room)))
            parts.append(words[: room.value])
        return np.concatenate(parts) if parts else np.empty((0, len(numbers)), np.uint32)


def _bound() -> ctypes.CDLL:
    lib = library()
    lib.zh_flight_open.restype = c_void_p
    lib.zh_flight_open.argtypes = (c_char_p, POINTER(c_float), c_uint32)
    lib.zh_flight_run.restype = c_int
    lib.zh_flight_run.argtypes = (
        *(c_void_p, c_void_p, c_uint32, c_void_p, c_uint32, c_void_p, POINTER(c_uint32)),
    )
    lib.zh_flight_snapshot_bytes.restype = c_size_t
    lib.zh_flight_snapshot.restype = lib.zh_flight_restore.restype = c_int
    lib.zh_flight_snapshot.argtypes = (c_void_p, c_char_p, c_size_t)
    lib.zh_flight_restore.argtypes = (c_void_p, c_char_p, c_size_t)
    lib.zh_flight_get_state.restype = c_int
    lib.zh_flight_get_state.argtypes = (c_void_p, POINTER(_State))
    lib.zh_flight_close.restype, lib.zh_flight_close.argtypes = None, (c_void_p,)
    lib.zh_flight_signal_is_float.restype = c_uint32
    return lib


def _todays_name(name: str, was: Mapping[str, Former]) -> str:
    """A renamed parameter by its name of today; every other by its own."""
    return (was[name].now or name) if name in was else name


def former_lines(head: Head) -> list[str]:
    """What became of the parameters that only the recording drive had."""
    known, was = {p.name for p in parameters_of_today()}, former()
    parameters = head.parameters.items()
    return [f"{n} = {v:g} {was[n].text}" for n, v in parameters if n not in known and n in was]


def _parameters(head: Head, known: set[str]) -> dict[str, float]:
    """Those of the recording that this firmware has, by their names of today."""
    was = former()
    todays = {_todays_name(name, was): value for name, value in head.parameters.items()}
    if gone := [name for name in todays if name not in known and name not in was]:
        raise UserError(
            f"the drive had parameter {gone[0]}, which this firmware does not know: replay it with "
            f"the version that recorded it ({head.identity})"
        )
    return {name: value for name, value in todays.items() if name in known}


def _open(head: Head, changed: Mapping[str, float], folders: tuple[Path, ...]) -> int:
    known = {p.name for p in parameters_of_today()}
    if other := [name for name in changed if name not in known]:
        raise UserError(f"--set {other[0]}: no such parameter; tools/zh get lists them")
    parameters = _parameters(head, known)
    gain = _gain(head, folders)
    entries = None if gain is None else gain.ctypes.data_as(POINTER(c_float))
    lines = override_lines(parameters | dict(changed))
    handle = _bound().zh_flight_open(lines, entries, 0 if gain is None else len(gain))
    if not handle:
        raise_last_error()
    return int(handle)


def _gain(head: Head, folders: tuple[Path, ...]) -> npt.NDArray[np.float32] | None:
    if head.table_crc32c == 0:
        return None
    gain = head.gain if head.gain is not None else find_table(head.table_crc32c, folders)
    if gain is None:
        raise UserError(
            f"the drive's gain table {head.table_crc32c:08x} is neither in the file nor in "
            "gain_tables; give its folder with --motor DIR"
        )
    if table_crc(gain) != head.table_crc32c:
        raise UserError("the gain table in the file is damaged")
    return np.ascontiguousarray(gain, np.float32)


def _todays_rows(
    recorded: npt.NDArray[np.uint32], names: list[str], changed: Mapping[str, float]
) -> npt.NDArray[np.uint32]:
    """Parameters by the numbers of this firmware; those that are to stay do not change."""
    rows = recorded.copy()
    today, was = {p.name: k for k, p in enumerate(parameters_of_today())}, former()
    for at in np.flatnonzero((rows[:, 0] & 0xFFFF) == PARAMETER):
        then = int(rows[at, 0]) >> 16
        name = _todays_name(names[then], was) if then < len(names) else ""
        number = _NOBODY if name in changed else today.get(name, _NOBODY)
        rows[at, 0] = PARAMETER | number << 16
    return rows
