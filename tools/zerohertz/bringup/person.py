"""Who reads the meters: somebody at the keyboard, a file of answers, or the simulated bench."""

from __future__ import annotations

import json
import queue
import sys
import threading
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from zerohertz.bringup.measure import Meter
from zerohertz.errors import UserError

_LOOK_S = 0.1


@dataclass(frozen=True)
class Reading:
    """One number that a person reads from an instrument."""

    name: str
    question: str
    unit: str


class Person(Protocol):
    """Asked in the order of the steps."""

    def ready(self, text: str) -> None:
        """Says that everything is connected; KeyboardInterrupt when not today."""
        ...

    def read(self, step: str, reading: Reading, meanwhile: Callable[[], None]) -> float:
        """meanwhile: to be called several times a second, as the drive is running."""
        ...


class Keyboard:
    """Questions on the terminal; q stops, to go on another day. End of input is a UserError."""

    def ready(self, text: str) -> None:
        if self._line(f"{text}\n  Enter: go on; q: stop here ", lambda: None).lower() == "q":
            raise KeyboardInterrupt

    def read(self, step: str, reading: Reading, meanwhile: Callable[[], None]) -> float:
        while True:
            text = self._line(f"  {reading.question}, {reading.unit} (q: stop): ", meanwhile)
            if text.lower() == "q":
                raise KeyboardInterrupt
            try:
                return float(text.replace(",", "."))
            except ValueError:
                print("  that is no number", file=sys.stderr)

    def _line(self, prompt: str, meanwhile: Callable[[], None]) -> str:
        print(prompt, end="", file=sys.stderr, flush=True)
        typed: queue.Queue[str] = queue.Queue()
        threading.Thread(target=lambda: typed.put(sys.stdin.readline()), daemon=True).start()
        while True:
            try:
                line = typed.get(timeout=_LOOK_S)
            except queue.Empty:
                meanwhile()
                continue
            if not line:
                asked = prompt.strip().splitlines()[0].removesuffix(" (q: stop):")
                raise UserError(f"the input has ended, and '{asked}' is missing; run it again")
            return line.strip()


class Answers:
    """Of a JSON file: {"step.reading": number, ...}; without the step it holds for all."""

    def __init__(self, path: Path) -> None:
        try:
            read = json.loads(path.read_text(encoding="utf-8"))
            self._answers = {str(k): float(v) for k, v in read.items()}
        except (OSError, ValueError, TypeError, AttributeError) as error:
            raise UserError(
                f"--answers {path}: is not a JSON object of numbers ({error})"
            ) from None
        self._path = path

    def ready(self, text: str) -> None:
        pass

    def read(self, step: str, reading: Reading, meanwhile: Callable[[], None]) -> float:
        for key in (f"{step}.{reading.name}", reading.name):
            if key in self._answers:
                return self._answers[key]
        raise UserError(f"{self._path}: {step}.{reading.name}: is missing; give {reading.unit}")


class Simulated:
    """Reads the instruments of a simulated bench."""

    def __init__(self, meter: Meter) -> None:
        self._meter = meter

    def ready(self, text: str) -> None:
        pass

    def read(self, step: str, reading: Reading, meanwhile: Callable[[], None]) -> float:
        return self._meter(reading.name)
