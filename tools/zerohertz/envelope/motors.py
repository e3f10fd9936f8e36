"""The motors of the envelope, each with the drive that belongs to it, at each control period.

Table 1's has the configuration as it ships; rewound with other pole pairs all its electrical
quantities stay. The others have what commissioning derives from plate and circuit. A gain table is
designed for the period.
"""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import math
import os
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path

from zerohertz.atlas.simulate import RATED_TORQUE_NM, make_bench
from zerohertz.campaign.rig import FIRMWARE, LINK, U_DC_V
from zerohertz.commission.board import Board
from zerohertz.commission.campaign import true_circuit
from zerohertz.commission.folder import BOARD, MOTOR, rig_file, store, stored_parameters
from zerohertz.commission.plate import read_plate
from zerohertz.commission.solve import Identified, rated_main_flux_Wb
from zerohertz.envelope.axes import OWN_MOTORS
from zerohertz.envelope.case import Case
from zerohertz.gain_design.command import JSON_NAME
from zerohertz.gain_design.table import design_table, table_json
from zerohertz.motor import Circuit, Motor, load_motor, motor_toml
from zerohertz.param_list import Value, defaults
from zerohertz.paths import BUILD, ROOT
from zerohertz.scenario.setup import load_setup

CONFIG = "recommended"
TOOLS = ROOT / "tools" / "zerohertz"
TABLE1_PAIRS = 2
TABLE1_POWER_KW = 1.5
TABLE1_J_KG_M2 = 0.015
# Brake chopper and limits of the dc link, over its nominal voltage: those of Table 1's bench.
CHOPPER, REGEN_START = FIRMWARE["chopper_on_V"] / U_DC_V, 365.0 / U_DC_V


@dataclasses.dataclass(frozen=True)
class Drive:
    """A motor by its nameplate, and the drive as it is delivered with it."""

    motor_dir: Path
    board: Path
    params: Mapping[str, Value]
    circuit: Circuit
    pole_pairs: int
    rated_rpm: float
    rated_Nm: float
    rated_A: float  # power invariant
    J_kg_m2: float  # the motor's own
    u_dc_V: float
    rig: Mapping[str, float]  # its dc link
    current_A: float  # full scales of the sensors
    line_V: float
    dc_V: float
    period_s: float

    @property
    def known(self) -> dict[str, Value]:
        """Every parameter of the firmware."""
        return defaults() | dict(self.params)

    @property
    def speed_unit(self) -> float:
        """Of limits in min^-1, which were chosen for two pole pairs."""
        return TABLE1_PAIRS / self.pole_pairs

    @property
    def flux_Wb(self) -> float:
        return self.circuit.M_H * float(self.known["i_d_A"])

    @property
    def power_W(self) -> float:
        return self.rated_Nm * self.rated_rpm * math.pi / 30.0


def drive_for(case: Case) -> Drive:
    """The drive of a run."""
    return drive_of(case.word("motor"), case.word("period_us"))


@functools.cache
def drive_of(name: str, period_us: str = "200") -> Drive:
    """By its names on the axes `motor` and `period_us`."""
    period_s = float(f"{period_us}e-6")
    if name in OWN_MOTORS:
        return _derived(name, period_s)
    return _table1(int(name.rpartition("_p")[2]) if "_p" in name else TABLE1_PAIRS, period_s)


def _table1(pairs: int, period_s: float) -> Drive:
    setup = load_setup(CONFIG)
    bench, motor = make_bench(setup), load_motor(setup.motor_dir)
    motor_dir, board, params = setup.motor_dir, setup.board, dict(bench.params)
    shipped_s = motor.design.period_s
    if period_s != shipped_s:
        motor_dir = _retimed(motor, setup.board, period_s)
        board = motor_dir / BOARD
        # The inverter's volt-seconds come more often.
        params["voltage_check_V"] = float(params["voltage_check_V"]) * shipped_s / period_s
    ratio = pairs / TABLE1_PAIRS
    return Drive(
        motor_dir=motor_dir,
        board=board,
        params=params | FIRMWARE | {"pole_pairs": pairs},
        circuit=motor.circuit,
        pole_pairs=pairs,
        rated_rpm=motor.nameplate.speed_rpm / ratio,
        rated_Nm=RATED_TORQUE_NM * ratio,
        rated_A=math.sqrt(3.0) * motor.nameplate.current_A,
        J_kg_m2=TABLE1_J_KG_M2 * ratio**2,
        u_dc_V=U_DC_V,
        rig=LINK,
        **_scales(board),
    )


def _derived(name: str, period_s: float) -> Drive:
    """As `zh commission` leaves it, had it found the circuit without an error."""
    rig = rig_file(name)
    plate = read_plate(rig)
    folder = rig_folder(rig, period_s)
    motor = load_motor(folder)
    u_dc_V = round(math.sqrt(2.0) * plate.voltage_V)
    # Capacitor, source and chopper as large for this power and voltage as Table 1's are for its.
    ohm = (u_dc_V / U_DC_V) ** 2 * TABLE1_POWER_KW / plate.power_kW
    params = stored_parameters(folder) | {
        "chopper_on_V": CHOPPER * u_dc_V,
        "regen_start_V": REGEN_START * u_dc_V,
    }
    circuit = {key: getattr(motor.circuit, key) for key in ("Rs_ohm", "Rr_ohm", "Ls_H", "Lr_H")}
    return Drive(
        motor_dir=folder,
        board=folder / BOARD,
        params=params | circuit | {"M_H": motor.circuit.M_H, "pole_pairs": plate.pole_pairs},
        circuit=motor.circuit,
        pole_pairs=plate.pole_pairs,
        rated_rpm=plate.speed_rpm,
        rated_Nm=plate.torque_Nm,
        rated_A=plate.current_vector_A,
        J_kg_m2=motor.mechanics.J_kg_m2,
        u_dc_V=u_dc_V,
        rig={key: x / ohm if key.endswith("_F") else x * ohm for key, x in LINK.items()},
        **_scales(folder / BOARD),
    )


def _scales(board: Path) -> dict[str, float]:
    """What the firmware's words mean, and how often they come."""
    content = tomllib.loads(board.read_text(encoding="utf-8"))
    scale = content["full_scale"]
    return {
        "current_A": scale["current_A"],
        "line_V": scale["line_voltage_V"],
        "dc_V": scale["dc_link_V"],
        "period_s": content["control"]["period_s"],
    }


def rig_folder(rig: Path, period_s: float) -> Path:
    """motor.toml, board.toml, firmware.toml and table, made once per set of inputs."""
    folder = _place(rig.stem, [rig, *sorted((TOOLS / "commission").glob("*.py"))], period_s)
    if not (folder / JSON_NAME).is_file():
        plate = read_plate(rig)
        at_plate = true_circuit(rig, 0.0)
        leak_H = at_plate.Ls_H - at_plate.M_H
        main_Wb = rated_main_flux_Wb(plate, at_plate.Rs_ohm, leak_H)
        circuit = true_circuit(rig, main_Wb)
        # The rotor's flux when the main flux is rated and no torque is asked for.
        i_d_A = main_Wb / circuit.M_H
        found = Identified(circuit, main_Wb, main_Wb, i_d_A, 0.0, ())
        store(folder, rig.stem, found, plate, Board.of_plate(plate, period_s))
        _design(folder)
    return folder


def _retimed(motor: Motor, board: Path, period_s: float) -> Path:
    """motor.toml, board.toml and table of a motor of gain_tables at another control period."""
    folder = _place(motor.name, [Path(motor.file), board], period_s)
    if not (folder / JSON_NAME).is_file():
        folder.mkdir(parents=True, exist_ok=True)
        timed = dataclasses.replace(
            motor, design=dataclasses.replace(motor.design, period_s=period_s)
        )
        text = board.read_text(encoding="utf-8")
        text = re.sub(r"(?m)^period_s = .*$", f"period_s = {period_s!r}", text)
        (folder / BOARD).write_text(text, encoding="utf-8")
        (folder / MOTOR).write_text(motor_toml(timed), encoding="utf-8")
        _design(folder)
    return folder


def _place(name: str, inputs: list[Path], period_s: float) -> Path:
    """The folder of what is made of these files, named by their content."""
    inputs = inputs + sorted((TOOLS / "gain_design").glob("*.py"))
    content = b"".join(path.read_bytes() for path in inputs) + repr(period_s).encode()
    mark = hashlib.sha256(content).hexdigest()[:16]
    return BUILD / "envelope" / "motors" / f"{name}-{1e6 * period_s:g}us-{mark}"


def _design(folder: Path) -> None:
    table = table_json(design_table(load_motor(folder), certificate=False))
    scratch = folder / f"{JSON_NAME}.{os.getpid()}"
    scratch.write_text(table, encoding="utf-8")
    scratch.replace(folder / JSON_NAME)  # workers make it side by side
