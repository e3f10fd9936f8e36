"""A recorded log: the CSV file, what its columns mean, and what is wrong with it.

What is declared about a log stands in flags or in a small TOML file beside it (same name, suffix
.toml): the scaling of its space vectors and which column plays which role. Currents and voltages
come out power invariant, as everywhere in the drive.
"""

from __future__ import annotations

import csv
import dataclasses
import math
import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from zerohertz.errors import UserError

FloatArray = npt.NDArray[np.float64]
ComplexArray = npt.NDArray[np.complex128]

# Role -> default column and unit. A log gives each vector as alpha/beta or as phases u, v.
ROLES = {
    "t": ("t_s", "time, s"),
    "i_alpha": ("ialpha_A", "stator current, A"),
    "i_beta": ("ibeta_A", "stator current, A"),
    "u_alpha": ("valpha_V", "stator voltage, V"),
    "u_beta": ("vbeta_V", "stator voltage, V"),
    "omega_e": ("omega_el_meas_rad_s", "measured electrical rotor speed, rad/s"),
    "i_u": ("", "phase current u, A, in place of alpha and beta"),
    "i_v": ("", "phase current v, A"),
    "u_uv": ("", "line voltage u_u - u_v, V, in place of alpha and beta"),
    "u_vw": ("", "line voltage u_v - u_w, V"),
}
SCALINGS = ("amplitude", "power")
MIN_ROWS = 20
STEP_TOLERANCE = 0.05  # of the median step; a log of six digits stays within it


@dataclasses.dataclass(frozen=True)
class Declaration:
    """What somebody stated about a log. None: nobody did."""

    scaling: str | None = None
    columns: Mapping[str, str] = dataclasses.field(default_factory=dict)


@dataclasses.dataclass(frozen=True)
class Log:
    """Evenly sampled signals of one run; vectors power invariant, speed electrical."""

    file: str
    t_s: FloatArray
    period_s: float
    i_s_A: ComplexArray
    u_s_V: ComplexArray
    omega_e_rad_s: FloatArray
    scaling: str
    scaling_declared: bool


def parse_columns(text: str) -> dict[str, str]:
    """'i_alpha=Ia,t=time' -> roles; UserError for a role that does not exist."""
    pairs = [item.strip() for item in text.split(",") if item.strip()]
    columns = {}
    for pair in pairs:
        role, separator, name = (part.strip() for part in pair.partition("="))
        if not separator or not name:
            raise UserError(f"--columns: '{pair}' is not role=name")
        columns[role] = name
    _check_roles(columns, "--columns")
    return columns


def load_declaration(log_file: Path) -> Declaration:
    """The sidecar of a log, or an empty declaration when there is none."""
    file = log_file.with_suffix(".toml")
    if not file.is_file():
        return Declaration()
    try:
        data = tomllib.loads(file.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise UserError(f"{file}: not valid TOML: {error}; correct the syntax") from None
    for section in data:
        if section not in ("log", "columns"):
            raise UserError(f"{file}: {section}: unknown; known are [log] and [columns]")
    log = _table(data, "log", file)
    for key in log:
        if key != "scaling":
            raise UserError(f"{file}: log.{key}: unknown key; known is scaling")
    columns = _table(data, "columns", file)
    for role, name in columns.items():
        if not isinstance(name, str):
            raise UserError(f"{file}: columns.{role}: is {name!r}; the column's name is needed")
    _check_roles(columns, f"{file}: columns")
    scaling = log.get("scaling")
    if scaling is not None:
        check_scaling(scaling, f"{file}: log.scaling")
    return Declaration(scaling, columns)


def merge(first: Declaration, second: Declaration) -> Declaration:
    """`first` where it says something, else `second`."""
    return Declaration(first.scaling or second.scaling, {**second.columns, **first.columns})


def check_scaling(scaling: Any, where: str) -> None:
    """UserError unless the scaling is one of the two."""
    if scaling not in SCALINGS:
        raise UserError(f"{where}: is {scaling!r}; write amplitude or power")


def read_log(file: Path, declaration: Declaration | None = None) -> Log:
    """The log, checked row by row; UserError names file, line and column of the first mistake."""
    declaration = declaration or Declaration()
    names = _names(declaration.columns)
    data = _read_columns(file, names)
    t_s = data["t"]
    period_s = _even_period_s(file, t_s)
    # Amplitude-invariant vectors are as long as a phase's peak; power-invariant ones sqrt(3/2) of
    # that. Phase and line quantities have no such freedom.
    scaling = declaration.scaling or "amplitude"
    factor = math.sqrt(1.5) if scaling == "amplitude" else 1.0
    return Log(
        file=str(file),
        t_s=t_s - t_s[0],
        period_s=period_s,
        i_s_A=_current(data, factor),
        u_s_V=_voltage(data, factor),
        omega_e_rad_s=data["omega_e"],
        scaling=scaling,
        scaling_declared=declaration.scaling is not None,
    )


def _table(data: Mapping[str, Any], section: str, file: Path) -> dict[str, Any]:
    content = data.get(section, {})
    if not isinstance(content, dict):
        raise UserError(f"{file}: {section}: must be a section; write [{section}]")
    return content


def _check_roles(columns: Iterable[str], where: str) -> None:
    for role in columns:
        if role not in ROLES:
            raise UserError(f"{where}: no role '{role}'; there are {', '.join(ROLES)}")


def _names(columns: Mapping[str, str]) -> dict[str, str]:
    """Column of every role that is read."""
    current = ("i_u", "i_v") if {"i_u", "i_v"} & set(columns) else ("i_alpha", "i_beta")
    voltage = ("u_uv", "u_vw") if {"u_uv", "u_vw"} & set(columns) else ("u_alpha", "u_beta")
    names = {}
    for role in ("t", *current, *voltage, "omega_e"):
        name = columns.get(role, ROLES[role][0])
        if not name:
            raise UserError(f"--columns: {role} is needed too; name its column")
        names[role] = name
    return names


def _read_columns(file: Path, names: Mapping[str, str]) -> dict[str, FloatArray]:
    try:
        with file.open(newline="", encoding="utf-8-sig") as stream:
            return _parse(file, csv.reader(stream), names)
    except FileNotFoundError:
        raise UserError(f"{file}: no such file; name a CSV file with a header line") from None
    except (UnicodeDecodeError, csv.Error) as error:
        raise UserError(f"{file}: not a CSV text file: {error}") from None
    except OSError as error:
        raise UserError(f"{file}: cannot be read: {error.strerror}") from None


def _parse(file: Path, reader: Any, names: Mapping[str, str]) -> dict[str, FloatArray]:
    header = [name.strip() for name in next(reader, [])]
    if not any(header):
        raise UserError(f"{file}: the file is empty; a header line and rows are needed")
    index = {role: _column(file, header, role, name) for role, name in names.items()}
    values: dict[str, list[float]] = {role: [] for role in names}
    for row in reader:
        if not row:
            continue
        where = f"{file}:{reader.line_num}"
        if len(row) != len(header):
            raise UserError(f"{where}: {len(row)} fields, the header has {len(header)}")
        for role, column in index.items():
            values[role].append(_number(row[column], where, header[column]))
    if len(values["t"]) < MIN_ROWS:
        raise UserError(f"{file}: {len(values['t'])} rows; at least {MIN_ROWS} are needed")
    return {role: np.array(column) for role, column in values.items()}


def _column(file: Path, header: list[str], role: str, name: str) -> int:
    """Where the column called `name` stands, which has to be there once."""
    if header.count(name) > 1:
        raise UserError(f"{file}:1: column '{name}' stands there twice; rename one")
    if name not in header:
        raise UserError(
            f"{file}:1: no column '{name}' ({ROLES[role][1]}); there are "
            f"{', '.join(header)}; name it with --columns {role}=NAME"
        )
    return header.index(name)


def _number(text: str, where: str, column: str) -> float:
    try:
        value = float(text)
    except ValueError:
        raise UserError(f"{where}: {column}: '{text}' is not a number") from None
    if not math.isfinite(value):
        raise UserError(f"{where}: {column}: is {text.strip()}; repair or cut out the row")
    return value


def _even_period_s(file: Path, t_s: FloatArray) -> float:
    """The log's own period; UserError unless time moves on evenly."""
    steps_s = np.diff(t_s)
    # Row k of the array stands in line k + 2; a step belongs to the line that ends it.
    if np.any(steps_s <= 0.0):
        line = int(np.argmax(steps_s <= 0.0)) + 3
        raise UserError(f"{file}:{line}: time does not increase; sort or cut the log")
    median_s = float(np.median(steps_s))
    uneven = np.abs(steps_s / median_s - 1.0) > STEP_TOLERANCE
    if np.any(uneven):
        at = int(np.argmax(uneven))
        raise UserError(
            f"{file}:{at + 3}: uneven time: a step of {steps_s[at]:.6g} s where the others are "
            f"{median_s:.6g} s; resample the log or write time with more digits"
        )
    # Nine digits: a period of 100 us is not one of 99.99999999999999 us.
    return float(f"{(t_s[-1] - t_s[0]) / (len(t_s) - 1):.9g}")


def _current(data: Mapping[str, FloatArray], factor: float) -> ComplexArray:
    if "i_alpha" in data:
        return factor * (data["i_alpha"] + 1j * data["i_beta"])
    # Power-invariant Clarke with i_u + i_v + i_w = 0.
    beta_A = (data["i_u"] + 2.0 * data["i_v"]) / math.sqrt(2.0)
    return math.sqrt(1.5) * data["i_u"] + 1j * beta_A


def _voltage(data: Mapping[str, FloatArray], factor: float) -> ComplexArray:
    if "u_alpha" in data:
        return factor * (data["u_alpha"] + 1j * data["u_beta"])
    alpha_V = math.sqrt(2.0 / 3.0) * (data["u_uv"] + 0.5 * data["u_vw"])
    return alpha_V + 1j * data["u_vw"] / math.sqrt(2.0)
