"""The objects of a fieldbus: the firmware's parameters by group, its signals by number."""

from __future__ import annotations

import re
from dataclasses import dataclass

from zerohertz import param_list
from zerohertz.param_list import Entry
from zerohertz.paths import ROOT

SIGNAL_LISTS = (
    ROOT / "firmware" / "unit" / "signal_list.def",
    ROOT / "firmware" / "law" / "estimator" / "hasegawa" / "estimator_signals.def",
)
WRITABLE = ROOT / "firmware" / "fieldbus" / "fieldbus_writable.def"
_SIGNAL = re.compile(r'^SIGNAL_(\w+)\(\s*(\w+),(?:[^"]|\n)*?"([^"]*)"\)', re.MULTILINE)
_WRITABLE = re.compile(r"^FIELDBUS_WRITABLE\((\w+)\)", re.MULTILINE)


@dataclass(frozen=True)
class Signal:
    """One signal of a control period."""

    name: str
    is_float: bool
    text: str


def signals() -> list[Signal]:
    """In the order of their numbers."""
    found = []
    for file in SIGNAL_LISTS:
        for kind, name, text in _SIGNAL.findall(file.read_text(encoding="utf-8")):
            found.append(Signal(name, kind.endswith("F"), text))
    return found


def grouped() -> list[tuple[int, int, Entry]]:
    """Number of the group, position in it, parameter."""
    order, seen = list(param_list.groups()), dict.fromkeys(param_list.groups(), -1)
    found = []
    for entry in param_list.entries().values():
        seen[entry.group] += 1
        found.append((order.index(entry.group), seen[entry.group], entry))
    return found


def writable() -> frozenset[str]:
    """The parameters that a bus may write."""
    return frozenset(_WRITABLE.findall(WRITABLE.read_text(encoding="utf-8")))
