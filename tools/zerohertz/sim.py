"""Closed-loop runs from Python: binding of host_sim/sim.h. A run is record = run(job).

The library works without the interpreter's lock: runs in threads go on side by side.
"""

from __future__ import annotations

import contextlib
import ctypes
import functools
import itertools
import os
from collections.abc import Iterator, Mapping, Sequence
from ctypes import POINTER, byref, c_char_p, c_float, c_int, c_uint32, c_void_p
from dataclasses import dataclass, field
from enum import IntFlag
from typing import Any

import numpy as np
import numpy.typing as npt

from zerohertz import arguments
from zerohertz.drive import check, library, override_lines
from zerohertz.errors import UserError
from zerohertz.paths import ROOT
from zerohertz.sil_types import WARNINGS, Commissioned, Fault, commissioned
from zerohertz.sim_structs import RawJob, RawResult

HOST_SIM = ROOT / "host_sim"

_FILES = ("scenario", "rig", "board", "motor_dir")
_LINES = ("scenario_overrides", "rig_overrides", "board_overrides", "firmware_config", "firmware")
_STOP_AT_TRIP, _TIME_SPLIT, _HASH_SIGNALS, _GUARD_RECORDED = 1, 2, 4, 8

Hashes = dict[str, int]  # 64 bits by the name of the traced signal
_hashes: list[Hashes] | None = None  # of the runs inside signal_hashes()


class Trip(IntFlag):
    """Events that would have ended a real experiment."""

    FIRMWARE = 1  # a fault of the firmware
    SPEED = 2  # true |w| > 3000 min^-1
    CURRENT = 4  # true |i_s| > 60 A, power invariant
    DIVERGED = 8  # the plant's numbers
    SLOW = 16  # the firmware: more than 250 us of CPU time per period
    NAN = 32  # the estimate was not finite


# Causes that are the estimator's own.
TOO_SLOW, NOT_FINITE = "too slow", "NaN"


def fault_names(bits: int) -> str:
    """Names of the fault bits, as in fault_list.def; empty: none."""
    return " ".join(fault.name or "" for fault in Fault if bits & fault)


@dataclass(frozen=True)
class Job:
    """One run. Files by path, or their text (anything with a line break).

    Firmware parameters, later wins: firmware_config, the scenario's [firmware], firmware.
    """

    scenario: str | os.PathLike[str] = HOST_SIM / "scenarios" / "smoke.toml"
    rig: str | os.PathLike[str] = HOST_SIM / "rigs" / "ideal.toml"
    board: str | os.PathLike[str] = HOST_SIM / "boards" / "paper.toml"
    motor_dir: str | os.PathLike[str] = ROOT / "gain_tables" / "hasegawa2005"
    firmware: Mapping[str, float] = field(default_factory=dict)
    firmware_config: Mapping[str, float] = field(default_factory=dict)
    rig_overrides: Mapping[str, Any] = field(default_factory=dict)
    scenario_overrides: Mapping[str, Any] = field(default_factory=dict)
    board_overrides: Mapping[str, Any] = field(default_factory=dict)
    gain: npt.NDArray[np.float32] | None = None  # (N, 4) instead of the motor's table
    seed: int | None = None  # None: the scenario's
    decimate: int = 1
    max_steps: int | None = None
    stop_at_trip: bool = False
    time_split: bool = False
    columns: tuple[str, ...] = ()  # recorded, in the order of the library; empty: every one
    guard_recorded: bool = False  # the guard of the speed counts and does not act


@dataclass(frozen=True)
class Record:
    """Record of a run: named columns, one row per recorded control period."""

    columns: dict[str, npt.NDArray[np.float32]]
    steps: int
    period_s: float
    trip: Trip
    trip_s: float | None
    first_fault: int  # fault bits, 0: none
    first_fault_s: float | None
    loop_ns_per_step: float  # CPU time, recording included
    controller_ns_per_step: float  # with Job.time_split, else 0
    plant_ns_per_step: float
    commissioned: Commissioned | None = None

    def __getitem__(self, name: str) -> npt.NDArray[np.float32]:
        return self.columns[name]

    @property
    def cause(self) -> str:
        """What stopped the run: `too slow`, `NaN`, the first fault's names, `diverged`, or none."""
        for trip, text in ((Trip.SLOW, TOO_SLOW), (Trip.NAN, NOT_FINITE)):
            if trip in self.trip:
                return text
        diverged = "diverged" if Trip.DIVERGED in self.trip else ""
        return fault_names(self._stopped()[0]) or diverged

    @property
    def cause_s(self) -> float | None:
        """When; the end of a run that was too slow."""
        if Trip.SLOW in self.trip:
            return self.steps * self.period_s
        bits, at_s = self._stopped()
        return at_s if bits else self.trip_s

    @property
    def stopping_trip(self) -> Trip:
        """What was passed, a warning of the firmware apart: the drive runs on with it."""
        return self.trip if self._stopped()[0] else self.trip & ~Trip.FIRMWARE

    def _stopped(self) -> tuple[int, float]:
        """The first fault that is no warning, and when: of a decimated record its row."""
        if self.first_fault & ~WARNINGS and self.first_fault_s is not None:
            return self.first_fault & ~WARNINGS, self.first_fault_s
        bits = self["faults"].astype(np.int64) & ~WARNINGS
        first = int(np.argmax(bits != 0))
        return int(bits[first]), float(self.t_s[first])

    @property
    def t_s(self) -> npt.NDArray[np.float32]:
        return self.columns["t_s"]


@functools.cache
def _library() -> ctypes.CDLL:
    lib = library()
    lib.zh_sim_run.restype, lib.zh_sim_run.argtypes = c_int, (POINTER(RawJob), POINTER(RawResult))
    lib.zh_sim_run_batch.restype = c_int
    lib.zh_sim_run_batch.argtypes = POINTER(RawJob), POINTER(RawResult), c_uint32
    lib.zh_sim_free.restype, lib.zh_sim_free.argtypes = None, (POINTER(RawResult),)
    lib.zh_sim_column_count.restype, lib.zh_sim_column_count.argtypes = c_uint32, ()
    for name in ("zh_sim_column_name", "zh_sim_column_text", "zh_sim_signal_name"):
        function = getattr(lib, name)
        function.restype, function.argtypes = c_char_p, (c_uint32,)
    return lib


@functools.cache
def _row() -> dict[str, str]:
    """Columns of a row in the library's order, and their meaning."""
    lib = _library()
    return {
        lib.zh_sim_column_name(k).decode(): lib.zh_sim_column_text(k).decode()
        for k in range(lib.zh_sim_column_count())
    }


def column_texts() -> dict[str, str]:
    """Columns of every record and their meaning; the name ends with the unit."""
    return {name: text for name, text in _row().items() if name != "faults_high"}


@functools.cache
def signal_names() -> tuple[str, ...]:
    """The traced signals of the firmware (firmware/unit/signal_list.def), in their order."""
    names = map(_library().zh_sim_signal_name, itertools.count())
    return tuple(name.decode() for name in itertools.takewhile(lambda name: name, names))


@contextlib.contextmanager
def signal_hashes() -> Iterator[list[Hashes]]:
    """Inside, every run also hashes its traced signals; the list gets one entry per run.

    For one thread.
    """
    global _hashes
    _hashes = []
    try:
        yield _hashes
    finally:
        _hashes = None


def run(job: Job) -> Record:
    """Simulate a job; raise UserError, which names file and key, for an invalid one."""
    lib = _library()
    raw, keep = _raw_job(job)
    result = RawResult(struct_size=ctypes.sizeof(RawResult))
    check(lib.zh_sim_run(byref(raw), byref(result)))
    del keep  # the table has to live as long as the call
    return _record(lib, result, job.columns)


def run_batch(jobs: Sequence[Job]) -> list[Record]:
    """Simulate several runs at once, in this thread: the records of run(), in less CPU time.

    UserError when one of them is senseless; the text begins with its index and none runs.
    """
    lib = _library()
    made = [_raw_job(job) for job in jobs]
    raw = (RawJob * len(jobs))(*(job for job, _ in made))
    results = (RawResult * len(jobs))()
    for result in results:
        result.struct_size = ctypes.sizeof(RawResult)
    check(lib.zh_sim_run_batch(raw, results, len(jobs)))
    del made  # the tables have to live as long as the call
    return [
        _record(lib, RawResult.from_buffer_copy(result), job.columns)
        for result, job in zip(results, jobs, strict=True)
    ]


class _Memory:
    """The library's record as numpy sees it: no copy, freed with the last column in use."""

    def __init__(self, lib: ctypes.CDLL, result: RawResult) -> None:
        self._lib, self._result = lib, result
        self.__array_interface__ = {
            "version": 3,
            "typestr": np.dtype(np.float32).str,
            "shape": (result.columns, result.stride),
            "data": (ctypes.cast(result.data, c_void_p).value, False),
        }

    def __del__(self) -> None:
        self._lib.zh_sim_free(byref(self._result))


def _chosen(columns: Sequence[str]) -> list[str]:
    """Columns of the library that Job.columns asks for, in the library's order."""
    wanted = set(columns or _row())
    if unknown := wanted - set(_row()):
        raise UserError(f"Job: columns: {', '.join(sorted(unknown))}: unknown; see column_texts()")
    if "faults" in wanted:
        wanted.add("faults_high")
    return [name for name in _row() if name in wanted]


def _column_bits(columns: Sequence[str]) -> int:
    if not columns:
        return 0
    chosen = _chosen(columns)
    return sum(1 << k for k, name in enumerate(_row()) if name in chosen)


def _record(lib: ctypes.CDLL, result: RawResult, columns: Sequence[str] = ()) -> Record:
    if _hashes is not None:
        names = signal_names()
        _hashes.append(dict(zip(names, result.signal_hashes[: len(names)], strict=True)))
    data = np.asarray(_Memory(lib, result))[:, : result.rows]
    found = {name: data[k] for k, name in enumerate(_chosen(columns))}
    # All 32 bits in one number again: a float32 holds 24.
    if "faults" in found:
        found["faults"] = found["faults"] + found.pop("faults_high").astype(float) * 2.0**24
    return Record(
        columns=found,
        steps=result.steps,
        period_s=result.period_s,
        trip=Trip(result.trip),
        trip_s=result.trip_s if result.trip_s >= 0.0 else None,
        first_fault=result.first_fault,
        first_fault_s=result.first_fault_s if result.first_fault_s >= 0.0 else None,
        loop_ns_per_step=result.loop_ns_per_step,
        controller_ns_per_step=result.controller_ns_per_step,
        plant_ns_per_step=result.plant_ns_per_step,
        commissioned=commissioned(result.commissioning),
    )


def _raw_job(job: Job) -> tuple[RawJob, Any]:
    if not isinstance(job, Job):
        arguments.refuse("run", "job", job, "a Job")
    for name, highest, span in (
        ("decimate", 2**32 - 1, "1 .. 2^32 - 1"),
        ("max_steps", 2**64 - 1, "1 .. 2^64 - 1"),
        ("seed", 2**64 - 1, "1 .. 2^64 - 1"),
    ):
        if (value := getattr(job, name)) is not None:
            arguments.whole("Job", name, value, 1, highest, span)
    raw = RawJob(
        struct_size=ctypes.sizeof(RawJob),
        flags=_STOP_AT_TRIP * job.stop_at_trip
        | _TIME_SPLIT * job.time_split
        | _GUARD_RECORDED * job.guard_recorded
        | _HASH_SIGNALS * (_hashes is not None),
        decimate=job.decimate,
        seed=job.seed or 0,
        max_steps=job.max_steps or 0,
        **{name: arguments.path("Job", name, getattr(job, name)) for name in _FILES},
        **{name: override_lines(getattr(job, name), "Job", name) for name in _LINES},
        columns=_column_bits(job.columns),
    )
    gain = None
    if job.gain is not None:
        try:
            gain = np.ascontiguousarray(job.gain, dtype=np.float32)
        except (ValueError, TypeError) as error:
            raise UserError(f"Job: gain: {error}; give an array (entries, 4)") from None
        if gain.ndim != 2 or gain.shape[1] != 4:
            raise UserError(f"Job: gain: has shape {gain.shape}; give (entries, 4)")
        raw.gain = gain.ctypes.data_as(POINTER(c_float))
        raw.gain_entries = len(gain)
    return raw, gain
