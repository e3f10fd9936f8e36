"""The parameter list of the firmware (firmware/parameters/*.def), as data.

The same text that the firmware is built from, with the list of the estimator in use, if it has one.
Python's standard library alone: the build reads it.
"""

from __future__ import annotations

import functools
import math
import os
import re
import struct
from dataclasses import dataclass
from pathlib import Path

from zerohertz.build import ESTIMATOR, OWN_LIST
from zerohertz.errors import UserError
from zerohertz.paths import ROOT

FOLDER = ROOT / "firmware" / "parameters"
LIST = FOLDER / "param_list.def"
FIELDBUS = "FIELDBUS"  # the group that an image has with ZH_FIELDBUS alone; the last
# What the values of an image depend on.
FILES = (LIST, FOLDER / "param_fieldbus.def", FOLDER / "param_choices.def")

Value = float | int

_STRINGS = r'((?:"[^"]*"\s*)+)'
_NUMBERS = r"([^,()]+),\s*([^,()]+),\s*([^,()]+)"
_NUMBER_ENTRY = re.compile(
    rf"^PARAM_([FU])\(\s*(\w+),\s*(\w+),\s*{_STRINGS},\s*{_NUMBERS},\s*(\w+),\s*{_STRINGS}\)\s*$",
    re.MULTILINE,
)
_CHOICE_ENTRY = re.compile(
    rf"^PARAM_E\(\s*(\w+),\s*(\w+),\s*(\w+),\s*(\d+)u,\s*(\w+),\s*{_STRINGS}\)\s*$", re.MULTILINE
)
_GROUP = re.compile(rf"^PARAM_GROUP\(\s*(\w+),\s*{_STRINGS},\s*{_STRINGS}\)\s*$", re.MULTILINE)
_CHOICES = re.compile(r"^PARAM_CHOICES\(\s*(\w+),\s*([^)]*)\)\s*$", re.MULTILINE)
_FORMER = re.compile(
    r"^PARAM_(RENAMED|CONSTANT|DROPPED)\(\s*(\w+),\s*([^)]*?)\s*\)\s*$", re.MULTILINE
)


@dataclass(frozen=True)
class Entry:
    """One parameter; numbers as printed in the list."""

    name: str
    group: str
    unit: str
    minimum: str
    maximum: str
    default: str
    access: str
    text: str
    whole: bool
    choices: tuple[str, ...] = ()

    @property
    def initial(self) -> Value:
        return int(self.default) if self.whole else float(self.default)

    @property
    def lowest(self) -> float:
        return float32(float(self.minimum))

    @property
    def highest(self) -> float:
        return float32(float(self.maximum))


@dataclass(frozen=True)
class Former:
    """What became of a parameter that an earlier list had."""

    now: str | None  # its name of today
    value: float | None  # the constant in its place
    text: str  # for a reader


def entries(fieldbus: bool = True, estimator: str | None = None) -> dict[str, Entry]:
    """Name -> parameter, in the list's order; the host has those of the fieldbus.

    estimator: the folder of the one whose list is at the end; by default the one in use.
    """
    texts = [_read("param_list")]
    if own := own_list(estimator):
        texts.append(own.read_text(encoding="utf-8"))
    if fieldbus:
        texts.append(_read("param_fieldbus"))
    return _entries(tuple(texts), _read("param_choices"), own)


def own_list(estimator: str | None = None) -> Path | None:
    """The estimator's own parameters, if it has some."""
    folder = os.environ.get(ESTIMATOR) if estimator is None else estimator
    file = Path(folder or "", OWN_LIST)
    return file if folder and file.is_file() else None


@functools.cache
def _entries(texts: tuple[str, ...], choices: str, own: Path | None) -> dict[str, Entry]:
    found: dict[str, Entry] = {}
    for text in texts:
        where = own if own is not None and text is texts[1] else LIST
        for entry in parse(text, _choice_lists(choices), where):
            if entry.name in found:
                raise UserError(f"{where}: {entry.name}: there is one already; take another name")
            found[entry.name] = entry
    return found


def groups() -> dict[str, tuple[str, str]]:
    """Group of the list -> its name and text, in order."""
    return {m[1]: (_joined(m[2]), _joined(m[3])) for m in _GROUP.finditer(_read("param_groups"))}


def _choice_lists(text: str) -> dict[str, tuple[str, ...]]:
    """List of choices -> names of the values 0, 1, ..."""
    return {m[1]: tuple(re.findall(r'"([^"]*)"', m[2])) for m in _CHOICES.finditer(text)}


def former() -> dict[str, Former]:
    """Name of a former list -> what applies now."""
    found = {}
    for kind, name, rest in _FORMER.findall(_read("param_former")):
        if kind == "RENAMED":
            found[name] = Former(rest, None, f"is called {rest} now")
        elif kind == "CONSTANT":
            number = rest.removesuffix("f")
            found[name] = Former(None, float(number), f"is a constant now, {number}")
        else:
            found[name] = Former(None, None, f"is derived now: {_joined(rest)}")
    return found


def defaults() -> dict[str, Value]:
    """Name -> default of every firmware parameter."""
    return {name: entry.initial for name, entry in entries().items()}


def parse(text: str, choices: dict[str, tuple[str, ...]], where: Path = LIST) -> list[Entry]:
    """Parameters in the list's order; UserError for a line that is not understood."""
    found: list[tuple[int, Entry]] = []
    for match in _NUMBER_ENTRY.finditer(text):
        kind, group, name, unit, *numbers, access, words = match.groups()
        least, most, default = (number.strip().rstrip("fu") for number in numbers)
        entry = Entry(
            *(name, group, _joined(unit), least, most, default, access, _joined(words), kind == "U")
        )
        _refuse_numbers(entry, f"{where}:{_line(text, match.start())}: {name}")
        found.append((match.start(), entry))
    for match in _CHOICE_ENTRY.finditer(text):
        group, name, chosen, default, access, words = match.groups()
        names = choices.get(chosen, ())
        most = str(len(names) - 1)
        entry = Entry(name, group, "", "0", most, default, access, _joined(words), True, names)
        found.append((match.start(), entry))
    listed = [match.start() for match in re.finditer(r"^PARAM_[FUE]\(", text, re.MULTILINE)]
    if len(found) != len(listed) or not listed:
        understood = {start for start, _ in found}
        first = next((start for start in listed if start not in understood), 0)
        said = f"{len(listed)} parameters, {len(found)} understood; mend the rest"
        raise UserError(f"{where.name if where == LIST else where}:{_line(text, first)}: {said}")
    return [entry for _, entry in sorted(found, key=lambda pair: pair[0])]


def _line(text: str, at: int) -> int:
    return 1 + text.count("\n", 0, at)


def _refuse_numbers(entry: Entry, where: str) -> None:
    """UserError unless minimum <= default <= maximum."""
    numbers = (entry.minimum, entry.default, entry.maximum)
    try:
        least, default, most = (float32(float(number)) for number in numbers)
    except ValueError:
        raise UserError(f"{where}: {', '.join(numbers)}: one of them is no number") from None
    if not least <= default <= most:
        said = f"default {entry.default} is not within {entry.minimum} to {entry.maximum}"
        raise UserError(f"{where}: {said}")


def float32(value: float) -> float:
    """The nearest float32, infinity beyond the largest."""
    try:
        return struct.unpack("<f", struct.pack("<f", value))[0]
    except OverflowError:
        return math.copysign(math.inf, value)


def no_such(name: str) -> str:
    """What to say of a name that is no parameter."""
    if name in former():
        return former()[name].text
    return "no such parameter; tools/docs/parameters.md lists them"


def number_of(text: str, choices: tuple[str, ...], where: str) -> float:
    """A number, or the number behind the name of a choice; UserError for anything else."""
    if text in choices:
        return float(choices.index(text))
    try:
        return float(text)
    except ValueError:
        names = f"give one of {', '.join(choices)}" if choices else "is not a number"
        raise UserError(f"{where}: '{text}': {names}") from None


def _read(name: str) -> str:
    path: Path = FOLDER / f"{name}.def"
    return path.read_text(encoding="utf-8")


def _joined(strings: str) -> str:
    """Adjacent C strings are one."""
    return "".join(re.findall(r'"([^"]*)"', strings))
