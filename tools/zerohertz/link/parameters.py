"""Parameters as a drive describes them over the link, why it refuses values, and what became of the
record it found in its flash. Bodies of the answers: firmware/host/README.md."""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum

from zerohertz import param_list
from zerohertz.gain_design.crc32c import crc32c

_NONE = 0xFFFF
_RELATIONS = ("at most", "below", "at least", "above", "exactly")


@dataclass(frozen=True)
class Parameter:
    """One parameter as the drive describes it."""

    index: int
    name: str
    unit: str
    whole: bool
    access: str
    minimum: float
    maximum: float
    initial: float
    group: str = ""
    choices: tuple[str, ...] = ()  # names of the values 0, 1, ...; none: a number

    @classmethod
    def from_answer(cls, index: int, body: bytes) -> Parameter:
        """A drive of before groups and choices leaves them out."""
        kind, access, minimum, maximum, initial = struct.unpack_from("<BBfff", body)
        name, rest = take_text(body[14:])
        unit, rest = take_text(rest)
        group, rest = take_text(rest) if rest else ("", b"")
        choices = []
        for _ in range(rest[0] if rest else 0):
            choice, after = take_text(rest[1:])
            choices.append(choice)
            rest = rest[:1] + after
        words = ("run", "ready", "protected")
        return cls(
            *(index, name, unit, kind == 1, words[min(access, 2)]),
            *(minimum, maximum, initial, group, tuple(choices)),
        )

    def number(self, text: str) -> float:
        """The number that a person wrote, or the one behind the name of a choice."""
        return param_list.number_of(text, self.choices, self.name)

    def show(self, value: float, unit: bool = True) -> str:
        """The value for a reader."""
        if self.choices and float(value).is_integer() and 0 <= value < len(self.choices):
            return self.choices[int(value)]
        return f"{value:.7g} {self.unit if unit else ''}".rstrip()

    @property
    def span(self) -> str:
        """What it may be."""
        if self.choices:
            return "one of " + ", ".join(self.choices)
        return f"{self.minimum:.7g} .. {self.maximum:.7g} {self.unit}".rstrip()


@dataclass(frozen=True)
class Conflict:
    """Two parameters that exclude each other: the first has to be at most, below, ... the limit."""

    first: int
    second: int
    relation: int
    limit: float

    @classmethod
    def from_answer(cls, body: bytes) -> Conflict | None:
        """None: the drive names nobody."""
        if len(body) < struct.calcsize("<HHBf"):
            return None
        found = cls(*struct.unpack_from("<HHBf", body))
        return found if found.first != _NONE and found.relation < len(_RELATIONS) else None

    def text(self, known: Mapping[str, Parameter], values: Mapping[str, float]) -> str:
        """Both parameters with their values, and what is allowed; '' for another list's indices."""
        listed = {p.index: p for p in known.values()}
        first, second = listed.get(self.first), listed.get(self.second)
        if first is None:
            return ""
        said = f"{first.name} = {first.show(values[first.name])} has to be "
        said += f"{_RELATIONS[self.relation]} {first.show(self.limit)}"
        if second is not None and second is not first:
            said += f" with {second.name} = {second.show(values[second.name])}"
        return said


class Fate(IntEnum):
    """What became of an entry of a record, numbers as in param_store.h."""

    TAKEN = 0
    RENAMED = 1
    UNKNOWN = 2
    REFUSED = 3


@dataclass(frozen=True)
class RecordEntry:
    """One entry of the record in the drive's flash."""

    key: int  # CRC-32C of the name it was saved under
    value: float
    index: int
    fate: int

    @classmethod
    def from_answer(cls, body: bytes) -> RecordEntry:
        return cls(*struct.unpack_from("<IfHB", body))


def record_lines(entries: Sequence[RecordEntry], known: Mapping[str, Parameter]) -> list[str]:
    """One line for each entry that is not in force under the name it was saved with."""
    listed = {p.index: p for p in known.values()}
    former = {crc32c(name.encode()): name for name in param_list.former()}
    lines = []
    for entry in entries:
        now = listed.get(entry.index)
        name = former.get(entry.key, f"a name with CRC {entry.key:08x}")
        if entry.fate == Fate.RENAMED and now is not None:
            lines.append(f"{name} = {entry.value:.7g} is {now.name} now: taken")
        elif entry.fate == Fate.REFUSED and now is not None:
            lines.append(f"{now.name} = {entry.value:.7g} is out of range, {now.span}: default")
        elif entry.fate == Fate.UNKNOWN:
            lines.append(f"{name} = {entry.value:.7g} {_instead(name, entry.value)}")
    return lines


def _instead(name: str, value: float) -> str:
    was = param_list.former().get(name)
    if was is None:
        return "is not known: dropped"
    same = was.value is not None and abs(was.value - value) <= 1e-6 * abs(value)
    return f"{was.text}" + (": the same" if same else "")


def take_text(body: bytes) -> tuple[str, bytes]:
    """A length byte and its bytes."""
    return body[1 : 1 + body[0]].decode(errors="replace"), body[1 + body[0] :]
