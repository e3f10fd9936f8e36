"""`zh design`: designs gain tables, or proves that the committed ones hold."""

from __future__ import annotations

import dataclasses
import json
import time
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console

from zerohertz.configuration.files import is_configuration
from zerohertz.console import progress_bar, short_paths
from zerohertz.errors import UserError
from zerohertz.gain_design.stored import JSON_NAME, read_table_json, require_folder_name
from zerohertz.gain_design.table import Table, design_table, gains_of, table_json
from zerohertz.motor import METHODS, Motor, load_motor, motor_toml, with_design
from zerohertz.options import Json
from zerohertz.paths import ROOT, make_folder

# Solvers and processors differ in the last digits; a redesign has to agree within this.
REDESIGN_TOLERANCE = 1.0e-3


@dataclasses.dataclass(frozen=True)
class Outcome:
    """What happened to one motor's table."""

    motor: str
    method: str
    entries: int
    solves: int  # runs of the solver Clarabel
    cpu_s: float
    max_gamma: float | None
    largest_difference: float | None  # relative, of the fresh design against the stored table
    faults: tuple[str, ...]
    done: str

    def as_json(self) -> dict[str, Any]:
        content = dataclasses.asdict(self)
        del content["motor"]
        return content | {"faults": list(self.faults)}


def register(app: typer.Typer) -> None:
    app.command("design")(design)


def design(
    motor_dirs: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="MOTOR_DIR", help="Motor folders; default: every one in gain_tables."
        ),
    ] = None,
    check: Annotated[
        bool,
        typer.Option(
            "--check", help="Write nothing; compare the stored tables with a fresh design."
        ),
    ] = False,
    method: Annotated[
        str | None,
        typer.Option(help=f"Method instead of motor.toml's: {', '.join(METHODS)}. Needs --out."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Write MOTOR/motor.toml and MOTOR/l_gain.json to this folder."),
    ] = None,
    as_json: Json = False,
) -> None:
    """Design the observer gain tables (l_gain.json).

    A stored table that a fresh design confirms stays as it is, so that results do not depend on the
    computer. With --check, exit 1 unless the JSON agrees with motor.toml and, within 1e-3, with a
    fresh design. The build generates the C source of a table.
    """
    _require_compatible(check, method, out)
    if out:
        make_folder(out, "--out")
    # What was found is the answer; with --json that is the object alone.
    answer = Console(stderr=as_json)
    outcomes = []
    for folder, motor in _motors(motor_dirs or default_motor_dirs()):
        _require_own_name(motor, folder)
        fresh, cpu_s = _timed_design(with_design(motor, method=method) if method else motor)
        if check:
            outcomes.append(_check(folder, fresh, cpu_s))
        else:
            outcomes.append(_store(out / motor.name if out else folder, fresh, cpu_s, bool(out)))
        _say(outcomes[-1], answer)
    if as_json:
        print(json.dumps({"motors": {o.motor: o.as_json() for o in outcomes}}))
    if any(outcome.faults for outcome in outcomes):
        raise typer.Exit(1)


def _require_compatible(check: bool, method: str | None, out: Path | None) -> None:
    if check and (method or out):
        raise UserError("--check: compares stored tables; leave out --method and --out")
    if method and not out:
        raise UserError(
            "--method: would overwrite the table of motor.toml; give a folder with --out"
        )


def _motors(given: list[Path]) -> list[tuple[Path, Motor]]:
    """Each motor with its folder."""
    folders = [motor_folder(path) for path in given]
    motors = [load_motor(folder) for folder in folders]
    _require_different_names(motors, folders)
    return list(zip(folders, motors, strict=True))


def motor_folder(given: Path) -> Path:
    """The motor's folder, which may be named by its motor.toml, or be a configuration's."""
    if is_configuration(given):
        from zerohertz.configuration.derive import derive

        return derive(given, table=False).derived
    folder = given.parent if given.name == "motor.toml" else given
    if given.exists() and not folder.is_dir():
        raise UserError(f"{given}: is not a motor folder; name the one with motor.toml")
    return folder


def _require_own_name(motor: Motor, folder: Path) -> None:
    """In gain_tables the folder's name is the motor's: two tables of one name cannot be linked."""
    if folder.resolve().parent == ROOT / "gain_tables":
        require_folder_name(motor, folder)


def _require_different_names(motors: list[Motor], folders: list[Path]) -> None:
    """The name says where a table goes and which one is meant."""
    first: dict[str, Path] = {}
    for motor, folder in zip(motors, folders, strict=True):
        other = first.setdefault(motor.name, folder)
        if other.resolve() != folder.resolve():
            raise UserError(
                f"{folder / 'motor.toml'}: motor.name: '{motor.name}' is also that of "
                f"{other / 'motor.toml'}; give each its own name"
            )


def default_motor_dirs() -> list[Path]:
    """Every folder of gain_tables that has a motor.toml."""
    return sorted(path.parent for path in (ROOT / "gain_tables").glob("*/motor.toml"))


def _timed_design(motor: Motor) -> tuple[Table, float]:
    with progress_bar(f"{motor.name}: {motor.design.method}", motor.design.entries) as progress:
        start_s = time.process_time()
        table = design_table(motor, progress=progress)
        return table, time.process_time() - start_s


def _check(folder: Path, fresh: Table, cpu_s: float) -> Outcome:
    difference = _difference(read_table_json(folder / JSON_NAME), fresh)
    faults = []
    if difference is None:
        faults.append(f"{folder / JSON_NAME}: was designed for other inputs; run zh design")
    elif difference > REDESIGN_TOLERANCE:
        faults.append(f"{folder / JSON_NAME}: entries: L is {difference:.1e} off a fresh design")
    return _outcome(fresh, cpu_s, difference, faults, "checked")


def _store(folder: Path, fresh: Table, cpu_s: float, with_motor: bool) -> Outcome:
    """Writes what is new: the json unless it holds."""
    folder.mkdir(parents=True, exist_ok=True)
    json_path = folder / JSON_NAME
    difference = _difference(read_table_json(json_path), fresh) if json_path.exists() else None
    holds = difference is not None and difference <= REDESIGN_TOLERANCE
    files = {} if holds else {JSON_NAME: table_json(fresh)}
    if with_motor:
        files["motor.toml"] = motor_toml(fresh.motor)
    for name, text in files.items():
        if _read(folder / name) != text:
            (folder / name).write_text(text, encoding="utf-8")
    done = "holds, left as it is" if holds else f"written to {folder}"
    return _outcome(fresh, cpu_s, difference, [], done)


def _outcome(
    fresh: Table, cpu_s: float, difference: float | None, faults: list[str], done: str
) -> Outcome:
    design, known = fresh.motor.design, [g for g in fresh.gamma if g is not None]
    return Outcome(
        motor=fresh.motor.name,
        method=design.method,
        entries=design.entries,
        solves=fresh.solves,
        cpu_s=round(cpu_s, 3),
        max_gamma=max(known) if len(known) == design.entries else None,
        largest_difference=difference,
        faults=tuple(faults),
        done=done,
    )


def _difference(stored: dict[str, Any], fresh: Table) -> float | None:
    """Largest |difference| / |gain| over both complex gains; None for other inputs."""
    if stored.get("inputs_sha256") != fresh.motor.inputs_sha256():
        return None
    old = gains_of(stored).astype(float).reshape(-1, 2, 2) @ np.array([1.0, 1.0j])
    new = fresh.gain.astype(float).reshape(-1, 2, 2) @ np.array([1.0, 1.0j])
    if old.shape != new.shape:
        return None
    tiny = np.finfo(np.float32).tiny  # L = 0 against L = 0
    return float(np.max(np.abs(new - old) / np.maximum(np.abs(old), tiny)))


def _read(path: Path) -> str | None:
    return path.read_text(encoding="utf-8") if path.exists() else None


def _say(outcome: Outcome, console: Console) -> None:
    gamma = "no common X" if outcome.max_gamma is None else f"gamma <= {outcome.max_gamma:.4g}"
    console.print(
        f"{outcome.motor}: {outcome.method}, {outcome.entries} entries, {gamma}, "
        f"{outcome.solves} solves, {outcome.cpu_s:.1f} CPU s: {short_paths(outcome.done)}",
        highlight=False,
        soft_wrap=True,
    )
    for fault in outcome.faults:
        console.print(f"  {short_paths(fault)}", highlight=False, soft_wrap=True)
    if outcome.max_gamma is not None and outcome.max_gamma >= 1.0:
        console.print("  gamma >= 1 bounds nothing: lower design.dw0_rad_s below 2 Rr/Lr")
