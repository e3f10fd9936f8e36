"""A measuring board: host_sim/boards/<name>.toml, as far as the firmware's parameters need it.

Python's standard library alone: the build reads it too. host_sim/board.cpp reads the same file.
"""

from __future__ import annotations

import dataclasses
import math
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from zerohertz.errors import UserError
from zerohertz.paths import ROOT

BOARDS = ROOT / "host_sim" / "boards"


@dataclasses.dataclass(frozen=True)
class Board:
    """The defaults are the paper's board, for which those of param_list.def were chosen."""

    adc_bits: int = 14
    current_full_scale_A: float = 25.0
    line_voltage_full_scale_V: float = 400.0
    dc_link_full_scale_V: float = 400.0
    filter_cutoff_Hz: float = 800.0
    filter_damping: float = math.sqrt(0.5)  # Butterworth
    period_s: float = 200e-6
    u_dc_V: float = 283.0


# Key of the file -> field, least and largest value.
_NUMBERS = {
    "adc.bits": ("adc_bits", 8, 16),
    "full_scale.current_A": ("current_full_scale_A", 1e-6, 1e4),
    "full_scale.line_voltage_V": ("line_voltage_full_scale_V", 1e-6, 1e5),
    "full_scale.dc_link_V": ("dc_link_full_scale_V", 1e-6, 1e5),
    "filter.voltage_cutoff_Hz": ("filter_cutoff_Hz", 10.0, 1e5),
    "filter.voltage_damping": ("filter_damping", 0.1, 10.0),
    "control.period_s": ("period_s", 1e-6, 1e-2),
    "inverter.u_dc_V": ("u_dc_V", 1e-6, 1e5),
}
_OPTIONAL = ("filter.voltage_damping",)
# Of the plant alone.
_OTHERS = ("board.name", "filter.order", "control.delay_periods", "protection.comparator_A")


def board_file(name: str | Path) -> Path:
    """A board by name, or of a TOML file."""
    path = Path(name)
    if path.suffix != ".toml":
        path = BOARDS / f"{name}.toml"
    if not path.is_file():
        known = ", ".join(sorted(file.stem for file in BOARDS.glob("*.toml")))
        raise UserError(f"--board: no board '{name}'; there are {known}, or name a TOML file")
    return path


def read_board(path: Path) -> Board:
    """UserError, with file and key, when the file cannot be used."""
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise UserError(f"{path}: cannot be read: {error}; correct it") from None
    return board_of(data, path)


def board_of(data: Mapping[str, Any], path: Path) -> Board:
    """Of a file's content."""
    given = dict(_flat(data, path))
    for key in given:
        if key not in _NUMBERS and key not in _OTHERS:
            known = ", ".join((*_NUMBERS, *_OTHERS))
            raise UserError(f"{path}: {key}: unknown key; known are {known}")
    values = {
        field: _number(given, key, low, high, path)
        for key, (field, low, high) in _NUMBERS.items()
        if key in given or key not in _OPTIONAL
    }
    board = Board(**values)
    if board.u_dc_V > board.dc_link_full_scale_V:
        raise UserError(
            f"{path}: inverter.u_dc_V: is above full_scale.dc_link_V; raise the full scale"
        )
    return board


def _flat(data: Mapping[str, Any], path: Path) -> list[tuple[str, Any]]:
    for section, content in data.items():
        if not isinstance(content, Mapping):
            raise UserError(f"{path}: {section}: is outside every section; move it into one")
    return [(f"{section}.{key}", value) for section in data for key, value in data[section].items()]


def _number(given: Mapping[str, Any], key: str, low: float, high: float, path: Path) -> float:
    value = given.get(key)
    whole = isinstance(low, int)
    kind = "a whole number" if whole else "a number"
    known = isinstance(value, int if whole else (int, float)) and not isinstance(value, bool)
    if not known or not low <= value <= high:
        shown = "missing" if value is None else repr(value)
        raise UserError(f"{path}: {key}: is {shown}; give {kind} of {low:g} .. {high:g}")
    return value
