"""The numbers behind the pictures of a gain table: poles over speed, gamma and its floor."""

from __future__ import annotations

import dataclasses
import json
import math
from pathlib import Path
from typing import Any

import numpy as np

MARKED_ELEC_PER_MIN = 600  # one marker per so much speed


@dataclasses.dataclass(frozen=True)
class Loci:
    """A table over speed, from standstill to its end."""

    motor: str
    method: str
    dw0_rad_s: float
    speeds_elec_per_min: np.ndarray
    motor_poles: np.ndarray  # two columns, complex
    observer_poles: np.ndarray
    gamma: np.ndarray
    floor: np.ndarray  # below which no gain can bring gamma


def read(motor_json: Path | str) -> Loci:
    """Of an l_gain.json."""
    content = json.loads(Path(motor_json).read_text(encoding="utf-8"))
    entries = content["entries"]
    speeds = np.arange(len(entries)) * float(content["step_elec_per_min"])
    poles = np.array([entry["poles"] for entry in entries])
    return Loci(
        motor=content["motor"],
        method=content["method"],
        dw0_rad_s=content["inputs"]["design"]["dw0_rad_s"],
        speeds_elec_per_min=speeds,
        motor_poles=_motor_poles(content, speeds),
        observer_poles=poles.reshape(-1, 2, 2) @ np.array([1.0, 1.0j]),
        gamma=np.array([entry["gamma"] for entry in entries], dtype=float),
        floor=_floor(content, speeds),
    )


def degrees(gamma: np.ndarray) -> np.ndarray:
    """Bound of the field orientation's error."""
    return np.degrees(2.0 * np.arctan(gamma))


def _motor_poles(content: dict[str, Any], speeds: np.ndarray) -> np.ndarray:
    """Eigenvalues of A(w), eq. (1), sorted into two continuous branches."""
    c = content["inputs"]["circuit"]
    leak = c["Ls_H"] * c["Lr_H"] - c["M_H"] ** 2
    q = c["Rr_ohm"] / c["Lr_H"] - 1j * speeds * 2.0 * math.pi / 60.0
    A = np.empty((len(speeds), 2, 2), dtype=complex)
    A[:, 0, 0] = -(c["Rs_ohm"] + c["M_H"] ** 2 * c["Rr_ohm"] / c["Lr_H"] ** 2) * c["Lr_H"] / leak
    A[:, 0, 1] = q * c["M_H"] / leak
    A[:, 1, 0] = c["M_H"] * c["Rr_ohm"] / c["Lr_H"]
    A[:, 1, 1] = -q
    poles = np.linalg.eigvals(A)
    return np.take_along_axis(poles, np.argsort(poles.imag, axis=1), axis=1)


def _floor(content: dict[str, Any], speeds: np.ndarray) -> np.ndarray:
    c, dw0 = content["inputs"]["circuit"], content["inputs"]["design"]["dw0_rad_s"]
    nearest = np.abs(speeds * 2.0 * math.pi / 60.0 - dw0 / 2.0)
    return dw0 / (2.0 * np.hypot(c["Rr_ohm"] / c["Lr_H"], nearest))
