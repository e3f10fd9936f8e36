"""What commissioning leaves: a folder with motor.toml, board.toml and firmware.toml.

motor.toml is what `zh design` makes the gain table of; board.toml says at which scaling the motor
was found; firmware.toml holds every parameter of the firmware that follows from both.
"""

from __future__ import annotations

import tomllib
from dataclasses import asdict
from pathlib import Path

from zerohertz.commission.plate import Plate, read_plate
from zerohertz.commission.run import PERIOD_S, board_text, inertia_kg_m2, motor_of
from zerohertz.commission.solve import Identified
from zerohertz.commission.tuning import design_of, firmware_parameters
from zerohertz.errors import UserError
from zerohertz.motor import Circuit, motor_toml
from zerohertz.paths import ROOT

RIGS = ROOT / "host_sim" / "rigs" / "motors"
MOTOR, BOARD, FIRMWARE = "motor.toml", "board.toml", "firmware.toml"


def rig_file(name: str) -> Path:
    """A rig by its name in host_sim/rigs/motors, or by its path."""
    path = Path(name) if name.endswith(".toml") else RIGS / f"{name}.toml"
    if not path.is_file():
        known = ", ".join(sorted(p.stem for p in RIGS.glob("*.toml")))
        raise UserError(f"--rig: there is no {path}; known are {known}, or give a file")
    return path


def all_rigs() -> list[Path]:
    """Every motor, the smallest first."""
    return sorted(RIGS.glob("*.toml"), key=lambda path: read_plate(path).power_kW)


def store(folder: Path, name: str, found: Identified, plate: Plate, board: Path | None) -> None:
    """The three files."""
    folder.mkdir(parents=True, exist_ok=True)
    circuit = Circuit(**{key: float(f"{x:.6g}") for key, x in asdict(found.circuit).items()})
    source = "zh commission: circuit as identified at standstill, leakage shared equally"
    motor = motor_of(name, source, plate, circuit, design_of(circuit, plate, PERIOD_S))
    parameters = firmware_parameters(found, plate, inertia_kg_m2(plate), PERIOD_S)
    lines = ["# Parameters of the firmware that follow from the motor (zh commission).", "[params]"]
    lines += [f"{key} = {value:.7g}" for key, value in parameters.items()]
    (folder / MOTOR).write_text(motor_toml(motor), encoding="utf-8")
    (folder / BOARD).write_text(
        board.read_text(encoding="utf-8") if board else board_text(plate), encoding="utf-8"
    )
    (folder / FIRMWARE).write_text("\n".join(lines) + "\n", encoding="utf-8")


def stored_parameters(folder: Path) -> dict[str, float]:
    """[params] of firmware.toml."""
    path = folder / FIRMWARE
    try:
        return dict(tomllib.loads(path.read_text(encoding="utf-8"))["params"])
    except (OSError, tomllib.TOMLDecodeError, KeyError):
        raise UserError(f"{path}: cannot be used; write it anew with zh commission") from None
