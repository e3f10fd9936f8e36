"""The firmware from Python: binding of host_sim/sil.h.

    with Drive("gain_tables/hasegawa2005", "host_sim/boards/paper.toml") as drive:
        out = drive.step(8192, 8192, 8192, 8192, 8192, 11592, speed_ref_rpm=60.0, run=True)

Each call of `step` runs one control period on six ADC words. The caller owns the plant and its
clock.
Parameters are items of the drive: drive["adapt_kp"] reads one, drive["adapt_kp"] = 5.0 sets it.
"""

from __future__ import annotations

import ctypes
import functools
import os
from collections.abc import Iterator, Mapping
from ctypes import (
    POINTER,
    Structure,
    byref,
    c_char_p,
    c_float,
    c_int,
    c_uint16,
    c_uint32,
    c_void_p,
)
from dataclasses import dataclass, fields
from enum import IntEnum, IntFlag
from typing import Any, Self

from zerohertz.build import ensure_built
from zerohertz.errors import UserError

VERSION = 3
StrPath = str | os.PathLike[str]

_RUN, _FAULT_RESET, _TORQUE_OFF = 1, 2, 4


class State(IntEnum):
    """States of the drive, numbers as in sil.h."""

    BOOT = 0
    SELF_TEST = 1
    READY = 2
    PREMAGNETISE = 3
    RUN = 4
    RAMP_DOWN = 5
    COAST = 6
    COMMISSIONING = 7
    FAULT = 8
    TORQUE_OFF = 9


class Fault(IntFlag):
    """Fault bits, as in fault_list.def."""

    OVER_CURRENT = 1 << 0
    DC_OVER_VOLTAGE = 1 << 1
    DC_UNDER_VOLTAGE = 1 << 2
    NON_FINITE = 1 << 3
    ADC_RANGE = 1 << 4
    CURRENT_SUM = 1 << 5
    OVER_SPEED = 1 << 6
    CONFIG = 1 << 7
    CURRENT_OFFSET = 1 << 8
    TABLE_CRC = 1 << 9
    PERIOD_LATE = 1 << 10
    PERIOD_OVERRUN = 1 << 11
    STATOR_RESISTANCE = 1 << 12
    ORIENTATION_LOST = 1 << 13
    OVERLOAD = 1 << 14
    CURRENT_SENSOR = 1 << 15
    VOLTAGE_SENSOR = 1 << 16
    OPEN_PHASE = 1 << 17
    EARTH_FAULT = 1 << 18
    STALL = 1 << 19
    OBSERVER = 1 << 20
    COMMAND_TIMEOUT = 1 << 21
    DERATED = 1 << 22
    REGENERATION = 1 << 23
    MAINS_LOST = 1 << 24
    BRAKE_INPUT = 1 << 25
    STORE = 1 << 26
    COMMISSIONING = 1 << 27
    FLYING_START = 1 << 28
    UNDERLOAD = 1 << 29
    ADC_FROZEN = 1 << 30
    SPEED_DEVIATION = 1 << 31


class Access(IntEnum):
    """When a parameter may change."""

    ANY_TIME = 0
    GATES_OFF = 1
    AT_OPEN = 2


@dataclass(frozen=True)
class Parameter:
    """One parameter of the firmware (param_list.def)."""

    name: str
    unit: str
    text: str
    minimum: float
    maximum: float
    initial: float
    access: Access
    whole: bool
    group: str
    choices: tuple[str, ...]  # names of the values 0, 1, ...; none: a number


@dataclass(frozen=True, slots=True)
class Output:
    """Duties, state and telemetry of one control period; vectors power invariant."""

    duty_u: float
    duty_v: float
    duty_w: float
    gates_on: bool
    state: int
    faults: int
    speed_hat_rpm: float
    lambda_Wb: float
    lambda_angle_rad: float
    i_d_A: float
    i_q_A: float
    i_q_ref_A: float
    e1_alpha_A: float
    e1_beta_A: float
    stator_frequency_Hz: float
    l1_re: float  # 1/s
    l1_im: float
    l2_re: float  # ohm
    l2_im: float
    x_rad_s: float
    speed_unknown: bool = False  # then speed_hat_rpm is NaN


class _In(Structure):
    _fields_ = (
        ("struct_size", c_uint32),
        *((name, c_uint16) for name in ("i_u", "i_v", "i_w", "u_uv", "u_vw", "u_dc")),
        ("speed_ref_rpm", c_float),
        ("torque_ref_Nm", c_float),
        ("mode", c_uint32),
        ("command", c_uint32),
    )


_WHOLE = ("gates_on", "state", "faults", "speed_unknown")
_FLAGS = ("gates_on", "speed_unknown")


class _Out(Structure):
    _fields_ = (
        ("struct_size", c_uint32),
        *((f.name, c_uint32 if f.name in _WHOLE else c_float) for f in fields(Output)),
    )


class _NameInfo(Structure):
    _fields_ = (
        ("struct_size", c_uint32),
        ("access", c_uint32),
        ("whole", c_uint32),
        ("minimum", c_float),
        ("maximum", c_float),
        ("initial", c_float),
        ("unit", c_char_p),
        ("text", c_char_p),
        ("group", c_char_p),
        ("choice", POINTER(c_char_p)),
    )


_PROTOTYPES: dict[str, tuple[Any, tuple[Any, ...]]] = {
    "zh_sil_version": (c_uint32, ()),
    "zh_sil_error": (c_char_p, ()),
    "zh_sil_open": (c_void_p, (c_char_p, c_char_p, c_char_p)),
    "zh_sil_close": (None, (c_void_p,)),
    "zh_sil_step": (c_int, (c_void_p, POINTER(_In), POINTER(_Out))),
    "zh_sil_get": (c_int, (c_void_p, c_char_p, POINTER(c_float))),
    "zh_sil_set": (c_int, (c_void_p, c_char_p, c_float)),
    "zh_sil_name_count": (c_uint32, ()),
    "zh_sil_name": (c_char_p, (c_uint32,)),
    "zh_sil_describe": (c_int, (c_uint32, POINTER(_NameInfo))),
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
    if lib.zh_sil_version() != VERSION:
        raise UserError(f"{path}: is version {lib.zh_sil_version()}, not {VERSION}; build it again")
    return lib


def raise_last_error() -> None:
    """Raise UserError with the library's text for its last failure on this thread."""
    raise UserError(library().zh_sil_error().decode(errors="replace"))


def check(status: int) -> None:
    if status != 0:
        raise_last_error()


def override_lines(values: Mapping[str, Any]) -> bytes:
    """name=value lines; a list of numbers or points is written as in TOML."""
    return "\n".join(f"{name}={_value_text(value)}" for name, value in values.items()).encode()


def _value_text(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return value
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_value_text(item) for item in value) + "]"
    return repr(float(value))


def parameters() -> tuple[Parameter, ...]:
    """Every parameter of the firmware."""
    lib = library()
    found = []
    for index in range(lib.zh_sil_name_count()):
        info = _NameInfo(struct_size=ctypes.sizeof(_NameInfo))
        check(lib.zh_sil_describe(index, byref(info)))
        found.append(
            Parameter(
                name=lib.zh_sil_name(index).decode(),
                unit=info.unit.decode(),
                text=info.text.decode(),
                minimum=info.minimum,
                maximum=info.maximum,
                initial=info.initial,
                access=Access(info.access),
                whole=bool(info.whole),
                group=info.group.decode(),
                choices=_choices(info),
            )
        )
    return tuple(found)


def _choices(info: _NameInfo) -> tuple[str, ...]:
    if not info.choice:
        return ()
    return tuple(info.choice[k].decode() for k in range(int(info.maximum) + 1))


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
        if self._handle:
            getattr(self._lib, self._CLOSE)(self._handle)
            self._handle = None

    def _open_handle(self) -> int:
        if not self._handle:
            raise UserError(f"{type(self).__name__}: is closed; open another one")
        return self._handle


class Drive(Handle):
    """One drive. Any number may exist; each may be used by one thread at a time.

    motor_dir has motor.toml and l_gain.json; board is a TOML file as in host_sim/boards; overrides
    set parameters of firmware/parameters/param_list.def, the protected ones only here.
    """

    _CLOSE = "zh_sil_close"

    def __init__(
        self,
        motor_dir: StrPath,
        board: StrPath,
        overrides: Mapping[str, float] | None = None,
    ) -> None:
        """Raise UserError, which names file and key, when the library refuses an input."""
        self._handle = None
        self._lib = library()
        self._in = _In(struct_size=ctypes.sizeof(_In))
        self._out = _Out(struct_size=ctypes.sizeof(_Out))
        lines = override_lines(overrides or {})
        self._handle = self._lib.zh_sil_open(os.fsencode(motor_dir), os.fsencode(board), lines)
        if not self._handle:
            raise_last_error()

    def step(
        self,
        i_u: int,
        i_v: int,
        i_w: int,
        u_uv: int,
        u_vw: int,
        u_dc: int,
        *,
        speed_ref_rpm: float,
        run: bool = False,
        fault_reset: bool = False,
        torque_off: bool = False,
    ) -> Output:
        """Run one control period on the ADC words sampled at this carrier crest.

        The returned duties act from the next crest to the one after; gates_on False acts at once.
        Raise UserError for a reference that is not finite; the drive has then tripped.
        """
        words = (i_u, i_v, i_w, u_uv, u_vw, u_dc)
        if min(words) < 0 or max(words) > 0xFFFF:
            raise UserError(f"Drive.step: {words} are not six words of 0 .. 65535; clip them")
        command = _RUN * run | _FAULT_RESET * fault_reset | _TORQUE_OFF * torque_off
        raw = self._in
        raw.i_u, raw.i_v, raw.i_w, raw.u_uv, raw.u_vw, raw.u_dc = words
        raw.speed_ref_rpm, raw.command = speed_ref_rpm, command
        check(self._lib.zh_sil_step(self._open_handle(), byref(raw), byref(self._out)))
        out = self._out
        return Output(
            *(bool(getattr(out, n)) if n in _FLAGS else getattr(out, n) for n in _OUTPUT_NAMES)
        )

    def __getitem__(self, name: str) -> float:
        value = c_float()
        check(self._lib.zh_sil_get(self._open_handle(), name.encode(), byref(value)))
        return value.value

    def __setitem__(self, name: str, value: float) -> None:
        check(self._lib.zh_sil_set(self._open_handle(), name.encode(), value))

    def __iter__(self) -> Iterator[str]:
        return iter(p.name for p in parameters())


_OUTPUT_NAMES = tuple(f.name for f in fields(Output))
