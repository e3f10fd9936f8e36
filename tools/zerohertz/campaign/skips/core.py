"""The emulated core: what it executes in a control period, and a run that leaves some of it out."""

from __future__ import annotations

import dataclasses
import functools
from pathlib import Path

from zerohertz import sim
from zerohertz.build import build_image
from zerohertz.image import histogram, loop

PRESET = "qemu_mps2"


@functools.cache
def image() -> Path:
    return build_image(PRESET)


@dataclasses.dataclass(frozen=True)
class Instruction:
    """One that a period executes."""

    address: int
    function: str  # innermost, of a .c file


def executed(job: sim.Job, period: int) -> list[Instruction]:
    """Every instruction between begin and end of the control interrupt's own work, by address."""
    found = histogram.executed(job, PRESET, period)
    names = histogram.functions_of(image(), found)
    return [Instruction(address, names[address][0]) for address in sorted(found)]


def run_skipping(job: sim.Job, period: int, address: int) -> loop.PilRun:
    """In that period the instruction is not executed; what it executes twice it skips twice."""
    return loop.run(job, image(), inject=loop.Inject.SKIP, inject_at=period, inject_address=address)
