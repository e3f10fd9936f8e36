"""The motors of the envelope, each with the drive that belongs to it.

Table 1's has the configuration as it ships; rewound with other pole pairs all its electrical
quantities stay. The others have what commissioning derives from plate and circuit.
"""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import math
import tomllib
from collections.abc import Mapping
from pathlib import Path

from zerohertz.atlas.simulate import RATED_TORQUE_NM, make_bench
from zerohertz.campaign.rig import FIRMWARE, LINK, U_DC_V
from zerohertz.commission.campaign import true_circuit
from zerohertz.commission.folder import BOARD, rig_file, store, stored_parameters
from zerohertz.commission.plate import read_plate
from zerohertz.commission.solve import Identified, rated_main_flux_Wb
from zerohertz.envelope.axes import OWN_MOTORS
from zerohertz.gain_design.command import JSON_NAME
from zerohertz.gain_design.table import design_table, table_json
from zerohertz.motor import Circuit, load_motor
from zerohertz.param_list import Value, defaults
from zerohertz.paths import BUILD, ROOT
from zerohertz.scenario.setup import load_setup

CONFIG = "recommended"
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


@functools.cache
def drive_of(name: str) -> Drive:
    """By its name on the axis `motor`."""
    if name in OWN_MOTORS:
        return _derived(name)
    return _table1(int(name.rpartition("_p")[2]) if "_p" in name else TABLE1_PAIRS)


def _table1(pairs: int) -> Drive:
    setup = load_setup(CONFIG)
    bench, motor = make_bench(setup), load_motor(setup.motor_dir)
    ratio = pairs / TABLE1_PAIRS
    return Drive(
        motor_dir=setup.motor_dir,
        board=setup.board,
        params=dict(bench.params) | FIRMWARE | {"pole_pairs": pairs},
        circuit=motor.circuit,
        pole_pairs=pairs,
        rated_rpm=motor.nameplate.speed_rpm / ratio,
        rated_Nm=RATED_TORQUE_NM * ratio,
        rated_A=math.sqrt(3.0) * motor.nameplate.current_A,
        J_kg_m2=TABLE1_J_KG_M2 * ratio**2,
        u_dc_V=U_DC_V,
        rig=LINK,
        **_scales(setup.board),
    )


def _derived(name: str) -> Drive:
    """As `zh commission` leaves it, had it found the circuit without an error."""
    rig = rig_file(name)
    plate = read_plate(rig)
    folder = _folder(rig)
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


def _folder(rig: Path) -> Path:
    """motor.toml, board.toml, firmware.toml and table, made once per set of inputs."""
    tools = ROOT / "tools" / "zerohertz"
    inputs = [rig, *sorted((tools / "commission").glob("*.py"))]
    inputs += sorted((tools / "gain_design").glob("*.py"))
    mark = hashlib.sha256(b"".join(path.read_bytes() for path in inputs)).hexdigest()[:16]
    folder = BUILD / "envelope" / "motors" / f"{rig.stem}-{mark}"
    if not (folder / JSON_NAME).is_file():
        plate = read_plate(rig)
        at_plate = true_circuit(rig, 0.0)
        leak_H = at_plate.Ls_H - at_plate.M_H
        main_Wb = rated_main_flux_Wb(plate, at_plate.Rs_ohm, leak_H)
        circuit = true_circuit(rig, main_Wb)
        # The rotor's flux when the main flux is rated and no torque is asked for.
        i_d_A = main_Wb / circuit.M_H
        found = Identified(circuit, main_Wb, main_Wb, i_d_A, 0.0, ())
        store(folder, rig.stem, found, plate)
        table = table_json(design_table(load_motor(folder), certificate=False))
        (folder / JSON_NAME).write_text(table, encoding="utf-8")
    return folder
