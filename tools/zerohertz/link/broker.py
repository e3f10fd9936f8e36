"""One drive, many clients: the broker owns the line, everybody else talks to the broker.

Each client has a session of its own with the broker, opened with the drive's key as on the drive
itself (guest.py). The broker alone has the drive's session. Reading is free for all. Running the
drive is for one client at a time; anybody may stop it. A client that goes away while it runs the
drive stops it; a broker that dies leaves that to the drive's command time-out.
"""

from __future__ import annotations

import struct
import threading
import time
from collections.abc import Callable
from typing import Protocol

from zerohertz.errors import UserError
from zerohertz.link.client import COMMISSION, RUN, TORQUE_OFF, Client, Op, RefusedError
from zerohertz.link.line import Line
from zerohertz.link.siphash import DEVELOPMENT_KEY

OK, BAD_LENGTH, NO_SESSION, PROTECTED, NOT_SEALED = 0, 6, 7, 9, 11
TAKEN, SILENT = 12, 13  # statuses of a broker's own
_PATIENCE_S = 0.4  # times four tries: an answer to the client before it gives up
_TRACE_LEASE_S = 2.0  # from a client's last question about its trace
_TRACE_QUEUE_S = 1.0
_FLIGHT_LEASE_S = 2.0  # from the last rows that its recorder took
_CONSTANT = (Op.PARAM_INFO, Op.SIGNAL_INFO)
_TRACE_DONE = 3
_FAULT = 8  # state of the drive: what stands of a run command starts nothing


class Member(Protocol):
    """What the broker knows of a client."""

    number: int
    name: str

    def revoke(self) -> None:
        """Its session has ended: somebody else stopped the drive, or the drive was reset."""
        ...


def refusal(status: int, text: str = "") -> bytes:
    """Body of an answer: the status and, for a broker's own, why."""
    told = text.encode()[:200]
    return bytes((status,)) + (bytes((len(told),)) + told if told else b"")


class Broker:
    """The drive's one session, shared. Every method is safe to call from any thread."""

    def __init__(self, line: Line, key: bytes = DEVELOPMENT_KEY) -> None:
        self.key = key
        self._line = line
        self._drive = Client(line, timeout_s=_PATIENCE_S, key=key, wait_for_lock=False)
        self._lock = threading.RLock()
        self._members: dict[int, Member] = {}
        self._joined = 0
        self._commander: Member | None = None
        self._tracer: Member | None = None
        self._traced_s = 0.0
        self._trace_next: tuple[Member, float] | None = None
        self._recorder: Member | None = None
        self._recorded_s = 0.0
        self._constant: dict[tuple[int, bytes], bytes] = {}
        self._hello = b""
        self._closed = False

    # --- who is there ------------------------------------------------------------------------

    def join(self, member: Member) -> int:
        """Its number."""
        with self._lock:
            self._joined += 1
            self._members[self._joined] = member
            return self._joined

    def leave(self, member: Member) -> None:
        """Stops the drive when this client ran it."""
        with self._lock:
            self._members.pop(member.number, None)
            if self._tracer is member:
                self._tracer = None
            if self._recorder is member:
                self.arm_flight(member, b"\0")
            if self._commander is member:
                self._commander = None
                self._acting(Op.COMMAND, struct.pack("<IfH", 0, 0.0, 0))

    def roles(self, asking: Member) -> bytes:
        """Own number, the commander's or 0, all clients with number and name."""
        with self._lock:
            commander = self._commander_now()
            body = struct.pack("<II", asking.number, commander.number if commander else 0)
            listed = b""
            count = 0
            for member in self._members.values():
                name = member.name.encode()[:40]
                entry = struct.pack("<IB", member.number, len(name)) + name
                if len(body) + 1 + len(listed) + len(entry) > 240:
                    break
                listed += entry
                count += 1
            return bytes((OK,)) + body + bytes((count,)) + listed

    # --- what they ask for -------------------------------------------------------------------

    def read(self, op: int, body: bytes) -> bytes:
        """An answer's body to a request that changes nothing."""
        with self._lock:
            if op not in _CONSTANT:
                answer = self._ask(op, body)
                if op == Op.HELLO and answer != self._hello:
                    self._hello, self._constant = answer, {}  # another firmware
                return answer
            if (op, body) not in self._constant:
                answer = self._ask(op, body)
                if answer[0] != OK:
                    return answer
                self._constant[op, body] = answer
            return self._constant[op, body]

    def act(self, op: int, body: bytes) -> bytes:
        """A request that can hurt; of the body what follows the session number."""
        with self._lock:
            return self._acting(op, body)

    def command(self, member: Member, body: bytes) -> bytes:
        """Run, commission or reset: refused while another client runs the drive. Stop: never."""
        if len(body) < struct.calcsize("<IfH"):
            return refusal(BAD_LENGTH)
        bits = struct.unpack_from("<I", body)[0]
        with self._lock:
            commander = member if member is self._commander else self._commander_now()
            if bits & ~TORQUE_OFF == 0:
                answer = self._acting(Op.COMMAND, body)
                self._commander = None
                if commander is not None and commander is not member:
                    commander.revoke()
                return answer
            if commander is not None and commander is not member:
                return refusal(TAKEN, f"{commander.name} runs the drive; stop it first")
            answer = self._acting(Op.COMMAND, body)
            if answer[0] == OK and bits & (RUN | COMMISSION):
                self._commander = member
            elif answer[0] == OK:
                self._commander = None
            return answer

    def unlock(self) -> bytes:
        """The drive's session may set protected parameters for some minutes."""
        with self._lock:
            return self._guarded(lambda: self._drive.unlock(self.key))

    # --- the one trace -----------------------------------------------------------------------

    def arm(self, member: Member, body: bytes) -> bytes:
        """Refused while another client's trace is armed or unread; who waited comes first."""
        with self._lock:
            now_s = time.monotonic()
            holder = self._tracer if now_s - self._traced_s < _TRACE_LEASE_S else None
            waiting, since_s = self._trace_next or (None, 0.0)
            if waiting is not None and now_s - since_s > _TRACE_QUEUE_S:
                waiting = None
            other = holder if holder is not member else None
            if other is None and waiting is not member:
                other = waiting
            if other is not None:
                if holder is not member:
                    self._trace_next = (member, now_s)
                else:
                    self._tracer = None
                return refusal(TAKEN, f"the trace memory is {other.name}'s at the moment")
            answer = self._acting(Op.TRACE_ARM, body)
            if answer[0] == OK:
                self._tracer, self._traced_s, self._trace_next = member, now_s, None
            return answer

    def trace(self, member: Member, op: int, body: bytes) -> bytes:
        """State and rows; the last row read ends the lease."""
        with self._lock:
            answer = self._ask(op, body)
            if member is self._tracer:
                self._traced_s = time.monotonic()
                if op == Op.TRACE_READ and self._last_row_in(body, answer):
                    self._tracer = None
            return answer

    def stop_trace(self, member: Member) -> bytes:
        """Of one's own; that of another goes on."""
        with self._lock:
            if self._tracer not in (None, member):
                return refusal(TAKEN, f"the trace memory is {self._tracer.name}'s at the moment")
            self._tracer = None
            return self._acting(Op.TRACE_STOP, b"")

    # --- the one flight recorder -------------------------------------------------------------

    def arm_flight(self, member: Member, body: bytes) -> bytes:
        """Starts or stops a recording; refused while another client records."""
        with self._lock:
            now_s = time.monotonic()
            lasting = now_s - self._recorded_s < _FLIGHT_LEASE_S
            if lasting and self._recorder not in (None, member):
                return refusal(TAKEN, f"{self._recorder.name} records a flight")
            answer = self._acting(Op.FLIGHT_ARM, body)
            if answer[0] == OK:
                self._recorder = member if body != b"\0" else None
                self._recorded_s = now_s
            return answer

    def read_flight(self, member: Member, body: bytes) -> bytes:
        """Rows, and those before are freed: only for who records."""
        with self._lock:
            if self._recorder is not member:
                return refusal(TAKEN, "another client has started a recording of its own")
            self._recorded_s = time.monotonic()
            return self._acting(Op.FLIGHT_READ, body)

    def _last_row_in(self, body: bytes, answer: bytes) -> bool:
        state = self._ask(Op.TRACE_STATE, b"")
        if state[0] != OK or answer[0] != OK or len(body) != 4:
            return False
        kind, rows, *_, columns = struct.unpack_from("<6I", state, 1)
        read = (len(answer) - 1) // max(4 * columns, 4)
        return kind == _TRACE_DONE and struct.unpack("<I", body)[0] + read >= rows

    # --- the drive ---------------------------------------------------------------------------

    def _commander_now(self) -> Member | None:
        """None once its command has run out in the drive, or a fault has ended it."""
        if self._commander is not None:
            status = self._ask(Op.STATUS, b"")
            if status[0] == OK:
                state, _, command = struct.unpack_from("<3I", status, 1)
                if state == _FAULT or not command & (RUN | COMMISSION):
                    self._commander = None
        return self._commander

    def _acting(self, op: int, body: bytes) -> bytes:
        """In the drive's session, sealed unless it is a stop, a trace, rows of a flight."""

        def ask() -> bytes:
            whole = struct.pack("<I", self._drive.session) + body
            stop = op == Op.COMMAND and not struct.unpack_from("<I", body)[0] & ~TORQUE_OFF
            if stop or op in (Op.TRACE_ARM, Op.TRACE_STOP, Op.FLIGHT_READ):
                return self._drive.request(Op(op), whole)
            return self._drive.sealed(Op(op), whole)

        answer = self._guarded(ask)
        if answer[0] == NO_SESSION:  # reset, or taken over: whoever goes on must not start it again
            self._drive.forget_session()
            for member in self._members.values():
                member.revoke()
            self._commander = self._tracer = self._recorder = None
        return answer

    def _ask(self, op: int, body: bytes) -> bytes:
        return self._guarded(lambda: self._drive.request(Op(op), body))

    def _guarded(self, ask: Callable[[], bytes | None]) -> bytes:
        """Status and body, whatever comes of it."""
        if self._closed:
            return refusal(SILENT, "the broker has ended")
        try:
            return bytes((OK,)) + (ask() or b"")
        except RefusedError as refused:
            return bytes((refused.status & 0xFF,)) + refused.detail
        except UserError as error:
            return refusal(SILENT, str(error))

    def close(self) -> None:
        """Stops a drive that a client still runs; from here on nobody is answered by the drive."""
        with self._lock:
            if self._commander is not None:
                self._commander = None
                self._acting(Op.COMMAND, struct.pack("<IfH", 0, 0.0, 0))
            self._closed = True
            self._line.close()
