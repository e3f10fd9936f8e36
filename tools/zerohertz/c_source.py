"""Tokens of C text: enough to check rules on it and to mutate it, without a compiler."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

_TOKEN = re.compile(
    r"""
    (?P<comment>/\*.*?\*/|//[^\n]*)
  | (?P<directive>^[ \t]*\#(?:\\\n|/\*.*?\*/|[^\n])*)
  | (?P<string>"(?:\\.|[^"\\\n])*"|'(?:\\.|[^'\\\n])*')
  | (?P<number>(?:0[xX][0-9a-fA-F]+|(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)[a-zA-Z]*)
  | (?P<name>[A-Za-z_]\w*)
  | (?P<operator><<=|>>=|\.\.\.|->|\+\+|--|<<|>>|<=|>=|==|!=|&&|\|\||[-+*/%&|^]=
        |[-+*/%&|^~!<>=?:;,.(){}\[\]])
    """,
    re.VERBOSE | re.MULTILINE | re.DOTALL,
)


@dataclass(frozen=True)
class Token:
    """One token; `start` counts characters from the beginning of the text."""

    kind: str
    text: str
    start: int
    line: int

    @property
    def end(self) -> int:
        """Just behind the last character."""
        return self.start + len(self.text)


def tokens(text: str, directives: bool = False) -> list[Token]:
    """The tokens of C text without comments, and without preprocessor lines unless asked for."""
    return [
        token
        for token in _scan(text)
        if token.kind != "comment" and (directives or token.kind != "directive")
    ]


def _scan(text: str) -> Iterator[Token]:
    line, counted = 1, 0
    for match in _TOKEN.finditer(text):
        line += text.count("\n", counted, match.start())
        counted = match.start()
        yield Token(str(match.lastgroup), match.group(), match.start(), line)


def includes(text: str) -> list[tuple[int, str]]:
    """Line and argument, with its quotes or angle brackets, of every #include."""
    found = []
    for token in tokens(text, directives=True):
        match = re.match(r'\s*#\s*include\s*(<[^>]+>|"[^"]+")', token.text)
        if token.kind == "directive" and match:
            found.append((token.line, match.group(1)))
    return found
