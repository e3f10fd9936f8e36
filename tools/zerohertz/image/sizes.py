"""What a linked image takes: flash, RAM, stack, and symbols that must not be in it."""

from __future__ import annotations

import re
import subprocess
from dataclasses import dataclass
from pathlib import Path

from zerohertz.errors import UserError
from zerohertz.image import stack
from zerohertz.image.ports import ports

FLASH_GOAL_BYTES = 80 * 1024  # the linker's region is the limit; growth has to be committed
TABLE_MAX_BYTES = 32 * 1024
RAM_MAX_BYTES = 16 * 1024  # without the memory of trace and flights, a port's choice

# Roots of the call graph: start-up with main, then the interrupts of the port, then a fault.
_START, _FAULT = "cm_start", "cm_fault_c"
FAULT_STACK_BYTES = 512  # hal/cortex_m/cm_fault.c


# The C library's heap, double precision of the compiler's run time, the mathematics library.
_FORBIDDEN = re.compile(
    r"_?(malloc|calloc|realloc|free|sbrk)(_r)?"
    r"|__aeabi_(d|[fil]+2d|ul2d)\w*|__\w*df\w*"
    r"|(a?(sin|cos|tan)h?|atan2|exp2?|log(2|10)?|pow|hypot|cbrt|fma|fmod|floor|ceil|round|sqrt)f?"
    r"|\w*printf"
)


@dataclass(frozen=True)
class Sizes:
    """Bytes of one image."""

    flash_bytes: int  # with the gain table
    table_bytes: int
    ram_bytes: int  # data, zeroed data and the stack with its guard; without trace_bytes
    trace_bytes: int  # memory that the port lends for the trace and for flights
    stack_bytes: int  # reserved
    stack_bound_bytes: int  # worst case of the call graph


def measure(elf: Path, port: str) -> Sizes:
    """Sizes of an image of hal/<port>; UserError when its stack has no bound."""
    sections = _sections(elf)
    symbols = _symbols(elf)
    table = re.compile(r"gain_entry(\..*)?")
    tables = [size for name, (_, size) in symbols.items() if table.fullmatch(name)]
    stack_bytes = symbols["cm_stack_top"][0] - symbols["cm_stack_bottom"][0]
    lent = ("trace_memory", "flight_memory")
    trace_bytes = sum(symbols.get(name, (0, 0))[1] for name in lent)
    ram = sum(sections.get(name, 0) for name in (".stack", ".data", ".bss", ".noinit"))
    return Sizes(
        flash_bytes=elf.with_suffix(".bin").stat().st_size,
        table_bytes=sum(tables),
        ram_bytes=ram - trace_bytes,
        trace_bytes=trace_bytes,
        stack_bytes=stack_bytes,
        stack_bound_bytes=stack_bound(elf, port),
    )


def stack_bound(elf: Path, port: str) -> int:
    """The main program, on top of it every interrupt once, at the very end the frame of a fault.

    A fault goes on with a stack of its own: UserError when that one does not suffice.
    """
    graph = stack.functions(stack.disassembly(elf))
    known = ports()[port]
    meant = frozenset(name for name in graph if re.fullmatch(known.recursive, name))

    def below(root: str) -> int:
        return stack.depth(graph, root, known.indirect_calls, meant)

    fault = below(_FAULT) + stack.EXCEPTION_FRAME_BYTES
    if fault > FAULT_STACK_BYTES:
        raise UserError(f"{port}: port_halt: takes {fault} bytes of a fault's {FAULT_STACK_BYTES}")
    frames = stack.EXCEPTION_FRAME_BYTES * (len(known.interrupts) + 1)
    return below(_START) + sum(map(below, known.interrupts)) + frames


def forbidden_symbols(elf: Path) -> list[str]:
    """Heap, double precision, mathematics library, printing: none of them belongs into an image."""
    return sorted(name for name in _symbols(elf) if _FORBIDDEN.fullmatch(name))


def _symbols(elf: Path) -> dict[str, tuple[int, int]]:
    """Name -> address and size (0 where the symbol has none)."""
    found = {}
    for line in _run("arm-none-eabi-nm", "-S", "--defined-only", elf).splitlines():
        words = line.split()
        if len(words) >= 3:
            size = int(words[1], 16) if len(words) == 4 else 0
            found[words[-1]] = (int(words[0], 16), size)
    return found


def _sections(elf: Path) -> dict[str, int]:
    lines = _run("arm-none-eabi-size", "-A", elf).splitlines()
    rows = [line.split() for line in lines if line.startswith(".")]
    return {row[0]: int(row[1]) for row in rows}


def _run(*command: str | Path) -> str:
    words = [str(word) for word in command]
    return subprocess.run(words, check=True, capture_output=True, text=True).stdout
