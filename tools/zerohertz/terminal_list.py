"""Parameters and faults of the terminals (firmware/terminals/*.def), as data."""

from __future__ import annotations

import functools
import re
from dataclasses import dataclass

from zerohertz.paths import ROOT

FOLDER = ROOT / "firmware" / "terminals"
_STRINGS = r'((?:"[^"]*"\s*)+)'
_NUMBER = re.compile(
    rf"^TERMINAL_F\((\w+), {_STRINGS}, ([^,]+), ([^,]+), ([^,]+),\s*{_STRINGS}\)", re.MULTILINE
)
_CHOICE = re.compile(rf"^TERMINAL_E\((\w+), \d+, {_STRINGS},\s*{_STRINGS}\)", re.MULTILINE)
_FAULT = re.compile(
    rf"^TERMINAL_FAULT\((\w+), (\d+), (\w+),\s*{_STRINGS},\s*{_STRINGS},\s*{_STRINGS}\)",
    re.MULTILINE,
)


@dataclass(frozen=True)
class TerminalParameter:
    """One parameter; numbers as printed in the list."""

    name: str
    unit: str
    minimum: str
    maximum: str
    default: str
    text: str
    choices: tuple[str, ...] = ()


@dataclass(frozen=True)
class TerminalFaultEntry:
    """One fault of the terminals, and what the drive does."""

    name: str
    bit: int
    reaction: str  # WARN, STOP or OFF
    text: str
    cause: str
    remedy: str


@functools.cache
def terminal_parameters() -> dict[str, TerminalParameter]:
    """Name -> parameter, in the list's order."""
    text = (FOLDER / "terminal_params.def").read_text(encoding="utf-8")
    found: list[tuple[int, TerminalParameter]] = []
    for m in _NUMBER.finditer(text):
        least, most, default = (number.strip().rstrip("f") for number in m.groups()[2:5])
        entry = TerminalParameter(m[1], _joined(m[2]), least, most, default, _joined(m[6]))
        found.append((m.start(), entry))
    for m in _CHOICE.finditer(text):
        names = tuple(_joined(m[2]).split(", "))
        entry = TerminalParameter(m[1], "", "0", str(len(names) - 1), "0", _joined(m[3]), names)
        found.append((m.start(), entry))
    return {entry.name: entry for _, entry in sorted(found, key=lambda pair: pair[0])}


def terminal_faults() -> list[TerminalFaultEntry]:
    """In the list's order."""
    text = (FOLDER / "terminal_faults.def").read_text(encoding="utf-8")
    return [
        TerminalFaultEntry(m[1], int(m[2]), m[3], _joined(m[4]), _joined(m[5]), _joined(m[6]))
        for m in _FAULT.finditer(text)
    ]


def _joined(strings: str) -> str:
    """Adjacent C strings are one."""
    return "".join(re.findall(r'"([^"]*)"', strings))
