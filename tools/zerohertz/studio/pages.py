"""The local server of `zh studio`: the page, the drive's bytes, and the tools behind it.

It listens on the loopback alone and serves one origin: a page of another origin can neither read
the drive nor reach its link. What can hurt needs the drive's key, which the page asks its user for.
"""

from __future__ import annotations

import asyncio
import contextlib
import hmac
import json
import secrets
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

from tornado.httpserver import HTTPServer
from tornado.web import Application, HTTPError, StaticFileHandler
from tornado.websocket import WebSocketClosedError, WebSocketHandler

from zerohertz.errors import UserError
from zerohertz.link.line import Line
from zerohertz.link.siphash import tools_response
from zerohertz.studio.tools import Tools

Dial = Callable[[], Line]

_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; "
    "img-src 'self' data:; connect-src 'self'; worker-src blob:; base-uri 'none'; "
    "form-action 'none'; frame-ancestors 'none'"
)
_MESSAGE_BYTES = 65536


def local_hosts(port: int) -> set[str]:
    """What a browser on this machine calls us; nothing that a foreign name server could add."""
    return {f"{name}:{port}" for name in ("127.0.0.1", "localhost")}


class _Files(StaticFileHandler):
    def prepare(self) -> None:
        if self.request.host not in self.settings["hosts"]:
            raise HTTPError(403)

    def set_extra_headers(self, path: str) -> None:
        self.set_header("Content-Security-Policy", _POLICY)
        self.set_header("Cache-Control", "no-cache")
        self.set_header("X-Content-Type-Options", "nosniff")
        self.set_header("Referrer-Policy", "no-referrer")


class _Socket(WebSocketHandler):
    def check_origin(self, origin: str) -> bool:
        hosts = self.settings["hosts"]
        return self.request.host in hosts and origin in {f"http://{host}" for host in hosts}

    def tell(self, message: str | bytes) -> None:
        """From any thread."""

        async def send() -> None:
            with contextlib.suppress(WebSocketClosedError):
                await self.write_message(message, binary=isinstance(message, bytes))

        asyncio.run_coroutine_threadsafe(send(), self.settings["loop"])


class _Link(_Socket):
    """The bytes of one page, to and from the broker."""

    _line: Line | None = None

    def open(self) -> None:
        self.set_nodelay(True)
        try:
            self._line = self.settings["dial"]()
        except UserError as error:
            self.close(1011, str(error)[:120])
            return
        threading.Thread(target=self._pump, daemon=True).start()

    def _pump(self) -> None:
        assert self._line is not None
        try:
            while True:
                if data := self._line.receive(1.0):
                    self.tell(data)
        except UserError as error:
            why = str(error)[:120]
            self.settings["loop"].call_soon_threadsafe(self.close, 1011, why)

    def on_message(self, message: str | bytes) -> None:
        if isinstance(message, bytes) and self._line is not None:
            with contextlib.suppress(UserError):
                self._line.send(message)

    def on_close(self) -> None:
        if self._line is not None:
            self._line.close()


class _ToolsSocket(_Socket):
    """JSON: commissioning and design, for a page whose user has the key."""

    def open(self) -> None:
        self._nonce = secrets.randbits(64)
        self._known = False
        self.tell(json.dumps({"nonce": f"{self._nonce:016x}"}))

    def on_message(self, message: str | bytes) -> None:
        try:
            asked = json.loads(message)
            if not self._known:
                self._open_with(str(asked["response"]))
                return
            self.settings["tools"].begin(asked, lambda event: self.tell(json.dumps(event)))
        except (ValueError, KeyError, TypeError):
            self.close(1003, "not understood")

    def _open_with(self, answer: str) -> None:
        expected = tools_response(self.settings["key"], self._nonce).to_bytes(8, "little").hex()
        self._known = hmac.compare_digest(expected.encode(), answer.encode())
        self._nonce = secrets.randbits(64)
        self.tell(json.dumps({"open": self._known} | self.settings["tools"].offer))

    def on_close(self) -> None:
        self.settings["tools"].abandon()


async def serve_pages(
    folder: Path, listening: Any, dial: Dial, key: bytes, tools: Tools, stop: asyncio.Event
) -> None:
    """Until `stop` is set."""
    port = listening.getsockname()[1]
    application = Application(
        [
            ("/link", _Link),
            ("/tools", _ToolsSocket),
            ("/(.*)", _Files, {"path": str(folder), "default_filename": "index.html"}),
        ],
        hosts=local_hosts(port),
        loop=asyncio.get_running_loop(),
        dial=dial,
        key=key,
        tools=tools,
        websocket_max_message_size=_MESSAGE_BYTES,
        log_function=lambda _: None,
    )
    server = HTTPServer(application)
    server.add_sockets([listening])
    await stop.wait()
    server.stop()
    await server.close_all_connections()
