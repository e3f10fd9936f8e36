"""tools/docs/faults.md from fault_list.def: the same list that the firmware is built from."""

from __future__ import annotations

import re
from dataclasses import dataclass

from zerohertz.errors import UserError
from zerohertz.paths import ROOT

LIST = ROOT / "firmware" / "sequence" / "fault_list.def"
PAGE = ROOT / "tools" / "docs" / "faults.md"

_STRINGS = r'((?:"[^"]*"\s*)+)'
_ENTRY = re.compile(
    r"^FAULT\(\s*(\w+),\s*(\d+),\s*(\w+),\s*" + r",\s*".join([_STRINGS] * 3) + r"\)\s*$",
    re.MULTILINE,
)
_REACTIONS = {
    "WARN": "reported only",
    "DERATE": "reported; the drive runs with less current, or more slowly, than asked",
    "RAMP_DOWN": "speed down on a ramp, then gates off",
    "GATES_OFF": "gates off at once",
}
_HEAD = """\
# Faults

Generated from `firmware/sequence/fault_list.def` by `tools/zh params --page`: do not edit.

A fault is a bit. It is latched until a reset (rising edge of the reset command) after its cause is
gone. The run command is then level-triggered: it must drop and rise again before the drive starts.
Bits are append-only.

| reaction | what the drive does |
|---|---|
"""
_COLUMNS = (
    "\n| bit | fault | reaction | what | likely cause | remedy |\n|---|---|---|---|---|---|\n"
)


@dataclass(frozen=True)
class Entry:
    """One fault of the list."""

    name: str
    bit: int
    reaction: str
    text: str
    cause: str
    remedy: str


def entries(text: str | None = None) -> list[Entry]:
    """Faults in the list's order; UserError for a line that is not understood."""
    text = LIST.read_text(encoding="utf-8") if text is None else text
    found = [
        Entry(name, int(bit), reaction, *(_joined(words) for words in rest))
        for name, bit, reaction, *rest in _ENTRY.findall(text)
    ]
    listed = len(re.findall(r"^FAULT\(", text, re.MULTILINE))
    if len(found) != listed or not found:
        raise UserError(f"{LIST.name}: {listed} faults, {len(found)} understood; mend the rest")
    return found


def _joined(strings: str) -> str:
    """Adjacent C strings are one."""
    return "".join(re.findall(r'"([^"]*)"', strings)).replace("|", "\\|")


def page_text(text: str | None = None) -> str:
    """The page for this list, by default the firmware's."""
    reactions = "".join(f"| {name} | {what} |\n" for name, what in _REACTIONS.items())
    rows = "".join(
        f"| {e.bit} | `{e.name}` | {e.reaction} | {e.text} | {e.cause} | {e.remedy} |\n"
        for e in entries(text)
    )
    return _HEAD + reactions + _COLUMNS + rows


def stale() -> bool:
    """Whether the committed page is not that of the list."""
    return not PAGE.is_file() or PAGE.read_text(encoding="utf-8") != page_text()


def write() -> None:
    """The page where it belongs."""
    PAGE.write_text(page_text(), encoding="utf-8")
