"""The board that a motor is found with: scaling, period, the current at which it trips."""

from __future__ import annotations

import math
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Self

from zerohertz.commission.plate import Plate
from zerohertz.errors import UserError
from zerohertz.link.client import Client

PERIOD_S = 200e-6
CURRENT_SUM = 0.12  # of full scale: current_sum_max_A where nobody gives it
CURRENT_SUM_TRIP = 0.29  # of the trip; the firmware takes .3
_SCALES = (
    "adc_bits",
    "current_full_scale_A",
    "line_voltage_full_scale_V",
    "dc_link_full_scale_V",
)


@dataclass(frozen=True)
class Board:
    """toml: as host_sim/boards has them."""

    toml: str
    period_s: float = PERIOD_S
    i_trip_max_A: float = math.inf
    senses_voltage: bool = True  # of the lines; else the duty alone tells it

    @classmethod
    def of_plate(cls, plate: Plate, period_s: float = PERIOD_S) -> Self:
        """Of the motor's size: full scales 2.5 x rated peak current, 1.5 x the dc link."""
        dc_V = round(math.sqrt(2.0) * plate.voltage_V)
        current_A, most_V = 2.5 * math.sqrt(2.0) * plate.current_A, 1.5 * dc_V
        text = _toml("scaled to the motor", 14, current_A, most_V, most_V, dc_V, period_s)
        return cls(text, period_s)

    def current_sum(self, i_trip_A: float) -> dict[str, float]:
        """Parameter of a motor so small for the sensors that the usual sum is beyond its trip."""
        full_scale_A = float(tomllib.loads(self.toml)["full_scale"]["current_A"])
        most_A = CURRENT_SUM_TRIP * i_trip_A
        return {"current_sum_max_A": most_A} if CURRENT_SUM * full_scale_A > most_A else {}

    @classmethod
    def of_file(cls, path: Path) -> Self:
        try:
            text = path.read_text(encoding="utf-8")
            return cls(text, float(tomllib.loads(text)["control"]["period_s"]))
        except (OSError, tomllib.TOMLDecodeError, KeyError, TypeError, ValueError):
            raise UserError(f"--board {path}: is not a board file; see host_sim/boards") from None

    @classmethod
    def of_drive(cls, drive: Client) -> Self:
        """As its parameters say. Its voltage filter cannot be read: 800 Hz are written."""
        p = drive.get(list(_SCALES))
        scales = [p[name] for name in _SCALES]
        period_s = float(f"{drive.identity.period_s:.7g}")
        text = _toml("as the drive says", *scales, drive.status().u_dc_V, period_s)
        return cls(text, period_s, drive.parameter("i_trip_A").initial)


def _toml(
    name: str,
    bits: float,
    i_A: float,
    line_V: float,
    dc_V: float,
    u_dc_V: float,
    period_s: float = PERIOD_S,
) -> str:
    return f"""\
[board]
name = "{name}"
[adc]
bits = {bits:.0f}
[full_scale]
current_A = {i_A:.4g}
line_voltage_V = {line_V}
dc_link_V = {dc_V}
[filter]
voltage_cutoff_Hz = 800.0
order = 2
[control]
period_s = {period_s}
[inverter]
u_dc_V = {u_dc_V:.6g}
"""
