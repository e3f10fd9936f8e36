"""A new configuration: its three files from a nameplate, a board and an application."""

from __future__ import annotations

import dataclasses
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from zerohertz.board import read_board
from zerohertz.commission.plate import Plate, plate_from
from zerohertz.configuration.files import APPLICATION, BOARD, MOTOR, require_name, wired
from zerohertz.errors import UserError
from zerohertz.image.ports import Port, ports, ports_at, read_ports
from zerohertz.toml_file import toml_value


@dataclasses.dataclass(frozen=True)
class Use:
    """An application to begin with; shares of rated speed."""

    slowest: float
    ramp_s: float | None  # to rated speed; None: what the motor gives
    direction: str
    stop: str
    about: str


APPLICATIONS = {
    "general": Use(0.0, None, "both", "ramp", "anything: both directions, down to standstill"),
    "pump": Use(0.25, 3.0, "positive", "ramp", "one direction, no load near standstill"),
    "fan": Use(0.25, 5.0, "positive", "coast", "one direction, no load near standstill"),
    "hoist": Use(0.0, None, "both", "ramp", "both directions, full load at standstill"),
    "conveyor": Use(0.05, 2.0, "both", "ramp", "both directions, loaded from low speed on"),
}


@dataclasses.dataclass(frozen=True)
class Limits:
    """Options of `zh new` beside the three choices."""

    full_scale_A: float | None = None
    link_V: float | None = None
    speed_rpm: float | None = None
    current_A: float | None = None
    torque_Nm: float | None = None


def require_plate(content: Mapping[str, Any]) -> Plate:
    known = {key: value for key, value in content.items() if key != "torque_Nm"}
    return plate_from(wired(known, "--nameplate"), "--nameplate")


def motor_text(content: Mapping[str, Any]) -> str:
    lines = [
        "# The motor. Voltage and current of the line, rms, for the connection that is wired.",
        "# A plate with both may be copied: voltage_V = { star = 400, delta = 230 }.",
        "",
        "[nameplate]",
        *(f"{key} = {toml_value(value)}" for key, value in content.items()),
        "",
        "# [circuit] (T form, per phase, stator-referred) follows here: zh commission finds it.",
        "",
    ]
    return "\n".join(lines)


def port_of(name: str) -> Port:
    """A preset with a board, or the folder of a port outside this tree."""
    known = {n: port for n, port in ports().items() if port.board is not None}
    known |= {port.name: port for port in ports_at(name) if port.board is not None}
    if name not in known and "/" in name:
        _require_port_folder(Path(name))
        name = str(Path(name).absolute())
    if name not in known:
        raise UserError(
            f"--board: no '{name}'; there are {', '.join(known)}, or the folder of a port whose "
            "port.toml has [boards]"
        )
    return known[name]


def _require_port_folder(folder: Path) -> None:
    """Says what is wrong with a path, instead of what else there is."""
    file = folder / "port.toml"
    if not folder.is_dir():
        raise UserError(f"--board {folder}: no such folder; correct the path")
    if not file.is_file():
        raise UserError(f"--board {folder}: has no port.toml; a port is made from hal/template")
    if not any(port.board for port in read_ports(file)):
        raise UserError(
            f"{file}: [boards]: section is missing; name the board's TOML file as in "
            "hal/stm32f405/port.toml"
        )


def board_text(port: Port, limits: Limits) -> str:
    """The port's board, with the ranges that were given."""
    assert port.board is not None
    read_board(port.board.file)
    data = tomllib.loads(port.board.file.read_text(encoding="utf-8"))
    head = {"name": data.get("board", {}).get("name", port.name), "port": port.name}
    if limits.full_scale_A is not None:
        data["full_scale"]["current_A"] = limits.full_scale_A
        data.pop("protection", None)
    if limits.link_V is not None:
        data["inverter"]["u_dc_V"] = limits.link_V
        if limits.link_V > data["full_scale"]["dc_link_V"] / 1.3:
            both = dict.fromkeys(("dc_link_V", "line_voltage_V"), round(1.5 * limits.link_V, 1))
            data["full_scale"] |= both
    i_trip_A = port.board.i_trip_A
    if i_trip_A is None or limits.full_scale_A is not None:
        i_trip_A = round(0.95 * data["full_scale"]["current_A"], 4)
    sections = {"board": head} | {k: v for k, v in data.items() if k != "board"}
    sections |= {"measures": {"line_voltages": port.board.line_voltages}}
    sections |= {"limits": {"i_trip_A": i_trip_A}}
    lines = ["# The board: what an image is built for, and how it measures."]
    for section, content in sections.items():
        lines += ["", f"[{section}]{_ABOUT.get(section, '')}"]
        lines += [f"{key} = {toml_value(value)}" for key, value in content.items()]
    return "\n".join(lines) + "\n"


_ABOUT = {
    "board": " # port: a preset of hal/*/port.toml, or the folder of a port outside the tree",
    "full_scale": " # at the ends of the ADC; line and dc link",
    "limits": " # i_trip_A: largest over-current trip, peak of a phase; u_dc_max_V, u_dc_min_V",
    "inverter": " # the dc link's nominal voltage",
}


def application_text(kind: str, plate: Plate, limits: Limits) -> str:
    use = APPLICATIONS[kind]
    speed = limits.speed_rpm or plate.speed_rpm
    current = [] if limits.current_A is None else [f"current_A = {limits.current_A:g}"]
    ramps = []
    if use.ramp_s is not None:
        ramps = [f"{key}_rpm_per_s = {speed / use.ramp_s:.4g}" for key in ("up", "down")]
    lines = [
        f"# The application: {kind}, {use.about}.",
        "",
        "[limits] # current_A: line, rms; without it 1.5 times rated, or what the board can do",
        f"speed_rpm = {speed:g}",
        *current,
        "",
        "[load] # what the trial asks for; slowest_rpm: nothing is asked for below",
        f"torque_Nm = {limits.torque_Nm or plate.torque_Nm:.4g}",
        f"slowest_rpm = {use.slowest * speed:.4g}",
        "J_kg_m2 = 0 # of the load, at the shaft; 0 if it turned while the inertia was found",
        "",
        "[ramps] # up_rpm_per_s, down_rpm_per_s; without them what the motor's torque allows",
        *ramps,
        "",
        "[modes]",
        f'direction = "{use.direction}" # both, positive, negative',
        f'stop = "{use.stop}" # ramp, coast',
        "flying_start = false # true: catches a shaft that already turns",
        "restarts = 0 # after a dip of the dc link; the shaft then starts by itself",
        "",
        "[params] # any other parameter by name: tools/docs/parameters.md",
        "",
    ]
    return "\n".join(lines)


def write_new(folder: Path, texts: Mapping[str, str]) -> None:
    """UserError when something is there: nothing is overwritten."""
    require_name(folder.absolute())
    if folder.exists() and not folder.is_dir():
        raise UserError(f"{folder}: is a file; take another name")
    for name in (MOTOR, BOARD, APPLICATION):
        if (folder / name).exists():
            raise UserError(
                f"{folder / name}: is there already and is left as it is; edit it, or take "
                "another name"
            )
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, text in texts.items():
            (folder / name).write_text(text, encoding="utf-8")
    except OSError as error:
        raise UserError(f"{folder}: {error.strerror}; name a folder that can be made") from None
