"""Worst-case stack of a linked image, from its disassembly: call graph, frames, exception entries.

Every push and every subtraction from sp counts, whether or not they exclude one another, and a jump
into another function counts as a call: the bound is on the safe side. A call through a register has
to be known by name, a cycle is an error: neither has a bound.
"""

from __future__ import annotations

import re
import subprocess
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from zerohertz.errors import UserError

# Pushed by the core on exception entry: 8 words, 18 of the FPU, one to align (ARMv7-M, B1.5.7).
EXCEPTION_FRAME_BYTES = 4 * (8 + 18 + 1)

_FUNCTION = re.compile(r"^([0-9a-f]{8}) <([^>]+)>:$")
# The linker's way to a function that is too far off for a branch: its address follows.
_VENEER = re.compile(r"__(.+)_veneer")
_WORD = re.compile(r"\.word\t0x([0-9a-f]{8})")
_TARGET = re.compile(r"\b[0-9a-f]+ <([^>+]+)(\+0x[0-9a-f]+)?>")
_RANGE = re.compile(r"([rsd])(\d+)-[rsd](\d+)")


@dataclass
class Function:
    """What the disassembly says about one function."""

    name: str
    frame_bytes: int = 0
    calls: set[str] = field(default_factory=set)
    indirect: bool = False


def disassembly(elf: Path, objdump: str = "arm-none-eabi-objdump") -> str:
    """The image as text."""
    command = (objdump, "-d", "--no-show-raw-insn", str(elf))
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def functions(text: str) -> dict[str, Function]:
    """All functions of a disassembly made with --no-show-raw-insn."""
    found: dict[str, Function] = {}
    names: dict[int, str] = {}
    veneers: dict[str, int] = {}
    current: Function | None = None
    for line in text.splitlines():
        if head := _FUNCTION.match(line):
            current = found.setdefault(head[2], Function(head[2]))
            names[int(head[1], 16)] = head[2]
        elif current is not None and _VENEER.fullmatch(current.name):
            if word := _WORD.search(line):
                veneers.setdefault(current.name, int(word[1], 16) & ~1)
        elif current is not None and "\t" in line:
            _, _, code = line.partition(":\t")
            mnemonic, _, operands = code.partition("\t")
            _read(current, mnemonic.strip(), operands.split("@")[0].split(";")[0].strip())
    for veneer, address in veneers.items():
        found[veneer].calls.add(names.get(address, f"0x{address:08x}"))
    return found


_CONDITION = "eq|ne|cs|cc|hs|lo|mi|pl|vs|vc|hi|ls|ge|lt|gt|le"
# Mnemonics, with or without the condition of an IT block.
_PUSH = re.compile(rf"(v?push)({_CONDITION})?")
_STORE_MULTIPLE = re.compile(rf"(v?stmdb|v?stmfd)({_CONDITION})?")
_STORE = re.compile(rf"(strd?)({_CONDITION})?")
_SUBTRACT = re.compile(rf"(subw?)({_CONDITION})?")
_CALL = re.compile(rf"(blx?|bx)({_CONDITION})?")
_JUMP = re.compile(rf"b({_CONDITION})?|cbz|cbnz")
# What gives stack back, or only looks at it.
_HARMLESS = re.compile(
    rf"(v?pop|v?ldm(ia|fd)?|adds?|addw|mov|ldrd?|v?ldr|cmp|mrs|msr|v?str|strd?|strb|strh)({_CONDITION})?"
)


def _read(function: Function, mnemonic: str, operands: str) -> None:
    base = mnemonic.split(".")[0]
    taken = _bytes_taken(function.name, base, operands)
    if taken is not None:
        function.frame_bytes += taken
    elif _CALL.fullmatch(base) or _JUMP.fullmatch(base):
        _follow(function, base, operands)
    elif re.match(r"(pc|sp)\b(?!\])", operands) and not _HARMLESS.fullmatch(base):
        raise UserError(f"{function.name}: {mnemonic} {operands}: not understood; no bound exists")
    elif operands.startswith("pc") and base.startswith("mov"):
        function.indirect = True


def _bytes_taken(name: str, base: str, operands: str) -> int | None:
    """What an instruction of function `name` takes from the stack; None for one that does not."""
    if _PUSH.fullmatch(base) or (_STORE_MULTIPLE.fullmatch(base) and operands.startswith("sp!")):
        return _register_bytes(operands)
    if _SUBTRACT.fullmatch(base) and operands.startswith("sp"):
        return _immediate(name, operands)
    if _STORE.fullmatch(base) and (pre := re.search(r"\[sp, #-(\d+)\]!", operands)):
        return int(pre[1])
    return None


def _follow(function: Function, base: str, operands: str) -> None:
    if target := _TARGET.search(operands):
        if target[1] != function.name:
            function.calls.add(target[1])
        elif base.startswith("bl") and target[2] is None:
            function.calls.add(function.name)
    elif operands != "lr":
        function.indirect = True


def _register_bytes(operands: str) -> int:
    names = operands[operands.index("{") + 1 : operands.index("}")]
    total = 0
    for name in names.split(","):
        span = _RANGE.fullmatch(name.strip())
        count = int(span[3]) - int(span[2]) + 1 if span else 1
        total += count * (8 if name.strip().startswith("d") else 4)
    return total


def _immediate(name: str, operands: str) -> int:
    value = re.search(r"#(\d+)", operands)
    if value is None:
        raise UserError(f"{name}: takes a stack frame whose size is not known; no bound exists")
    return int(value[1])


def depth(
    graph: Mapping[str, Function],
    root: str,
    known: Mapping[str, tuple[str, ...]],
    recursive: frozenset[str] = frozenset(),
    path: tuple[str, ...] = (),
) -> int:
    """Bytes from the entry of `root` down. `known`: targets of calls through a register, by caller;
    `recursive`: functions whose calls of themselves are left out. UserError for any other cycle."""
    if root not in graph:
        raise UserError(f"{root}: is not in the image; its stack is not known")
    if root in path:
        cycle = " -> ".join((*path[path.index(root) :], root))
        raise UserError(f"{root}: recursion, {cycle}; no bound exists")
    function = graph[root]
    name = root.split(".")[0]  # without what the compiler appends to a clone
    if function.indirect and name not in known:
        raise UserError(f"{root}: calls through a register; name the targets")
    calls = function.calls | set(known.get(name, ()))
    if root in recursive:
        calls -= {root}
    below = (depth(graph, call, known, recursive, (*path, root)) for call in calls)
    return function.frame_bytes + max(below, default=0)
