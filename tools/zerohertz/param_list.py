"""The firmware's parameters as param_list.def lists them.

Python's standard library alone: the build reads them too.
"""

from __future__ import annotations

import dataclasses
import math
import re
import struct

from zerohertz.paths import ROOT

PARAM_LIST = ROOT / "firmware" / "parameters" / "param_list.def"
_PATTERN = r'PARAM_([FU])\((\w+),\s*"[^"]*",\s*([^,]+),\s*([^,]+),\s*([^,]+),'


@dataclasses.dataclass(frozen=True)
class ListedParameter:
    """The decimals of the list, not yet rounded to float32."""

    name: str
    whole: bool
    minimum: float
    maximum: float
    initial: float | int


def read_param_list() -> dict[str, ListedParameter]:
    """By name, in the order of the list."""
    text = PARAM_LIST.read_text(encoding="utf-8")
    return {
        name: ListedParameter(name, kind == "U", *(_number(value) for value in values))
        for kind, name, *values in re.findall(_PATTERN, text)
    }


def float32(value: float) -> float:
    """The nearest float32, infinity beyond the largest."""
    try:
        return struct.unpack("<f", struct.pack("<f", value))[0]
    except OverflowError:
        return math.copysign(math.inf, value)


def _number(text: str) -> float | int:
    return int(text.rstrip("u")) if text.endswith("u") else float(text.rstrip("f"))
