"""One section of a TOML file that people write: every key checked, none unknown."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from zerohertz.errors import UserError


def require_sections(data: Mapping[str, Any], known: tuple[str, ...], file: str) -> None:
    for section, content in data.items():
        if section not in known:
            raise UserError(f"{file}: [{section}]: unknown section; known are {', '.join(known)}")
        if not isinstance(content, Mapping):
            raise UserError(f"{file}: {section}: is outside every section; write [{section}]")


class Section:
    """Every key is asked for once; what is left at the end is unknown."""

    def __init__(self, data: Mapping[str, Any], name: str, file: str) -> None:
        self._content, self._name, self._file = dict(data.get(name, {})), name, file
        self._known: list[str] = []

    def _take(self, key: str, otherwise: Any) -> Any:
        self._known.append(key)
        return self._content.pop(key, otherwise)

    def _wrong(self, key: str, text: str) -> UserError:
        return UserError(f"{self._file}: {self._name}.{key}: {text}")

    def number(self, key: str) -> float | None:
        value = self._take(key, None)
        if value is None:
            return None
        known = isinstance(value, (int, float)) and not isinstance(value, bool)
        if not known or not 0.0 < value < 1e6:
            raise self._wrong(key, f"is {value!r}; a positive number is needed")
        return float(value)

    def number_or_zero(self, key: str) -> float:
        if self._content.get(key) == 0:
            self._take(key, None)
        return self.number(key) or 0.0

    def whole(self, key: str, most: int) -> int:
        value = self._take(key, 0)
        if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= most:
            raise self._wrong(key, f"is {value!r}; give a whole number of 0 .. {most}")
        return value

    def text(self, key: str, otherwise: str | None) -> str | None:
        value = self._take(key, otherwise)
        if value is not None and not isinstance(value, str):
            raise self._wrong(key, f"is {value!r}; a text is needed")
        return value

    def choice(self, key: str, choices: tuple[str, ...], otherwise: str) -> str:
        value = self._take(key, otherwise)
        if value not in choices:
            raise self._wrong(key, f"is {value!r}; give one of {', '.join(choices)}")
        return str(value)

    def switch(self, key: str, otherwise: bool) -> bool:
        value = self._take(key, otherwise)
        if not isinstance(value, bool):
            raise self._wrong(key, f"is {value!r}; write true or false")
        return value

    def end(self) -> None:
        for key in self._content:
            raise self._wrong(key, f"unknown key; known are {', '.join(self._known)}")
