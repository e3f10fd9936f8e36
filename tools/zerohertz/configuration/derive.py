"""What follows from a configuration's three files: everything below its folder `build`.

build/NAME has motor.toml, board.toml, firmware.toml, rig.toml and l_gain.json, as the other
commands and the build know them. They are made anew whenever what they follow from has changed.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from zerohertz.commission.board import Board
from zerohertz.commission.board_run import OTHER_MOTOR_S
from zerohertz.commission.folder import BOARD as BOARD_TOML
from zerohertz.commission.folder import FIRMWARE, parameters_of, rig_file
from zerohertz.commission.folder import MOTOR as MOTOR_TOML
from zerohertz.commission.plate import guess
from zerohertz.commission.run import motor_of, nameplate_of, no_design
from zerohertz.commission.solve import Identified, identified
from zerohertz.commission.tuning import design_of
from zerohertz.configuration import checks
from zerohertz.configuration.files import (
    APPLICATION,
    BUILD,
    DIRECTIONS,
    FILES,
    MOTOR,
    STOPS,
    Configuration,
    read_configuration,
)
from zerohertz.console import short_paths, tell
from zerohertz.errors import UserError
from zerohertz.gain_design.stored import JSON_NAME, read_table_json
from zerohertz.image.param_values import image_values
from zerohertz.motor import Circuit, Design, Motor, Nameplate, motor_from_dict, motor_toml
from zerohertz.toml_file import toml_value, with_line

RIG = "rig.toml"
INPUTS = "inputs.json"
OVER_SPEED = 1.14  # of the largest speed; the firmware takes 1.15
ESTIMATE = 1.05  # of the over-speed trip: the bound of the estimate


def board_of(c: Configuration) -> Board:
    """The board with which the motor is found and simulated."""
    lines = []
    for section, content in c.board.plain.items():
        lines += [f"[{section}]", *(f"{k} = {toml_value(v)}" for k, v in content.items()), ""]
    return Board(
        "\n".join(lines), c.board.scaling.period_s, checks.trip_A(c), c.board.line_voltages
    )


def derive(path: Path | str, table: bool = True, guessed: bool = False) -> Configuration:
    """Everything up to date; says what was made again, and why.

    table: l_gain.json too. guessed: without a circuit, what an image needs to find it.
    """
    c = read_configuration(path)
    checks.require_consistent(c)
    if c.motor.circuit is None and not guessed:
        raise UserError(
            f"{c.file(MOTOR)}: [circuit]: section is missing; find it with tools/zh commission "
            f"{short_paths(c.folder)} --rig NAME or --port DEVICE, or write it by hand"
        )
    circuit = c.motor.circuit or guess(c.motor.plate)
    found = identified(circuit, c.motor.plate)
    motor = _designed_motor(c, found)
    texts = {
        MOTOR_TOML: motor_toml(motor),
        BOARD_TOML: board_of(c).toml,
        RIG: _rig(c, circuit),
        FIRMWARE: _firmware(c, _parameters(c, found, motor)),
    }
    _bring_up_to_date(c, texts, motor if table else None)
    return c


def _bring_up_to_date(c: Configuration, texts: Mapping[str, str], designed: Motor | None) -> None:
    """The table of that motor too."""
    there = {name for name in (*texts, JSON_NAME) if (c.derived / name).exists()}
    made = [name for name, text in texts.items() if _write(c.derived / name, text)]
    if designed is not None and not _table_holds(c.derived, designed):
        _design(c.derived, designed)
        made.append(JSON_NAME)
    again = [name for name in made if name in there]
    _say(c, [name for name in made if name not in there], again, designed is not None)


def _designed_motor(c: Configuration, found: Identified) -> Motor:
    """What it cannot be, or cannot do, is refused before it is designed for."""
    plain = _motor(c, found.circuit, no_design(c.board.scaling.period_s))
    checks.require_possible(c, found)
    if c.motor.circuit is None:
        tell(f"zh: {c.name}: no circuit yet: guessed, good for zh commission alone")
        return plain
    design = design_of(found.circuit, checks.total_plate(c), c.board.scaling.period_s)
    return _motor(c, found.circuit, design)


def firmware_file(c: Configuration) -> Path:
    """What -DZH_CONFIG and --config take."""
    return c.derived / FIRMWARE


def _say(c: Configuration, made: list[str], again: list[str], whole: bool) -> None:
    """Which inputs changed is known by their hashes of the last time that all was derived."""
    now = {name: hashlib.sha256(c.texts[name].encode()).hexdigest() for name in FILES}
    file = c.folder / BUILD / INPUTS
    if made:
        tell(f"zh: {c.name}: derived: {', '.join(made)}")
    if again:
        changed = " and ".join(_changed(file, now)) or "the tools"
        tell(f"zh: {c.name}: {changed} changed; derived again: {', '.join(again)}")
    if whole:
        _write(file, json.dumps(now, indent=1) + "\n")


def _changed(file: Path, now: Mapping[str, str]) -> list[str]:
    try:
        before = json.loads(file.read_text(encoding="utf-8"))
        return [name for name in FILES if before.get(name) != now[name]]
    except (OSError, ValueError, AttributeError):
        return []


def _write(path: Path, text: str) -> bool:
    """Whether it was another one."""
    if path.is_file() and path.read_text(encoding="utf-8") == text:
        return False
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    return True


def _motor(c: Configuration, circuit: Circuit, design: Design) -> Motor:
    source = c.motor.source or f"circuit as given in {MOTOR} of the configuration"
    motor = motor_of(c.name, source, checks.total_plate(c), circuit, design)
    file = c.file(MOTOR)
    try:
        return motor_from_dict(motor.inputs(), file)
    except UserError as error:
        raise UserError(with_line(str(error), file, c.texts[MOTOR])) from None


def rig_of(c: Configuration) -> Path:
    """The simulated motor that it was found on, or else one of what is known."""
    return c.derived / RIG if c.motor.rig is None else rig_file(c.motor.rig)


def nameplate_asked(c: Configuration) -> Nameplate:
    """The nameplate with the application's speed and load in place of rated ones: for a trial."""
    return dataclasses.replace(
        nameplate_of(c.motor.plate), speed_rpm=checks.speed_rpm(c), torque_Nm=checks.load_Nm(c)
    )


def _parameters(c: Configuration, found: Identified, motor: Motor) -> dict[str, float]:
    """As commissioning derives them, then the application's, then [params]."""
    values = parameters_of(found, checks.total_plate(c), board_of(c))
    values |= _speeds(c, values) | _modes(c)
    values |= OTHER_MOTOR_S if c.motor.circuit is None else {}
    values |= dict(c.application.params)
    file = Path(c.file(APPLICATION))
    try:
        image_values(motor, c.board.scaling, values, file)
    except UserError as error:
        raise UserError(f"{error}; change [params], or what they follow from") from None
    return values


def _speeds(c: Configuration, derived: Mapping[str, float]) -> dict[str, float]:
    """Limits and ramps of the application, electrical."""
    rad_s = c.motor.plate.pole_pairs * math.pi / 30.0
    wanted, values = c.application, {}
    if wanted.speed_rpm is not None:
        most = wanted.speed_rpm * rad_s
        values["speed_max_rad_s"] = most
        values["torque_speed_max_rad_s"] = most
        values["over_speed_rad_s"] = OVER_SPEED * most
        bound = ESTIMATE * values["over_speed_rad_s"]
        values["omega_max_rad_s"] = max(derived["omega_max_rad_s"], bound)
    if wanted.up_rpm_per_s is not None:
        values["speed_slew_rad_s2"] = wanted.up_rpm_per_s * rad_s
    if wanted.down_rpm_per_s is not None:
        values["ramp_down_rad_s2"] = wanted.down_rpm_per_s * rad_s
    return values


def _modes(c: Configuration) -> dict[str, float]:
    wanted, board = c.application, c.board
    values: dict[str, float] = {
        "direction": DIRECTIONS.index(wanted.direction),
        "stop_mode": STOPS.index(wanted.stop),
        "flying_start": int(wanted.flying_start),
        "restart_count": wanted.restarts,
    }
    limits = {"u_dc_max_V": board.u_dc_max_V, "u_dc_min_V": board.u_dc_min_V}
    return values | {name: value for name, value in limits.items() if value is not None}


def _firmware(c: Configuration, values: Mapping[str, float]) -> str:
    """The parameters, and what they were derived for."""
    rig = rig_of(c)
    lines = [f"# Follows from {', '.join(FILES)}: do not edit, change those.", "[config]"]
    lines += [f'name = "{c.name}"', f"motor = {toml_value(str(c.derived))}"]
    lines += [f"board = {toml_value(str(c.derived / 'board'))}"]
    lines += [f"rig = {toml_value(str(rig.with_suffix('')))}", "", "[params]"]
    lines += [f"{key} = {value:.7g}" for key, value in values.items()]
    return "\n".join(lines) + "\n"


def _rig(c: Configuration, circuit: Circuit) -> str:
    """A plant of the motor as it is known: for who has no other. Friction and sensors as usual."""
    plate, u_dc_V = checks.total_plate(c), c.board.scaling.u_dc_V
    friction_Nm = 0.01 * plate.torque_Nm
    peak_A = math.sqrt(2.0) * plate.current_A
    sections: dict[str, dict[str, Any]] = {
        "rig": {"name": c.name},
        "motor": dataclasses.asdict(circuit) | {"pole_pairs": plate.pole_pairs},
        "mechanics": {
            "J_kg_m2": plate.J_kg_m2,
            "coulomb_Nm": friction_Nm,
            "viscous_Nms": 0.5 * friction_Nm / (plate.speed_rpm * math.pi / 30.0),
        },
        "inverter": {
            "model": "averaged",
            "u_dc_V": u_dc_V,
            "carrier_Hz": 1.0 / c.board.scaling.period_s,
            "dead_time_s": 2e-6,
            "i_threshold_A": 0.015 * peak_A,
            "drop_V": min(1.0, 0.002 * u_dc_V),
        },
        "sensors": {
            "current_offset_A": [0.015 * peak_A, -0.01 * peak_A, 0.0075 * peak_A],
            "current_noise_A": 3e-4 * peak_A,
        },
    }
    lines = []
    for section, content in sections.items():
        lines += [f"[{section}]", *(f"{k} = {toml_value(v)}" for k, v in content.items()), ""]
    return "\n".join(lines)


def _table_holds(folder: Path, motor: Motor) -> bool:
    path = folder / JSON_NAME
    try:
        return path.is_file() and read_table_json(path)["inputs_sha256"] == motor.inputs_sha256()
    except UserError:
        return False


def _design(folder: Path, motor: Motor) -> None:
    # Here and not above: what only reads a configuration need not wait for the solver.
    from zerohertz.gain_design.table import design_table, table_json

    (folder / JSON_NAME).write_text(table_json(design_table(motor)), encoding="utf-8")
