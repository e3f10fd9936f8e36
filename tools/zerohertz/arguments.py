"""Arguments of the Python interface: what is no number, path or name is refused with its name.

Each check is given where it stands ("Drive.step") and the argument's name. Ranges of parameters and
files are the library's to judge.
"""

from __future__ import annotations

import operator
import os
from collections.abc import Mapping
from typing import Any, NoReturn

from zerohertz.errors import UserError


def refuse(where: str, name: str, value: object, remedy: str) -> NoReturn:
    """Raise UserError with the argument, what it is, and what to give."""
    text = repr(value)
    shown = text if len(text) <= 60 else f"a {type(value).__name__}"
    raise UserError(f"{where}: {name}: is {shown}; give {remedy}") from None


def number(where: str, name: str, value: Any, remedy: str = "a number") -> float:
    """A real number, NaN and infinity too: the library refuses those."""
    try:
        if not isinstance(value, (str, bytes)):
            return float(value)
    except (TypeError, ValueError, OverflowError):
        pass
    refuse(where, name, value, remedy)


def finite(where: str, name: str, value: Any, remedy: str = "a finite number") -> float:
    """A real number that is neither NaN nor infinite."""
    given = number(where, name, value, remedy)
    if given - given != 0.0:
        refuse(where, name, value, remedy)
    return given


def whole(where: str, name: str, value: Any, low: int, high: int, span: str = "") -> int:
    """A whole number from low to high; span: how the complaint writes that range."""
    span = span or f"{low} .. {high}"
    try:
        given = operator.index(value)
    except TypeError:
        refuse(where, name, value, f"a whole number, {span}")
    if not low <= given <= high:
        raise UserError(f"{where}: {name}: {given} is outside {span}")
    return given


def level(where: str, name: str, value: Any) -> bool:
    """True or False; 1 and 0 are as good."""
    try:
        if value in (0, 1):
            return bool(value)
    except (TypeError, ValueError):  # an array
        pass
    refuse(where, name, value, "True or False")


def path(where: str, name: str, value: Any) -> bytes:
    """Name of a file or a folder, as the library takes it; or a file's text."""
    try:
        is_text = isinstance(value, str) and "\n" in value
        given = value.encode() if is_text else os.fsencode(value)
    except (TypeError, UnicodeEncodeError):
        refuse(where, name, value, "a path")
    if b"\0" in given:
        refuse(where, name, value, "a path")
    return given


def text(where: str, name: str, value: Any) -> bytes:
    """Name of a parameter or a signal, as the library takes it."""
    try:
        if isinstance(value, str) and "\0" not in value:
            return value.encode()
    except UnicodeEncodeError:
        pass
    refuse(where, name, value, "a name")


def mapping(where: str, name: str, value: Any) -> Mapping[Any, Any]:
    """Names and what they shall be."""
    if not isinstance(value, Mapping):
        refuse(where, name, value, "a mapping of names to values")
    return value
