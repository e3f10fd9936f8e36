"""A stage of the test run: what it is called, what it waits for, what it answers."""

from __future__ import annotations

import subprocess
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from zerohertz.paths import ROOT
from zerohertz.testing import watchdog


@dataclass(frozen=True)
class Outcome:
    """Tests or checks that passed and failed, and one line to show."""

    passed: int
    failed: int
    note: str = ""


class Log:
    """Collects a stage's output in one file, so that parallel stages do not mix on the screen."""

    def __init__(self, path: Path) -> None:
        self.path = path
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("")

    def write(self, text: str) -> None:
        """Append a line."""
        with self.path.open("a") as file:
            file.write(text.rstrip("\n") + "\n")

    def run(self, *command: str | Path) -> int:
        """Run a command in the checkout; its output goes to the log. Returns its exit code."""
        words = [str(word) for word in command]
        self.write("$ " + " ".join(words))
        with self.path.open("a") as file:
            try:
                process = subprocess.Popen(
                    words, cwd=ROOT, stdin=subprocess.DEVNULL, stdout=file, stderr=subprocess.STDOUT
                )
            except FileNotFoundError:
                file.write(f"{words[0]}: not installed; run tools/zh setup\n")
                return 127
        try:
            return watchdog.wait(process, self.path)
        except watchdog.StoppedError as stopped:
            self.write(f"{words[0]}: {stopped}")
            return 124

    def check(self, *commands: tuple[str | Path, ...]) -> Outcome:
        """One check per command: passed where it exits with 0."""
        failed = sum(self.run(*command) != 0 for command in commands)
        return Outcome(len(commands) - failed, failed)


@dataclass(frozen=True)
class Stage:
    """`run` is started once all stages named in `needs` have passed; asked: in --only alone."""

    name: str
    what: str
    run: Callable[[Log], Outcome]
    needs: tuple[str, ...] = ()
    cores: int = 1
    quick: bool = False
    asked: bool = False


@dataclass
class Report:
    """What a stage that ran, or could not run, leaves behind."""

    stage: Stage
    outcome: Outcome
    seconds: float
    log: Path
    skipped: bool = False

    @property
    def ok(self) -> bool:
        """Nothing failed and something ran."""
        return self.outcome.failed == 0 and self.outcome.passed > 0


@dataclass
class Stopwatch:
    """Seconds since it was made."""

    start: float = field(default_factory=time.monotonic)

    def read(self) -> float:
        """Elapsed seconds."""
        return time.monotonic() - self.start
