"""Rules of CONVENTIONS 6 for the words: sentences of one idea, the terms of the field.

Read: pages, comments of headers, texts of parameters and faults, help of every command. A sentence
also ends at a semicolon. A word has two letters in a row, so numbers and signs do not count.
"""

from __future__ import annotations

import re
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

# Words of a sentence: more fail the check, more than AIM are listed in its log.
LIMIT = 45
AIM = 25
# What this project once wrote, and what the field writes (CONTRACTS 7, CONVENTIONS 6).
WORDS = {
    "impressed current": "I-f",
    "flux_level": "flux_reference",
    "lockstep witness": "lockstep peer",
    "is no number": "is not finite",
    "periods on end": "periods in a row",
    "what the legs lose": "the dead-time loss",
    "nobody knows": "is unknown",
}
HEADERS = ("firmware/*.h", "firmware/*.def", "hal/*.h", "host_sim/*.h", "host_sim/*.hpp")
_COMMENT = re.compile(r"/\*.*?\*/|(?:^[ \t]*//[^\n]*\n)+|//[^\n]*", re.DOTALL | re.MULTILINE)
_STRINGS = re.compile(r'"[^"\n]*"(?:\s*"[^"\n]*")*')
# Not behind these.
_SHORT = r"(?<!e\.g\.)(?<!i\.e\.)(?<!Fig\.)(?<!Figs\.)(?<!eq\.)"
_END = re.compile(rf"(?:(?<=[.!?]){_SHORT}|(?<=;))[\"')*\]]*\s+")
_WORD = re.compile(r"[A-Za-z]{2}")


@dataclass(frozen=True)
class Passage:
    """A paragraph, an item of a list, a comment or a text, and where it stands."""

    where: str
    text: str


def tracked(root: Path, *patterns: str) -> list[Path]:
    """Files under version control that match."""
    command = ("git", "-C", str(root), "ls-files", "-z", *patterns)
    listed = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    return [root / name for name in listed.split("\0") if name]


def breaches(passages: list[Passage]) -> list[str]:
    """Sentences beyond LIMIT and words that are called otherwise, as `where: what is wrong`."""
    found = [f"{p.where}: {n} words, at most {LIMIT}: {s}" for p, n, s in _beyond(passages, LIMIT)]
    for p in passages:
        text = p.text.lower()
        found += [f"{p.where}: `{w}` is called `{b}`" for w, b in WORDS.items() if w in text]
    return found


def long_sentences(passages: list[Passage]) -> list[str]:
    """Sentences beyond AIM, for the log."""
    return [f"{p.where}: {n} words: {s}" for p, n, s in _beyond(passages, AIM)]


def _beyond(passages: list[Passage], limit: int) -> Iterator[tuple[Passage, int, str]]:
    for passage in passages:
        for sentence in sentences(passage.text):
            words = sum(bool(_WORD.search(word)) for word in sentence.split())
            if words > limit:
                yield passage, words, sentence


def sentences(text: str) -> list[str]:
    """A link counts by its text, code as one word."""
    text = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", " ".join(text.split()))
    return _END.split(re.sub(r"`[^`]*`", "`code`", text))


def prose(text: str) -> Iterator[tuple[int, str]]:
    """Lines of a page outside fenced code, numbered from 1."""
    code = False
    for number, line in enumerate(text.splitlines(), 1):
        if line.lstrip().startswith("```"):
            code = not code
        elif not code:
            yield number, line


def of_lines(where: str, lines: Iterator[tuple[int, str]]) -> Iterator[Passage]:
    """Paragraphs of a page; tables, headings and pictures are none."""
    begin, words = 0, []
    for number, line in (*lines, (0, "")):
        text = line.strip()
        item = re.match(r"(?:[-*]|\d+\.) ", text)
        other = not text or text.startswith(("|", "#", "<", "!["))
        if words and (item or other):
            yield Passage(f"{where}:{begin}", " ".join(words))
            words = []
        if not other:
            begin = begin if words else number
            words.append(text[item.end() :] if item else text)


def of_source(where: str, text: str) -> Iterator[Passage]:
    """Comments of C or C++, each paragraph by itself, and the strings of a .def."""
    for comment in _COMMENT.finditer(text):
        first = text.count("\n", 0, comment.start()) + 1
        lines = re.sub(r"(?m)^\s*(?:/\*|\*/|\*(?!/)|//)|\*/$", "", comment[0]).split("\n")
        # Indented: a formula or a diagram, each line by itself.
        apart = [line if not line.startswith("   ") else f"- {line.strip()}" for line in lines]
        yield from of_lines(where, iter(list(enumerate(apart, first))))
    if where.endswith(".def"):
        code = _COMMENT.sub(lambda m: "\n" * m[0].count("\n"), text)
        for strings in _STRINGS.finditer(code):
            line = code.count("\n", 0, strings.start()) + 1
            yield Passage(f"{where}:{line}", re.sub(r'"\s*"', "", strings[0]).strip('"'))


def of_help(command: Any, words: str = "zh") -> Iterator[Passage]:
    """Help of a command, of its options and of the commands below it."""
    for paragraph in (command.help or "").split("\n\n"):
        yield Passage(words, paragraph)
    for parameter in command.params:
        yield Passage(
            f"{words} {max(parameter.opts, key=len)}", getattr(parameter, "help", "") or ""
        )
    for name, below in getattr(command, "commands", {}).items():
        yield from of_help(below, f"{words} {name}")


def of_pages(root: Path) -> list[Passage]:
    """Of every page under version control."""
    return [
        passage
        for page in tracked(root, "*.md")
        for passage in of_lines(
            str(page.relative_to(root)), prose(page.read_text(encoding="utf-8"))
        )
    ]


def of_sources(root: Path) -> list[Passage]:
    """Of every header and list under version control."""
    return [
        passage
        for path in tracked(root, *HEADERS)
        for passage in of_source(str(path.relative_to(root)), path.read_text(encoding="utf-8"))
    ]


def of_commands() -> list[Passage]:
    """Of the whole command line."""
    import typer

    from zerohertz.cli import make_app

    return list(of_help(typer.main.get_command(make_app())))
