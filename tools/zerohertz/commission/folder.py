"""What commissioning leaves: a folder with motor.toml, board.toml and firmware.toml.

motor.toml is what `zh design` makes the gain table of; board.toml says at which scaling the motor
was found; firmware.toml holds every parameter of the firmware that follows from both.
"""

from __future__ import annotations

import tomllib
from dataclasses import asdict
from pathlib import Path

from zerohertz.commission.board import Board
from zerohertz.commission.plate import Plate, read_plate
from zerohertz.commission.run import inertia_kg_m2, motor_of
from zerohertz.commission.solve import Identified
from zerohertz.commission.tuning import DUTY, design_of, firmware_parameters
from zerohertz.errors import UserError
from zerohertz.motor import Circuit, motor_toml
from zerohertz.paths import ROOT

RIGS = ROOT / "host_sim" / "rigs" / "motors"
LOW_VOLTAGE = "im_bench"  # too small a voltage for the campaigns over RIGS
MOTOR, BOARD, FIRMWARE = "motor.toml", "board.toml", "firmware.toml"


def rig_named(name: str) -> Path:
    """Of host_sim/rigs/motors, or the low-voltage machine beside it."""
    path = RIGS / f"{name}.toml"
    return path if name != LOW_VOLTAGE else RIGS.parent / path.name


def rig_file(name: str) -> Path:
    """A rig by its name in host_sim/rigs/motors, or by its path."""
    path = Path(name) if name.endswith(".toml") else rig_named(name)
    if not path.is_file():
        known = ", ".join([*sorted(p.stem for p in RIGS.glob("*.toml")), LOW_VOLTAGE])
        raise UserError(f"there is no {path}; known are {known}, or give a file")
    return path


def all_rigs() -> list[Path]:
    """Every motor, the smallest first."""
    return sorted(RIGS.glob("*.toml"), key=lambda path: read_plate(path).power_kW)


def store(
    folder: Path, name: str, found: Identified, plate: Plate, board: Board | None = None
) -> None:
    """The three files; without a board, for one of the motor's size."""
    board = board or Board.of_plate(plate)
    folder.mkdir(parents=True, exist_ok=True)
    circuit = Circuit(**{key: float(f"{x:.6g}") for key, x in asdict(found.circuit).items()})
    source = "zh commission: circuit as identified at standstill, leakage shared equally"
    motor = motor_of(name, source, plate, circuit, design_of(circuit, plate, board.period_s))
    parameters = parameters_of(found, plate, board)
    lines = ["# Parameters of the firmware that follow from the motor (zh commission).", "[params]"]
    lines += [f"{key} = {value:.7g}" for key, value in parameters.items()]
    (folder / MOTOR).write_text(motor_toml(motor), encoding="utf-8")
    (folder / BOARD).write_text(board.toml, encoding="utf-8")
    (folder / FIRMWARE).write_text("\n".join(lines) + "\n", encoding="utf-8")


def parameters_of(found: Identified, plate: Plate, board: Board) -> dict[str, float]:
    """Of the firmware."""
    J_kg_m2 = inertia_kg_m2(plate)
    values = firmware_parameters(found, plate, J_kg_m2, board.period_s, board.i_trip_max_A)
    values |= board.current_sum(values["i_trip_A"])
    return values if board.senses_voltage else values | {"voltage_source": DUTY}


def stored_parameters(folder: Path) -> dict[str, float]:
    """[params] of firmware.toml."""
    path = folder / FIRMWARE
    try:
        return dict(tomllib.loads(path.read_text(encoding="utf-8"))["params"])
    except (OSError, tomllib.TOMLDecodeError, KeyError):
        raise UserError(f"{path}: cannot be used; write it anew with zh commission") from None
