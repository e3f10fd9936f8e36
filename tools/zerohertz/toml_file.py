"""TOML files that people write: read, and mistakes in them shown with their line.

Python's standard library alone: the build reads motors with it.
"""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from zerohertz.errors import UserError


def read_text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise UserError(f"{path}: no such file; correct the name") from None
    except UnicodeDecodeError as error:
        raise UserError(f"{path}: is not UTF-8 text: {error}; save it as such") from None
    except OSError as error:
        raise UserError(f"{path}: cannot be read: {error.strerror}") from None


def parsed(text: str, file: str) -> dict[str, Any]:
    """UserError, with the line, for what is no TOML."""
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        line = re.search(r"at line (\d+)", str(error))
        where = f"{file}:{line[1]}" if line else file
        raise UserError(f"{where}: not valid TOML: {error}; correct the syntax") from None


def with_line(message: str, file: str, text: str) -> str:
    """`file: section.key: ...` with the line of the key, where the text has it."""
    named = re.match(rf"{re.escape(file)}: (\w+)\.(\w+): ", message)
    section = ""
    for number, line in enumerate(text.splitlines() if named else (), start=1):
        if header := re.match(r"\s*\[(\w+)\]", line):
            section = header[1]
        elif section == named[1] and re.match(rf"\s*{named[2]}\s*=", line):
            return f"{file}:{number}" + message.removeprefix(file)
    return message


def toml_value(value: Any) -> str:
    """As a TOML file has it. Its basic string has JSON's escapes; repr of a float is exact."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, Mapping):
        return f"{{ {', '.join(f'{k} = {toml_value(v)}' for k, v in value.items())} }}"
    return json.dumps(value, ensure_ascii=False) if isinstance(value, str) else repr(value)


def with_section(text: str, section: str, values: dict[str, Any]) -> str:
    """The text with another content of one section; the rest as it was, comments included."""
    lines = "".join(f"{key} = {toml_value(value)}\n" for key, value in values.items())
    block = f"[{section}]\n{lines}"
    old = re.search(rf"^\[{section}\][^\n]*\n.*?(?=^\[|\Z)", text, re.MULTILINE | re.DOTALL)
    if old is None:
        return f"{text.rstrip()}\n\n{block}"
    rest = text[old.end() :]
    return text[: old.start()] + block + ("\n" + rest if rest else "")
