"""Frames of the host link: COBS between zeros, CRC-32C at the end. firmware/host/command.h."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass

from zerohertz.gain_design.crc32c import crc32c

BODY_MAX = 244
_HEAD, _CRC = 2, 4


@dataclass(frozen=True)
class Frame:
    """One whole frame whose CRC is right."""

    sequence: int
    op: int
    body: bytes


def encode(frame: Frame) -> bytes:
    """What goes on the wire, both zeros included."""
    if len(frame.body) > BODY_MAX:
        raise ValueError(f"a body of {len(frame.body)} bytes; {BODY_MAX} is the most")
    raw = bytes((frame.sequence, frame.op)) + frame.body
    raw += struct.pack("<I", crc32c(raw))
    # Shorter than 254 bytes: every code is a distance to a zero, none stands for a full block.
    return b"\0" + b"".join(bytes((len(p) + 1,)) + p for p in raw.split(b"\0")) + b"\0"


def decode(chunk: bytes) -> Frame | None:
    """What stands between two zeros; None when it is no frame."""
    raw = bytearray()
    at = 0
    while at < len(chunk):
        code = chunk[at]
        piece = chunk[at + 1 : at + code]
        if len(piece) != code - 1:
            return None
        raw += (b"\0" if at else b"") + piece
        at += code
    if not _HEAD + _CRC <= len(raw) <= _HEAD + BODY_MAX + _CRC:
        return None
    if struct.unpack("<I", raw[-_CRC:])[0] != crc32c(bytes(raw[:-_CRC])):
        return None
    return Frame(raw[0], raw[1], bytes(raw[_HEAD:-_CRC]))


class Reader:
    """Bytes as they come, frames out; what is none (a banner's text) is kept in `noise`."""

    def __init__(self) -> None:
        self._rest = b""
        self.noise = b""

    def feed(self, data: bytes) -> Iterator[Frame]:
        *chunks, self._rest = (self._rest + data).split(b"\0")
        for chunk in chunks:
            frame = decode(chunk) if chunk else None
            if frame is not None:
                yield frame
            else:
                self.noise = (self.noise + chunk)[-4096:]
