"""The gain table of one motor: L over speed in float32, its certificate, and l_gain.json.

Entry k holds L at w = k times the step, and the step is the float32 next to 2 elec. min^-1
(pi/15 rad/s): the very number by which the firmware finds its entry, so that the speed of an entry
is an exact rational. L(-w) = conj L(w) is the firmware's part.
"""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from zerohertz.gain_design.crc32c import crc32c
from zerohertz.gain_design.entries import Progress, design_entries
from zerohertz.gain_design.gamma_positive_real import Multiplier
from zerohertz.gain_design.machine import COORDINATES, ComplexArray, observer_poles
from zerohertz.gain_design.stored import SCHEMA, float32_text
from zerohertz.motor import STEP_ELEC_PER_MIN, Design, Motor

STEP_RAD_S = np.float32(STEP_ELEC_PER_MIN * 2.0 * math.pi / 60.0)
# The certificate stores a gamma this much above the least one: room for rounding X.
GAMMA_MARGIN = 1.01

Four = tuple[float, float, float, float]


@dataclasses.dataclass(frozen=True)
class Table:
    """L as float32 (N rows l1_re l1_im in 1/s, l2_re l2_im in ohm) and what is known about it."""

    motor: Motor
    gain: npt.NDArray[np.float32]
    gamma: tuple[float | None, ...]  # None: the LMIs do not all hold, or nobody asked
    X: tuple[Four | None, ...]  # x11, Re x12, Im x12, x22
    poles: tuple[Four, ...]  # Re, Im of the fast one, then of the other, 1/s
    solves: int  # how often the solver was run

    def words(self) -> bytes:
        """The gains as they lie in flash: little-endian float32, entry after entry."""
        return self.gain.astype("<f4").tobytes()


def speed_of_entry_rad_s(entry: int) -> float:
    return entry * float(STEP_RAD_S)


def design_table(
    motor: Motor,
    design: Design | None = None,
    *,
    certificate: bool = True,
    progress: Progress | None = None,
) -> Table:
    """The gain table of the motor, designed anew; writes nothing.

    `certificate=False` leaves out gamma and X: enough for a simulation, ten times faster where L
    has a closed form. MotorError when no gain meets the LMIs of method gamma_pr.
    """
    if design is not None:
        motor = dataclasses.replace(motor, design=design)
    speeds_rad_s = [speed_of_entry_rad_s(k) for k in range(motor.design.entries)]
    entries, solves = design_entries(motor, speeds_rad_s, certificate, progress or (lambda _: None))
    return Table(
        motor,
        np.array([_four(*entry.gain) for entry in entries], dtype=np.float32),
        tuple(_gamma_digits(entry.multiplier) for entry in entries),
        tuple(_X_digits(entry.multiplier) for entry in entries),
        tuple(
            _pole_digits(motor, omega_rad_s, entry.gain)
            for omega_rad_s, entry in zip(speeds_rad_s, entries, strict=True)
        ),
        solves,
    )


def table_json(table: Table) -> str:
    """Text of l_gain.json: one line per entry, so that a change shows in a diff."""
    motor = table.motor
    head: dict[str, Any] = {
        "schema": SCHEMA,
        "motor": motor.name,
        "inputs": motor.inputs(),
        "inputs_sha256": motor.inputs_sha256(),
        "motor_id": f"{crc32c(motor.machine_bytes()):08x}",
        "method": motor.design.method,
        "step_elec_per_min": STEP_ELEC_PER_MIN,
        "step_rad_s": float(float32_text(STEP_RAD_S)),
        "X_coordinates": COORDINATES,
        "crc32c": f"{crc32c(table.words()):08x}",
    }
    entries = zip(table.gain, table.gamma, table.X, table.poles, strict=True)
    inputs = [f"{json.dumps(k)}: {_text(v)}" for k, v in head["inputs"].items()]
    parts = [f"{json.dumps(k)}: {_text(v)}" for k, v in head.items() if k != "inputs"]
    parts.insert(2, '"inputs": {\n' + ",\n".join(inputs) + "\n}")
    parts.append('"entries": [\n' + ",\n".join(_line(*entry) for entry in entries) + "\n]")
    return "{\n" + ",\n".join(parts) + "\n}\n"


def gains_of(content: Mapping[str, Any]) -> npt.NDArray[np.float32]:
    """Table.gain of the content of a l_gain.json."""
    return np.array([entry["L"] for entry in content["entries"]], dtype=np.float32)


def _four(first: complex, second: complex) -> Four:
    return (float(first.real), float(first.imag), float(second.real), float(second.imag))


def _pole_digits(motor: Motor, omega_rad_s: float, gain: ComplexArray) -> Four:
    p1, p2 = np.round(observer_poles(motor.circuit, omega_rad_s, gain), 4) + 0.0
    return _four(p1, p2)


def _gamma_digits(multiplier: Multiplier | None) -> float | None:
    return _digits(GAMMA_MARGIN * multiplier.gamma, 7) if multiplier else None


def _X_digits(multiplier: Multiplier | None) -> Four | None:
    if multiplier is None:
        return None
    X = multiplier.X
    values = (X[0, 0].real, X[0, 1].real, X[0, 1].imag, X[1, 1].real)
    return tuple(_digits(float(x), 9) for x in values)


def _digits(value: float, digits: int) -> float:
    return float(f"{value:.{digits}g}")


def _text(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False)


def _line(gain: npt.NDArray[np.float32], gamma: float | None, X: Four | None, poles: Four) -> str:
    rest = json.dumps({"gamma": gamma, "X": X, "poles": poles}, separators=(",", ":"))
    return f'{{"L":[{",".join(map(float32_text, gain))}],{rest[1:]}'
