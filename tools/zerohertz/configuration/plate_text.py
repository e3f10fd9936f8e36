"""A nameplate in one line, as it is printed: `4 kW, 400 V, 7,9 A, Y, 50 Hz, 1435 rpm, cos phi .82`.

What can be read in two ways is refused with both: a thousands separator, two voltages without a
connection, horsepower.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from zerohertz.errors import UserError

EXAMPLE = "4 kW, 400 V, 7.9 A, star, 50 Hz, 1435 rpm, cos phi .82"
HOW_TO_ASK = {
    "power_kW": "rated power, kW",
    "voltage_V": "line voltage of the connection that is wired, V rms",
    "current_A": "line current of that connection, A rms",
    "connection": "star or delta",
    "frequency_Hz": "rated frequency, Hz",
    "speed_rpm": "rated speed, min^-1",
    "cos_phi": "cos phi",
}
# In small letters and without blanks -> key.
_UNITS = {
    "kw": "power_kW",
    "v": "voltage_V",
    "a": "current_A",
    "hz": "frequency_Hz",
    **dict.fromkeys(
        ("rpm", "r/min", "u/min", "1/min", "/min", "min^-1", "min-1", "min⁻¹"), "speed_rpm"
    ),
    **dict.fromkeys(("nm", "n·m"), "torque_Nm"),
    **dict.fromkeys(("kgm2", "kgm^2", "kgm²", "kg·m²", "kg·m2"), "J_kg_m2"),
}
_HORSES_KW = {"hp": 0.7457, "ps": 0.7355, "cv": 0.7355, "ch": 0.7355}
_LARGE = ("w", "v", "speed_rpm")  # nobody prints three decimals of these
_CONNECTIONS = {
    **dict.fromkeys(("star", "y", "wye"), "star"),
    **dict.fromkeys(("delta", "d", "δ", "∆"), "delta"),
}
_LARGER = {"voltage_V": "star", "current_A": "delta"}  # which connection has more
# A comma between two parts has a blank or a letter behind it, or a letter before it.
_BETWEEN = re.compile(r"[;\n]|,(?!\d)|(?<=[^\d\s.]),")
_NUMBER = r"(?:\d+(?:[.,]\d*)?|[.,]\d+)"
_QUANTITY = re.compile(rf"({_NUMBER})(?:\s*/\s*({_NUMBER}))?\s*(\D.*)")
_COS_PHI = re.compile(rf"(?:cos\s?(?:phi|φ|ϕ)|pf)\s*=?\s*({_NUMBER})", re.IGNORECASE)


def plate_of_text(text: str, connection: str | None = None) -> dict[str, Any]:
    """Keys of [nameplate]; UserError for a part that says nothing, or two things.

    connection: the one that is wired. Of two voltages (or currents) the plate keeps both.
    """
    content: dict[str, Any] = {}
    order: tuple[str, ...] = ()
    for part in (piece.strip() for piece in _BETWEEN.split(text)):
        if not part:
            continue
        words = _connections(part)
        if len(words) == 2:
            order = words
            continue
        key, value = ("connection", words[0]) if words else _quantity(part)
        if key in content:
            raise UserError(f"--nameplate: '{part}': {key} is there twice; give it once")
        content[key] = value
    _require_order(content, order)
    if connection is not None:
        content["connection"] = _one_connection(content, connection_of(connection))
    return content


def missing(content: Mapping[str, Any]) -> list[str]:
    return [key for key in HOW_TO_ASK if key not in content]


def connection_of(text: str) -> str:
    """star or delta, however it is written."""
    word = text.strip().lower()
    if word not in _CONNECTIONS:
        raise UserError(f"connection: is '{text}'; give star or delta (Y or D), as it is wired")
    return _CONNECTIONS[word]


def answer(key: str, text: str) -> float | str:
    """What somebody types when asked for a key."""
    if key == "connection":
        return connection_of(text)
    if not re.fullmatch(_NUMBER, text.strip()):
        raise UserError(f"{key}: '{text}' is not a number")
    return _number(text.strip())


def _number(text: str) -> float:
    return float(text.replace(",", "."))


def _connections(part: str) -> tuple[str, ...]:
    """One, or both in the order of the plate (D/Y); empty: the part is something else."""
    words = [_CONNECTIONS.get(word.strip()) for word in part.lower().split("/")]
    return tuple(word for word in words if word) if all(words) and len(words) < 3 else ()


def _quantity(part: str) -> tuple[str, Any]:
    if found := _COS_PHI.fullmatch(part):
        return "cos_phi", _number(found[1])
    found = _QUANTITY.fullmatch(part)
    unit = re.sub(r"\s", "", found[3]).lower() if found else ""
    if found is None or unit not in (*_UNITS, *_HORSES_KW, "w"):
        raise UserError(
            f"--nameplate: '{part}': is not understood; write it like '{EXAMPLE}', a comma and a "
            "blank between the parts"
        )
    return _value(part, unit, [text for text in found.groups()[:2] if text])


def _value(part: str, unit: str, numbers: list[str]) -> tuple[str, Any]:
    key = _UNITS.get(unit, "power_kW")
    for text in numbers:
        _require_one_meaning(part, text, unit if unit in _LARGE else key)
    values = [_number(text) for text in numbers]
    if unit in _HORSES_KW:
        kW = " / ".join(f"{_HORSES_KW[unit] * value:.4g}" for value in values)
        raise UserError(f"--nameplate: '{part}': give the power in kW: {kW} kW")
    if len(values) == 2:
        return key, _both(part, key, values)
    return key, 1e-3 * values[0] if unit == "w" else values[0]


def _require_one_meaning(part: str, text: str, kind: str) -> None:
    if kind in _LARGE and (found := re.fullmatch(r"(\d+)[.,](\d{3})", text)):
        raise UserError(
            f"--nameplate: '{part}': is it {found[1]}{found[2]} or {found[1]}.{found[2]}? write "
            f"{found[1]}{found[2]}, without a separator, if that is meant"
        )


def _both(part: str, key: str, values: list[float]) -> dict[str, float]:
    """Star has more voltage, delta more current: so the plate's order says nothing new."""
    if key not in _LARGER:
        raise UserError(f"--nameplate: '{part}': has two values; give the one that belongs to it")
    larger, smaller = max(values), min(values)
    star = _LARGER[key] == "star"
    return {"star": larger if star else smaller, "delta": smaller if star else larger}


def _require_order(content: Mapping[str, Any], order: tuple[str, ...]) -> None:
    """Both connections belong to two values, and say which is wired only with --connection."""
    if order and len(set(order)) == 1:
        raise UserError(f"--nameplate: '{order[0]}' is there twice; a plate with both has D/Y")
    if order and "connection" in content:
        raise UserError(
            f"--nameplate: D/Y and {content['connection']}; leave out the one that is not wired"
        )


def _one_connection(content: Mapping[str, Any], connection: str) -> str:
    said = content.get("connection", connection)
    if said != connection:
        raise UserError(
            f"--connection {connection}: the nameplate says {said}; leave one of them out"
        )
    return connection
