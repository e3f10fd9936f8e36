"""Cycles of a Cortex-M4F, estimated from what was executed.

The model is the timing tables of ARM's Cortex-M4 reference manual (r0p1, sections 3.3 and 7.2.3),
see
`MODEL`. It leaves out what a manual cannot know (flash wait states, bus contention) and counts
every load for itself, where the core would overlap neighbouring ones.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

MODEL_NAME = "Cortex-M4 reference manual r0p1, no wait states"
MODEL = (
    ("instruction, when nothing below says otherwise", "1"),
    ("division and square root of floats", "14"),
    ("division of integers", "12"),
    ("multiply-add of floats", "3"),
    ("load of one register; store of one float register", "2"),
    ("load or store of n registers, push, pop", "1 + n"),
    ("branch taken, in addition", "2"),
    ("result of float arithmetic used by the next instruction, in addition", "1"),
    ("exception, with the float registers saved and restored", "56"),
)
# Entry 12, exit 10, the float registers saved (lazily) and restored 17 each.
EXCEPTION_CYCLES = 56
TAKEN_CYCLES = 2
CLOCK_HZ = 168e6  # of the STM32F405
PERIOD_S = 200e-6

_LINE = re.compile(r"^ +([0-9a-f]+):\t(\S+)(?:\t(.*))?$", re.MULTILINE)
_CONDITION = "eq|ne|cs|cc|hs|lo|mi|pl|vs|vc|hi|ls|ge|lt|gt|le"
# First match counts; None: 1 + number of registers.
_COSTS: tuple[tuple[re.Pattern[str], int | None], ...] = tuple(
    (re.compile(rf"(?:{pattern})(?:{_CONDITION})?"), cost)
    for pattern, cost in (
        ("vdiv|vsqrt", 14),
        ("[us]div", 12),
        ("vn?ml[as]|vfn?m[as]", 3),
        ("v?ldm\\w*|v?stm\\w*|v?push|v?pop", None),
        ("ldrd|strd", 3),
        ("ldr\\w*|vldr|vstr|tb[bh]", 2),
    )
)
_ARITHMETIC = re.compile(r"v(add|sub|mul|div|sqrt|cvt|nmul|n?ml[as]|fn?m[as])")
_FLOAT = re.compile(r"\bs(\d+)\b")


@dataclass(frozen=True)
class Instruction:
    """One line of the disassembly."""

    mnemonic: str
    operands: str

    @property
    def cycles(self) -> int:
        """When the next instruction is not the target of a branch and needs no result of it."""
        name = self.mnemonic.split(".")[0]
        for pattern, cost in _COSTS:
            if pattern.fullmatch(name):
                return 1 + _registers(self.operands) if cost is None else cost
        return 1

    @property
    def result(self) -> str | None:
        """The float register that arithmetic writes."""
        if not _ARITHMETIC.match(self.mnemonic):
            return None
        first = _FLOAT.match(self.operands)
        return first[0] if first else None

    def reads(self, register: str) -> bool:
        """Whether a float register is a source here: any operand but a pure destination."""
        name = self.mnemonic.split(".")[0]
        operands = self.operands.split(",")
        keeps = re.match(r"vstr|vcmp|vn?ml|vfn?m|vpush|vstm", name)
        sources = operands if keeps else operands[1:]
        return any(found[0] == register for o in sources for found in _FLOAT.finditer(o))


def _registers(operands: str) -> int:
    """Number of registers in {...}, ranges included."""
    total = 0
    for name in operands[operands.index("{") + 1 : operands.index("}")].split(","):
        span = re.fullmatch(r"\s*[rsd](\d+)-[rsd](\d+)\s*", name)
        count = int(span[2]) - int(span[1]) + 1 if span else 1
        total += 2 * count if name.strip().startswith("d") else count
    return total


def instructions(disassembly: str) -> dict[int, Instruction]:
    """Address -> instruction, of a disassembly made with --no-show-raw-insn."""
    found = {}
    for address, mnemonic, operands in _LINE.findall(disassembly):
        plain = operands.split("@")[0].split(";")[0].strip()
        found[int(address, 16)] = Instruction(mnemonic, plain)
    return found


def cycles(
    code: Mapping[int, Instruction], counted: Mapping[int, tuple[float, float]]
) -> dict[int, float]:
    """Address -> cycles, from how often it was executed and went elsewhere than to the next."""
    spent = {}
    previous: Instruction | None = None
    for address in sorted(code):
        instruction = code[address]
        executed, left = counted.get(address, (0.0, 0.0))
        if executed:
            cost = instruction.cycles
            if previous is not None and previous.result and instruction.reads(previous.result):
                cost += 1
            spent[address] = executed * cost + left * TAKEN_CYCLES
        previous = instruction
    return spent
