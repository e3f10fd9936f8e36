"""Mutants of C text: one small, wrong change each, made on tokens.

A mutant that no unit test notices shows a promise that nobody checks (CONVENTIONS 11). Comments,
strings, preprocessor lines (but the number of a #define), enumerations and type declarations stay
as they are: mutating them gives text, not behaviour.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

from zerohertz.c_source import Token, tokens

_SWAPS = {
    "+": ("-",),
    "-": ("+",),
    "*": ("/",),
    "/": ("*",),
    "%": ("*",),
    "+=": ("-=",),
    "-=": ("+=",),
    "*=": ("/=",),
    "/=": ("*=",),
    "|=": ("&=",),
    "&=": ("|=",),
    "^=": ("|=",),
    "++": ("--",),
    "--": ("++",),
    "<": ("<=", ">="),
    "<=": ("<", ">"),
    ">": (">=", "<="),
    ">=": (">", "<"),
    "==": ("!=",),
    "!=": ("==",),
    "&&": ("||",),
    "||": ("&&",),
    "&": ("|",),
    "|": ("&",),
    "^": ("|",),
    "<<": (">>",),
    ">>": ("<<",),
}
# Operators that are something else when nothing stands before them: sign, address, pointer.
_BINARY_ONLY = {"+", "-", "*", "&"}
_NAMES = {"true": "false", "false": "true", "minf": "maxf", "maxf": "minf"}
_MEMBERS = {"alpha": "beta", "beta": "alpha", "d": "q", "q": "d", "u": "v", "v": "w", "w": "u"}
_KEYWORDS_BEFORE_EXPRESSION = {"return", "case", "else", "do"}
_TYPE_WORDS = {"typedef", "struct", "union", "enum", "extern"}
_DEFINED_NUMBER = re.compile(
    r"\s*#\s*define\s+\w+\s+(\(?-?)([\d.]+[\w.+-]*?)\)?\s*(?:/\*.*)?", re.DOTALL
)


@dataclass(frozen=True)
class Mutant:
    """The characters from `start` to `end` of a file become `new`."""

    file: str
    start: int
    end: int
    new: str
    line: int
    kind: str

    def apply(self, text: str) -> str:
        """The mutated file."""
        return text[: self.start] + self.new + text[self.end :]

    def before_after(self, text: str) -> tuple[str, str]:
        """The line as it was and as it becomes, without the indentation."""
        head = text.rfind("\n", 0, self.start) + 1
        tail = text.find("\n", self.end)
        tail = len(text) if tail < 0 else tail
        after = text[head : self.start] + self.new + text[self.end : tail]
        return " ".join(text[head:tail].split()), " ".join(after.split())


def mutants(file: str, text: str) -> list[Mutant]:
    """All mutants of one file, in the order of their place."""
    found: list[Mutant] = []

    def add(first: Token, last: Token, new: str, kind: str) -> None:
        found.append(Mutant(file, first.start, last.end, new, first.line, kind))

    code = tokens(text, directives=True)
    frozen = _frozen(code)
    for index, token in enumerate(code):
        if index in frozen:
            continue
        if token.kind == "directive":
            found += _of_define(file, token)
            continue
        for new, kind in _of_token(code, index):
            add(token, token, new, kind)
        for last, new, kind in _of_construct(text, code, index):
            add(token, last, new, kind)
    return sorted(set(found), key=lambda m: (m.start, m.end, m.new))


def _frozen(code: list[Token]) -> set[int]:
    """Indices inside enumerations, type declarations, asserts and prototypes' type lists."""
    frozen: set[int] = set()
    index = 0
    while index < len(code):
        text = code[index].text
        if text in _TYPE_WORDS or text in ("assert", "_Static_assert"):
            end = _statement_end(code, index)
            frozen.update(range(index, end + 1))
            index = end
        index += 1
    return frozen


def _statement_end(code: list[Token], index: int) -> int:
    """Index of the semicolon that ends what starts here, braces skipped."""
    depth = 0
    for i in range(index, len(code)):
        depth += (code[i].text in ("{", "(")) - (code[i].text in ("}", ")"))
        if code[i].text == ";" and depth <= 0:
            return i
    return len(code) - 1


def _of_define(file: str, token: Token) -> Iterator[Mutant]:
    match = _DEFINED_NUMBER.fullmatch(token.text)
    if match:
        for new in _numbers(match.group(2)):
            start = token.start + match.start(2)
            yield Mutant(file, start, start + len(match.group(2)), new, token.line, "constant")


def _of_token(code: list[Token], index: int) -> Iterator[tuple[str, str]]:
    kind, text = code[index].kind, code[index].text
    if kind == "operator":
        yield from _of_operator(code, index)
    elif kind == "number":
        for new in _numbers(text):
            yield new, "constant"
    elif kind == "name" and text in _NAMES:
        yield _NAMES[text], "name"
    elif kind == "name" and text in _MEMBERS and index and code[index - 1].text in (".", "->"):
        yield _MEMBERS[text], "component"


def _of_operator(code: list[Token], index: int) -> Iterator[tuple[str, str]]:
    text = code[index].text
    binary = index > 0 and _ends_operand(code[index - 1])
    if text == "!":
        yield "", "negation"
    elif text not in _BINARY_ONLY or (binary and not _is_declarator(code, index)):
        for new in _SWAPS.get(text, ()):
            yield new, "operator"
    elif text == "-" and not binary:
        yield "", "sign"


def _ends_operand(token: Token) -> bool:
    if token.kind == "name":
        return token.text not in _KEYWORDS_BEFORE_EXPRESSION
    return token.kind == "number" or token.text in (")", "]")


def _is_declarator(code: list[Token], index: int) -> bool:
    """`float *x` and `(const motor_t *)`: a star behind a type name, not a product."""
    if code[index].text != "*":
        return False
    before, after = code[index - 1].text, code[index + 1].text
    is_type = before.endswith("_t") or before in ("float", "char", "void", "const", "int")
    return is_type or after in (")", "const")


def _numbers(text: str) -> list[str]:
    """Other values for a literal: floats by zero, one and ten per cent, integers by one."""
    if text[:2].lower() == "0x":
        digits = text[2:].rstrip("uUlL")
        suffix = text[2 + len(digits) :]
        return [f"0x{int(digits, 16) ^ 1:X}{suffix}"]
    if text.lower().endswith("f") or "." in text:
        value = float(text.rstrip("fF"))
        suffix = "f" if text.lower().endswith("f") else ""
        others = [1.0, -1.0] if value == 0.0 else [0.0, 1.1 * value]
        return [f"{other!r}{suffix}" for other in others]
    digits = text.rstrip("uUlL")
    suffix = text[len(digits) :]
    value = int(digits, 8 if digits.startswith("0") and len(digits) > 1 else 10)
    return [f"{value + 1}{suffix}"]


def _of_construct(text: str, code: list[Token], index: int) -> Iterator[tuple[Token, str, str]]:
    """Mutants of more than one token: last token, new text, kind."""
    token = code[index]
    if token.text == "clampf" and index + 1 < len(code) and code[index + 1].text == "(":
        yield from _swapped_bounds(text, code, index)
    if token.text in ("if", "while") and code[index + 1].text == "(":
        close = _closing(code, index + 1)
        if close:
            condition = text[code[index + 1].start : code[close].end]
            yield code[close], f"{token.text} (!{condition})", "condition"
    if _starts_statement(code, index):
        end = _statement_end(code, index)
        if _is_removable(code[index : end + 1]):
            yield code[end], ";", "statement"


def _closing(code: list[Token], opening: int) -> int:
    depth = 0
    for i in range(opening, len(code)):
        depth += (code[i].text == "(") - (code[i].text == ")")
        if depth == 0:
            return i
    return 0


def _swapped_bounds(text: str, code: list[Token], index: int) -> Iterator[tuple[Token, str, str]]:
    close = _closing(code, index + 1)
    commas = [index + 1]
    depth = 0
    for i in range(index + 2, close):
        depth += (code[i].text in "([{") - (code[i].text in ")]}")
        if code[i].text == "," and depth == 0:
            commas.append(i)
    commas.append(close)
    if len(commas) == 4 and code[index - 1].text != "float":
        x, lo, hi = (text[code[a].end : code[b].start].strip() for a, b in pairwise(commas))
        yield code[close], f"clampf({x}, {hi}, {lo})", "clamp bounds"


def _starts_statement(code: list[Token], index: int) -> bool:
    if code[index].kind != "name" and code[index].text not in ("*", "++", "--"):
        return False
    before = code[index - 1].text if index else ""
    return before in (";", "{", "}", ")", "else", ":") and code[index - 1].kind != "directive"


def _is_removable(statement: list[Token]) -> bool:
    """An assignment or a call, but no declaration, no flow: `a.b = c;`, `f(x);`, `n++;`."""
    words = [token.text for token in statement]
    if words[0] in ("return", "if", "for", "while", "switch", "case", "do", "else", "default"):
        return False
    if any(word in ("{", "}") for word in words) and "=" not in words:
        return False
    if _is_declaration(statement):
        return False
    changes = {"=", "+=", "-=", "*=", "/=", "|=", "&=", "^=", "++", "--"}
    return bool(changes & set(words)) or (words[1:2] == ["("] and words[-2:] == [")", ";"])


def _is_declaration(statement: list[Token]) -> bool:
    """Type and name, or type and pointer."""
    if len(statement) < 2:
        return False
    first, second = statement[:2]
    return first.kind == second.kind == "name" or (second.text == "*" and first.text != "*")
