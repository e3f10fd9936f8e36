"""The nameplate as its owner reads it, and what follows from it alone.

Vectors are power invariant: their length is sqrt(3) times the rms value of a phase of the
star-equivalent machine, so a voltage is as long as the line voltage is rms, and a current sqrt(3)
times the line current. A motor in delta is its star equivalent at the terminals: the line values
on the plate are all that is needed, as long as they belong to the connection that is wired.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from zerohertz.errors import UserError
from zerohertz.motor import Circuit

CONNECTIONS = ("star", "delta")


@dataclass(frozen=True)
class Plate:
    """Rated values; voltage and current of the line, rms, for the connection that is wired."""

    power_kW: float
    voltage_V: float
    current_A: float
    connection: str
    frequency_Hz: float
    speed_rpm: float
    cos_phi: float
    J_kg_m2: float | None = None  # of the motor, from the catalogue; None: guessed from its size

    @property
    def pole_pairs(self) -> int:
        """The slip is small: the most pole pairs whose synchronous speed is not below rated."""
        return int(60.0 * self.frequency_Hz / self.speed_rpm)

    @property
    def omega_rad_s(self) -> float:
        return 2.0 * math.pi * self.frequency_Hz

    @property
    def slip(self) -> float:
        return 1.0 - self.speed_rpm * self.pole_pairs / (60.0 * self.frequency_Hz)

    @property
    def slip_Hz(self) -> float:
        return self.slip * self.frequency_Hz

    @property
    def torque_Nm(self) -> float:
        return 1e3 * self.power_kW / (2.0 * math.pi * self.speed_rpm / 60.0)

    @property
    def current_vector_A(self) -> float:
        return math.sqrt(3.0) * self.current_A

    @property
    def impedance_ohm(self) -> float:
        """Rated voltage over rated current, per phase."""
        return self.voltage_V / self.current_vector_A

    @property
    def efficiency(self) -> float:
        drawn_kW = 1e-3 * self.voltage_V * self.current_vector_A * self.cos_phi
        return self.power_kW / drawn_kW


def read_plate(rig: Path) -> Plate:
    """[nameplate] of a file; UserError names what is missing or impossible."""
    try:
        data = tomllib.loads(rig.read_text(encoding="utf-8"))
    except OSError as error:
        raise UserError(f"{rig}: cannot be read: {error.strerror}") from None
    except tomllib.TOMLDecodeError as error:
        raise UserError(f"{rig}: not valid TOML: {error}; correct the syntax") from None
    if not isinstance(data.get("nameplate"), Mapping):
        raise UserError(f"{rig}: [nameplate]: section is missing; give what the plate says")
    return plate_from(data["nameplate"], str(rig))


def plate_from(content: Mapping[str, Any], file: str) -> Plate:
    known = {field.name for field in fields(Plate)}
    for key in content:
        if key not in known:
            raise UserError(f"{file}: nameplate.{key}: unknown key; known are {sorted(known)}")
    for key in sorted(known - {"connection", "J_kg_m2"} | set(content) - {"connection"}):
        if not _is_positive(content.get(key)):
            raise UserError(
                f"{file}: nameplate.{key}: is {content.get(key)!r}; a positive number is needed"
            )
    if content.get("connection") not in CONNECTIONS:
        raise UserError(f"{file}: nameplate.connection: give one of {', '.join(CONNECTIONS)}")
    plate = Plate(**content)
    _require_possible(plate, file)
    return plate


def _is_positive(value: object) -> bool:
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    return is_number and 0 < value < 1e6


def _require_possible(plate: Plate, file: str) -> None:
    """No motor has a power factor of one, or a rated speed far from a synchronous one."""
    if plate.cos_phi >= 1.0:
        raise UserError(f"{file}: nameplate.cos_phi: is {plate.cos_phi}; give a value below 1")
    if plate.speed_rpm >= 60.0 * plate.frequency_Hz or plate.slip > 0.2 or plate.slip <= 0.0:
        raise UserError(
            f"{file}: nameplate.speed_rpm: {plate.speed_rpm:g} is not a rated speed at "
            f"{plate.frequency_Hz:g} Hz; it lies up to 20 % below a synchronous speed"
        )


def warnings(plate: Plate) -> list[str]:
    """What does not fit together, and which slip of the pen that usually is."""
    found = []
    if plate.efficiency > 0.985:
        found.append(
            f"efficiency {plate.efficiency:.0%} from power, voltage, current and cos phi is "
            "impossible: is current_A that of the other connection (star and delta differ by 1.73)?"
        )
    elif plate.efficiency < 0.4:
        found.append(
            f"efficiency {plate.efficiency:.0%} is too low for a motor: is the power in kW, and "
            f"are voltage and current those of the {plate.connection} connection?"
        )
    if not 0.4 <= plate.cos_phi <= 0.95:
        found.append(f"cos phi {plate.cos_phi:g} is unusual: .5 to .92 is what motors have")
    expected = 0.05 * plate.power_kW**-0.35
    if not 0.2 * expected < plate.slip < 4.0 * expected:
        found.append(
            f"slip {plate.slip:.1%} is unusual for {plate.power_kW:g} kW (about {expected:.1%}): "
            "is speed_rpm the rated speed under load?"
        )
    return found


SAME = 0.05  # of a value that two plates of one motor have
_TOLD = ("power_kW", "voltage_V", "current_A", "frequency_Hz", "speed_rpm")


def require_same(rig: str, its: Plate, told: Plate) -> None:
    """UserError with both values when a simulated motor is another one than the plate's."""
    for name in _TOLD:
        one, other = getattr(its, name), getattr(told, name)
        if abs(one / other - 1.0) > SAME:
            raise UserError(
                f"--rig {rig}: is another motor: its {name} is {one:g}, the nameplate's {other:g}; "
                "a motor that no rig is like is found with --port, or its circuit written by hand"
            )


def guess(plate: Plate) -> Circuit:
    """A circuit to begin with: good enough for slow current control, and for nothing else."""
    z, omega = plate.impedance_ohm, plate.omega_rad_s
    reactive = math.sqrt(1.0 - plate.cos_phi**2)
    M_H = 1.1 * z / (reactive * omega)
    leak_H = 0.08 * z / omega
    return Circuit(
        Rs_ohm=0.06 * z * plate.power_kW**-0.3,
        Rr_ohm=plate.slip * z * plate.cos_phi,
        Ls_H=M_H + leak_H,
        Lr_H=M_H + leak_H,
        M_H=M_H,
    )


def magnetising_A(plate: Plate) -> float:
    """Of that guess, at rated voltage and frequency."""
    return plate.voltage_V / (plate.omega_rad_s * guess(plate).Ls_H)


def level_s(plate: Plate) -> float:
    """Eight rotor time constants: load angle of the rotor at rated slip, and saturation's share."""
    load_over_magnetising = plate.cos_phi / math.sqrt(1.0 - plate.cos_phi**2)
    tau_s = 1.6 * load_over_magnetising / (2.0 * math.pi * plate.slip_Hz)
    return min(max(8.0 * tau_s, 0.4), 30.0)


def threshold_A(plate: Plate) -> float:
    """Leg current beyond which the inverter's error is taken as constant."""
    return 0.02 * math.sqrt(2.0) * plate.current_A
