"""tools/docs/parameters.md from param_list.def: the same list that the firmware is built from."""

from __future__ import annotations

import re
from dataclasses import dataclass

from zerohertz.errors import UserError
from zerohertz.paths import ROOT

LIST = ROOT / "firmware" / "parameters" / "param_list.def"
PAGE = ROOT / "tools" / "docs" / "parameters.md"

_STRINGS = r'((?:"[^"]*"\s*)+)'
_ENTRY = re.compile(
    r"^PARAM_([FU])\(\s*(\w+),\s*"
    + _STRINGS
    + r",\s*([^,]+),\s*([^,]+),\s*([^,]+),\s*(\w+),\s*"
    + _STRINGS
    + r"\)\s*$",
    re.MULTILINE,
)
_SECTION = re.compile(r"^/\*(.*?)\*/", re.MULTILINE | re.DOTALL)
_HEAD = """\
# Parameters

Generated from `firmware/parameters/param_list.def` by `tools/zh params --page`: do not edit.

Access: **RUN** at any time, **READY** with the gates off, **PROTECTED** with the gates off and the
drive unlocked (`firmware/host/access.h`). Whole: integers only. Ranges include their ends; a
stored value outside today's range falls back to the default, and the store says so
(`firmware/host/param_store.h`).
"""
_COLUMNS = """\
| name | unit | minimum | maximum | default | access | what |
|---|---|---|---|---|---|---|"""


@dataclass(frozen=True)
class Entry:
    """One line of the list, as printed there."""

    name: str
    unit: str
    minimum: str
    maximum: str
    default: str
    access: str
    text: str
    whole: bool


def entries(text: str) -> dict[str, list[Entry]]:
    """Section -> parameters in the list's order; UserError for a line that is not understood."""
    sections = [(match.start(), " ".join(match[1].split())) for match in _SECTION.finditer(text)]
    found: dict[str, list[Entry]] = {}
    for match in _ENTRY.finditer(text):
        title = [name for start, name in sections if start < match.start()][-1]
        kind, name, unit, *numbers, access, words = match.groups()
        entry = Entry(
            name,
            _joined(unit),
            *(number.strip().rstrip("fu") for number in numbers),
            access,
            _joined(words),
            kind == "U",
        )
        found.setdefault(title, []).append(entry)
    listed = len(re.findall(r"^PARAM_", text, re.MULTILINE))
    read = sum(len(group) for group in found.values())
    if read != listed or read == 0:
        raise UserError(f"{LIST.name}: {listed} parameters, {read} understood; mend the rest")
    return found


def _joined(strings: str) -> str:
    """Adjacent C strings are one."""
    return "".join(re.findall(r'"([^"]*)"', strings))


def page_text(text: str | None = None) -> str:
    """The page for this list, by default the firmware's."""
    groups = entries(LIST.read_text(encoding="utf-8") if text is None else text)
    parts = [_HEAD]
    for title, group in groups.items():
        rows = "\n".join(_row(entry) for entry in group)
        parts.append(f"## {title.split(':')[0].rstrip('.')}\n\n{title}\n\n{_COLUMNS}\n{rows}\n")
    return "\n".join(parts)


def _row(entry: Entry) -> str:
    unit = entry.unit or ("whole" if entry.whole else "")
    if entry.whole and entry.unit:
        unit += ", whole"
    limits = f"{entry.minimum} | {entry.maximum} | {entry.default}"
    text = entry.text.replace("|", "\\|")
    return f"| `{entry.name}` | {unit} | {limits} | {entry.access} | {text} |"


def stale() -> bool:
    """Whether the committed page is not that of the list."""
    return not PAGE.is_file() or PAGE.read_text(encoding="utf-8") != page_text()


def write() -> None:
    """The page where it belongs."""
    PAGE.write_text(page_text(), encoding="utf-8")
