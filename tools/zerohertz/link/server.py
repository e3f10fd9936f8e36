"""The SIL drive behind a line: binding of host_sim/link.h, in real time or faster."""

from __future__ import annotations

import contextlib
import ctypes
import os
import select
import time
import tty
from collections.abc import Callable
from ctypes import (
    POINTER,
    Structure,
    byref,
    c_char_p,
    c_double,
    c_int,
    c_uint8,
    c_uint32,
    c_uint64,
    c_void_p,
)
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, Self

from zerohertz import sim
from zerohertz.drive import check, library, raise_last_error

_CHUNK_BYTES = 4096
_SLICE_S = 2e-3  # of the drive's time, between two looks at the line
# A machine that is slower than the drive's clock gives time up. Caught up, seconds of the drive
# would pass before a host that was held up too says a word.
_LAG_S = 0.05


@dataclass(frozen=True)
class SilState:
    """Of the rig, which no firmware knows."""

    gates_on: bool
    periods: int
    digest: int  # of every duty and gate so far
    time_s: float
    speed_rpm: float
    u_dc_V: float
    i_u_A: float  # at the drive's terminals
    i_v_A: float
    i_w_A: float


class _State(Structure):
    _fields_ = (
        ("struct_size", c_uint32),
        ("gates_on", c_uint32),
        ("periods", c_uint64),
        ("digest", c_uint64),
        ("time_s", c_double),
        ("speed_rpm", c_double),
        *((name, c_double) for name in ("u_dc_V", "i_u_A", "i_v_A", "i_w_A")),
    )


class _CanFrame(Structure):
    _fields_ = (("id", c_uint32), ("length", c_uint32), ("data", c_uint8 * 8))


class LinkedDrive:
    """One drive on its rig; bytes in, bytes out."""

    def __init__(
        self, job: sim.Job, *, commands_from_link: bool = True, keep: Path | None = None
    ) -> None:
        lib = library()
        lib.zh_link_open.restype = c_void_p
        lib.zh_link_open.argtypes = (c_void_p, c_uint32, c_char_p)
        lib.zh_link_run.restype = c_int
        lib.zh_link_run.argtypes = (
            *(c_void_p, c_uint32, c_char_p, POINTER(c_uint32)),
            *(c_void_p, POINTER(c_uint32)),
        )
        lib.zh_link_modbus_put.restype = lib.zh_link_modbus_take.restype = c_int
        lib.zh_link_modbus_put.argtypes = (c_void_p, c_char_p, c_uint32)
        lib.zh_link_modbus_take.argtypes = (c_void_p, c_void_p, POINTER(c_uint32))
        lib.zh_link_can_put.restype = lib.zh_link_can_take.restype = c_int
        lib.zh_link_can_put.argtypes = (c_void_p, POINTER(_CanFrame))
        lib.zh_link_can_take.argtypes = (c_void_p, POINTER(_CanFrame), POINTER(c_uint32))
        lib.zh_link_get_state.restype = c_int
        lib.zh_link_get_state.argtypes = (c_void_p, POINTER(_State))
        lib.zh_link_close.restype, lib.zh_link_close.argtypes = None, (c_void_p,)
        self._lib = lib
        raw, alive = sim._raw_job(job)
        kept = os.fsencode(keep) if keep is not None else None
        self._handle = lib.zh_link_open(byref(raw), int(commands_from_link), kept)
        del alive
        if not self._handle:
            raise_last_error()
        self._sent = ctypes.create_string_buffer(_CHUNK_BYTES)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        if self._handle:
            self._lib.zh_link_close(self._handle)
            self._handle = None

    def run(self, periods: int, received: bytes = b"") -> tuple[int, bytes]:
        """Control periods; how many of the bytes the drive took, and what it said."""
        taken, said = c_uint32(len(received)), c_uint32(_CHUNK_BYTES)
        arguments = (periods, received, byref(taken), self._sent, byref(said))
        check(self._lib.zh_link_run(self._handle, *arguments))
        return taken.value, self._sent.raw[: said.value]

    def modbus(self, received: bytes = b"") -> bytes:
        """Bytes onto the drive's Modbus line for the next periods; what it has said there."""
        check(self._lib.zh_link_modbus_put(self._handle, received, len(received)))
        said = c_uint32(_CHUNK_BYTES)
        check(self._lib.zh_link_modbus_take(self._handle, self._sent, byref(said)))
        return self._sent.raw[: said.value]

    def can_put(self, number: int, data: bytes) -> None:
        """A frame onto the drive's CAN line."""
        frame = _CanFrame(number, len(data), (c_uint8 * 8)(*data))
        check(self._lib.zh_link_can_put(self._handle, byref(frame)))

    def can_take(self) -> list[tuple[int, bytes]]:
        """What the drive has sent since: identifiers and data."""
        frames, frame, taken = [], _CanFrame(), c_uint32(1)
        while True:
            check(self._lib.zh_link_can_take(self._handle, byref(frame), byref(taken)))
            if not taken.value:
                return frames
            frames.append((frame.id, bytes(frame.data[: frame.length])))

    @property
    def state(self) -> SilState:
        raw = _State(struct_size=ctypes.sizeof(_State))
        check(self._lib.zh_link_get_state(self._handle, byref(raw)))
        names = (name for name, _ in _State._fields_ if name != "struct_size")
        values = {name: getattr(raw, name) for name in names}
        return SilState(**values | {"gates_on": bool(raw.gates_on)})


class DirectLine:
    """A host's end in the same program: the drive lives only while somebody waits at it."""

    def __init__(self, drive: LinkedDrive, periods: int) -> None:
        self._drive, self._periods, self._waiting = drive, periods, b""

    def send(self, data: bytes) -> None:
        self._waiting += data

    def receive(self, timeout_s: float) -> bytes:
        taken, said = self._drive.run(self._periods, self._waiting)
        self._waiting = self._waiting[taken:]
        return said

    def pause(self, seconds: float) -> None:
        """Lets so much of the drive's time pass."""
        self._drive.run(1)
        state = self._drive.state
        self._drive.run(round(seconds * state.periods / state.time_s))

    def close(self) -> None:
        pass


class _End(Protocol):
    """The drive's end of a line."""

    def exchange(self, say: bytes, wait_s: float) -> bytes: ...


class PtyEnd:
    """A terminal device, for programs that know serial ports only."""

    def __init__(self) -> None:
        self._master, slave = os.openpty()
        tty.setraw(slave)
        os.set_blocking(self._master, False)
        self.name = os.ttyname(slave)

    def exchange(self, say: bytes, wait_s: float) -> bytes:
        with contextlib.suppress(OSError):
            os.write(self._master, say)
        if select.select([self._master], [], [], wait_s)[0]:
            with contextlib.suppress(OSError):
                return os.read(self._master, _CHUNK_BYTES)
        return b""

    def close(self) -> None:
        os.close(self._master)


def serve(
    drive: LinkedDrive,
    end: _End,
    speed: float,
    going_on: Callable[[], bool] = lambda: True,
    modbus: _End | None = None,
) -> None:
    """Until `going_on` says no. speed: drive seconds per second, 0: as fast as it goes."""
    drive.run(1)
    period_s = drive.state.time_s / drive.state.periods
    periods = max(round(_SLICE_S / period_s), 1)
    slice_s = periods * period_s
    waiting, said = b"", b""
    due_s = time.monotonic()
    while going_on():
        now_s = time.monotonic()
        if speed > 0.0:
            due_s = max(due_s + slice_s / speed, now_s - _LAG_S)
        waiting += end.exchange(said, max(due_s - now_s, 0.0) if speed > 0.0 else 0.0)
        if speed > 0.0 and (left_s := due_s - time.monotonic()) > 0.0:
            time.sleep(left_s)
        taken, said = drive.run(periods, waiting)
        waiting = waiting[taken:]
        if modbus is not None:
            drive.modbus(modbus.exchange(drive.modbus(), 0.0))
