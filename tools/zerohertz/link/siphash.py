"""SipHash-2-4 (Aumasson, Bernstein 2012): the answer to a drive's challenge."""

from __future__ import annotations

import hmac
from pathlib import Path

from zerohertz.errors import UserError

# hal/include/hal_development_key.h: known to everybody
DEVELOPMENT_KEY = b"ZeroHertz develo"
_MASK = 2**64 - 1


def _rotated(x: int, n: int) -> int:
    return ((x << n) | (x >> (64 - n))) & _MASK


def _round(v: list[int]) -> None:
    for a, b, n, m in ((0, 1, 13, 32), (2, 3, 16, 0), (0, 3, 21, 0), (2, 1, 17, 32)):
        v[a] = (v[a] + v[b]) & _MASK
        v[b] = _rotated(v[b], n) ^ v[a]
        v[a] = _rotated(v[a], m) if m else v[a]


def siphash_2_4(key: bytes, message: bytes) -> int:
    """64 bits over the message under a key of 16 bytes."""
    k = [int.from_bytes(key[at : at + 8], "little") for at in (0, 8)]
    v = [
        k[n % 2] ^ constant
        for n, constant in enumerate(
            (0x736F6D6570736575, 0x646F72616E646F6D, 0x6C7967656E657261, 0x7465646279746573)
        )
    ]
    padded = message + b"\0" * (7 - len(message) % 8) + bytes((len(message) % 256,))
    for at in range(0, len(padded), 8):
        word = int.from_bytes(padded[at : at + 8], "little")
        v[3] ^= word
        for _ in range(2):
            _round(v)
        v[0] ^= word
    v[2] ^= 0xFF
    for _ in range(4):
        _round(v)
    return v[0] ^ v[1] ^ v[2] ^ v[3]


def response(key: bytes, nonce: int, unlock: bool = True) -> int:
    """What unlocks, or only opens a session; firmware/host/access.h."""
    purpose = b"zhunlock" if unlock else b"zhopened"
    return siphash_2_4(key, purpose + nonce.to_bytes(8, "little"))


def tools_response(key: bytes, nonce: int) -> int:
    """What opens the tools behind a page of `zh studio`; nothing that a drive would take."""
    return siphash_2_4(key, b"zhtools\0" + nonce.to_bytes(8, "little"))


class Seal:
    """Counter and MAC of the requests of one session."""

    def __init__(self, key: bytes, nonce: int) -> None:
        head = b"zhsealed" + nonce.to_bytes(8, "little")
        halves = (siphash_2_4(key, head + half.to_bytes(8, "little")) for half in (0, 1))
        self._key = b"".join(half.to_bytes(8, "little") for half in halves)
        self._counter = 0

    def of(self, request: bytes) -> bytes:
        """The request with what shows that it is ours, and the next one."""
        self._counter += 1
        return self._of(request, self._counter)

    def fits(self, request: bytes, sealed: bytes) -> bool:
        """The other end: whether who has the key sealed this, after all that came before."""
        counter = int.from_bytes(sealed[len(request) : len(request) + 4], "little")
        if counter <= self._counter or not hmac.compare_digest(self._of(request, counter), sealed):
            return False
        self._counter = counter
        return True

    def _of(self, request: bytes, counter: int) -> bytes:
        message = request + counter.to_bytes(4, "little")
        return message + siphash_2_4(self._key, message).to_bytes(8, "little")


def load_key(path: Path | None, option: str = "--key") -> bytes:
    """32 hexadecimal digits of a file; none: the development key."""
    if path is None:
        return DEVELOPMENT_KEY
    try:
        key = bytes.fromhex(path.read_text(encoding="ascii"))
    except (OSError, ValueError) as error:
        raise UserError(
            f"{option} {path}: cannot be read as hexadecimal digits ({error})"
        ) from None
    if len(key) != 16:
        raise UserError(f"{option} {path}: {len(key)} bytes; a key has 16, 32 hexadecimal digits")
    return key
