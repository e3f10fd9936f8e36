"""The firmware's self-commissioning in the simulated rig."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from zerohertz.commission.board import Board
from zerohertz.commission.plate import Plate, guess, level_s, threshold_A
from zerohertz.commission.tuning import DUTY, PEAK, TRIP, limit_A
from zerohertz.drive import Fault
from zerohertz.errors import UserError
from zerohertz.gain_design.command import JSON_NAME
from zerohertz.gain_design.table import design_table, table_json
from zerohertz.motor import Circuit, Design, Mechanics, Motor, Nameplate, motor_toml, usual_J_kg_m2
from zerohertz.sim import Commissioned, Job, run

REFUSALS = {
    1: "the current does not follow: is the motor connected, phase u too, and the dc link up?",
    2: "phases v and w do not share the current: one of them is open",
    3: "the stator resistance is no motor's of this size: check the plate and the wiring",
    4: "the flux had not settled: try again (noise does it as well), or raise rs_level_s",
    5: "more current did not give more flux: check the current sensors' signs",
    6: "the leakage is nothing or more than a motor has: is there a filter in the line?",
    7: "no rotor answers, or one of another size: check the plate",
}
_LONGEST_S = 600.0
_SCENARIO = f"""\
[scenario]
name = "commission"
duration_s = {_LONGEST_S}
commission_s = 0.3
[profiles]
speed_ref_rpm = [[0.0, 0.0]]
"""


def nameplate_of(plate: Plate) -> Nameplate:
    """As motor.toml has it."""
    return Nameplate(
        power_W=1e3 * plate.power_kW,
        speed_rpm=plate.speed_rpm,
        voltage_V=plate.voltage_V,
        current_A=plate.current_A,
        frequency_Hz=plate.frequency_Hz,
        pole_pairs=plate.pole_pairs,
        torque_Nm=round(plate.torque_Nm, 3),
    )


def inertia_kg_m2(plate: Plate) -> float:
    """The catalogue's, or what a motor of this torque usually has."""
    return plate.J_kg_m2 or usual_J_kg_m2(plate.torque_Nm)


def motor_of(name: str, source: str, plate: Plate, circuit: Circuit, design: Design) -> Motor:
    return Motor(
        name=name,
        source=source,
        nameplate=nameplate_of(plate),
        circuit=circuit,
        mechanics=Mechanics(J_kg_m2=inertia_kg_m2(plate)),
        design=design,
    )


def no_design(period_s: float) -> Design:
    """L = 0."""
    return Design(
        method="zero", dw0_rad_s=1.0, radius_per_s=1500.0, decay_per_s=0.0, relax=1.05,
        period_s=period_s, table_end_elec_per_min=2,
    )  # fmt: skip


def write_folder(motor: Motor, folder: Path) -> None:
    """motor.toml and its table."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "motor.toml").write_text(motor_toml(motor), encoding="utf-8")
    (folder / JSON_NAME).write_text(table_json(design_table(motor)), encoding="utf-8")


def commission(
    rig: Path,
    plate: Plate,
    board: Board | None = None,
    seed: int = 1,
    faults: Mapping[str, Any] | None = None,
) -> tuple[Commissioned, float]:
    """What the firmware found, and how long it took; it is told the plate alone.

    faults: of a scenario's [faults], by name.
    """
    board = board or Board.of_plate(plate)
    nothing = no_design(board.period_s)
    unknown = motor_of("unknown", "guessed from the nameplate", plate, guess(plate), nothing)
    with tempfile.TemporaryDirectory() as folder:
        write_folder(unknown, Path(folder))
        job = Job(
            scenario=_SCENARIO,
            scenario_overrides={f"faults.{key}": value for key, value in (faults or {}).items()},
            rig=rig,
            board=board.toml,
            motor_dir=folder,
            firmware=start_parameters(plate, board.i_trip_max_A) | _limits(plate, board),
            seed=seed,
            decimate=1000,
        )
        record = run(job)
    if record.first_fault and not record.commissioned.refusal:
        names = " ".join(f.name or "" for f in Fault if f & record.first_fault)
        raise UserError(
            f"commissioning: the drive tripped: {names}; check the motor's wiring (zh bringup), "
            "and that this is the rig's nameplate"
        )
    return record.commissioned, record.steps * record.period_s


def _limits(plate: Plate, board: Board) -> dict[str, float]:
    """What the simulated drive would else scale to the motor, whatever its board can take."""
    source = {} if board.senses_voltage else {"voltage_source": DUTY}
    if math.isinf(board.i_trip_max_A):
        return source
    most_A = limit_A(plate, board.i_trip_max_A)
    currents = dict.fromkeys(("i_max_A", "i_q_max_A", "i_d_max_A"), most_A)
    trip_A = TRIP * PEAK * most_A
    return source | currents | {"i_trip_A": trip_A} | board.current_sum(trip_A)


def start_parameters(plate: Plate, i_trip_max_A: float = math.inf) -> dict[str, float]:
    """Firmware parameters before anything is known but the plate, and what the board can take."""
    return {
        "observer_gain_enable": 0,
        "com_rated_A": min(plate.current_vector_A, limit_A(plate, i_trip_max_A)),
        "rs_level_s": level_s(plate),
        "com_slip_Hz": plate.slip_Hz,
        "dead_time_i_threshold_A": threshold_A(plate),
        "current_bandwidth_rad_s": 400.0,
    }


def refused(found: Commissioned) -> str | None:
    if found.done:
        return None
    return REFUSALS.get(found.refusal, "it did not end in time")
