"""What `zh commission` says and writes, whoever found the motor: the simulated rig or a drive."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable
from pathlib import Path

from zerohertz.commission import board_run
from zerohertz.commission import run as firmware
from zerohertz.commission.board import Board
from zerohertz.commission.folder import store
from zerohertz.commission.plate import Plate, warnings
from zerohertz.commission.rotate import Mechanics, turn, turn_rig
from zerohertz.commission.solve import Identified, solve
from zerohertz.link.client import Client
from zerohertz.sim import Commissioned


@dataclasses.dataclass(frozen=True)
class Finding:
    """refusal: why there is no motor."""

    name: str
    plate: Plate  # with the inertia that was found, if it was looked for
    board: Board
    firmware: Commissioned
    seconds: float
    motor: Identified | None
    mechanics: Mechanics | None = None
    rig: Path | None = None  # simulated motor; None: a drive's

    @property
    def refusal(self) -> str | None:
        return firmware.refused(self.firmware)

    def write(self, folder: Path) -> None:
        if self.motor is not None:
            store(folder, self.name, self.motor, self.plate, self.board)

    def as_dict(self) -> dict[str, object]:
        answer: dict[str, object] = {"rig": self.name, "seconds": self.seconds}
        answer |= {"warnings": warnings(self.plate), "refusal": self.refusal}
        answer["firmware"] = dataclasses.asdict(self.firmware)
        if self.motor is not None:
            answer["motor"] = dataclasses.asdict(self.motor)
        if self.mechanics is not None:
            answer["mechanics"] = dataclasses.asdict(self.mechanics)
        return answer

    def text(self) -> str:
        if self.motor is None:
            return f"{self.name}: refused: {self.refusal}"
        motor, c = self.motor, self.motor.circuit
        points = ", ".join(f"{psi:.3f} Wb at {i:.3g} A" for psi, i in motor.curve[1:])
        lines = [
            f"{self.name}: found in {self.seconds:.0f} s at standstill",
            f"  Rs {c.Rs_ohm:.5g} ohm, Rr {c.Rr_ohm:.5g} ohm, sigma Ls {1e3 * c.sigma_Ls_H:.5g} mH",
            f"  Ls = Lr {1e3 * c.Ls_H:.5g} mH, M {1e3 * c.M_H:.5g} mH "
            f"at {motor.main_flux_Wb:.4g} Wb",
            f"  rated flux takes i_d {motor.i_d_A:.4g} A, a leg loses {motor.lost_V:.3g} V",
            f"  magnetising curve (power invariant): {points}",
        ]
        if self.mechanics is not None:
            m = self.mechanics
            lines.append(f"  J {m.J_kg_m2:.4g} kg m2, friction {m.coulomb_Nm:.3g} Nm")
            lines[-1] += f" and {m.viscous_Nms:.3g} Nm per rad/s; M of the turning motor"
        return "\n".join(lines)


def of_rig(path: Path, plate: Plate, board: Board | None, rotate: bool, seed: int) -> Finding:
    """By the firmware in the simulated rig; without a board, on one of the motor's size."""
    board = board or Board.of_plate(plate)
    seen, seconds = firmware.commission(path, plate, board, seed)
    motor = solve(seen, plate) if seen.done else None
    mechanics = None
    if motor is not None and rotate:
        mechanics, seen = turn_rig(path, seen, plate, board, seed)
        motor = solve(seen, plate)
        plate = dataclasses.replace(plate, J_kg_m2=mechanics.J_kg_m2)
    return Finding(path.stem, plate, board, seen, seconds, motor, mechanics, path.absolute())


def of_drive(
    drive: Client,
    name: str,
    plate: Plate,
    say: Callable[[str], None],
    rotate: bool = False,
    pause: board_run.Pause = time.sleep,
    board: Board | None = None,
) -> Finding:
    """By a drive on its line; rotate: then turned, without a gain table, which it has none of.
    board: what is known of it, or else as the drive says."""
    board = board or Board.of_drive(drive)
    seen, seconds = board_run.commission(drive, plate, say, pause)
    motor = solve(seen, plate) if seen.done else None
    mechanics = None
    if motor is not None and rotate:
        say("turning")
        _ = drive.signals  # a table; read while the shaft turns, it lets a command run out
        with board_run.borrowed(drive, board_run.values_of(motor, plate, board)):
            mechanics, seen = turn(drive, seen, plate, pause)
        motor = solve(seen, plate)
        plate = dataclasses.replace(plate, J_kg_m2=mechanics.J_kg_m2)
    return Finding(name, plate, board, seen, seconds, motor, mechanics)
