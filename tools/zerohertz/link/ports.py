"""Where the clients of a broker come in: TCP on the loopback, or a socket beside a serial port."""

from __future__ import annotations

import contextlib
import os
import select
import socket
import threading
import time
from pathlib import Path
from typing import Self

from zerohertz.errors import UserError
from zerohertz.link.broker import Broker
from zerohertz.link.guest import Guest, Lockout
from zerohertz.link.line import Line, SerialLine, SocketLine, UnixLine
from zerohertz.link.siphash import DEVELOPMENT_KEY

_CHUNK_BYTES = 4096
_FOLDER_MODE = 0o700
_BUSY_S = 2.0  # another command has the port for a moment
_POLL_S = 0.05


class Hub:
    """A broker with its ports. `with` closes both, and stops a drive that a client runs."""

    def __init__(self, line: Line, key: bytes = DEVELOPMENT_KEY) -> None:
        self.broker = Broker(line, key)
        self._lockout = Lockout()
        self._listeners: list[socket.socket] = []
        self._peers: set[socket.socket] = set()
        self._closed = False
        self._guard = threading.Lock()  # of both

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def guest(self) -> Guest:
        """One more client, whatever brings its bytes."""
        return Guest(self.broker, self._lockout)

    def line(self) -> SocketLine:
        """To this broker, from inside."""
        ours, theirs = socket.socketpair()
        threading.Thread(target=self._talk, args=(theirs,), daemon=True).start()
        return SocketLine(ours, "the broker")

    def listen_tcp(self, port: int) -> int:
        """The port: 0 takes a free one."""
        listener = socket.socket()
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listener.bind(("127.0.0.1", port))
        except OSError as error:
            raise UserError(f"--tcp {port}: cannot be used ({error}); give another one") from None
        self._listen(listener)
        return int(listener.getsockname()[1])

    def listen_beside(self, device: str) -> None:
        """Where every other command looks that is given this serial port."""
        path = socket_beside(device)
        path.unlink(missing_ok=True)  # the port is ours: nobody else can listen for it
        listener = socket.socket(socket.AF_UNIX)
        listener.bind(str(path))
        self._listen(listener)

    def close(self) -> None:
        """Nobody can come in any more; who is there hears that the line is closed."""
        self.broker.close()
        for listener in self._listeners:
            if listener.family == socket.AF_UNIX:
                Path(listener.getsockname()).unlink(missing_ok=True)
            with contextlib.suppress(OSError):
                listener.shutdown(socket.SHUT_RDWR)
            listener.close()
        with self._guard:
            self._closed = True
            peers = list(self._peers)
        for peer in peers:
            with contextlib.suppress(OSError):
                peer.shutdown(socket.SHUT_RDWR)

    def _listen(self, listener: socket.socket) -> None:
        listener.listen(8)
        self._listeners.append(listener)
        threading.Thread(target=self._accept, args=(listener,), daemon=True).start()

    def _accept(self, listener: socket.socket) -> None:
        while True:
            try:
                peer, _ = listener.accept()
            except OSError:
                return
            if peer.family == socket.AF_INET:
                peer.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            threading.Thread(target=self._talk, args=(peer,), daemon=True).start()

    def _talk(self, peer: socket.socket) -> None:
        with self._guard:
            if self._closed:  # it came in just before the door shut
                peer.close()
                return
            self._peers.add(peer)
        guest = self.guest()
        try:
            with contextlib.suppress(OSError), peer:
                while data := peer.recv(_CHUNK_BYTES):
                    peer.sendall(guest.feed(data))
        finally:
            with self._guard:
                self._peers.discard(peer)
            guest.leave()


class BrokerEnd:
    """The served drive's end of its line: a broker, with a TCP port for its clients."""

    def __init__(self, port: int) -> None:
        self._drive, ours = socket.socketpair()
        self.hub = Hub(SocketLine(ours, "the served drive"))
        self.port = self.hub.listen_tcp(port)
        self.name = f"127.0.0.1:{self.port}"

    def exchange(self, say: bytes, wait_s: float) -> bytes:
        if say:
            self._drive.sendall(say)
        readable, _, _ = select.select([self._drive], [], [], wait_s)
        return self._drive.recv(_CHUNK_BYTES) if readable else b""

    def close(self) -> None:
        self.hub.close()


def socket_beside(device: str) -> Path:
    """Of the broker that owns this serial port, if there is one; only for this user."""
    base = os.environ.get("XDG_RUNTIME_DIR")
    folder = Path(base) / "zerohertz" if base else Path(f"/tmp/zerohertz-{os.getuid()}")
    folder.mkdir(mode=_FOLDER_MODE, exist_ok=True)
    found = folder.stat()
    if found.st_uid != os.getuid() or found.st_mode & 0o077:
        raise UserError(f"{folder}: has to be this user's alone; remove it")
    return folder / (str(Path(device).resolve()).strip("/").replace("/", "-") + ".sock")


def line_to(device: str, baud: int, key: bytes, share: bool) -> tuple[Line, Hub | None]:
    """To the broker of this port, else to the port; share: as a broker that others find."""
    until_s = time.monotonic() + (_BUSY_S if Path(device).exists() else 0.0)
    while True:
        if (path := socket_beside(device)).exists():
            with contextlib.suppress(UserError):
                return UnixLine(path, wait_s=0.0), None
        try:
            serial = SerialLine(device, baud)
            break
        except UserError:
            if time.monotonic() > until_s:
                raise
        time.sleep(_POLL_S)
    if not share:
        return serial, None
    hub = Hub(serial, key)
    hub.listen_beside(device)
    return hub.line(), hub
