"""Processor in the loop: binding of host_sim/pil.h with the emulator round it."""

from __future__ import annotations

import ctypes
import dataclasses
import os
import threading
from collections.abc import Callable
from ctypes import (
    POINTER,
    Structure,
    byref,
    c_char,
    c_char_p,
    c_double,
    c_int,
    c_uint32,
    c_uint64,
    c_void_p,
)
from dataclasses import dataclass, field
from enum import IntEnum
from fractions import Fraction
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from zerohertz import sim
from zerohertz.drive import State, check, library
from zerohertz.image.emulator import LINK, NS_PER_INSTRUCTION, emulator
from zerohertz.sim_structs import RawResult


class End(IntEnum):
    """How a run ended, numbers as in pil.h."""

    EQUAL = 0
    DIFFERS = 1
    LEFT = 2  # the image stopped by itself
    SILENT = 3


class Inject(IntEnum):
    """Defects the image can be told to have: hal/qemu_mps2/pil_protocol.h."""

    NONE = 0
    WILD_WRITE = 1
    NULL_WRITE = 2
    CODE_WRITE = 3
    STACK_OVERFLOW = 4
    DIVISION_BY_ZERO = 5
    UNDEFINED_INSTRUCTION = 6
    STUCK_CONTROL = 7
    DEAD_CONTROL = 8
    STUCK_BACKGROUND = 9
    TABLE_BIT = 10
    IMAGE_BIT = 11
    OVERRUN = 12
    OVERRUNS = 13
    EXECUTE_RAM = 14
    HANG = 15
    LIVE_CHANGE = 16  # no defect: a live change of the parameters in every round of the background
    TRACE = 17  # nor this: a trace of eight signals runs
    SKIP = 18  # one instruction of one period is not executed


@dataclass(frozen=True)
class Periods:
    """Every control period of a run, in order."""

    instructions: NDArray[np.int64]  # of the interrupt, entry to exit
    state: NDArray[np.uint32]  # State behind the period
    slot: NDArray[np.uint32]  # of the schedule for what runs slower than a period
    faults: NDArray[np.uint32]  # latched behind the period

    @property
    def running(self) -> NDArray[np.int64]:
        """Instructions of the periods in state RUN."""
        return self.instructions[self.state == State.RUN]


@dataclass(frozen=True)
class PilRun:
    """What one run on the emulated core left."""

    end: End
    exit_code: int  # of the image
    text: str  # what it printed: banner, and why it stopped
    periods: int  # compared with the SIL firmware
    run_periods: int  # of them in state RUN
    differing_bits: int  # in the first period that differs; 0: none does
    mean_instructions: float  # of the interrupt in state RUN; 0 without one
    worst_instructions: int  # of the interrupt in any state
    worst_latency_instructions: int  # from the timer's event to the interrupt's first statement
    late_periods: int
    stack_bytes: int
    stack_used_bytes: int
    gates_on: bool  # in the last period answered
    faults: int  # latched then
    warned: int  # every fault bit that ever stood
    loop_s: float
    difference: str  # period, signal and both words; empty when none
    each: Periods = field(repr=False, compare=False)
    record: sim.Record | None = field(default=None, repr=False, compare=False)
    # By file, what the drive said on its fieldbuses.
    bus_said: dict[str, bytes] = field(default_factory=dict, repr=False, compare=False)

    @property
    def periods_per_s(self) -> float:
        return self.periods / self.loop_s if self.loop_s > 0.0 else 0.0


class _Job(Structure):
    _fields_ = (
        ("struct_size", c_uint32),
        ("inject", c_uint32),
        ("inject_at", c_uint32),
        ("own_params", c_uint32),
        ("folder", c_char_p),
        ("inject_address", c_uint32),
        ("record", POINTER(RawResult)),
        ("words", c_char_p),
        ("bus", c_uint32),
    )


class _Result(Structure):
    _fields_ = (
        ("struct_size", c_uint32),
        ("end", c_uint32),
        ("periods", c_uint64),
        ("answered", c_uint64),
        ("period", c_void_p),
        ("owner", c_void_p),
        *(
            (name, c_uint32)
            for name in (
                *("clock_Hz", "worst_latency_ticks", "late_periods"),
                *("stack_bytes", "stack_used_bytes", "background_calls"),
                *("gates_on", "faults", "warned", "differing_bits"),
            )
        ),
        ("loop_s", c_double),
        ("difference", c_char * 160),
    )


def run(
    job: sim.Job,
    elf: Path,
    *,
    inject: Inject = Inject.NONE,
    inject_at: int = 0,
    inject_address: int | None = None,
    own_params: bool = False,
    machine: str = "mps2-an386",
    beside: Callable[[Path], None] | None = None,
    link_frames: bytes | None = b"",
    kept: tuple[int, bytes] | None = None,
    plugin: str | None = None,
    words: Path | None = None,
    bus_files: dict[str, bytes] | None = None,
) -> PilRun:
    """The image against the plant. UserError when it does not start or is of other sources.

    `beside` runs in a thread of its own meanwhile, given the socket of the image's host link;
    `link_frames` is what that link hears first (None: emulator.StepLine), `kept` what RAM
    holds from before, `plugin` an argument of the emulator (emulator.py). With `inject_address`
    (Inject.SKIP) the run also leaves its record; `state` and `faults` in it are the image's as
    well. `words` is a file for every signal of every period as the image said it.
    """
    lib = library()
    lib.zh_pil_run.restype = c_int
    raw, keep = sim._raw_job(job)
    result = _Result(struct_size=ctypes.sizeof(_Result))
    record = RawResult(struct_size=ctypes.sizeof(RawResult))
    with emulator(elf, machine, link_frames, kept, plugin, bus_files) as image:
        pil = _Job(
            struct_size=ctypes.sizeof(_Job),
            inject=inject,
            inject_at=inject_at,
            own_params=own_params,
            folder=os.fsencode(image.folder),
            inject_address=inject_address or 0,
            words=os.fsencode(words) if words is not None else None,
            bus=int(bus_files is not None),
        )
        if inject_address is not None:
            pil.record = ctypes.pointer(record)
        talker = threading.Thread(target=beside, args=(image.folder / LINK,)) if beside else None
        if talker is not None:
            talker.start()
        check(lib.zh_pil_run(byref(raw), byref(pil), byref(result)))
        if result.end in (End.DIFFERS, End.SILENT):
            image.process.kill()
        exit_code = image.wait()
        text = image.text
        bus_said = {file.name: file.read_bytes() for file in image.folder.glob("*_said")}
        if talker is not None:
            talker.join()
    del keep
    each = _periods(lib, result)
    ended = dataclasses.replace(_ended(result, each, exit_code, text), bus_said=bus_said)
    if inject_address is None:
        return ended
    return dataclasses.replace(ended, record=_record(record, each))


def _record(raw: RawResult, each: Periods) -> sim.Record:
    """The plant's record with the words of the image."""
    found = sim._record(sim._library(), raw)
    n = min(len(found.t_s), len(each.state))
    columns = {name: column[:n] for name, column in found.columns.items()}
    said = {name: getattr(each, name)[:n].astype(np.float32) for name in ("state", "faults")}
    return dataclasses.replace(found, columns=columns | said)


def _ended(result: _Result, each: Periods, exit_code: int, text: str) -> PilRun:
    running = each.running
    return PilRun(
        end=End(result.end),
        exit_code=exit_code,
        text=text,
        periods=result.periods,
        run_periods=len(running),
        differing_bits=result.differing_bits,
        mean_instructions=float(running.mean()) if len(running) else 0.0,
        worst_instructions=int(each.instructions.max(initial=0)),
        worst_latency_instructions=round(
            result.worst_latency_ticks * 1e9 / (result.clock_Hz * NS_PER_INSTRUCTION)
        ),
        late_periods=result.late_periods,
        stack_bytes=result.stack_bytes,
        stack_used_bytes=result.stack_used_bytes,
        gates_on=bool(result.gates_on),
        faults=result.faults,
        warned=result.warned,
        loop_s=result.loop_s,
        difference=result.difference.decode(),
        each=each,
    )


def _periods(lib: ctypes.CDLL, result: _Result) -> Periods:
    """The library's array, as ours. Exact: an instruction takes longer than a tick, so the tick at
    which one reads the timer says which one it was."""
    lib.zh_pil_free.restype = None
    words = np.zeros((0, 5), np.uint32)
    if result.answered:
        kind = ctypes.POINTER(c_uint32)
        raw = np.ctypeslib.as_array(ctypes.cast(result.period, kind), shape=(result.answered, 5))
        words = raw.copy()
    lib.zh_pil_free(byref(result))
    ticks = words[:, :2].astype(np.int64)
    ticks[:, 1] += (ticks[:, 1] < ticks[:, 0]) * 2**32
    per = Fraction(result.clock_Hz * NS_PER_INSTRUCTION, 10**9)  # ticks of an instruction
    number = -(-ticks * per.denominator // per.numerator)
    return Periods(number[:, 1] - number[:, 0], *(words[:, k] for k in (2, 3, 4)))
