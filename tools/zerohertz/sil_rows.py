"""Arrays for the SIL library: one row per control period, and the signals noted in each."""

from __future__ import annotations

import ctypes
import functools
from collections.abc import Sequence
from ctypes import POINTER, byref, c_double, c_uint32
from typing import Any

import numpy as np
import numpy.typing as npt

from zerohertz.errors import UserError
from zerohertz.sil import check, library
from zerohertz.sil_types import IN, OUT, OUTPUT_NAMES, WORDS, RawRecord, RawSignal, Rows, Signal

RUN, FAULT_RESET, TORQUE_OFF, COMMISSION = 1, 2, 4, 8
TORQUE_MODE = 1
_COMMANDS = {"run": RUN, "fault_reset": FAULT_RESET, "torque_off": TORQUE_OFF}
_COMMANDS |= {"commission": COMMISSION}


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


def numbers(where: str, names: Sequence[str]) -> ctypes.Array[c_uint32]:
    """Of these signals, for the library."""
    known = signal_numbers()
    if isinstance(names, str):
        raise UserError(f"{where}: signals: is one text; give a list of names")
    for name in names:
        if name not in known:
            raise UserError(f"{where}: signals: '{name}': no such signal; signal_list() has them")
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
    sampled = _words(where, words) if words is not None else np.zeros((count or 0, 6), np.uint16)
    rows = np.zeros(len(sampled), dtype=IN)
    rows["struct_size"] = IN.itemsize
    for k, name in enumerate(WORDS):
        rows[name] = sampled[:, k]
    _fill(where, rows, "speed_ref_rpm", "speed_ref_rpm", speed_ref_rpm, np.float32)
    if torque_ref_Nm is not None:
        _fill(where, rows, "torque_ref_Nm", "torque_ref_Nm", torque_ref_Nm, np.float32)
        rows["mode"] = TORQUE_MODE
    command = np.zeros(len(rows), dtype=np.uint32)
    for (name, bit), levels in zip(_COMMANDS.items(), commands, strict=True):
        level = np.zeros(len(rows), dtype=[(name, bool)])
        _fill(where, level, name, name, levels, bool)
        command |= np.uint32(bit) * level[name]
    rows["command"] = command
    return rows


def _words(where: str, words: npt.ArrayLike) -> npt.NDArray[Any]:
    found = np.asarray(words)
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
    try:
        rows[field] = np.asarray(values, dtype=kind)
    except (ValueError, TypeError) as error:
        raise UserError(
            f"{where}: {argument}: {error}; give one value, or one per row ({len(rows)})"
        ) from None


class Recording:
    """Signals to note in every period, for the library (zh_sil_record)."""

    def __init__(self, where: str, names: Sequence[str], count: int) -> None:
        self._names = tuple(names)
        self._numbers = numbers(where, names)
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
