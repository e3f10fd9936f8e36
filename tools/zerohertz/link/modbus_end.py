"""Where a Modbus master reaches the served drive: RTU frames on TCP, or a terminal device."""

from __future__ import annotations

import contextlib
import select
import socket

from zerohertz.errors import UserError
from zerohertz.link.server import PtyEnd

_CHUNK_BYTES = 4096


class TcpEnd:
    """One master at a time on the loopback: a serial line has one, too."""

    def __init__(self, port: int) -> None:
        self._listener = socket.socket()
        self._listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            self._listener.bind(("127.0.0.1", port))
        except OSError as error:
            self._listener.close()
            raise UserError(f"--modbus {port}: cannot be used ({error}); give another") from None
        self._listener.listen(1)
        self._master: socket.socket | None = None
        self.name = f"127.0.0.1:{self._listener.getsockname()[1]}"

    def exchange(self, say: bytes, wait_s: float) -> bytes:
        """What the master says; it hears `say`."""
        if self._master is None:
            if not select.select([self._listener], [], [], wait_s)[0]:
                return b""
            self._master, _ = self._listener.accept()
            self._master.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        with contextlib.suppress(OSError):
            self._master.sendall(say)
            if not select.select([self._master], [], [], wait_s)[0]:
                return b""
            if data := self._master.recv(_CHUNK_BYTES):
                return data
        self._master.close()
        self._master = None
        return b""

    def close(self) -> None:
        if self._master is not None:
            self._master.close()
        self._listener.close()


def modbus_end(where: str) -> TcpEnd | PtyEnd:
    """A TCP port, 0 for a free one, or `pty`."""
    if where == "pty":
        return PtyEnd()
    if not where.isdigit() or int(where) > 65535:
        raise UserError(f"--modbus {where}: give a TCP port or pty")
    return TcpEnd(int(where))
