"""What the motor of `zh special hot_motor` does in its hour."""

from __future__ import annotations

import enum


class Thermal(enum.StrEnum):
    HEATS = "heats"  # from cold
    WARM = "warm"  # it was warm before the processor started, and stays so
    COOL = "cool"  # it stays cold
