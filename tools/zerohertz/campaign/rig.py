"""The board and dc link on which things break, and what the campaigns say about fault bits."""

from __future__ import annotations

from collections.abc import Mapping

from zerohertz.drive import Fault

U_DC_V = 283.0
# A dc link of 1 mF that cannot feed back, with a brake resistor that the firmware knows of.
LINK: Mapping[str, float] = {
    "dc_link.capacitance_F": 1e-3,
    "dc_link.source_ohm": 0.5,
    "dc_link.chopper_ohm": 100.0,
}
FIRMWARE: Mapping[str, float] = {"chopper_on_V": 350.0}
OVER_PU = 1.125  # of i_trip_A


def bit_names(bits: int) -> str:
    return " ".join(fault.name or "" for fault in Fault if bits & fault)
