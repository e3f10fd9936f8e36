"""A serial port for a page: `navigator.serial` as Chromium has it, its bytes over a WebSocket.

Chromium shows a dialog that headless browsers cannot answer; from the port's streams on everything
is the page's own code.
"""

from __future__ import annotations

import asyncio
import contextlib
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from tornado.httpserver import HTTPServer
from tornado.netutil import bind_sockets
from tornado.web import Application
from tornado.websocket import WebSocketClosedError, WebSocketHandler

from zerohertz.errors import UserError
from zerohertz.link.line import Line

FAKE = """
window.serialCalls = [];
Object.defineProperty(navigator, 'serial', { value: { requestPort: async () => ({
  async open(options) {
    window.serialCalls.push(options);
    const socket = new WebSocket('ws://127.0.0.1:PORT/');
    socket.binaryType = 'arraybuffer';
    await new Promise((resolve, reject) => {
      Object.assign(socket, { onopen: resolve, onerror: () => reject(new Error('no bridge')) });
    });
    this.readable = new ReadableStream({
      start(controller) {
        socket.onmessage = ({ data }) => controller.enqueue(new Uint8Array(data));
        socket.onclose = () => controller.error(new Error('device lost'));
      },
    });
    this.writable = new WritableStream({ write: (bytes) => socket.send(bytes) });
    this.close = async () => socket.close();
  },
}) } });
"""


@contextmanager
def bridged(line: Line) -> Iterator[str]:
    """Script for a page whose serial port is this line; at the end nobody reads the line."""
    sockets = bind_sockets(0, "127.0.0.1")
    port = sockets[0].getsockname()[1]
    loop = asyncio.new_event_loop()
    opened: list[_Port] = []
    thread = threading.Thread(target=_serve, args=(loop, sockets, line, opened), daemon=True)
    thread.start()
    try:
        yield FAKE.replace("PORT", str(port))
    finally:
        asyncio.run_coroutine_threadsafe(_unplug(opened), loop).result(60.0)
        loop.call_soon_threadsafe(loop.stop)
        thread.join(60.0)


async def _unplug(opened: list[_Port]) -> None:
    for port in opened:
        port.unplugged.set()
        port.close()
        await asyncio.to_thread(port.pump.join)


class _Port(WebSocketHandler):
    pump: threading.Thread
    unplugged: threading.Event

    def check_origin(self, origin: str) -> bool:
        return True

    def open(self, *args: str, **kwargs: str) -> None:
        self.unplugged = threading.Event()
        self.pump = threading.Thread(target=self._pump, daemon=True)
        self.pump.start()
        self.settings["opened"].append(self)

    def _pump(self) -> None:
        loop: asyncio.AbstractEventLoop = self.settings["loop"]
        while not self.unplugged.is_set():
            with contextlib.suppress(UserError):
                if data := self.settings["line"].receive(0.05):
                    asyncio.run_coroutine_threadsafe(self._send(data), loop)

    async def _send(self, data: bytes) -> None:
        with contextlib.suppress(WebSocketClosedError):
            await self.write_message(data, binary=True)

    def on_message(self, message: str | bytes) -> None:
        if isinstance(message, bytes):
            self.settings["line"].send(message)

    def on_close(self) -> None:
        self.unplugged.set()


def _serve(loop: asyncio.AbstractEventLoop, sockets: Any, line: Line, opened: list[_Port]) -> None:
    asyncio.set_event_loop(loop)

    async def begin() -> None:
        application = Application([("/", _Port)], loop=loop, line=line, opened=opened)
        HTTPServer(application).add_sockets(sockets)

    loop.run_until_complete(begin())
    loop.run_forever()
