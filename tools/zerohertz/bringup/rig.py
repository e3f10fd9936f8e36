"""A simulated bench for `zh bringup --rig`: a published motor on a board that knows it.

The drive has the rig's circuit, dead time and drop as parameters; saturation, friction, offsets,
noise and the errors of the meters it does not know.
"""

from __future__ import annotations

import contextlib
import tempfile
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from zerohertz import sim
from zerohertz.bringup.bench import Bench
from zerohertz.bringup.measure import Meter
from zerohertz.bringup.model import meter_of, ready_bench
from zerohertz.commission.board import Board
from zerohertz.commission.plate import Plate, plate_from
from zerohertz.commission.run import inertia_kg_m2, motor_of, write_folder
from zerohertz.commission.solve import Identified, rated_main_flux_Wb, rotor_flux_Wb
from zerohertz.commission.tuning import design_of, firmware_parameters
from zerohertz.errors import UserError
from zerohertz.link.server import LinkedDrive
from zerohertz.motor import Circuit

METER_OFF = 0.01  # of every reading: what a clamp is worth
_CIRCUIT = ("Rs_ohm", "Rr_ohm", "Ls_H", "Lr_H", "M_H")
_TOLD = {"dead_time_s": "dead_time_s", "drop_V": "device_drop_V"}


@contextlib.contextmanager
def bench_of(
    rig: str,
    board: str | None = None,
    seed: int = 1,
    faults: Mapping[str, Any] | None = None,
    changes: Mapping[str, Any] | None = None,
    firmware: Mapping[str, float] | None = None,
    keep: Path | None = None,
) -> Iterator[tuple[Bench, Meter]]:
    """rig, board: texts. faults: of a scenario's [faults]; changes: of the rig, untold.

    keep: folder for the drive's gain table, which a replay of its flights needs.
    """
    with tempfile.TemporaryDirectory() as folder:
        job = _job(rig, board, keep or Path(folder), firmware or {})
        overrides = {f"faults.{name}": value for name, value in (faults or {}).items()}
        more = {"scenario_overrides": {"profiles.load_torque_Nm": "[[0.0, 0.0]]"} | overrides}
        drive = LinkedDrive(sim.Job(**job, **more, rig_overrides=dict(changes or {}), seed=seed))
        with drive:
            yield ready_bench(drive, 0.0), meter_of(drive, METER_OFF)


def _job(
    rig: str, board: str | None, folder: Path, firmware: Mapping[str, float]
) -> dict[str, Any]:
    try:
        content = tomllib.loads(rig)
        plate = plate_from(content["nameplate"], "rig")
        circuit = Circuit(**{name: content["motor"][name] for name in _CIRCUIT})
        told = {to: content["inverter"].get(name, 0.0) for name, to in _TOLD.items()}
        text = board or Board.of_plate(plate).toml
        period_s = float(tomllib.loads(text)["control"]["period_s"])
    except (tomllib.TOMLDecodeError, KeyError, TypeError) as error:
        raise UserError(f"--rig, --board: cannot be used: {error}") from None
    design = design_of(circuit, plate, period_s)
    write_folder(motor_of("rig", "the rig's circuit", plate, circuit, design), folder)
    values = _tuned(circuit, plate, period_s) | told | firmware
    return {"rig": rig, "board": text, "motor_dir": folder, "firmware": values}


def _tuned(circuit: Circuit, plate: Plate, period_s: float) -> dict[str, float]:
    """As `zh commission` would."""
    main_Wb = rated_main_flux_Wb(plate, circuit.Rs_ohm, circuit.Ls_H - circuit.M_H)
    rotor_Wb = rotor_flux_Wb(circuit, plate)
    known = Identified(circuit, main_Wb, rotor_Wb, rotor_Wb / circuit.M_H, 0.0, ())
    values = firmware_parameters(known, plate, inertia_kg_m2(plate), period_s)
    return values | {"com_rated_A": plate.current_vector_A, "com_slip_Hz": plate.slip_Hz}
