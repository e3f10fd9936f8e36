"""What goes into a drive of host_sim/sil.h and comes out of it: enumerations, values, structs.

Use them from `zerohertz.drive` and `zerohertz.plant`.
"""

from __future__ import annotations

from ctypes import (
    POINTER,
    Structure,
    c_char_p,
    c_double,
    c_float,
    c_uint16,
    c_uint32,
)
from dataclasses import dataclass, fields
from enum import IntEnum, IntFlag
from typing import Any

import numpy as np
import numpy.typing as npt


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


# Bits that leave the gates on.
WARNINGS = int(Fault.PERIOD_LATE | Fault.DERATED | Fault.REGENERATION | Fault.UNDERLOAD)


class Access(IntEnum):
    """When a parameter may change."""

    ANY_TIME = 0
    GATES_OFF = 1
    AT_OPEN = 2


class Confidence(IntEnum):
    """How far the drive trusts the angle of its flux."""

    CLOSED = 0
    DEGRADED = 1
    LOST = 2


class Reason(IntFlag):
    """Why it does not."""

    UNSURE = 1  # the bound of the flux error is beyond 25 degrees
    RESIDUAL = 2  # two flux estimates differ more than uncertainty explains
    FLUX = 4  # more flux than any current here makes
    LOST = 8  # far beyond, or one of the others for too long
    STILL = 16  # a field at standstill under torque


class Commissioning(IntEnum):
    """Where the identification of the motor is."""

    NONE = 0
    BUSY = 1
    DONE = 2
    REFUSED = 3


class Refusal(IntEnum):
    """Why commissioning gave no result."""

    NONE = 0
    NO_CURRENT = 1  # current does not follow: no motor, or too little voltage
    OPEN_PHASE = 2
    RS = 3  # not a motor's stator resistance
    UNSETTLED = 4  # the flux was still changing: use longer levels
    CURVE = 5  # more current did not give more flux
    LEAKAGE = 6
    ROTOR = 7


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


@dataclass(frozen=True)
class Signal:
    """One traced signal of the firmware (signal_list.def)."""

    name: str
    unit: str  # empty: a bare number
    text: str
    whole: bool


@dataclass(frozen=True)
class Commissioned:
    """Result of the firmware's self-commissioning (zh_commissioning of sil.h)."""

    done: bool
    refusal: int  # Refusal
    Rs_ohm: float
    lost_V: float
    sigma_Ls_H: float
    Rr_gamma_ohm: float  # (M/Lr)^2 Rr
    M_gamma_H: float  # M^2/Lr for small changes about bias_A
    bias_A: float
    level_A: tuple[float, ...]
    flux_Wb: tuple[float, ...]
    error_V: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Output:
    """Duties, state and telemetry of one control period; vectors power invariant."""

    duty_u: float
    duty_v: float
    duty_w: float
    gates_on: bool
    state: int  # State
    faults: int  # Fault
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
    confidence: int = 0  # Confidence
    reasons: int = 0  # Reason
    commissioning: int = 0  # Commissioning
    speed_bound_rpm: float = 0.0  # bound of the speed error, as far as known
    speed_ref_rpm: float = 0.0  # after the slew limit
    i_d_ref_A: float = 0.0
    lambda_ref_Wb: float = 0.0
    Rs_hat_ohm: float = 0.0  # in use: parameter, measurement at the start, tracking
    leg_loss_pu: float = 0.0  # voltage lost in a leg over the dc link, identified; 0: it was not
    u_s_alpha_V: float = 0.0  # what the estimator was given: voltage ...
    u_s_beta_V: float = 0.0
    i_s_alpha_A: float = 0.0  # ... and current, stationary frame
    i_s_beta_A: float = 0.0
    u_dc_V: float = 0.0
    brake_on: bool = False

    @property
    def duties(self) -> tuple[float, float, float]:
        return self.duty_u, self.duty_v, self.duty_w


@dataclass(frozen=True, slots=True)
class Truth:
    """True quantities of a plant at a carrier crest; vectors power invariant."""

    diverged: bool
    t_s: float
    speed_rpm: float
    torque_Nm: float  # of the motor, in the air gap
    load_torque_Nm: float  # positive opposes positive rotation
    i_s_alpha_A: float
    i_s_beta_A: float
    psi_s_alpha_Wb: float
    psi_s_beta_Wb: float
    psi_r_alpha_Wb: float
    psi_r_beta_Wb: float
    u_s_alpha_V: float  # mean over the last period
    u_s_beta_V: float
    i_peak_A: float  # largest leg current over the last period
    u_dc_V: float


WORDS = ("i_u", "i_v", "i_w", "u_uv", "u_vw", "u_dc")
FLAGS = frozenset({"gates_on", "speed_unknown", "brake_on"})
_WHOLE = FLAGS | {"state", "faults", "confidence", "reasons", "commissioning"}
OUTPUT_NAMES = tuple(f.name for f in fields(Output))
TRUTH_NAMES = tuple(f.name for f in fields(Truth))

COMMISSIONING_LEVELS = 8
FOUND = ("Rs_ohm", "lost_V", "sigma_Ls_H", "Rr_gamma_ohm", "M_gamma_H", "bias_A")
CURVES = ("level_A", "flux_Wb", "error_V")


class RawCommissioning(Structure):
    """zh_commissioning"""

    _fields_ = (
        ("done", c_uint32),
        ("refusal", c_uint32),
        *((name, c_float) for name in FOUND),
        *((name, c_float * COMMISSIONING_LEVELS) for name in CURVES),
    )


def commissioned(raw: RawCommissioning) -> Commissioned:
    """The struct as a value."""
    return Commissioned(
        done=bool(raw.done),
        refusal=raw.refusal,
        **{name: getattr(raw, name) for name in FOUND},
        **{name: tuple(getattr(raw, name)) for name in CURVES},
    )


class RawIn(Structure):
    """zh_sil_in"""

    _fields_ = (
        ("struct_size", c_uint32),
        *((name, c_uint16) for name in WORDS),
        ("speed_ref_rpm", c_float),
        ("torque_ref_Nm", c_float),
        ("mode", c_uint32),
        ("command", c_uint32),
    )


class RawOut(Structure):
    """zh_sil_out"""

    _fields_ = (
        ("struct_size", c_uint32),
        *((name, c_uint32 if name in _WHOLE else c_float) for name in OUTPUT_NAMES),
    )


class RawTruth(Structure):
    """zh_plant_truth"""

    _fields_ = (
        ("struct_size", c_uint32),
        ("diverged", c_uint32),
        *((name, c_double) for name in TRUTH_NAMES[1:]),
    )


class RawParameter(Structure):
    """zh_sil_name_info"""

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


class RawSignal(Structure):
    """zh_sil_signal_info"""

    _fields_ = (
        ("struct_size", c_uint32),
        ("whole", c_uint32),
        ("name", c_char_p),
        ("unit", c_char_p),
        ("text", c_char_p),
    )


class RawRecord(Structure):
    """zh_sil_record"""

    _fields_ = (
        ("struct_size", c_uint32),
        ("count", c_uint32),
        ("index", POINTER(c_uint32)),
        ("value", POINTER(c_double)),
    )


IN: np.dtype[Any] = np.dtype(RawIn)
OUT: np.dtype[Any] = np.dtype(RawOut)
TRUTH: np.dtype[Any] = np.dtype(RawTruth)

Rows = npt.NDArray[Any]  # structured, one element per period
