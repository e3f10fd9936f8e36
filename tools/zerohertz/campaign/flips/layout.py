"""Which member of unit_t (firmware/unit/unit.h) a byte of RAM is, by debug information."""

from __future__ import annotations

import dataclasses
import functools
import re
import subprocess
from collections.abc import Iterator
from pathlib import Path

from zerohertz.build import ensure_built
from zerohertz.errors import UserError

_TARGET = "zh_unit"
_OBJECT = Path("firmware/unit/CMakeFiles/zh_unit.dir/period.c.o")
_ENTRY = re.compile(r"^ <(\d+)><([0-9a-f]+)>: Abbrev Number: \d+ \(DW_TAG_(\w+)\)")
_ATTRIBUTE = re.compile(r"^\s+<[0-9a-f]+>\s+DW_AT_(\w+)\s*:\s*(.*?)\s*$")
_SKIPPED = ("typedef", "const_type", "volatile_type")
_TYPES = (*_SKIPPED, "structure_type", "union_type", "array_type", "base_type")
_TYPES = (*_TYPES, "pointer_type", "enumeration_type", "member", "subrange_type")


@dataclasses.dataclass(frozen=True)
class Leaf:
    """One number of the drive: a float, an integer, a flag, a pointer."""

    path: str  # drive.estimator.observer.i_s_hat_A.alpha
    offset: int
    size: int
    kind: str  # float, integer, enum, pointer

    @property
    def owner(self) -> str:
        """The C object that it belongs to; elements of an array are one."""
        return re.sub(r"\[\d+\]", "[]", self.path.rpartition(".")[0]) or self.path


@dataclasses.dataclass
class _Entry:
    tag: str
    attributes: dict[str, str]
    children: list[_Entry]

    def number(self, name: str) -> int:
        return int(self.attributes[name], 0)


@functools.cache
def leaves() -> tuple[Leaf, ...]:
    """All numbers of unit_t as the host's compiler lays it out, in their order."""
    folder = ensure_built(_TARGET).folder
    return leaves_of(folder / _OBJECT, "unit_t")


def leaf_of(path: str) -> Leaf:
    """By its name."""
    for leaf in leaves():
        if leaf.path == path:
            return leaf
    raise UserError(f"--case: {path}: unit_t has no such member; --list names all")


def leaves_of(binary: Path, type_name: str) -> tuple[Leaf, ...]:
    """Of a struct that a binary with debug information knows."""
    command = ("readelf", "--debug-dump=info", str(binary))
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    known = _entries(done.stdout)
    for entry in known.values():
        if entry.tag == "typedef" and _name(entry) == type_name:
            return tuple(_walk(known, entry, "", 0))
    raise UserError(f"{binary}: has no type {type_name}; build it with debug information")


def _entries(text: str) -> dict[int, _Entry]:
    """By their offset: those of the first unit that names types."""
    known: dict[int, _Entry] = {}
    above: dict[int, _Entry] = {}
    current: _Entry | None = None
    for line in text.splitlines():
        if found := _ENTRY.match(line):
            level, at, tag = int(found[1]), int(found[2], 16), found[3]
            current = _Entry(tag, {}, [])
            above[level] = current
            if tag in _TYPES:
                known[at] = current
                if level > 0:
                    above[level - 1].children.append(current)
        elif current is not None and (found := _ATTRIBUTE.match(line)):
            current.attributes[found[1]] = found[2]
    return known


def _name(entry: _Entry) -> str:
    return entry.attributes.get("name", "").rpartition(": ")[2]


def _type(known: dict[int, _Entry], entry: _Entry) -> _Entry:
    """Behind typedef, const and volatile."""
    while True:
        entry = known[int(entry.attributes["type"].strip("<>"), 16)]
        if entry.tag not in _SKIPPED:
            return entry


def _size(known: dict[int, _Entry], entry: _Entry) -> int:
    if entry.tag == "array_type":
        return _count(entry) * _size(known, _type(known, entry))
    return entry.number("byte_size")


def _count(entry: _Entry) -> int:
    count = 1
    for child in entry.children:
        count *= child.number("upper_bound") + 1
    return count


def _walk(known: dict[int, _Entry], entry: _Entry, path: str, at: int) -> Iterator[Leaf]:
    entry = _type(known, entry) if entry.tag in _SKIPPED else entry
    if entry.tag in ("structure_type", "union_type"):
        members = [child for child in entry.children if child.tag == "member"]
        # Of a union the first member names the bytes.
        for child in members[:1] if entry.tag == "union_type" else members:
            inner = f"{path}.{_name(child)}" if path else _name(child)
            start = int(child.attributes.get("data_member_location", "0").split()[0], 0)
            yield from _walk(known, _type(known, child), inner, at + start)
    elif entry.tag == "array_type":
        of = _type(known, entry)
        for k in range(_count(entry)):
            yield from _walk(known, of, f"{path}[{k}]", at + k * _size(known, of))
    else:
        yield Leaf(path, at, entry.number("byte_size"), _kind(entry))


def _kind(entry: _Entry) -> str:
    if entry.tag == "base_type":
        return "float" if entry.attributes["encoding"].split()[0] == "4" else "integer"
    return {"enumeration_type": "enum", "pointer_type": "pointer"}[entry.tag]
