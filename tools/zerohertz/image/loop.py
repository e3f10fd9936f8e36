"""Processor in the loop: binding of host_sim/pil.h with the emulator round it."""

from __future__ import annotations

import ctypes
import os
import threading
from collections.abc import Callable
from ctypes import Structure, byref, c_char, c_char_p, c_double, c_int, c_uint32, c_uint64
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path

from zerohertz import sim
from zerohertz.drive import check, library
from zerohertz.image.emulator import LINK, NS_PER_INSTRUCTION, emulator


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


@dataclass(frozen=True)
class PilRun:
    """What one run on the emulated core left."""

    end: End
    exit_code: int  # of the image
    text: str  # what it printed: banner, and why it stopped
    periods: int  # compared with the SIL firmware
    run_periods: int  # of them in state RUN
    differing_bits: int  # in the first period that differs; 0: none does
    mean_instructions: float  # of a control period in state RUN; 0 without one
    worst_instructions: int  # of all control periods
    worst_latency_instructions: int  # from the timer's event to the interrupt's first statement
    late_periods: int
    stack_bytes: int
    stack_used_bytes: int
    gates_on: bool  # in the last period answered
    faults: int  # latched then
    warned: int  # every fault bit that ever stood
    loop_s: float
    difference: str  # period, signal and both words; empty when none

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
    )


class _Result(Structure):
    _fields_ = (
        ("struct_size", c_uint32),
        ("end", c_uint32),
        ("periods", c_uint64),
        ("run_periods", c_uint64),
        ("run_ticks", c_double),
        *(
            (name, c_uint32)
            for name in (
                *("clock_Hz", "worst_ticks", "worst_latency_ticks", "late_periods"),
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
    own_params: bool = False,
    machine: str = "mps2-an386",
    beside: Callable[[Path], None] | None = None,
    link_frames: bytes = b"",
    kept: tuple[int, bytes] | None = None,
) -> PilRun:
    """The image against the plant. UserError when it does not start or is of other sources.

    `beside` runs in a thread of its own meanwhile, given the socket of the image's host link;
    `link_frames` is what that link hears first, `kept` what RAM holds from before (emulator.py).
    """
    lib = library()
    lib.zh_pil_run.restype = c_int
    raw, keep = sim._raw_job(job)
    result = _Result(struct_size=ctypes.sizeof(_Result))
    with emulator(elf, machine, link_frames, kept) as image:
        pil = _Job(
            struct_size=ctypes.sizeof(_Job),
            inject=inject,
            inject_at=inject_at,
            own_params=own_params,
            folder=os.fsencode(image.folder),
        )
        talker = threading.Thread(target=beside, args=(image.folder / LINK,)) if beside else None
        if talker is not None:
            talker.start()
        check(lib.zh_pil_run(byref(raw), byref(pil), byref(result)))
        if result.end in (End.DIFFERS, End.SILENT):
            image.process.kill()
        exit_code = image.wait()
        text = image.text
        if talker is not None:
            talker.join()
    del keep

    def instructions(ticks: float) -> float:
        return ticks * 1e9 / (result.clock_Hz * NS_PER_INSTRUCTION)

    return PilRun(
        end=End(result.end),
        exit_code=exit_code,
        text=text,
        periods=result.periods,
        run_periods=result.run_periods,
        differing_bits=result.differing_bits,
        mean_instructions=instructions(result.run_ticks / max(result.run_periods, 1)),
        worst_instructions=round(instructions(result.worst_ticks)),
        worst_latency_instructions=round(instructions(result.worst_latency_ticks)),
        late_periods=result.late_periods,
        stack_bytes=result.stack_bytes,
        stack_used_bytes=result.stack_used_bytes,
        gates_on=bool(result.gates_on),
        faults=result.faults,
        warned=result.warned,
        loop_s=result.loop_s,
        difference=result.difference.decode(),
    )
