"""motor.toml and l_gain.json as exact data; contradictions in them and between them."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import math
import struct
import tomllib
from collections.abc import Iterable, Mapping
from fractions import Fraction
from pathlib import Path
from typing import Any

from zerohertz.check.inequalities import Machine
from zerohertz.errors import UserError

ELEC_PER_MIN_PER_STEP = 2
Four = tuple[Fraction, Fraction, Fraction, Fraction]
_CIRCUIT = ("Rs_ohm", "Rr_ohm", "Ls_H", "Lr_H", "M_H")
_DESIGN = ("dw0_rad_s", "radius_per_s", "decay_per_s", "period_s")


@dataclasses.dataclass(frozen=True)
class StoredTable:
    """What was read, exact; `faults` are contradictions that no entry can be blamed for."""

    name: str
    method: str
    machine: Machine
    step_rad_s: Fraction  # the float32 by which the firmware finds its entry
    gain: tuple[Four, ...]
    gamma: tuple[Fraction | None, ...]
    X: tuple[Four | None, ...]
    poles: tuple[tuple[float, float, float, float], ...]
    faults: tuple[str, ...]


def read_stored_table(folder: Path) -> StoredTable:
    """UserError when a file cannot be read as what it should be; contradictions become faults."""
    motor_path, path = folder / "motor.toml", folder / "l_gain.json"
    motor = _read_toml(motor_path)
    machine = _machine(motor, motor_path)
    _require_henry(motor, motor_path)
    table = _read_json(path)
    try:
        return _stored_table(motor, machine, table)
    except KeyError as error:
        raise UserError(f"{path}: {error.args[0]}: key is missing; run zh design") from None
    except (TypeError, ValueError, AttributeError, struct.error, OverflowError) as error:
        raise UserError(f"{path}: cannot be read as a gain table: {error}; run zh design") from None


def _stored_table(
    motor: Mapping[str, Any], machine: Machine, table: Mapping[str, Any]
) -> StoredTable:
    entries = table["entries"]
    gain = tuple(_four(map(_float32, _four(entry["L"]))) for entry in entries)
    return StoredTable(
        name=table["motor"],
        method=table["method"],
        machine=machine,
        step_rad_s=_float32(table["step_rad_s"]),
        gain=gain,
        gamma=tuple(None if (g := entry["gamma"]) is None else Fraction(g) for entry in entries),
        X=tuple(None if (X := entry["X"]) is None else _four(X) for entry in entries),
        poles=tuple(tuple(map(float, _four(entry["poles"]))) for entry in entries),
        faults=tuple(_faults(motor, table, gain)),
    )


def _faults(
    motor: Mapping[str, Any], table: Mapping[str, Any], gain: tuple[Four, ...]
) -> list[str]:
    """Contradictions between the two files, and inside the json."""
    faults, inputs = [], table["inputs"]
    for section in sorted({*motor, *inputs}):
        ours, theirs = motor.get(section, {}), inputs.get(section, {})
        faults += [
            f"inputs.{section}.{key}: {_shown(theirs.get(key))} in l_gain.json, "
            f"{_shown(ours.get(key))} in motor.toml"
            for key in sorted({*ours, *theirs})
            if ours.get(key) != theirs.get(key)
        ]
    words = b"".join(struct.pack("<4f", *row) for row in gain)
    machine = {key: inputs[key] for key in ("circuit", "nameplate")}
    end = inputs["design"]["table_end_elec_per_min"]
    expected = {
        "schema": 2,
        "motor": inputs["motor"]["name"],
        "method": inputs["design"]["method"],
        "inputs_sha256": hashlib.sha256(_canonical(inputs)).hexdigest(),
        "motor_id": f"{_crc32c(_canonical(machine)):08x}",
        "step_elec_per_min": ELEC_PER_MIN_PER_STEP,
        "crc32c": f"{_crc32c(words):08x}",
    }
    faults += [
        f"{key}: {table[key]} is stored, {value} is right"
        for key, value in expected.items()
        if table[key] != value
    ]
    count = end // ELEC_PER_MIN_PER_STEP + 1
    if len(gain) != count:
        faults.append(f"entries: {len(gain)} are stored, {count} is right")
    nominal_rad_s = ELEC_PER_MIN_PER_STEP * 2 * math.pi / 60
    step_rad_s = float(_float32(table["step_rad_s"]))
    if not math.isclose(step_rad_s, nominal_rad_s, rel_tol=2**-24):
        faults.append(f"step_rad_s: {step_rad_s} rad/s is not the float32 next to pi/15")
    if gain[0][1] != 0 or gain[0][3] != 0:
        faults.append("entries: L(0) is not real, so L(-w) = conj L(w) fails at standstill")
    return faults


def _machine(motor: Mapping[str, Any], path: Path) -> Machine:
    """Only what the proof needs is looked at; UserError unless it makes a machine."""
    values = {
        key: _number(motor, section, key, path)
        for section, keys in (("circuit", _CIRCUIT), ("design", _DESIGN))
        for key in keys
    }
    machine = Machine(**values)
    if machine.M_H**2 >= machine.Ls_H * machine.Lr_H:
        raise UserError(f"{path}: circuit.M_H: leaves no leakage (M^2 >= Ls Lr); lower it")
    return machine


def _require_henry(motor: Mapping[str, Any], path: Path) -> None:
    """A slipped unit shall not look like a table without proof; motors have .5 to 10 pu."""
    try:
        plate, circuit = motor["nameplate"], motor["circuit"]
        rated_ohm = float(plate["voltage_V"]) / (math.sqrt(3.0) * float(plate["current_A"]))
        rated_H = rated_ohm / (2.0 * math.pi * float(plate["frequency_Hz"]))
    except (KeyError, TypeError, ValueError, ZeroDivisionError):
        return  # no nameplate to compare with; the proof needs none
    lines = path.read_text(encoding="utf-8").splitlines()
    for key in ("Ls_H", "Lr_H", "M_H"):
        value_H = float(circuit[key])
        if value_H > 50.0 * rated_H:
            at = (f":{n}" for n, text in enumerate(lines, start=1) if text.lstrip().startswith(key))
            raise UserError(
                f"{path}{next(at, '')}: circuit.{key}: is {value_H:g} H, {value_H / rated_H:.3g} "
                f"times the nameplate's; {value_H / 1e3:g} H if mH was meant"
            )


def _number(motor: Mapping[str, Any], section: str, key: str, path: Path) -> Fraction:
    content = motor.get(section)
    value = content.get(key) if isinstance(content, Mapping) else None
    if isinstance(value, bool) or not isinstance(value, (Fraction, int)):
        shown = "missing" if value is None else repr(value)
        raise UserError(f"{path}: {section}.{key}: is {shown}; a finite number is needed")
    if value < 0 or (value == 0 and key != "decay_per_s"):
        raise UserError(f"{path}: {section}.{key}: is {float(value)}; it must be positive")
    return Fraction(value)


def _exact_or_text(text: str) -> Fraction | str:
    """TOML's nan and inf stay text, which no key accepts."""
    try:
        return Fraction(text.replace("_", ""))
    except ValueError:
        return text


def _read_toml(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"), parse_float=_exact_or_text)
    except FileNotFoundError:
        raise UserError(f"{path}: no such file; name a folder of gain_tables") from None
    except (tomllib.TOMLDecodeError, ValueError) as error:
        raise UserError(f"{path}: not valid TOML: {error}; correct the syntax") from None


def _read_json(path: Path) -> dict[str, Any]:
    def no_constant(name: str) -> None:
        raise ValueError(f"{name} is not a number")

    try:
        text = path.read_text(encoding="utf-8")
        content = json.loads(text, parse_float=Fraction, parse_constant=no_constant)
    except FileNotFoundError:
        raise UserError(f"{path}: no such file; run zh design") from None
    except ValueError as error:
        raise UserError(f"{path}: not valid JSON: {error}; run zh design") from None
    if not isinstance(content, dict):
        raise UserError(f"{path}: is not a JSON object; run zh design")
    return content


def _float32(decimal: Fraction | int) -> Fraction:
    """The float32 that the decimal stands for, as firmware and compiler round it."""
    (value,) = struct.unpack("<f", struct.pack("<f", decimal))
    return Fraction(value)


def _four(values: Iterable[Any]) -> Four:
    first, second, third, fourth = (Fraction(value) for value in values)
    return (first, second, third, fourth)


def _canonical(content: Any) -> bytes:
    """JSON with sorted keys, no spaces, decimals as the shortest text of the double."""
    plain = json.dumps(content, sort_keys=True, separators=(",", ":"), default=float)
    return plain.encode()


def _shown(value: Any) -> str:
    return str(float(value)) if isinstance(value, Fraction) else repr(value)


def _crc32c(data: bytes) -> int:
    """CRC-32C bit by bit: slow, and like nothing that computed the stored one."""
    crc = 0xFFFFFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = (crc >> 1) ^ (0x82F63B78 & -(crc & 1))
    return crc ^ 0xFFFFFFFF
