"""Arrays for the SIL library: one row per control period, and the signals noted in each."""

from __future__ import annotations

import ctypes
import functools
from collections.abc import Iterable, Sequence
from ctypes import POINTER, byref, c_double, c_uint32
from typing import Any

import numpy as np
import numpy.typing as npt

from zerohertz import arguments
from zerohertz.errors import UserError
from zerohertz.sil import check, library
from zerohertz.sil_types import IN, OUT, OUTPUT_NAMES, WORDS, RawRecord, RawSignal, Rows, Signal

RUN, FAULT_RESET, TORQUE_OFF, COMMISSION = 1, 2, 4, 8
TORQUE_MODE = 1
COMMANDS = {"run": RUN, "fault_reset": FAULT_RESET, "torque_off": TORQUE_OFF}
COMMANDS |= {"commission": COMMISSION}


@functools.cache
def signal_list() -> tuple[Signal, ...]:
    """Every signal that `Drive.signals` reads, in the order of the trace."""
    lib = library()
    found = []
    for index in range(lib.zh_sil_signal_count()):
        info = RawSignal(struct_size=ctypes.sizeof(RawSignal))
        check(lib.zh_sil_signal_describe(index, byref(info)))
        name, unit, text = (t.decode() for t in (info.name, info.unit, info.text))
        found.append(Signal(name, unit, text, bool(info.whole)))
    return tuple(found)


@functools.cache
def signal_numbers() -> dict[str, int]:
    return {signal.name: k for k, signal in enumerate(signal_list())}


def chosen_signals(where: str, argument: str, names: Iterable[str]) -> tuple[str, ...]:
    """These names, each once; UserError for one that is no signal's."""
    known = signal_numbers()
    if isinstance(names, str):
        raise UserError(f"{where}: {argument}: is one text; give a list of names")
    try:
        chosen = tuple(dict.fromkeys(names))
    except TypeError:
        arguments.refuse(where, argument, names, "a list of names")
    for name in chosen:
        if name not in known:
            raise UserError(
                f"{where}: {argument}: '{name}': no such signal; signal_list() has them"
            )
    return chosen


def numbers(names: Sequence[str]) -> ctypes.Array[c_uint32]:
    """Of these signals, for the library."""
    known = signal_numbers()
    return (c_uint32 * len(names))(*(known[name] for name in names))


def outputs(count: int) -> Rows:
    out = np.zeros(count, dtype=OUT)
    out["struct_size"] = OUT.itemsize
    return out


def inputs(
    where: str,
    words: npt.ArrayLike | None,
    speed_ref_rpm: npt.ArrayLike,
    torque_ref_Nm: npt.ArrayLike | None,
    *commands: npt.ArrayLike,
    count: int | None = None,
) -> Rows:
    """Rows of zh_sil_in; commands in the order of their bits. Words: None with a count."""
    sampled = _words(where, words) if count is None else np.zeros((count, 6), np.uint16)
    rows = np.zeros(len(sampled), dtype=IN)
    rows["struct_size"] = IN.itemsize
    for k, name in enumerate(WORDS):
        rows[name] = sampled[:, k]
    _fill(where, rows, "speed_ref_rpm", "speed_ref_rpm", speed_ref_rpm, np.float32)
    if torque_ref_Nm is not None:
        _fill(where, rows, "torque_ref_Nm", "torque_ref_Nm", torque_ref_Nm, np.float32)
        rows["mode"] = TORQUE_MODE
    command = np.zeros(len(rows), dtype=np.uint32)
    for (name, bit), levels in zip(COMMANDS.items(), commands, strict=True):
        level = np.zeros(len(rows), dtype=[(name, bool)])
        _fill(where, level, name, name, levels, bool)
        command |= np.uint32(bit) * level[name]
    rows["command"] = command
    return rows


def _array(where: str, argument: str, values: npt.ArrayLike | None) -> npt.NDArray[Any]:
    try:
        return np.asarray(values)
    except (ValueError, TypeError) as error:
        raise UserError(f"{where}: {argument}: {error}; give an array") from None


def _words(where: str, words: npt.ArrayLike | None) -> npt.NDArray[Any]:
    found = _array(where, "words", words)
    if found.ndim != 2 or found.shape[1] != len(WORDS):
        raise UserError(f"{where}: words: has shape {found.shape}; give (periods, 6)")
    if found.dtype.kind not in "iu":
        raise UserError(f"{where}: words: are of type {found.dtype}; give whole numbers")
    if found.size and (found.min() < 0 or found.max() > 0xFFFF):
        raise UserError(f"{where}: words: are not all in 0 .. 65535; clip them")
    return found


def _fill(
    where: str, rows: Rows, field: str, argument: str, values: npt.ArrayLike, kind: Any
) -> None:
    given = _array(where, argument, values)
    if given.ndim > 1 or given.size not in (1, len(rows)):
        raise UserError(
            f"{where}: {argument}: has shape {given.shape}; give one value, or one per row "
            f"({len(rows)})"
        )
    levels = kind is bool
    if given.dtype.kind not in ("biu" if levels else "biuf"):
        wanted = "True or False" if levels else "numbers"
        raise UserError(f"{where}: {argument}: is of type {given.dtype}; give {wanted}")
    if levels and given.dtype.kind != "b" and not np.isin(given, (0, 1)).all():
        raise UserError(f"{where}: {argument}: is not all 0 or 1; give True or False")
    with np.errstate(over="ignore"):  # what becomes infinite is the library's to refuse
        rows[field] = given.astype(kind)


class Recording:
    """Signals to note in every period, for the library (zh_sil_record)."""

    def __init__(self, where: str, names: Iterable[str], count: int) -> None:
        self._names = chosen_signals(where, "signals", names)
        self._numbers = numbers(self._names)
        self._values = np.zeros((count, len(self._names)))
        self._raw = RawRecord(
            struct_size=ctypes.sizeof(RawRecord),
            count=len(self._names),
            index=ctypes.cast(self._numbers, POINTER(c_uint32)),
            value=self._values.ctypes.data_as(POINTER(c_double)),
        )
        self.pointer = byref(self._raw)

    def joined(self, out: Rows) -> Rows:
        """Outputs and signals in one array; a signal that an output repeats appears once."""
        more = [n for n in self._names if n not in OUTPUT_NAMES]
        if not more:
            return out[list(OUTPUT_NAMES)]
        fields_of_out = [(n, OUT[n]) for n in OUTPUT_NAMES]
        rows = np.empty(len(out), dtype=[*fields_of_out, *((n, np.float64) for n in more)])
        for name in OUTPUT_NAMES:
            rows[name] = out[name]
        for k, name in enumerate(self._names):
            if name in more:
                rows[name] = self._values[:, k]
        return rows
