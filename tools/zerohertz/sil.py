"""The SIL library as ctypes sees it, and what every handle of it does."""

from __future__ import annotations

import ctypes
import functools
import os
from collections.abc import Mapping
from ctypes import POINTER, c_char_p, c_double, c_float, c_int, c_size_t, c_uint32, c_uint64
from ctypes import c_void_p as c_handle
from typing import Any, NoReturn, Self

from zerohertz import arguments
from zerohertz.build import PYTHON, ensure_built
from zerohertz.errors import UserError
from zerohertz.sil_types import (
    RawCommissioning,
    RawIn,
    RawOut,
    RawParameter,
    RawRecord,
    RawSignal,
    RawTruth,
)

VERSION = 5
StrPath = str | os.PathLike[str]

_PROTOTYPES: dict[str, tuple[Any, tuple[Any, ...]]] = {
    "zh_sil_version": (c_uint32, ()),
    "zh_sil_error": (c_char_p, ()),
    "zh_sil_open": (c_handle, (c_char_p, c_char_p, c_char_p)),
    "zh_sil_close": (None, (c_handle,)),
    "zh_sil_step": (c_int, (c_handle, POINTER(RawIn), POINTER(RawOut))),
    "zh_sil_look": (c_int, (c_handle, POINTER(RawOut))),
    "zh_sil_step_many": (c_int, (POINTER(c_handle), c_handle, c_handle, c_uint32)),
    "zh_sil_run": (c_int, (c_handle, c_handle, c_handle, c_uint32, POINTER(RawRecord))),
    "zh_sil_commissioned": (c_int, (c_handle, POINTER(RawCommissioning))),
    "zh_sil_reset": (c_int, (c_handle,)),
    "zh_sil_snapshot_bytes": (c_size_t, ()),
    "zh_sil_snapshot": (c_int, (c_handle, c_char_p, c_size_t)),
    "zh_sil_restore": (c_int, (c_handle, c_char_p, c_size_t)),
    "zh_sil_signal_count": (c_uint32, ()),
    "zh_sil_signal_find": (c_uint32, (c_char_p,)),
    "zh_sil_signal_describe": (c_int, (c_uint32, POINTER(RawSignal))),
    "zh_sil_signals": (c_int, (c_handle, POINTER(c_uint32), c_uint32, POINTER(c_double))),
    "zh_sil_get": (c_int, (c_handle, c_char_p, POINTER(c_float))),
    "zh_sil_set": (c_int, (c_handle, c_char_p, c_float)),
    "zh_sil_name_count": (c_uint32, ()),
    "zh_sil_name": (c_char_p, (c_uint32,)),
    "zh_sil_describe": (c_int, (c_uint32, POINTER(RawParameter))),
    "zh_sil_terminals_fit": (c_int, (c_handle, c_char_p)),
    "zh_sil_terminals_set": (c_int, (c_handle, c_handle)),
    "zh_sil_terminals_look": (c_int, (c_handle, c_handle)),
    "zh_plant_open": (c_handle, (c_char_p, c_char_p, c_char_p, c_char_p, c_uint64)),
    "zh_plant_close": (None, (c_handle,)),
    "zh_plant_sample": (c_int, (c_handle, c_handle)),
    "zh_plant_advance": (c_int, (c_handle, POINTER(c_double), c_uint32, c_uint32)),
    "zh_plant_look": (c_int, (c_handle, POINTER(RawTruth))),
    "zh_plant_set": (c_int, (c_handle, c_char_p, c_double)),
    "zh_plant_reseed": (c_int, (c_handle, c_uint64)),
    "zh_plant_run": (
        c_int,
        (c_handle, c_handle, c_handle, c_handle, c_handle, c_uint32, POINTER(RawRecord)),
    ),
    "zh_plant_copy": (c_handle, (c_handle,)),
    "zh_plant_restore": (c_int, (c_handle, c_handle)),
}


@functools.cache
def library() -> ctypes.CDLL:
    """The SIL library, built if out of date; ZEROHERTZ_SIL names another one."""
    path = ensure_built().sil_library
    try:
        lib = ctypes.CDLL(os.fspath(path))
        for name, (result, arguments) in _PROTOTYPES.items():
            function = getattr(lib, name)
            function.restype, function.argtypes = result, arguments
    except (OSError, AttributeError) as error:
        raise UserError(f"{path}: cannot be loaded ({error}); build it again") from None
    if PYTHON in os.environ:
        from zerohertz.estimators import bridge

        bridge.register(lib)
    if lib.zh_sil_version() != VERSION:
        raise UserError(f"{path}: is version {lib.zh_sil_version()}, not {VERSION}; build it again")
    return lib


def last_error() -> str:
    """The library's text for its last failure on this thread."""
    return str(library().zh_sil_error().decode(errors="replace"))


def raise_last_error() -> NoReturn:
    """Raise UserError with the library's text for its last failure on this thread."""
    raise UserError(last_error())


def check(status: int) -> None:
    """Raise UserError unless the status is that of success."""
    if status != 0:
        raise_last_error()


def override_lines(
    values: Mapping[str, Any], where: str = "Job", argument: str = "overrides"
) -> bytes:
    """name=value lines; a list of numbers or points is written as in TOML."""
    given = arguments.mapping(where, argument, values)
    lines = [f"{name}={_value_text(where, name, value)}" for name, value in given.items()]
    for name, line in zip(given, lines, strict=True):
        if "\n" in line or "\0" in line:
            arguments.refuse(where, argument, name, "one line per parameter")
    return "\n".join(lines).encode()


def _value_text(where: str, name: Any, value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return value
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_value_text(where, name, item) for item in value) + "]"
    return repr(arguments.number(where, str(name), value, "a number, a text or a list"))


class Handle:
    """An object of the library, freed by close(), a with block or the garbage collector."""

    _CLOSE: str  # name of the library's function
    _handle: int | None
    _lib: ctypes.CDLL

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __del__(self) -> None:
        self.close()

    def close(self) -> None:
        """Free it; more than once is allowed."""
        if self._handle:
            getattr(self._lib, self._CLOSE)(self._handle)
            self._handle = None

    def _open_handle(self) -> int:
        if not self._handle:
            raise UserError(f"{type(self).__name__}: is closed; open another one")
        return self._handle
