"""Frames in Python: what was written is read, what was damaged is not."""

from __future__ import annotations

import random

import pytest

from zerohertz.link.frame import BODY_MAX, Frame, Reader, decode, encode


def test_every_length_comes_back_and_has_no_zero_inside() -> None:
    rng = random.Random(1)
    for n in range(BODY_MAX + 1):
        for body in (bytes(n), b"\xff" * n, rng.randbytes(n)):
            wire = encode(Frame(n % 256, 0x21, body))
            assert wire[0] == wire[-1] == 0
            assert 0 not in wire[1:-1]
            assert list(Reader().feed(wire)) == [Frame(n % 256, 0x21, body)]


def test_a_frame_in_pieces_behind_text_is_found_and_the_text_kept() -> None:
    reader = Reader()
    wire = b"ZeroHertz 0.1.0\r\n" + encode(Frame(1, 2, b"abc"))
    found = [frame for byte in wire for frame in reader.feed(bytes((byte,)))]
    assert found == [Frame(1, 2, b"abc")]
    assert b"ZeroHertz 0.1.0" in reader.noise


def test_no_flipped_bit_gets_through() -> None:
    wire = encode(Frame(7, 0x10, b"\x00\x01\x00\xff"))
    for at in range(1, len(wire) - 1):
        for bit in range(8):
            damaged = bytearray(wire)
            damaged[at] ^= 1 << bit
            assert list(Reader().feed(bytes(damaged))) == []


@pytest.mark.parametrize("chunk", [b"\x01", b"\x05ab", b"\x03ab\xff", b"\xff" * 300])
def test_what_is_no_frame_is_none(chunk: bytes) -> None:
    assert decode(chunk) is None


def test_a_body_too_long_is_refused_here() -> None:
    with pytest.raises(ValueError, match="244"):
        encode(Frame(0, 0, bytes(BODY_MAX + 1)))
