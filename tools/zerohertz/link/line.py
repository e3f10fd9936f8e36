"""Where bytes go to and come from: a TCP socket (SIL, emulator) or a serial port."""

from __future__ import annotations

import contextlib
import errno
import select
import socket
import time
from pathlib import Path
from typing import Protocol

from zerohertz.errors import UserError

DEFAULT_TCP_PORT = 7405
DEFAULT_BAUD = 115200
_CONNECT_S = 5.0


class Line(Protocol):
    """Bytes in both directions."""

    def send(self, data: bytes) -> None: ...

    def receive(self, timeout_s: float) -> bytes:
        """What has come, empty after the time; UserError when the other end is gone."""
        ...

    def close(self) -> None: ...


class SocketLine:
    """A connected socket."""

    def __init__(self, connected: socket.socket, where: str) -> None:
        self._socket, self._where = connected, where

    def send(self, data: bytes) -> None:
        try:
            self._socket.sendall(data)
        except OSError as error:
            raise UserError(f"{self._where}: the connection is gone ({error})") from None

    def receive(self, timeout_s: float) -> bytes:
        with contextlib.suppress(OSError, ValueError):  # closed meanwhile
            readable, _, _ = select.select([self._socket], [], [], timeout_s)
            if not readable:
                return b""
            if data := self._socket.recv(65536):
                return data
        raise UserError(f"{self._where}: the other end has closed the connection")

    def close(self) -> None:
        with contextlib.suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)
        self._socket.close()


class TcpLine(SocketLine):
    """A socket on this machine."""

    def __init__(self, port: int, host: str = "127.0.0.1") -> None:
        where = f"{host}:{port}"
        try:
            connected = socket.create_connection((host, port), timeout=_CONNECT_S)
        except OSError as error:
            raise UserError(f"{where}: no connection ({error}); start tools/zh serve") from None
        connected.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        super().__init__(connected, where)


class UnixLine(SocketLine):
    """A socket in the file system: the emulated image's, or a broker's. Waits for it."""

    def __init__(self, path: Path, wait_s: float = _CONNECT_S) -> None:
        connected = socket.socket(socket.AF_UNIX)
        until_s = time.monotonic() + wait_s
        while True:
            try:
                connected.connect(str(path))
                break
            except OSError as error:
                if time.monotonic() > until_s:
                    raise UserError(f"{path}: no connection ({error})") from None
            time.sleep(0.01)
        super().__init__(connected, str(path))


class SerialLine:
    """A serial port, or the terminal that `zh serve --pty` names; one program has it at a time."""

    def __init__(self, device: str, baud: int = DEFAULT_BAUD) -> None:
        import serial

        self._device = device
        try:
            self._serial = serial.Serial(device, baud, timeout=0, exclusive=True)
        except (OSError, ValueError) as error:
            raise UserError(f"--port {device}: {_why_closed(device, error)}") from None

    def send(self, data: bytes) -> None:
        try:
            self._serial.write(data)
        except OSError as error:
            raise UserError(f"--port {self._device}: is gone ({error})") from None

    def receive(self, timeout_s: float) -> bytes:
        try:
            self._serial.timeout = timeout_s
            first = self._serial.read(1)
            return first + self._serial.read(self._serial.in_waiting) if first else b""
        except OSError as error:
            raise UserError(f"--port {self._device}: is gone ({error})") from None

    def close(self) -> None:
        self._serial.close()


def _why_closed(device: str, error: OSError | ValueError) -> str:
    """A wrong name, a missing right, or what the system says."""
    from serial.tools.list_ports import comports

    there = sorted(port.device for port in comports())
    if device not in there and not Path(device).exists():
        return f"there is no such device; serial ports here: {', '.join(there) or 'none'}"
    if getattr(error, "errno", None) == errno.EACCES:
        return "cannot be opened: no permission; add your user to the group of the device"
    return f"cannot be opened ({error})"
