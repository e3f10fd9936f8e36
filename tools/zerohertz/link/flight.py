"""The drive's flight recorder over the link: firmware/host/README.md."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from enum import IntEnum

from zerohertz.link.client import Client, Op

ROW_BYTES = 12
_WORDS = 6


class Recorder(IntEnum):
    """What the drive's recorder does, numbers as in firmware/host/flight.h."""

    OFF = 0
    ASKED = 1
    ON = 2
    LOST = 3  # its memory was full: the host was too slow


@dataclass(frozen=True)
class FlightState:
    """Of the drive's recorder; rows are counted from the start of the recording."""

    state: int  # Recorder
    rows: int  # that the memory holds
    written: int
    taken: int
    changes: int  # of parameters, since the drive's start
    lost: int  # periods since the memory was full


def flight_state(drive: Client) -> FlightState:
    body = drive.request(Op.FLIGHT_STATE, what="the flight recorder")
    return FlightState(*struct.unpack_from(f"<{_WORDS}I", body))


def arm_flight(drive: Client, on: bool) -> None:
    """On: the drive starts its control state anew, gates off, and records from there."""
    body = struct.pack("<IB", drive.session, on)
    drive.sealed(Op.FLIGHT_ARM, body, "starting a recording" if on else "ending the recording")


def read_flight(drive: Client, row: int) -> tuple[int, bytes]:
    """State of the recorder, and rows from this one on; the drive frees those before it."""
    body = drive.request(Op.FLIGHT_READ, struct.pack("<II", drive.session, row), "the recording")
    whole = (len(body) - 1) // ROW_BYTES * ROW_BYTES
    return body[0], body[1 : 1 + whole]
