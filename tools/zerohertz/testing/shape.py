"""How long and how branched a function may be (CONVENTIONS 1), measured with lizard.

Lines run from the function's name to its closing brace, comments included. Complexity is one plus
every if, loop, case, catch, ?:, && and ||. No function and no file is excepted.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Limits:
    """The most that a function may have; a file too, where `file_lines` is given."""

    folders: tuple[str, ...]
    suffixes: tuple[str, ...]
    lines: int
    complexity: int
    parameters: int | None = None
    file_lines: int | None = None


LIMITS = (
    Limits(("firmware", "hal"), (".c", ".h"), 40, 10, parameters=5, file_lines=300),
    Limits(("tools",), (".py",), 60, 12),
    Limits(("host_sim",), (".c", ".h", ".cpp", ".hpp"), 60, 12),
)


def check_tree(root: Path) -> list[str]:
    """Every function and file below `root` that is over a limit: where, measured, limit."""
    return [
        f"{path.relative_to(root)}{what}"
        for limits in LIMITS
        for path in _sources(root, limits)
        for what in check_text(path.name, path.read_text(encoding="utf-8"), limits)
    ]


def files_checked(root: Path) -> int:
    """How many files check_tree reads; none means that it measured nothing."""
    return sum(len(_sources(root, limits)) for limits in LIMITS)


def check_text(name: str, text: str, limits: Limits) -> list[str]:
    """What is over a limit in a file called `name`, as `:line function: measured, limit`."""
    import lizard  # of the test packages; `zh test --only` is read before they are installed

    found = []
    lines = len(text.splitlines())
    if limits.file_lines is not None and lines > limits.file_lines:
        found.append(f": {lines} lines, at most {limits.file_lines}")
    for function in lizard.analyze_file.analyze_source_code(name, text).function_list:
        measured = (
            (function.end_line - function.start_line + 1, limits.lines, "lines"),
            (function.cyclomatic_complexity, limits.complexity, "complexity"),
            (len(function.parameters), limits.parameters, "parameters"),
        )
        found += [
            f":{function.start_line} {function.name}: {value} {of_what}, at most {limit}"
            for value, limit, of_what in measured
            if limit is not None and value > limit
        ]
    return found


def _sources(root: Path, limits: Limits) -> list[Path]:
    return sorted(
        path
        for folder in limits.folders
        for path in (root / folder).rglob("*")
        if path.suffix in limits.suffixes
    )
