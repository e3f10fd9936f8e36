"""A closed-loop run that is stopped on the way: binding of host_sim/sim_steps.h."""

from __future__ import annotations

import ctypes
import functools
from ctypes import POINTER, byref, c_char_p, c_float, c_int, c_uint32, c_uint64, c_void_p
from types import TracebackType
from typing import Self

from zerohertz import sim
from zerohertz.drive import check, library, raise_last_error
from zerohertz.sim_structs import RawJob, RawResult


@functools.cache
def _library() -> ctypes.CDLL:
    lib = library()
    lib.zh_sim_open.restype, lib.zh_sim_open.argtypes = c_void_p, (POINTER(RawJob),)
    lib.zh_sim_open_endless.restype = c_void_p
    lib.zh_sim_open_endless.argtypes = POINTER(RawJob), c_uint64
    lib.zh_sim_change.restype, lib.zh_sim_change.argtypes = c_int, (c_void_p, c_char_p)
    lib.zh_sim_set.restype, lib.zh_sim_set.argtypes = c_int, (c_void_p, c_char_p, c_float)
    lib.zh_sim_look.restype, lib.zh_sim_look.argtypes = c_int, (c_void_p, POINTER(RawResult))
    lib.zh_sim_advance.restype, lib.zh_sim_advance.argtypes = c_int, (c_void_p, c_uint64)
    lib.zh_sim_flip.restype, lib.zh_sim_flip.argtypes = c_int, (c_void_p, c_uint32, c_uint32)
    for name in ("zh_sim_faults", "zh_sim_gates_on"):
        function = getattr(lib, name)
        function.restype, function.argtypes = c_uint32, (c_void_p,)
    lib.zh_sim_unit_bytes.restype, lib.zh_sim_unit_bytes.argtypes = c_uint32, ()
    lib.zh_sim_take.restype, lib.zh_sim_take.argtypes = c_int, (c_void_p, POINTER(RawResult))
    lib.zh_sim_close.restype, lib.zh_sim_close.argtypes = None, (c_void_p,)
    return lib


def unit_bytes() -> int:
    """Of the RAM that a drive owns."""
    return int(_library().zh_sim_unit_bytes())


class Steps:
    """One run; a process that forks has it twice, each going on by itself."""

    def __init__(self, job: sim.Job, keep_rows: int | None = None) -> None:
        """keep_rows: the run has no end, and its record keeps this many rows."""
        raw, keep = sim._raw_job(job)
        self._columns = job.columns
        if keep_rows is None:
            self._run = _library().zh_sim_open(byref(raw))
        else:
            self._run = _library().zh_sim_open_endless(byref(raw), keep_rows)
        del keep  # the table is copied
        if not self._run:
            raise_last_error()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        _library().zh_sim_close(self._run)

    def advance(self, steps: int) -> None:
        """Until so many control periods are done in all, or the run has ended."""
        check(_library().zh_sim_advance(self._run, steps))

    def change(self, scenario: str) -> None:
        """Commands, profiles and faults of another scenario, a text, from the next period on."""
        check(_library().zh_sim_change(self._run, scenario.encode()))

    def set(self, name: str, value: float) -> None:
        """A parameter of the firmware; UserError when it is refused."""
        check(_library().zh_sim_set(self._run, name.encode(), value))

    def newest(self, name: str) -> float:
        """The last recorded value of a column."""
        found = RawResult(struct_size=ctypes.sizeof(RawResult))
        check(_library().zh_sim_look(self._run, byref(found)))
        column = sim._chosen(self._columns).index(name)
        return float(found.data[column * found.stride + (found.rows - 1) % found.stride])

    def flip(self, byte: int, bit: int) -> None:
        """A bit (0..7) of a byte of the drive's RAM, before its next period."""
        check(_library().zh_sim_flip(self._run, byte, bit))

    def faults(self) -> int:
        """The fault bits that the drive has latched by now."""
        return int(_library().zh_sim_faults(self._run))

    def gates_on(self) -> bool:
        """As the last period put them out."""
        return bool(_library().zh_sim_gates_on(self._run))

    def take(self) -> sim.Record:
        """What is recorded so far; the run is over."""
        result = RawResult(struct_size=ctypes.sizeof(RawResult))
        check(_library().zh_sim_take(self._run, byref(result)))
        return sim._record(sim._library(), result, self._columns)
