"""The flight recorder behind the page: keeps the last seconds, and a file of them at a fault."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from zerohertz.errors import UserError
from zerohertz.flight.wanted import Wanted
from zerohertz.link.client import Client, RefusedError

KEEP_S = 10.0
AFTER_S = 0.1
_TRY_S = 1.0
_NOT_NOW = 8


class Flights:
    """One recording at a time, beside whatever else the page lets run."""

    def __init__(self, connect: Callable[[], Client], folder: Path) -> None:
        self._connect, self._folder = connect, folder
        self._cancel = threading.Event()

    def cancel(self) -> None:
        self._cancel.set()

    def record(self, say: Callable[[str], None]) -> dict[str, Any]:
        """Until a fault, or cancelled: what is in the file."""
        self._cancel.clear()
        self._folder.mkdir(parents=True, exist_ok=True)
        file = self._folder / time.strftime("fault-%Y%m%d-%H%M%S.flight")
        wanted = Wanted(file, before_s=KEEP_S, after_fault_s=AFTER_S)
        with self._connect() as drive:
            while True:
                try:
                    told = wanted.record(drive, _TRY_S, say, lambda *_: not self._cancel.is_set())
                    break
                except RefusedError as refused:
                    if refused.status != _NOT_NOW:
                        raise
                if self._cancel.is_set():
                    raise UserError("cancelled")
        seconds = told.periods * told.period_s
        return {"file": str(file), "seconds": seconds, "fault": told.fault, "why": told.why}
