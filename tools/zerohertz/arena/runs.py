"""The envelope's runs in numbers, as the kept answers have them: what entrants are compared by."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

SHARES = ("held", "undeclared_harm", "false_trip")
COLUMNS = ("index", *SHARES, "above_1Hz_s", "oriented_above_1Hz_s", "torque_ripple_pu")


def columns_of(rows: Sequence[Mapping[str, Any]]) -> dict[str, list[float | None]]:
    """The columns of the envelope's rows."""
    return {
        name: [None if row[name] is None else round(float(row[name]), 5) for row in rows]
        for name in COLUMNS
    }
