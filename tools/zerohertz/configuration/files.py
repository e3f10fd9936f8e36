"""The three files of a configuration that people write: motor.toml, board.toml, application.toml.

Everything else follows from them (zerohertz.configuration.derive). Mistakes raise UserError with
file, line, key and remedy; what contradicts something else is in zerohertz.configuration.checks.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

from zerohertz import board as boards
from zerohertz.commission.plate import Plate, plate_from
from zerohertz.configuration.section import Section, require_sections
from zerohertz.errors import UserError
from zerohertz.motor import Circuit
from zerohertz.scenario.setup import parameters_of
from zerohertz.toml_file import parsed, read_text, with_line

MOTOR, BOARD, APPLICATION = "motor.toml", "board.toml", "application.toml"
FILES = (MOTOR, BOARD, APPLICATION)
BUILD = "build"  # what is derived; may be deleted at any time
CONNECTION_RATIO = math.sqrt(3.0)
# Parameters that another file says.
OWNED = {
    **dict.fromkeys(("Rs_ohm", "Rr_ohm", "Ls_H", "Lr_H", "M_H"), f"is the motor's ({MOTOR})"),
    "pole_pairs": f"follows from the nameplate ({MOTOR})",
    **dict.fromkeys(
        (
            *("period_s", "adc_bits", "current_full_scale_A", "line_voltage_full_scale_V"),
            "dc_link_full_scale_V",
        ),
        f"is the board's ({BOARD})",
    ),
}
DIRECTIONS = ("both", "positive", "negative")
STOPS = ("coast", "ramp")


@dataclass(frozen=True)
class MotorFile:
    """plate: with the inertia that was found, if it was; circuit: None until it was found."""

    plate: Plate
    source: str = ""
    rig: str | None = None  # simulated motor that it was found on
    torque_Nm: float | None = None  # of the plate, if it is there
    turned: bool = False  # the inertia is that of [mechanics]
    circuit: Circuit | None = None


@dataclass(frozen=True)
class BoardFile:
    """A board of host_sim/boards, and what an image of it needs."""

    port: str
    scaling: boards.Board
    line_voltages: bool
    i_trip_A: float  # over-current trip at most
    u_dc_max_V: float | None
    u_dc_min_V: float | None
    plain: Mapping[str, Any]  # the sections that host_sim knows


@dataclass(frozen=True)
class Application:
    """What is asked of the drive; None: what the motor gives."""

    speed_rpm: float | None = None
    current_A: float | None = None  # line, rms
    torque_Nm: float | None = None  # of the load
    slowest_rpm: float = 0.0  # nothing is asked for below
    load_J_kg_m2: float = 0.0
    up_rpm_per_s: float | None = None
    down_rpm_per_s: float | None = None
    direction: str = "both"
    stop: str = "ramp"
    flying_start: bool = False
    restarts: int = 0
    params: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Configuration:
    """The folder as it was read."""

    folder: Path
    motor: MotorFile
    board: BoardFile
    application: Application
    texts: Mapping[str, str]  # of FILES

    @property
    def name(self) -> str:
        return self.folder.name

    @property
    def derived(self) -> Path:
        return self.folder / BUILD / self.name

    def file(self, name: str) -> str:
        return str(self.folder / name)

    def wrong(self, name: str, key: str, text: str) -> UserError:
        """A mistake in one of the files, with its line."""
        file = self.file(name)
        return UserError(with_line(f"{file}: {key}: {text}", file, self.texts[name]))


def is_configuration(path: Path | str) -> bool:
    return (Path(path) / APPLICATION).is_file()


def read_configuration(path: Path | str) -> Configuration:
    """UserError names the file that is missing or wrong."""
    folder = Path(path).absolute()
    if not folder.is_dir():
        raise UserError(f"{path}: no such configuration; make one with tools/zh new {path}")
    require_name(folder)
    for name in FILES:
        if not (folder / name).is_file():
            raise UserError(
                f"{folder / name}: no such file; tools/zh new makes a folder with all three"
            )
    return read_texts(folder, {name: read_text(folder / name) for name in FILES})


def read_texts(folder: Path, texts: Mapping[str, str]) -> Configuration:
    """As if they were in the folder."""
    readers = {MOTOR: _motor, BOARD: _board, APPLICATION: _application}
    read: dict[str, Any] = {}
    for name, reader in readers.items():
        file = str(folder / name)
        try:
            read[name] = reader(parsed(texts[name], file), file)
        except UserError as error:
            raise UserError(with_line(str(error), file, texts[name])) from None
    return Configuration(folder, read[MOTOR], read[BOARD], read[APPLICATION], texts)


def require_name(folder: Path) -> None:
    """It becomes a C identifier and a folder of the build."""
    if not re.fullmatch(r"[a-z][a-z0-9_]*", folder.name):
        raise UserError(
            f"{folder}: '{folder.name}' is no name for a configuration; use a-z, 0-9 and _, a "
            "letter first"
        )


def _motor(data: Mapping[str, Any], file: str) -> MotorFile:
    require_sections(data, ("motor", "nameplate", "circuit", "mechanics"), file)
    if "nameplate" not in data:
        raise UserError(f"{file}: [nameplate]: section is missing; give what the plate says")
    head = Section(data, "motor", file)
    source, rig = head.text("source", ""), head.text("rig", None)
    head.end()
    given = dict(data["nameplate"])
    torque_Nm = Section({"nameplate": given}, "nameplate", file).number("torque_Nm")
    given.pop("torque_Nm", None)
    plate = plate_from(wired(given, file), file)
    mechanics = Section(data, "mechanics", file)
    J_kg_m2 = mechanics.number("J_kg_m2")
    mechanics.end()
    if J_kg_m2 is not None:
        plate = replace(plate, J_kg_m2=J_kg_m2)
    return MotorFile(plate, source or "", rig, torque_Nm, J_kg_m2 is not None, _circuit(data, file))


def _circuit(data: Mapping[str, Any], file: str) -> Circuit | None:
    if "circuit" not in data:
        return None
    section = Section(data, "circuit", file)
    values = {entry.name: section.number(entry.name) for entry in fields(Circuit)}
    section.end()
    for key, value in values.items():
        if value is None:
            raise UserError(f"{file}: circuit.{key}: key is missing; all five belong together")
    return Circuit(**values)  # type: ignore[arg-type]


def wired(given: dict[str, Any], file: str) -> dict[str, Any]:
    """Voltage and current of the connection; a plate may give both: {star = 400, delta = 230}."""
    for key, larger in (("voltage_V", "star"), ("current_A", "delta")):
        both = given.get(key)
        if not isinstance(both, Mapping):
            continue
        where = f"{file}: nameplate.{key}"
        numbers = [both.get("star"), both.get("delta")]
        if len(both) != 2 or not all(isinstance(x, (int, float)) and x > 0 for x in numbers):
            raise UserError(f"{where}: is {both!r}; write {{ star = 400, delta = 230 }}")
        smaller = "delta" if larger == "star" else "star"
        ratio = both[larger] / both[smaller]
        if not 0.95 < ratio / CONNECTION_RATIO < 1.05:
            raise UserError(
                f"{where}: {larger} {both[larger]:g} over {smaller} {both[smaller]:g} is "
                f"{ratio:.3g}; star and delta differ by 1.73, {larger} having more: correct one"
            )
        if given.get("connection") in both:
            given[key] = both[given["connection"]]
    return given


_OF_IMAGE = ("measures", "limits")


def _board(data: Mapping[str, Any], file: str) -> BoardFile:
    known = ("board", "adc", "full_scale", "filter", "control", "inverter", "protection")
    require_sections(data, (*known, *_OF_IMAGE), file)
    plain = {name: dict(content) for name, content in data.items() if name in known}
    port = plain.get("board", {}).pop("port", None)
    if not isinstance(port, str):
        raise UserError(
            f"{file}: board.port: is {port!r}; name a preset of hal/*/port.toml, or a folder"
        )
    scaling = boards.board_of(plain, Path(file))
    measures, limits = Section(data, "measures", file), Section(data, "limits", file)
    line_voltages = measures.switch("line_voltages", True)
    measures.end()
    i_trip_A = limits.number("i_trip_A") or 0.95 * scaling.current_full_scale_A
    u_max_V, u_min_V = limits.number("u_dc_max_V"), limits.number("u_dc_min_V")
    limits.end()
    return BoardFile(port, scaling, line_voltages, i_trip_A, u_max_V, u_min_V, plain)


def _application(data: Mapping[str, Any], file: str) -> Application:
    require_sections(data, ("limits", "load", "ramps", "modes", "params"), file)
    limits, load = Section(data, "limits", file), Section(data, "load", file)
    ramps, modes = Section(data, "ramps", file), Section(data, "modes", file)
    wanted = Application(
        speed_rpm=limits.number("speed_rpm"),
        current_A=limits.number("current_A"),
        torque_Nm=load.number("torque_Nm"),
        slowest_rpm=load.number_or_zero("slowest_rpm"),
        load_J_kg_m2=load.number_or_zero("J_kg_m2"),
        up_rpm_per_s=ramps.number("up_rpm_per_s"),
        down_rpm_per_s=ramps.number("down_rpm_per_s"),
        direction=modes.choice("direction", DIRECTIONS, "both"),
        stop=modes.choice("stop", STOPS, "ramp"),
        flying_start=modes.switch("flying_start", False),
        restarts=modes.whole("restarts", 100),
        params=parameters_of(data.get("params", {}), Path(file)),
    )
    for key, owner in OWNED.items():
        if key in wanted.params:
            raise UserError(f"{file}: params.{key}: {owner}; change it there")
    for section in (limits, load, ramps, modes):
        section.end()
    return wanted
