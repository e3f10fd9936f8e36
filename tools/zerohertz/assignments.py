"""Options that set something: name=value."""

from __future__ import annotations

from typing import Any

from zerohertz.errors import UserError


def assignments(option: str, lines: list[str], numbers: bool) -> dict[str, Any]:
    """`name=value` lines of an option; text where numbers are not demanded."""
    values: dict[str, Any] = {}
    for line in lines:
        name, equals, text = line.partition("=")
        if not equals or not name or not text:
            raise UserError(f"{option}: '{line}': write name=value")
        try:
            values[name] = float(text)
        except ValueError:
            if numbers:
                raise UserError(f"{option}: {name}: '{text}' is not a number") from None
            values[name] = text
    return values
