"""A client of the broker: the same frames, sessions and keys as a drive's, checked here."""

from __future__ import annotations

import hmac
import secrets
import struct
import time
from collections.abc import Callable

from zerohertz.link.broker import (
    BAD_LENGTH,
    NO_SESSION,
    NOT_SEALED,
    OK,
    PROTECTED,
    Broker,
    refusal,
)
from zerohertz.link.client import ANSWER, TORQUE_OFF, Op
from zerohertz.link.frame import Frame, Reader, encode
from zerohertz.link.siphash import Seal, response

_NO_SUCH_OP, _NOT_NOW, _REFUSED = 5, 8, 10
_MAC_BYTES, _COUNTER_BYTES = 8, 4
_LOCKOUT_S = 10.0  # from the third wrong answer, as on a drive
_OPEN_S = 600.0  # without a sealed request
_UNLOCKED_S = 600.0
_PROTECTED_ACCESS = 2
_READING = frozenset(
    {
        *(Op.HELLO, Op.PARAM_INFO, Op.SIGNAL_INFO, Op.GET, Op.STORE, Op.STORE_ENTRY, Op.STATUS),
        *(Op.SAMPLE, Op.COMMISSIONING, Op.FAULT_LOG, Op.FAULT_RECORD, Op.FAULT_READ),
        Op.FLIGHT_STATE,
    }
)
_SEALED_OPS = frozenset({Op.SET, Op.SAVE, Op.COMMAND, Op.FAULT_CLEAR, Op.FLIGHT_ARM})


class Lockout:
    """Wrong keys, of all clients together."""

    def __init__(self) -> None:
        self._wrong = 0
        self._until_s = 0.0

    @property
    def standing(self) -> bool:
        return time.monotonic() < self._until_s

    def note(self, right: bool) -> None:
        self._wrong = 0 if right else self._wrong + 1
        if self._wrong >= 3:
            self._wrong, self._until_s = 0, time.monotonic() + _LOCKOUT_S


class Guest:
    """Bytes of one client in, answers out. One thread at a time calls `feed`."""

    def __init__(self, broker: Broker, lockout: Lockout) -> None:
        self.name = "a client"
        self._broker, self._lockout = broker, lockout
        self._reader = Reader()
        self._last: tuple[Frame, bytes] | None = None
        self._session = 0
        self._nonce: int | None = None
        self._seal: Seal | None = None
        self._sealed_s = 0.0
        self._unlocked_s = -_UNLOCKED_S
        self.number = broker.join(self)

    def feed(self, data: bytes) -> bytes:
        """What to send back."""
        said = b""
        for frame in self._reader.feed(data):
            if self._last is None or self._last[0] != frame:
                answer = Frame(frame.sequence, frame.op | ANSWER, self._answer(frame))
                self._last = (frame, encode(answer))
            said += self._last[1]
        return said

    def leave(self) -> None:
        """The connection is gone."""
        self._broker.leave(self)

    def revoke(self) -> None:
        """What it was allowed to do has ended."""
        self._session = 0
        self._seal = self._nonce = None

    def _answer(self, frame: Frame) -> bytes:
        op, body = frame.op, frame.body
        if op in _READING:
            return self._broker.read(op, body)
        if op in (Op.TRACE_STATE, Op.TRACE_READ):
            return self._broker.trace(self, op, body)
        own = {
            Op.SESSION: self._open_session,
            Op.CLIENT: self._introduce,
            Op.ROLES: lambda _: self._broker.roles(self),
            Op.CHALLENGE: self._challenge,
            Op.UNLOCK: self._unlock,
            Op.SEALED: self._sealed,
        }
        acting = {
            Op.COMMAND: self._stop,
            Op.TRACE_ARM: lambda rest: self._broker.arm(self, rest),
            Op.TRACE_STOP: lambda _: self._broker.stop_trace(self),
            Op.FLIGHT_READ: lambda rest: self._broker.read_flight(self, rest),
        }
        if op in own:
            return own[Op(op)](body)
        if op in acting:
            return self._with_session(body, acting[Op(op)])
        return refusal(NOT_SEALED if op in _SEALED_OPS else _NO_SUCH_OP)

    def _with_session(self, body: bytes, ask: Callable[[bytes], bytes]) -> bytes:
        if len(body) < 4:
            return refusal(BAD_LENGTH)
        if self._session == 0 or struct.unpack_from("<I", body)[0] != self._session:
            return refusal(NO_SESSION)
        return ask(body[4:])

    def _open_session(self, _: bytes) -> bytes:
        self.revoke()
        self._session = 1 + secrets.randbelow(2**32 - 1)
        return struct.pack("<BI", OK, self._session)

    def _introduce(self, body: bytes) -> bytes:
        told = body[1 : 1 + body[0]].decode(errors="replace") if body else ""
        self.name = "".join(c for c in told if c.isprintable())[:40] or self.name
        return struct.pack("<BI", OK, self.number)

    def _challenge(self, body: bytes) -> bytes:
        def ask(_: bytes) -> bytes:
            self._seal = None
            if self._lockout.standing:
                return refusal(_NOT_NOW)
            self._nonce = secrets.randbits(64)
            return struct.pack("<BQ", OK, self._nonce)

        return self._with_session(body, ask)

    def _unlock(self, body: bytes) -> bytes:
        def ask(rest: bytes) -> bytes:
            if self._nonce is None or len(rest) != 8:
                return refusal(_REFUSED)
            nonce, self._nonce = self._nonce, None
            right = [
                unlock
                for unlock in (False, True)
                if hmac.compare_digest(_word(response(self._broker.key, nonce, unlock)), rest)
            ]
            self._lockout.note(bool(right))
            if not right:
                return refusal(_REFUSED)
            if right[0]:
                answer = self._broker.unlock()
                if answer[0] != OK:
                    return answer
                self._unlocked_s = time.monotonic()
            self._seal, self._sealed_s = Seal(self._broker.key, nonce), time.monotonic()
            return bytes((OK,))

        return self._with_session(body, ask)

    def _sealed(self, body: bytes) -> bytes:
        request = body[: -_MAC_BYTES - _COUNTER_BYTES]
        now_s = time.monotonic()
        if now_s - self._sealed_s > _OPEN_S:
            self._seal = None
        if self._seal is None or not request or not self._seal.fits(request, body):
            return refusal(NOT_SEALED)
        self._sealed_s = now_s
        op = request[0]
        if op not in _SEALED_OPS:
            return refusal(_NO_SUCH_OP)
        return self._with_session(request[1:], lambda rest: self._act(op, rest))

    def _stop(self, rest: bytes) -> bytes:
        """What needs no key; anything else does."""
        if len(rest) >= 4 and struct.unpack_from("<I", rest)[0] & ~TORQUE_OFF:
            return refusal(NOT_SEALED)
        return self._broker.command(self, rest)

    def _act(self, op: int, rest: bytes) -> bytes:
        if op == Op.COMMAND:
            return self._broker.command(self, rest)
        if op == Op.SET and not self._may_set(rest):
            return refusal(PROTECTED)
        if op == Op.FLIGHT_ARM:
            return self._broker.arm_flight(self, rest)
        return self._broker.act(op, rest)

    def _may_set(self, rest: bytes) -> bool:
        """A protected parameter only by who unlocked: the drive sees the broker alone."""
        info = self._broker.read(Op.PARAM_INFO, rest[:2])
        if info[0] != OK or info[2] != _PROTECTED_ACCESS:
            return True  # what else is wrong the drive says
        return time.monotonic() - self._unlocked_s < _UNLOCKED_S


def _word(number: int) -> bytes:
    return number.to_bytes(8, "little")
