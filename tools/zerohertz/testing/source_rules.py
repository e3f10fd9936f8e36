"""Rules of CONVENTIONS that no compiler checks, on the text of the firmware.

Freestanding C and nothing but sqrtf of the maths library (5), no heap, no hidden state, no goto, no
function pointer (3). What slips through as text is caught once more in the object files
(object_rules). Includes: include_rules.
"""

from __future__ import annotations

import re
from pathlib import Path

from zerohertz.c_source import Token, tokens

FOLDERS = ("firmware", "hal/include")

_HEAP = "malloc calloc realloc free alloca aligned_alloc"
_STDIO = "printf fprintf sprintf snprintf vprintf puts putchar scanf fopen"
_JUMPS = "goto setjmp longjmp"
_MATH = "sin cos tan asin acos atan atan2 sinh cosh tanh exp exp2 log log2 log10 pow hypot cbrt fma"
_MATH += " fabs floor ceil round trunc fmod fmin fmax sqrt lrint lround isnan isinf isfinite"
FORBIDDEN = {
    **dict.fromkeys(_HEAP.split(), "no heap"),
    **dict.fromkeys(_STDIO.split(), "no input or output"),
    **dict.fromkeys(_JUMPS.split(), "no jumps out of the flow"),
    **dict.fromkeys(_MATH.split(), "not the C library's mathematics"),
    **{
        f"{name}f": "not the C library's mathematics"
        for name in _MATH.split()
        if name not in ("sqrt", "fabs")
    },
    "double": "float only",
}


def check_tree(root: Path) -> list[str]:
    """Every breach below `root`, as `file:line: what is wrong`."""
    return [
        f"{path.relative_to(root)}:{line}: {what}"
        for path in _sources(root)
        for line, what in sorted(
            check_text(path.read_text(), pointers=path.is_relative_to(root / "hal"))
        )
    ]


def files_checked(root: Path) -> int:
    """How many files check_tree reads; none means that the rules checked nothing."""
    return len(_sources(root))


def check_text(text: str, pointers: bool = False) -> list[tuple[int, str]]:
    """Breaches in one file, which may hold function pointers or not."""
    code = tokens(text)
    return [
        *_bad_names(code),
        *_bad_literals(code),
        *_mutable_statics(code),
        *([] if pointers else _function_pointers(code)),
    ]


def _sources(root: Path) -> list[Path]:
    return sorted(
        path
        for folder in FOLDERS
        for path in (root / folder).rglob("*")
        if path.suffix in (".c", ".h", ".def")
    )


def _bad_names(code: list[Token]) -> list[tuple[int, str]]:
    # A member or field may bear any name: x.exp is not exp().
    return [
        (token.line, f"'{token.text}' is not allowed here: {FORBIDDEN[token.text]}")
        for before, token in zip([None, *code], code, strict=False)
        if token.kind == "name"
        and token.text in FORBIDDEN
        and (before is None or before.text not in (".", "->"))
    ]


def _bad_literals(code: list[Token]) -> list[tuple[int, str]]:
    decimal = re.compile(r"(?:\d+\.\d*|\.\d+|\d+[eE][+-]?\d+)(?:[eE][+-]?\d+)?[lL]?")
    return [
        (token.line, f"literal {token.text} is a double; end it in f")
        for token in code
        if token.kind == "number" and decimal.fullmatch(token.text)
    ]


def _mutable_statics(code: list[Token]) -> list[tuple[int, str]]:
    """`static` that starts neither a function nor a constant, at any depth."""
    found = []
    for index, token in enumerate(code):
        if token.text != "static":
            continue
        words = []
        for follower in code[index + 1 :]:
            if follower.text in ("=", ";", "(", "["):
                break
            words.append(follower)
        is_function = follower.text == "("
        if not is_function and not _is_constant([word.text for word in words]):
            found.append((token.line, "static data that can change; state belongs in a struct"))
    return found


def _is_constant(words: list[str]) -> bool:
    """Whether the object itself is const: for a pointer that is the one after the last `*`."""
    last_star = max((i for i, word in enumerate(words) if word == "*"), default=-1)
    return "const" in words[last_star + 1 :]


def _function_pointers(code: list[Token]) -> list[tuple[int, str]]:
    texts = [token.text for token in code]
    return [
        (code[i].line, "a function pointer; these live in the HAL alone")
        for i in range(len(code) - 4)
        if texts[i : i + 2] == ["(", "*"]
        and code[i + 2].kind == "name"
        and texts[i + 3 : i + 5] == [")", "("]
        # `(*p)(` after a name or operator is a call or a cast, after a type name a declaration;
        # all of them mean that a pointer to a function is about.
    ]
