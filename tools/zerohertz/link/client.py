"""A drive at the other end of a line: requests and answers. firmware/host/README.md."""

from __future__ import annotations

import contextlib
import struct
import time
from dataclasses import asdict, dataclass
from enum import IntEnum
from functools import cached_property
from typing import Self

from zerohertz import param_list
from zerohertz.errors import UserError
from zerohertz.link.frame import BODY_MAX, Frame, Reader, encode
from zerohertz.link.line import Line
from zerohertz.link.parameters import Conflict, Parameter, RecordEntry, take_text
from zerohertz.link.siphash import DEVELOPMENT_KEY, Seal, response

PROTOCOL = 1
RUN, RESET, TORQUE_OFF, COMMISSION, TORQUE_MODE = 1, 2, 4, 8, 16
ANSWER = 0x80
_TRIES = 4
_WORDS_U, _WORDS_F = 9, 10  # of a status
_TRACE_WORDS, _RECORD_WORDS = 6, 5
_STORE_CONFLICT_AT = struct.calcsize("<8I")
_STORE_TAIL_AT = _STORE_CONFLICT_AT + struct.calcsize("<HHBf")
_NOT_NOW, _PROTECTED, _REFUSED, _NOT_SEALED = 8, 9, 10, 11  # statuses of an answer
TAKEN = 12  # by another client of the broker
_BROKERS_OWN = (TAKEN, 13)  # they come with their reason
_LOCKED_OUT_S = 11.0
_POLL_S = 0.05


class Op(IntEnum):
    """Requests, numbers as in firmware/unit/unit_link.h."""

    HELLO = 0x01
    SESSION = 0x02
    PARAM_INFO = 0x03
    SIGNAL_INFO = 0x04
    GET = 0x10
    SET = 0x11
    SAVE = 0x12
    STORE = 0x13
    CHALLENGE = 0x14
    UNLOCK = 0x15
    STORE_ENTRY = 0x16
    COMMAND = 0x20
    STATUS = 0x21
    SAMPLE = 0x22
    COMMISSIONING = 0x23
    LOADER = 0x24
    TRACE_ARM = 0x30
    TRACE_STATE = 0x31
    TRACE_READ = 0x32
    TRACE_STOP = 0x33
    FLIGHT_ARM = 0x34
    FLIGHT_STATE = 0x35
    FLIGHT_READ = 0x36
    FAULT_LOG = 0x40
    FAULT_RECORD = 0x41
    FAULT_READ = 0x42
    FAULT_CLEAR = 0x43
    SEALED = 0x50
    # Of a broker alone (broker.py); a drive does not know them.
    CLIENT = 0x60
    ROLES = 0x61


REASONS = {
    1: "is no finite number",
    2: "is out of range",
    3: "has to be a whole number",
    4: "is not there",
    5: "the drive does not know this request",
    6: "the drive knows this request in another length; is the firmware of another version?",
    7: "somebody else has taken over the drive, or it was reset; connect anew",
    8: "not now: only with the gates off, or the drive is locked out for a while",
    9: "is protected; give --unlock",
    11: "needs the key of the drive; give --key FILE",
    TAKEN: "another program has it",
    13: "the drive does not answer",
    10: "is in range, but refused together with the other values, or by the drive as it stands",
}


class RefusedError(UserError):
    """The drive's answer had a status other than 0."""

    def __init__(self, what: str, status: int, detail: bytes = b"", why: str = "") -> None:
        super().__init__(f"{what}: {why or REASONS.get(status, f'refused with status {status}')}")
        self.status = status
        self.detail = detail  # what followed the status


class NoAnswerError(UserError):
    """Nobody answered in time, however often asked."""


@dataclass(frozen=True)
class Identity:
    """Who is at the other end."""

    protocol: int
    parameters: int
    signals: int
    trace_words: int
    motor_id: int
    table_crc32c: int
    period_s: float
    pole_pairs: float
    text: str


@dataclass(frozen=True)
class Signal:
    """One signal that can be traced."""

    number: int
    name: str
    whole: bool

    def value(self, word: int) -> float | int:
        return word if self.whole else struct.unpack("<f", struct.pack("<I", word))[0]

    def word(self, value: float) -> int:
        if self.whole:
            return int(value)
        return struct.unpack("<I", struct.pack("<f", value))[0]


@dataclass(frozen=True)
class Status:
    """What the drive is doing; speeds mechanical."""

    state: int
    faults: int
    command: int
    period: int
    command_ran_out: int
    good_frames: int
    bad_frames: int
    confidence: int
    reasons: int
    speed_ref_rad_s: float
    speed_hat_rad_s: float
    speed_bound_rad_s: float
    lambda_Wb: float
    i_d_A: float
    i_q_A: float
    i_q_ref_A: float
    u_dc_V: float
    stator_frequency_Hz: float
    Rs_hat_ohm: float
    speed_unknown: int  # 1: nothing shows the rotor; speed_hat_rad_s is NaN
    terminal_faults: int = 0  # zerohertz.terminals.Fault of a board that has terminals

    def as_json(self) -> dict[str, int | float | None]:
        """What nobody knows is null."""
        told = asdict(self)
        return {name: None if value != value else value for name, value in told.items()}


@dataclass(frozen=True)
class StoreState:
    """What the drive's parameter store found at start and does now."""

    found: int  # FOUND
    saving: int
    failed: int
    unlocked: int
    taken: int
    missing: int
    unknown: int
    refused: int
    renamed: int
    entries: int  # of the record in the flash
    conflict: str  # what in the set in use excludes each other, so that the drive does not run


FOUND = {
    0: "of the image, none were saved",
    1: "as saved",
    2: "LOST: what was saved cannot be read; check them and save anew",
}


@dataclass(frozen=True)
class Commissioning:
    """How far the drive is with finding its motor, and what it found."""

    status: int  # 0 going on or never begun, 1 done, 2 refused
    refusal: int
    stage: int
    level: int
    found: tuple[float, ...]  # Rs, loss of a leg, sigma Ls, (M/Lr)^2 Rr, M^2/Lr, current of both
    curve: tuple[tuple[float, float, float], ...]  # current, flux, error of the inverter


@dataclass(frozen=True)
class TraceState:
    """Of the drive's recorder."""

    state: int  # 0 idle, 1 armed, 2 triggered, 3 done
    rows: int
    trigger_row: int
    trigger_period: int
    decimation: int
    signals: tuple[int, ...]


@dataclass(frozen=True)
class FaultEntry:
    """One fault of the list."""

    number: int
    faults: int
    state: int
    period: int


@dataclass(frozen=True)
class FaultRecord:
    """Head of the record round the last fault."""

    number: int
    period: int
    rows: int
    fault_row: int
    from_before_reset: bool
    signals: tuple[int, ...]


@dataclass(frozen=True)
class Roles:
    """Clients of a broker by number."""

    own: int
    commander: int  # 0: nobody runs the drive
    names: dict[int, str]


_NO_ANSWER = "is the drive powered? A simulated one may be too slow on a busy machine"


class Client:
    """Requests to one drive, each answered before the next is sent."""

    def __init__(
        self,
        line: Line,
        timeout_s: float = 0.5,
        key: bytes = DEVELOPMENT_KEY,
        wait_for_lock: bool = True,
    ) -> None:
        self._line = line
        self._wait_for_lock = wait_for_lock
        self._key = key
        self._seal: Seal | None = None
        self._timeout_s = timeout_s
        self._reader = Reader()
        # Not always the same first number: a drive remembers the last request of who came before.
        self._sequence = time.monotonic_ns() // 1_000_000 % 256

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._line.close()

    def request(self, op: Op, body: bytes = b"", what: str = "") -> bytes:
        """The answer's body; RefusedError, or UserError when none comes."""
        self._sequence = (self._sequence + 1) % 256
        wire = encode(Frame(self._sequence, op, body))
        for _ in range(_TRIES):
            self._line.send(wire)
            until = time.monotonic() + self._timeout_s
            while (left_s := until - time.monotonic()) > 0.0:
                for frame in self._reader.feed(self._line.receive(left_s)):
                    if (frame.sequence, frame.op) == (self._sequence, op | ANSWER):
                        return self._body(frame, what or op.name.lower())
        heard = self._reader.noise.decode(errors="replace").strip()
        raise NoAnswerError(
            f"no answer to {what or op.name.lower()}; "
            + (f"received instead: {heard[-200:]!r}" if heard else _NO_ANSWER)
        )

    def sealed(self, op: Op, body: bytes, what: str = "") -> bytes:
        """A request that can hurt: with counter and MAC, in a session opened with the key."""
        what = what or op.name.lower()
        for again in (True, False):
            if self._seal is None:
                self._open(what)
            assert self._seal is not None
            try:
                return self.request(Op.SEALED, self._seal.of(bytes((op,)) + body), what)
            except RefusedError as refused:
                # The session ends by itself after minutes of silence.
                if refused.status != _NOT_SEALED or not again:
                    raise
                self._seal = None
        raise AssertionError

    def _open(self, what: str, unlock: bool = False) -> None:
        """Answers a challenge; a drive gives none for a second from its power-up on, and for ten
        from the third wrong answer."""
        until_s = time.monotonic() + (_LOCKED_OUT_S if self._wait_for_lock else 0.0)
        while True:
            try:
                return self._answer_challenge(what, unlock)
            except RefusedError as refused:
                if refused.status != _NOT_NOW or time.monotonic() > until_s:
                    raise
                time.sleep(_POLL_S)

    def _answer_challenge(self, what: str, unlock: bool) -> None:
        """A broker passes the NOT_NOW of a drive just powered up on as its answer to UNLOCK."""
        nonce = struct.unpack("<Q", self.request(Op.CHALLENGE, self._acting, what))[0]
        answer = struct.pack("<Q", response(self._key, nonce, unlock))
        try:
            self.request(Op.UNLOCK, self._acting + answer, what)
        except RefusedError as refused:
            if refused.status not in (_REFUSED, _PROTECTED):
                raise
            raise UserError("the key is not this drive's; three wrong ones lock out") from None
        self._seal = Seal(self._key, nonce)

    def _body(self, frame: Frame, what: str) -> bytes:
        if not frame.body or frame.body[0] != 0:
            status, detail = (frame.body[0] if frame.body else -1), frame.body[1:]
            why = take_text(detail)[0] if status in _BROKERS_OWN and detail else ""
            raise RefusedError(what, status, detail, why)
        return frame.body[1:]

    # --- what there is ---------------------------------------------------------------------

    @cached_property
    def identity(self) -> Identity:
        head = struct.Struct("<HHHIIIff")
        body = self.request(Op.HELLO)
        if struct.unpack_from("<H", body)[0] != PROTOCOL:
            raise UserError(
                f"the drive speaks protocol {struct.unpack_from('<H', body)[0]}, not {PROTOCOL}; "
                "use the tools of its version"
            )
        return Identity(*head.unpack_from(body), take_text(body[head.size :])[0])

    @cached_property
    def parameters(self) -> dict[str, Parameter]:
        found = {}
        for index in range(self.identity.parameters):
            body = self.request(Op.PARAM_INFO, struct.pack("<H", index))
            parameter = Parameter.from_answer(index, body)
            found[parameter.name] = parameter
        return found

    @cached_property
    def signals(self) -> dict[str, Signal]:
        found = {}
        for number in range(self.identity.signals):
            body = self.request(Op.SIGNAL_INFO, bytes((number,)))
            name = take_text(body[1:])[0]
            found[name] = Signal(number, name, body[0] == 1)
        return found

    def parameter(self, name: str) -> Parameter:
        if name not in self.parameters:
            was = param_list.former().get(name)
            why = was.text if was else "no such parameter; tools/zh get lists them"
            raise UserError(f"{name}: {why}")
        return self.parameters[name]

    def signal(self, name: str) -> Signal:
        if name not in self.signals:
            raise UserError(f"{name}: no such signal; there are {', '.join(self.signals)}")
        return self.signals[name]

    # --- parameters, commands, status -------------------------------------------------------

    @cached_property
    def session(self) -> int:
        """From here on this client acts on the drive, and nobody else."""
        return struct.unpack("<I", self.request(Op.SESSION))[0]

    def forget_session(self) -> None:
        """The next request that acts asks for a new one."""
        self.__dict__.pop("session", None)
        self._seal = None

    def introduce(self, name: str) -> None:
        """Tells a broker who is there; a drive does not want to know."""
        told = name.encode()[:40]
        with contextlib.suppress(RefusedError):
            self.request(Op.CLIENT, bytes((len(told),)) + told, "hello")

    def roles(self) -> Roles:
        """Who else is at this broker, and who runs the drive."""
        body = self.request(Op.ROLES)
        own, commander = struct.unpack_from("<II", body)
        names, rest = {}, body[9:]
        for _ in range(body[8]):
            number = struct.unpack_from("<I", rest)[0]
            names[number], rest = take_text(rest[4:])
        return Roles(own, commander, names)

    def get(self, names: list[str]) -> dict[str, float]:
        values: dict[str, float] = {}
        most = BODY_MAX // 4 - 1
        for at in range(0, len(names), most):
            some = names[at : at + most]
            indices = [self.parameter(name).index for name in some]
            body = self.request(Op.GET, struct.pack(f"<{len(some)}H", *indices))
            values |= dict(zip(some, struct.unpack(f"<{len(some)}f", body), strict=True))
        return values

    def set(self, name: str, value: float) -> None:
        """RefusedError says what the value may be, and which other parameter is in the way."""
        parameter = self.parameter(name)
        what = f"{name} = {parameter.show(value)}"
        try:
            body = struct.pack("<IHf", self.session, parameter.index, value)
            self.sealed(Op.SET, body, what)
        except RefusedError as refused:
            why = self._why(parameter, value, refused)
            raise RefusedError(what, refused.status, refused.detail, why) from None

    def _why(self, parameter: Parameter, value: float, refused: RefusedError) -> str:
        """'' where the status says all there is."""
        if refused.status in (2, 3):
            return f"{REASONS[refused.status]}; give {parameter.span}"
        conflict = Conflict.from_answer(refused.detail)
        if refused.status != _REFUSED or conflict is None:
            return ""
        return f"is refused: {self._conflict_text(conflict, {parameter.name: value})}"

    def _conflict_text(self, conflict: Conflict, asked: dict[str, float]) -> str:
        involved = (conflict.first, conflict.second)
        names = [name for name, p in self.parameters.items() if p.index in involved]
        return conflict.text(self.parameters, self.get(names) | asked)

    def unlock(self, key: bytes) -> None:
        """Protected parameters can be set from now on, for some minutes."""
        self._key = key
        self._open("unlocking", unlock=True)

    def save(self, patience_s: float = 30.0) -> StoreState:
        """The parameters in use survive power-down; waits until they do."""
        self.sealed(Op.SAVE, self._acting, "saving")
        until_s = time.monotonic() + patience_s
        while (state := self.store()).saving:
            if time.monotonic() > until_s:
                raise UserError("the drive has not saved yet; it does so only with the gates off")
        if state.failed:
            raise UserError("the drive's flash has failed; the saved set stays as it was")
        return state

    def store(self) -> StoreState:
        body = self.request(Op.STORE)
        head = struct.unpack_from("<8I", body)
        rest = body[_STORE_TAIL_AT:]  # empty from a drive of before
        tail = struct.unpack_from("<II", rest) if rest else (0, 0)
        conflict = Conflict.from_answer(body[_STORE_CONFLICT_AT:])
        return StoreState(*head, *tail, self._conflict_text(conflict, {}) if conflict else "")

    def record(self) -> list[RecordEntry]:
        """All entries of the record in the drive's flash."""
        return [
            RecordEntry.from_answer(self.request(Op.STORE_ENTRY, struct.pack("<H", n)))
            for n in range(self.store().entries)
        ]

    @property
    def _acting(self) -> bytes:
        return struct.pack("<I", self.session)

    def command(
        self,
        bits: int,
        speed_rad_s: float = 0.0,
        valid_s: float = 0.0,
        torque_Nm: float | None = None,
    ) -> None:
        """valid_s: the drive stops by itself when no command follows in this time; 0: never.

        torque_Nm: the drive gives this torque instead of holding a speed.
        """
        valid_ms = min(round(valid_s * 1000.0), 0xFFFF)
        torque = b"" if torque_Nm is None else struct.pack("<f", torque_Nm)
        bits |= TORQUE_MODE if torque else 0
        body = struct.pack("<IIfH", self.session, bits, speed_rad_s, valid_ms) + torque
        if bits & ~TORQUE_OFF:
            self.sealed(Op.COMMAND, body)
        else:
            self.request(Op.COMMAND, body)  # a stop needs no key

    def status(self) -> Status:
        layout = struct.Struct(f"<{_WORDS_U}I{_WORDS_F}fI")
        body = self.request(Op.STATUS)
        behind = body[layout.size :]  # an older image ends here
        return Status(*layout.unpack_from(body), int.from_bytes(behind[:4], "little"))

    def commissioning(self) -> Commissioning:
        body = self.request(Op.COMMISSIONING, what="commissioning result")
        head = struct.Struct("<4I6f")
        *words, Rs, lost, leak, Rr, M, bias = head.unpack_from(body)
        curve = tuple(struct.iter_unpack("<3f", body[head.size :]))
        return Commissioning(*words, (Rs, lost, leak, Rr, M, bias), curve)

    def sample(self, names: list[str]) -> tuple[int, list[float]]:
        """Up to eight signals of one and the same period, and its number."""
        chosen = [self.signal(name) for name in names]
        body = self.request(Op.SAMPLE, bytes(s.number for s in chosen))
        period, *words = struct.unpack(f"<{1 + len(chosen)}I", body)
        return period, [s.value(w) for s, w in zip(chosen, words, strict=True)]

    # --- trace and faults -------------------------------------------------------------------

    def arm(
        self,
        names: list[str],
        *,
        trigger: str,
        edge: int,
        level: float,
        before: float,
        decimation: int,
        rows: int,
    ) -> tuple[int, int]:
        """Rows that will be recorded, and how many of them before the trigger."""
        watched = self.signal(trigger)
        body = struct.pack("<IB", self.session, len(names))
        body += bytes(self.signal(name).number for name in names)
        body += struct.pack(
            *("<IBBIfI", decimation, watched.number, edge),
            *(watched.word(level), before, rows),
        )
        return struct.unpack_from("<II", self.request(Op.TRACE_ARM, body, "trace set-up"))

    def trace_state(self) -> TraceState:
        body = self.request(Op.TRACE_STATE)
        *words, n = struct.unpack_from(f"<{_TRACE_WORDS}I", body)
        at = 4 * _TRACE_WORDS
        return TraceState(*words, tuple(body[at : at + n]))

    def stop_trace(self) -> None:
        self.request(Op.TRACE_STOP, struct.pack("<I", self.session))

    def trace_words(self, state: TraceState) -> list[tuple[int, ...]]:
        return self._rows(Op.TRACE_READ, state.rows, len(state.signals))

    def _rows(self, op: Op, rows: int, columns: int) -> list[tuple[int, ...]]:
        found: list[tuple[int, ...]] = []
        while len(found) < rows:
            body = self.request(op, struct.pack("<I", len(found)))
            found += struct.iter_unpack(f"<{columns}I", body)
        return found[:rows]

    def faults(self) -> tuple[int, list[FaultEntry]]:
        """How many there ever were, and the last ones, newest first."""
        body = self.request(Op.FAULT_LOG, what="fault list")
        return struct.unpack_from("<I", body)[0], [
            FaultEntry(*words) for words in struct.iter_unpack("<4I", body[4:])
        ]

    def fault_record(self) -> tuple[FaultRecord, list[tuple[int, ...]]] | None:
        """None when no fault has opened the gates yet."""
        try:
            body = self.request(Op.FAULT_RECORD)
        except RefusedError as refused:
            if refused.status == 4:
                return None
            raise
        *words, before = struct.unpack_from(f"<{_RECORD_WORDS}I", body)
        head = FaultRecord(*words, bool(before), tuple(body[4 * _RECORD_WORDS :]))
        return head, self._rows(Op.FAULT_READ, head.rows, len(head.signals))

    def clear_faults(self) -> None:
        self.sealed(Op.FAULT_CLEAR, self._acting)

    def stop(self) -> None:
        """Best effort, for the way out."""
        with contextlib.suppress(UserError):
            self.command(0)
