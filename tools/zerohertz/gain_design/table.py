"""The gain table of one motor: L over speed in float32, its certificate, and l_gain.json.

Entry k holds L at w = k times the step, and the step is the float32 next to 2 elec. min^-1
(pi/15 rad/s): the very number by which the firmware finds its entry, so that the speed of an entry
is an exact rational. L(-w) = conj L(w) is the firmware's part.
"""

from __future__ import annotations

import contextlib
import dataclasses
import json
import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from zerohertz.gain_design.closed_form import closed_form_gain
from zerohertz.gain_design.cones import InfeasibleError
from zerohertz.gain_design.crc32c import crc32c
from zerohertz.gain_design.gamma_positive_real import GammaPositiveReal, Multiplier
from zerohertz.gain_design.machine import COORDINATES, ComplexArray, as_stored, observer_poles
from zerohertz.gain_design.pole_shift import pole_shift_gain
from zerohertz.gain_design.stored import SCHEMA, float32_text
from zerohertz.gain_design.zero import zero_gain
from zerohertz.motor import STEP_ELEC_PER_MIN, Design, Motor, MotorError

STEP_RAD_S = np.float32(STEP_ELEC_PER_MIN * 2.0 * math.pi / 60.0)
# The certificate stores a gamma this much above the least one: room for rounding X.
GAMMA_MARGIN = 1.01

Progress = Callable[[int], None]
Four = tuple[float, float, float, float]


@dataclasses.dataclass(frozen=True)
class Table:
    """L as float32 (N rows l1_re l1_im in 1/s, l2_re l2_im in ohm) and what is known about it."""

    motor: Motor
    gain: npt.NDArray[np.float32]
    gamma: tuple[float | None, ...]  # None: the LMIs do not all hold, or nobody asked
    X: tuple[Four | None, ...]  # x11, Re x12, Im x12, x22
    poles: tuple[Four, ...]  # Re, Im of the fast one, then of the other, 1/s

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
    lmi = GammaPositiveReal(motor)
    entries = []
    for entry in range(motor.design.entries):
        entries.append(_entry(motor, lmi, speed_of_entry_rad_s(entry), certificate))
        if progress:
            progress(entry + 1)
    gains, gammas, multipliers, poles = zip(*entries, strict=True)
    return Table(motor, np.array(gains, dtype=np.float32), gammas, multipliers, poles)


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


def _entry(
    motor: Motor, lmi: GammaPositiveReal, omega_rad_s: float, certificate: bool
) -> tuple[Four, float | None, Four | None, Four]:
    """L, gamma, X and poles at one speed."""
    multiplier: Multiplier | None = None
    if motor.design.method == "gamma_pr":
        try:
            gain, multiplier = lmi.gain(omega_rad_s)
        except InfeasibleError:
            raise _infeasible(motor, omega_rad_s) from None
    else:
        gain = as_stored(_explicit_gain(motor, omega_rad_s), omega_rad_s)
        if not np.all(np.isfinite(gain)):
            raise MotorError(
                f"{motor.file}: circuit: L is beyond float32; correct the five numbers"
            )
        if certificate:
            with contextlib.suppress(InfeasibleError):
                multiplier = lmi.multiplier(omega_rad_s, gain)
    poles = observer_poles(motor.circuit, omega_rad_s, gain)
    p1, p2 = np.round(poles, 4) + 0.0
    return (
        _four(*gain),
        _digits(GAMMA_MARGIN * multiplier.gamma, 7) if multiplier else None,
        _X_digits(multiplier) if multiplier else None,
        _four(p1, p2),
    )


def _explicit_gain(motor: Motor, omega_rad_s: float) -> ComplexArray:
    design, circuit = motor.design, motor.circuit
    if design.method == "closed_form":
        return closed_form_gain(
            circuit, omega_rad_s, p1_per_s=design.p1_at(omega_rad_s), a=design.a, b=design.b
        )
    if design.method == "pole_shift":
        return pole_shift_gain(
            circuit,
            omega_rad_s,
            real_factor=design.real_factor,
            imag_factor=design.imag_factor,
        )
    return zero_gain()


def _infeasible(motor: Motor, omega_rad_s: float) -> MotorError:
    elec_per_min = omega_rad_s * 60.0 / (2.0 * math.pi)
    return MotorError(
        f"{motor.file}: design.radius_per_s, design.decay_per_s: no gain meets the LMIs at "
        f"{elec_per_min:.0f} elec. min^-1; enlarge radius_per_s, or lower decay_per_s or dw0_rad_s"
    )


def _four(first: complex, second: complex) -> Four:
    return (float(first.real), float(first.imag), float(second.real), float(second.imag))


def _X_digits(multiplier: Multiplier) -> Four:
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
