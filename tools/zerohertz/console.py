"""What a command says on the way, beside its answer: lines, paths and a progress bar, on stderr."""

from __future__ import annotations

import contextlib
import re
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

_console = Console(stderr=True)


def tell(text: str) -> None:
    """One line."""
    _console.print(text, highlight=False, soft_wrap=True)


def short_paths(text: object) -> str:
    """A path, or a text with paths: those below the current folder as seen from there."""
    here = re.escape(str(Path.cwd()))
    return re.sub(rf"(?<![\w./-]){here}/(?=\S)", "", str(text))


@contextlib.contextmanager
def progress_bar(text: str, total: int) -> Iterator[Callable[[int], None]]:
    """A bar where somebody looks; what is done is set, not added."""
    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.completed}"))
    hidden = not sys.stderr.isatty()
    with Progress(
        *columns, TimeRemainingColumn(), console=_console, transient=True, disable=hidden
    ) as bar:
        task = bar.add_task(text, total=total)
        yield lambda done: bar.update(task, completed=done)
