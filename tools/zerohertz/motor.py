"""The machine and what its gain table is designed for: motor.toml, loaded and validated.

T-equivalent circuit, per phase, referred to the stator. Every quantity carries its unit in its
name. A file that cannot be used raises MotorError: one line that names file, key and remedy.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import math
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from zerohertz.errors import UserError
from zerohertz.toml_file import toml_value, with_line

METHODS = ("gamma_pr", "closed_form", "pole_shift", "zero")
STEP_ELEC_PER_MIN = 2  # the paper's quantisation of the gain table
MAX_ENTRIES = 2048  # GAIN_TABLE_MAX_ENTRIES of gain_table.h: 32 KiB of words


class MotorError(UserError):
    """Motor data that cannot be used: `file: key: what is wrong; remedy`."""


@dataclasses.dataclass(frozen=True)
class Nameplate:
    power_W: float
    speed_rpm: float
    voltage_V: float  # line to line, rms
    current_A: float  # phase, rms
    frequency_Hz: float
    pole_pairs: int
    torque_Nm: float


@dataclasses.dataclass(frozen=True)
class Circuit:
    Rs_ohm: float
    Rr_ohm: float
    Ls_H: float
    Lr_H: float
    M_H: float

    @property
    def sigma_Ls_H(self) -> float:
        """sigma Ls = Ls - M^2/Lr, written without cancelling twice."""
        return (self.Ls_H * self.Lr_H - self.M_H**2) / self.Lr_H

    @property
    def eps_H(self) -> float:
        """epsilon of eq. (1): sigma Ls Lr / M."""
        return (self.Ls_H * self.Lr_H - self.M_H**2) / self.M_H

    @property
    def tau_per_s(self) -> float:
        """Rr/Lr, the inverse rotor time constant."""
        return self.Rr_ohm / self.Lr_H

    @property
    def a11_per_s(self) -> float:
        """(Rs + M^2 Rr/Lr^2)/(sigma Ls): minus the current row's own entry in A, eq. (1)."""
        return (self.Rs_ohm + (self.M_H / self.Lr_H) ** 2 * self.Rr_ohm) / self.sigma_Ls_H


@dataclasses.dataclass(frozen=True)
class Mechanics:
    J_kg_m2: float  # the motor's own rotor


@dataclasses.dataclass(frozen=True)
class Design:
    """Requirements of the LMIs (14)-(16), the table's range, and the methods' own numbers."""

    method: str
    dw0_rad_s: float  # speed error the field orientation must survive, electrical
    radius_per_s: float  # r of (15)
    decay_per_s: float  # h of (16)
    relax: float  # gamma allowed over its minimum in stage two
    period_s: float  # T of the Euler disc |1 + T s| < 1
    table_end_elec_per_min: int
    p1_per_s: float | None = None  # closed_form, and reference of gamma_pr
    a: float | None = None
    b: float | None = None
    p1_fast_per_s: float | None = None  # closed_form: p1 goes to this ...
    p1_slow_elec_per_min: float | None = None  # ... in a straight line from this speed on ...
    p1_fast_elec_per_min: float | None = None  # ... to this one
    real_factor: float | None = None  # pole_shift
    imag_factor: float | None = None

    def p1_at(self, omega_rad_s: float) -> float:
        """The pole p1 of the closed form at this speed (electrical), 1/s."""
        if self.p1_fast_per_s is None:
            return self.p1_per_s
        speed = abs(omega_rad_s) * 60.0 / (2.0 * math.pi)
        slow, fast = self.p1_slow_elec_per_min, self.p1_fast_elec_per_min
        share = min(max((speed - slow) / (fast - slow), 0.0), 1.0)
        return self.p1_per_s + share * (self.p1_fast_per_s - self.p1_per_s)

    @property
    def entries(self) -> int:
        return self.table_end_elec_per_min // STEP_ELEC_PER_MIN + 1


@dataclasses.dataclass(frozen=True)
class Motor:
    name: str
    source: str
    nameplate: Nameplate
    circuit: Circuit
    mechanics: Mechanics
    design: Design
    file: str = "motor.toml"  # where it came from, for error messages only

    def inputs(self) -> dict[str, Any]:
        """The content of motor.toml, numbers normalised (200 and 200.0 are the same input)."""
        design = {k: v for k, v in dataclasses.asdict(self.design).items() if v is not None}
        return {
            "motor": {"name": self.name, "source": self.source},
            "nameplate": dataclasses.asdict(self.nameplate),
            "circuit": dataclasses.asdict(self.circuit),
            "mechanics": dataclasses.asdict(self.mechanics),
            "design": design,
        }

    def inputs_sha256(self) -> str:
        return hashlib.sha256(_canonical(self.inputs())).hexdigest()

    def machine_bytes(self) -> bytes:
        """What motor_id is the CRC-32C of: the canonical JSON of circuit and nameplate.

        The design is left out on purpose: two tables for one machine share the motor_id.
        """
        inputs = self.inputs()
        return _canonical({key: inputs[key] for key in ("circuit", "nameplate")})


# Key -> (required for these methods, kind). Kinds are checked by _number below.
_SECTIONS: dict[str, dict[str, str]] = {
    "motor": {"name": "name", "source": "text"},
    "nameplate": {
        "power_W": "positive",
        "speed_rpm": "positive",
        "voltage_V": "positive",
        "current_A": "positive",
        "frequency_Hz": "positive",
        "pole_pairs": "count",
        "torque_Nm": "positive",
    },
    "circuit": dict.fromkeys(("Rs_ohm", "Rr_ohm", "Ls_H", "Lr_H", "M_H"), "positive"),
    "mechanics": {"J_kg_m2": "positive"},
    "design": {
        "method": "method",
        "dw0_rad_s": "positive",
        "radius_per_s": "positive",
        "decay_per_s": "not_negative",
        "relax": "at_least_one",
        "period_s": "positive",
        "table_end_elec_per_min": "table_end",
        "p1_per_s": "negative",
        "a": "positive",
        "b": "not_negative",
        "p1_fast_per_s": "negative",
        "p1_slow_elec_per_min": "not_negative",
        "p1_fast_elec_per_min": "positive",
        "real_factor": "positive",
        "imag_factor": "not_negative",
    },
}
_NEEDED_BY = {
    "p1_per_s": ("gamma_pr", "closed_form"),
    "a": ("gamma_pr", "closed_form"),
    "b": ("gamma_pr", "closed_form"),
    "real_factor": ("pole_shift",),
    "imag_factor": ("pole_shift",),
}
_SCHEDULE = ("p1_fast_per_s", "p1_slow_elec_per_min", "p1_fast_elec_per_min")  # all or none
_LARGEST = 1.0e30  # no quantity of a motor comes near; float32 ends at 3.4e38
_RULES = {
    "positive": (lambda x: x > 0.0, "must be greater than zero"),
    "negative": (lambda x: x < 0.0, "must be less than zero"),
    "not_negative": (lambda x: x >= 0.0, "must not be negative"),
    "at_least_one": (lambda x: x >= 1.0, "must be 1 or more"),
}


def load_motor(path: Path | str) -> Motor:
    """Motor of a directory (its motor.toml) or of a file; MotorError when it cannot be used."""
    file = Path(path)
    if file.is_dir():
        file = file / "motor.toml"
    try:
        text = file.read_text(encoding="utf-8")
        data = tomllib.loads(text)
    except FileNotFoundError:
        raise MotorError(f"{file}: no such file; name a folder with a motor.toml") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise MotorError(f"{file}: not valid TOML: {error}; correct the syntax") from None
    except OSError as error:
        raise MotorError(f"{file}: cannot be read: {error.strerror}") from None
    try:
        return motor_from_dict(data, str(file))
    except MotorError as error:
        raise MotorError(with_line(str(error), str(file), text)) from None


def motor_from_dict(data: Mapping[str, Any], file: str = "motor.toml") -> Motor:
    """Validates the content of a motor.toml; `file` appears in the messages."""
    for section in data:
        if section not in _SECTIONS:
            known = ", ".join(_SECTIONS)
            raise MotorError(f"{file}: [{section}]: unknown section; known are {known}")
    values = {section: _section(data, section, file) for section in _SECTIONS}
    motor = Motor(
        name=values["motor"]["name"],
        source=values["motor"]["source"],
        nameplate=Nameplate(**values["nameplate"]),
        circuit=Circuit(**values["circuit"]),
        mechanics=Mechanics(**values["mechanics"]),
        design=Design(**values["design"]),
        file=file,
    )
    _require_plausible(motor, file)
    _require_nameplate(motor, file)
    _require_leakage(motor.circuit, file)
    _require_schedule(motor.design, file)
    return motor


def with_design(motor: Motor, **changes: Any) -> Motor:
    """The motor with other design values, validated like a file."""
    inputs = motor.inputs()
    inputs["design"].update(changes)
    return motor_from_dict(inputs, motor.file)


def motor_toml(motor: Motor) -> str:
    """Text of a motor.toml with the motor's inputs."""
    lines: list[str] = []
    for section, content in motor.inputs().items():
        lines += [f"[{section}]"] + [f"{k} = {toml_value(v)}" for k, v in content.items()] + [""]
    return "\n".join(lines)


def _section(data: Mapping[str, Any], section: str, file: str) -> dict[str, Any]:
    if section not in data:
        raise MotorError(f"{file}: [{section}]: section is missing; add it")
    content = data[section]
    if not isinstance(content, Mapping):
        raise MotorError(f"{file}: {section}: must be a section; write [{section}]")
    for key in content:
        if key not in _SECTIONS[section]:
            known = ", ".join(_SECTIONS[section])
            raise MotorError(f"{file}: {section}.{key}: unknown key; known are {known}")
    method = content.get("method")
    result = {}
    for key, kind in _SECTIONS[section].items():
        if key in content:
            result[key] = _value(content[key], kind, f"{file}: {section}.{key}")
        elif key in _SCHEDULE:
            continue
        elif key not in _NEEDED_BY:
            raise MotorError(f"{file}: {section}.{key}: key is missing; add it")
        elif method in _NEEDED_BY[key]:
            raise MotorError(f"{file}: {section}.{key}: key is missing; method {method} needs it")
    return result


def _value(value: Any, kind: str, where: str) -> Any:
    if kind in ("name", "text", "method"):
        return _text(value, kind, where)
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise MotorError(f"{where}: is {value!r}; a number is needed")
    if not -_LARGEST <= value <= _LARGEST:  # false for NaN too
        raise MotorError(f"{where}: is {str(value)[:12]}; a finite number is needed")
    if kind in ("count", "table_end"):
        return _whole_number(value, kind, where)
    holds, text = _RULES[kind]
    if not holds(value):
        raise MotorError(f"{where}: is {value}; it {text}")
    return float(value)


def _text(value: Any, kind: str, where: str) -> str:
    if not isinstance(value, str) or not value.strip():
        raise MotorError(f"{where}: is {value!r}; a text is needed")
    if kind == "name" and not re.fullmatch(r"[a-z][a-z0-9_]*", value):
        raise MotorError(f"{where}: is {value!r}; use a-z, 0-9 and _, it becomes a C identifier")
    if kind == "method" and value not in METHODS:
        raise MotorError(f"{where}: is {value!r}; known are {', '.join(METHODS)}")
    return value


def _whole_number(value: float, kind: str, where: str) -> int:
    if value != int(value) or value < 1:
        raise MotorError(f"{where}: is {value}; a whole number of 1 or more is needed")
    end = (MAX_ENTRIES - 1) * STEP_ELEC_PER_MIN
    if kind == "table_end" and (value % STEP_ELEC_PER_MIN or value > end):
        raise MotorError(f"{where}: is {value}; an even number up to {end} is needed (32 KiB)")
    return int(value)


def _require_leakage(circuit: Circuit, file: str) -> None:
    if circuit.M_H**2 >= circuit.Ls_H * circuit.Lr_H:
        raise MotorError(
            f"{file}: circuit.M_H: {circuit.M_H} H leaves no leakage (M^2 >= Ls Lr); "
            f"it must be below {math.sqrt(circuit.Ls_H * circuit.Lr_H):.6g} H"
        )


# What the firmware takes (param_list.def).
_CIRCUIT_LIMITS = {
    **dict.fromkeys(("Rs_ohm", "Rr_ohm"), (1e-4, 1e3)),
    **dict.fromkeys(("Ls_H", "Lr_H", "M_H"), (1e-6, 10.0)),
}
# Of the rated impedance: far beyond any motor's (.003 .. .3 and .5 .. 10), and still less than the
# factor of 1000 by which a slipped unit misses.
_RESISTANCE_PU = (1e-4, 3.0)
_REACTANCE_PU = (0.05, 50.0)


# A motor's inertia lies within this factor of the usual one, with its load below the second.
J_RATIO = 12.0
J_RATIO_COUPLED = 500.0
POWER_TOLERANCE = 0.05  # plates are rounded
_YIELD = (0.15, 0.97)  # efficiency times cos phi: a very small motor's, and the largest's
_PERIOD_S = (20e-6, 2e-3)  # what the firmware takes (param_list.def)


def usual_J_kg_m2(torque_Nm: float) -> float:
    """What a motor of this torque usually has."""
    return 6e-4 * torque_Nm**1.25


def _require_plausible(motor: Motor, file: str) -> None:
    plate = motor.nameplate
    rated_ohm = plate.voltage_V / (math.sqrt(3.0) * plate.current_A)
    for key, (low, high) in _CIRCUIT_LIMITS.items():
        value = getattr(motor.circuit, key)
        unit = key.rpartition("_")[2]
        factor = 1.0 if unit == "ohm" else 2.0 * math.pi * plate.frequency_Hz
        low_pu, high_pu = _RESISTANCE_PU if unit == "ohm" else _REACTANCE_PU
        pu = value * factor / rated_ohm
        if not low_pu <= pu <= high_pu:
            slip = f"{value / 1e3:g} {unit} if m{unit} was meant; " if pu > high_pu else ""
            raise MotorError(
                f"{file}: circuit.{key}: is {value:g} {unit}, {pu:.3g} times the rated impedance "
                f"of {rated_ohm:.3g} ohm, where motors have {low_pu:g} to {high_pu:g}; {slip}"
                f"look at its unit, and at voltage_V and current_A"
            )
        if not low <= value <= high:
            raise MotorError(
                f"{file}: circuit.{key}: is {value:g} {unit}; "
                f"the firmware takes {low:g} .. {high:g}"
            )
    synchronous_rpm = 60.0 * plate.frequency_Hz / plate.pole_pairs
    if not 0.5 * synchronous_rpm < plate.speed_rpm < synchronous_rpm:
        raise MotorError(
            f"{file}: nameplate.speed_rpm: is {plate.speed_rpm:g}; rated speed lies a little below "
            f"the synchronous {synchronous_rpm:g} min^-1 of frequency_Hz and pole_pairs"
        )


def _require_nameplate(motor: Motor, file: str) -> None:
    """Values that contradict one another, with both."""
    plate, J_kg_m2, period_s = motor.nameplate, motor.mechanics.J_kg_m2, motor.design.period_s
    drawn_W = math.sqrt(3.0) * plate.voltage_V * plate.current_A
    if not _YIELD[0] < plate.power_W / drawn_W < _YIELD[1]:
        raise MotorError(
            f"{file}: nameplate.power_W: is {plate.power_W:g} W, and voltage_V = "
            f"{plate.voltage_V:g} with current_A = {plate.current_A:g} draw {drawn_W:.4g} VA; "
            "look at its unit, and at the connection that voltage and current are of"
        )
    torque_Nm = plate.power_W / (plate.speed_rpm * math.pi / 30.0)
    if abs(plate.torque_Nm / torque_Nm - 1.0) > POWER_TOLERANCE:
        raise MotorError(
            f"{file}: nameplate.torque_Nm: is {plate.torque_Nm:g} Nm, and power_W = "
            f"{plate.power_W:g} at speed_rpm = {plate.speed_rpm:g} is {torque_Nm:.4g} Nm; correct "
            "the one that is wrong"
        )
    usual = usual_J_kg_m2(plate.torque_Nm)
    if not usual / J_RATIO < J_kg_m2 < usual * J_RATIO_COUPLED:
        raise MotorError(
            f"{file}: mechanics.J_kg_m2: is {J_kg_m2:g} kg m2; a motor of {plate.torque_Nm:g} Nm "
            f"has about {usual:.2g}; look at its unit"
        )
    if not _PERIOD_S[0] <= period_s <= _PERIOD_S[1]:
        raise MotorError(
            f"{file}: design.period_s: is {period_s:g} s; the firmware takes {_PERIOD_S[0]:g} .. "
            f"{_PERIOD_S[1]:g}: 200e-6 if 200 us was meant"
        )


def _require_schedule(design: Design, file: str) -> None:
    given = [key for key in _SCHEDULE if getattr(design, key) is not None]
    if not given:
        return
    if len(given) < len(_SCHEDULE):
        missing = next(key for key in _SCHEDULE if key not in given)
        raise MotorError(f"{file}: design.{missing}: key is missing; {given[0]} needs it")
    if design.method != "closed_form":
        raise MotorError(f"{file}: design.{given[0]}: is for method closed_form; remove it")
    if design.p1_slow_elec_per_min >= design.p1_fast_elec_per_min:
        raise MotorError(
            f"{file}: design.p1_slow_elec_per_min: is {design.p1_slow_elec_per_min:g}; it must be "
            f"below p1_fast_elec_per_min = {design.p1_fast_elec_per_min:g}"
        )


def _canonical(content: Any) -> bytes:
    return json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False).encode()
