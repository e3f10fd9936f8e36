"""A boot loader at the other end of a line. hal/boot/boot_link.h."""

from __future__ import annotations

import struct
import time
from collections.abc import Callable
from dataclasses import dataclass

from zerohertz.errors import UserError
from zerohertz.link.frame import Frame, Reader, encode
from zerohertz.link.line import Line
from zerohertz.update.image import Image

ASK, BEGIN, DATA, COMMIT = 0x70, 0x71, 0x72, 0x73
ANSWER, PROTOCOL = 0x80, 1
CHUNK_BYTES = 224
_NO_SUCH_OP = 5  # of an application, which does not know ASK
_TRIES = 5
_ANSWER_S = 1.0
_SLOW_S = 20.0  # a signature, an erasure, a copy
_ASK_EVERY_S = 0.1
_STATE = struct.Struct("<HIII16s")

REASONS = {
    1: "is of a format or a size that this loader does not take",
    2: "is for another board",
    3: "is not newer than what the drive has run",
    4: "was not signed with the key that the drive trusts",
    5: "arrived torn; try again",
    6: "the flash of the drive fails",
    7: "the drive's counter of versions is full: it takes no more updates",
    8: "the loader expected something else; try again",
    9: "the loader does not know this request; is it of another version?",
}


@dataclass(frozen=True)
class State:
    """What a loader says of itself."""

    running: int  # version of the application; 0: nothing can be started
    counter: int  # the lowest version it takes
    room_bytes: int
    board: str


class RefusedError(UserError):
    """The loader's answer had a status other than 0."""

    def __init__(self, status: int) -> None:
        super().__init__(REASONS.get(status, f"refused with status {status}"))
        self.status = status


class Loader:
    """Requests to a loader, each answered before the next is sent."""

    def __init__(self, line: Line, answer_s: float = _ANSWER_S, slow_s: float = _SLOW_S) -> None:
        self._line, self._answer_s, self._slow_s = line, answer_s, slow_s
        self._reader = Reader()
        self._sequence = time.monotonic_ns() // 1_000_000 % 256

    def find(
        self,
        wait_s: float,
        hint: Callable[[str], None],
        call: Callable[[], None] | None = None,
    ) -> State:
        """Waits for the loader, which listens for half a second after a reset; `call` makes an
        application that answers instead reset into it."""
        until_s = time.monotonic() + wait_s
        said = False
        while time.monotonic() < until_s:
            answer = self._once(ASK, b"", _ASK_EVERY_S)
            if answer is not None and answer[:1] == b"\0":
                return _state(answer[1:])
            running = answer is not None and answer[:1] == bytes((_NO_SUCH_OP,))
            if running and call is not None:
                call()
                call, said = None, True
                continue
            if not said:
                hint("the application runs" if running else "nobody answers yet")
                said = True
            if answer is not None:
                time.sleep(_ASK_EVERY_S)
        raise UserError("no boot loader answers; switch the drive off and on while this waits")

    def update(self, image: Image, progress: Callable[[int], None]) -> None:
        """Sends all of it; the loader then proves and starts it. Begun anew, it starts over."""
        try:
            self._request(BEGIN, image.header, self._slow_s)
            for at in range(0, len(image.application), CHUNK_BYTES):
                chunk = image.application[at : at + CHUNK_BYTES]
                self._request(DATA, struct.pack("<I", at) + chunk, self._answer_s)
                progress(at + len(chunk))
            self._request(COMMIT, b"", self._slow_s)
        except RefusedError:
            raise
        except UserError as lost:
            raise UserError(
                f"{lost}. The update is not complete: give the same command again"
            ) from None

    def _request(self, op: int, body: bytes, timeout_s: float) -> bytes:
        self._sequence = (self._sequence + 1) % 256
        for _ in range(_TRIES):
            answer = self._exchange(op, body, timeout_s)
            if answer is None:
                continue
            if answer[:1] != b"\0":
                raise RefusedError(answer[0] if answer else -1)
            return answer[1:]
        raise UserError("the loader has fallen silent")

    def _once(self, op: int, body: bytes, timeout_s: float) -> bytes | None:
        self._sequence = (self._sequence + 1) % 256
        return self._exchange(op, body, timeout_s)

    def _exchange(self, op: int, body: bytes, timeout_s: float) -> bytes | None:
        """One frame and what answers it in time."""
        self._line.send(encode(Frame(self._sequence, op, body)))
        until_s = time.monotonic() + timeout_s
        while (left_s := until_s - time.monotonic()) > 0.0:
            for frame in self._reader.feed(self._line.receive(left_s)):
                if (frame.sequence, frame.op) == (self._sequence, op | ANSWER):
                    return frame.body
        return None


def _state(body: bytes) -> State:
    if len(body) != _STATE.size or body[0] != PROTOCOL:
        raise UserError("the loader speaks another protocol; take the tools of its version")
    _, running, counter, room, board = _STATE.unpack(body)
    return State(running, counter, room, board.rstrip(b"\0").decode(errors="replace"))


def refusal(image: Image, state: State) -> str | None:
    """What the loader would refuse, said before anything is sent."""
    if image.board != state.board:
        return f"is for the board {image.board}; this one is {state.board}"
    if len(image.application) > state.room_bytes:
        return f"has {len(image.application)} bytes; {state.room_bytes} is the most"
    least = state.counter + (1 if state.running else 0)
    if image.version < least:
        return f"is version {image.version}; this drive takes {least} or higher"
    return None


def send(
    loader: Loader,
    image: Image,
    wait_s: float = 60.0,
    progress: Callable[[int], None] = lambda _: None,
    hint: Callable[[str], None] = lambda _: None,
    call: Callable[[], None] | None = None,
) -> State:
    """An update from finding the loader to its word that the new version runs."""
    state = loader.find(wait_s, hint, call)
    if (why := refusal(image, state)) is not None:
        raise UserError(why)
    loader.update(image, progress)
    state = loader.find(wait_s, lambda _: None)
    if state.running != image.version:
        raise UserError(f"version {state.running or 'none'} starts instead; try again")
    return state
