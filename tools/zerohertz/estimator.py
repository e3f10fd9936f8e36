"""An estimator of the firmware alone, on recorded signals: binding of host_sim/sil_estimator.h.

    with Estimator(motor_dir, period_s=200e-6) as estimator:
        out = estimator.run(events(count, u_alpha_V=..., i_alpha_A=...))
        out["omega_e_rad_s"]

Without a library it is the estimator of the drive in the SIL library; built_library names others,
which may be loaded beside it.
"""

from __future__ import annotations

import ctypes
import functools
import os
from collections.abc import Mapping
from ctypes import c_char_p, c_float, c_int, c_size_t, c_uint32, c_void_p
from enum import IntEnum
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from zerohertz import arguments
from zerohertz.build import ensure_built
from zerohertz.drive import Handle, StrPath, override_lines
from zerohertz.errors import UserError
from zerohertz.estimators.chosen import in_tree
from zerohertz.paths import LIBRARIES


class Verb(IntEnum):
    """A function of the contract (firmware/law/estimator/estimator.h)."""

    STEP = 0
    HOLD = 1
    OFF = 2
    SEED = 3
    RESET = 4


EVENT = np.dtype(
    [
        ("verb", np.uint32),
        ("frame_imposed", np.uint32),
        ("u_alpha_V", np.float32),
        ("u_beta_V", np.float32),
        ("i_alpha_A", np.float32),
        ("i_beta_A", np.float32),
        ("expected_step_rad_s", np.float32),
        ("omega_frame_rad_s", np.float32),
        ("omega_e_rad_s", np.float32),
        ("lambda_alpha_Wb", np.float32),
        ("lambda_beta_Wb", np.float32),
        ("dwell", np.float32),
        ("slip_extra_rad_s", np.float32),
        ("tau_extra_per_s", np.float32),
    ]
)
ESTIMATE = np.dtype(
    [
        ("omega_e_rad_s", np.float32),
        ("omega_s_rad_s", np.float32),
        ("lambda_alpha_Wb", np.float32),
        ("lambda_beta_Wb", np.float32),
        ("residual_alpha_A", np.float32),
        ("residual_beta_A", np.float32),
        ("correction_alpha_V", np.float32),
        ("correction_beta_V", np.float32),
    ]
)

_PROTOTYPES: dict[str, tuple[Any, tuple[Any, ...]]] = {
    "zh_estimator_open": (c_void_p, (c_char_p, c_char_p, c_float)),
    "zh_estimator_close": (None, (c_void_p,)),
    "zh_estimator_run": (c_int, (c_void_p, c_size_t, c_void_p, c_void_p)),
    "zh_estimator_signal_name": (c_char_p, (c_uint32,)),
    "zh_estimator_signal": (c_float, (c_void_p, c_uint32)),
    "zh_estimator_error": (c_char_p, ()),
}


MAX_ROWS = 10**9


def events(count: int, **columns: npt.ArrayLike) -> npt.NDArray[Any]:
    """`count` steps with these columns of EVENT; the others are 0."""
    rows = np.zeros(arguments.whole("events", "count", count, 0, MAX_ROWS), dtype=EVENT)
    for name, values in columns.items():
        if name not in (EVENT.names or ()):
            raise UserError(f"events: {name}: no such column; give one of {EVENT.names}")
        try:
            rows[name] = values
        except (ValueError, TypeError, OverflowError) as error:
            raise UserError(f"events: {name}: {error}; give one value, or {count}") from None
    return rows


def built_library(name: str) -> Path:
    """The library of one estimator alone, built if out of date."""
    prefix = "zh_estimator_"
    known = in_tree() or sorted(
        p.stem.split(prefix, 1)[1] for p in LIBRARIES.glob(f"lib{prefix}*.so")
    )  # the package has the libraries alone
    if name not in known:
        arguments.refuse("built_library", "name", name, f"one of {', '.join(known)}")
    target = f"{prefix}{name}"
    return ensure_built(target).library(target)


@functools.cache
def _library(path: Path) -> ctypes.CDLL:
    """Its symbols stay its own (RTLD_LOCAL): another estimator's have the same names."""
    try:
        lib = ctypes.CDLL(os.fspath(path), mode=ctypes.RTLD_LOCAL)
        for name, (result, arguments) in _PROTOTYPES.items():
            function = getattr(lib, name)
            function.restype, function.argtypes = result, arguments
    except (OSError, AttributeError) as error:
        raise UserError(f"{path}: cannot be loaded ({error}); build it anew") from None
    return lib


class Estimator(Handle):
    """One estimator, starting from a motor at rest without flux; for one thread at a time."""

    _CLOSE = "zh_estimator_close"

    def __init__(
        self,
        motor_dir: StrPath,
        overrides: Mapping[str, float] | None = None,
        *,
        period_s: float,
        library: Path | None = None,
    ) -> None:
        self._handle = None
        if library is not None:
            arguments.path("Estimator", "library", library)
        self._lib = _library(Path(library) if library else ensure_built().sil_library)
        self._handle = self._lib.zh_estimator_open(
            arguments.path("Estimator", "motor_dir", motor_dir),
            override_lines({} if overrides is None else overrides, "Estimator"),
            arguments.number("Estimator", "period_s", period_s),
        )
        if not self._handle:
            self._raise_last_error()

    def run(self, rows: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Rows of EVENT, one after the other; the estimate after each, rows of ESTIMATE."""
        if not isinstance(rows, np.ndarray) or rows.dtype != EVENT or rows.ndim != 1:
            arguments.refuse("Estimator.run", "rows", rows, "rows of EVENT: events() makes them")
        rows = np.ascontiguousarray(rows)
        out = np.empty(len(rows), dtype=ESTIMATE)
        status = self._lib.zh_estimator_run(
            self._open_handle(), len(rows), rows.ctypes.data, out.ctypes.data
        )
        if status != 0:
            self._raise_last_error()
        return out

    def signals(self) -> dict[str, float]:
        """Signals of this estimator beside the estimate."""
        handle = self._open_handle()
        shown: dict[str, float] = {}
        while (name := self._lib.zh_estimator_signal_name(len(shown))) is not None:
            shown[name.decode()] = self._lib.zh_estimator_signal(handle, len(shown))
        return shown

    def _raise_last_error(self) -> None:
        raise UserError(self._lib.zh_estimator_error().decode(errors="replace"))
