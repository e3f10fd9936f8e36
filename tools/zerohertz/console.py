"""What a command says on the way, beside its answer: lines, paths and a progress bar, on stderr."""

from __future__ import annotations

import contextlib
import re
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

_console = Console(stderr=True)
LINE_EVERY_S = 60.0  # of a long run whose output goes to a file


def tell(text: str) -> None:
    """One line."""
    _console.print(text, highlight=False, soft_wrap=True)


def short_paths(text: object) -> str:
    """A path, or a text with paths: those below the current folder as seen from there."""
    here = re.escape(str(Path.cwd()))
    return re.sub(rf"(?<![\w./-]){here}/(?=\S)", "", str(text))


@contextlib.contextmanager
def progress_bar(text: str, total: int) -> Iterator[Callable[[int], None]]:
    """A bar where somebody looks, else a line a minute; what is done is set, not added."""
    if not sys.stderr.isatty():
        yield _lines(text, total)
        return
    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.completed}"))
    with Progress(*columns, TimeRemainingColumn(), console=_console, transient=True) as bar:
        task = bar.add_task(text, total=total)
        yield lambda done: bar.update(task, completed=done)


def _lines(text: str, total: int) -> Callable[[int], None]:
    said_s = time.monotonic()

    def update(done: int) -> None:
        nonlocal said_s
        if time.monotonic() - said_s >= LINE_EVERY_S:
            said_s = time.monotonic()
            tell(f"  {text}: {done} of {total}" if total else f"  {text}: {done}")

    return update
