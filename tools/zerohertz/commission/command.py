"""`zh commission`: an unknown motor becomes motor.toml and parameters. `zh trial`: does it run?

`zh campaign commissioning`: both, for every motor of host_sim/rigs/motors.
"""

from __future__ import annotations

import dataclasses
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TextIO

import typer
from rich.console import Console

from zerohertz.errors import UserError
from zerohertz.link.command import (
    BaudOption,
    KeyOption,
    PortOption,
    SilOption,
    TcpOption,
    UnlockOption,
    open_client,
    unlock_drive,
)
from zerohertz.link.line import DEFAULT_BAUD, DEFAULT_TCP_PORT
from zerohertz.options import Json

if TYPE_CHECKING:
    from zerohertz.commission.board import Board
    from zerohertz.commission.campaign import Row
    from zerohertz.commission.finding import Finding
    from zerohertz.commission.plate import Plate
    from zerohertz.link.client import Client
    from zerohertz.motor import Nameplate


FolderArgument = Annotated[
    Path | None, typer.Argument(metavar="[NAME]", help="Configuration: the folder of zh new.")
]
RigOption = Annotated[
    str | None, typer.Option(help="Simulated rig: a name in host_sim/rigs/motors, or a file.")
]
PlateOption = Annotated[
    str | None,
    typer.Option(help="Nameplate of a drive's motor: a file with [nameplate], or a rig."),
]
OutOption = Annotated[
    Path | None, typer.Option(help="Write the result to this folder (or its motor.toml).")
]
BoardOption = Annotated[
    Path | None, typer.Option(help="Board file; default: a board that fits the motor.")
]
RotateOption = Annotated[
    bool, typer.Option("--rotate", help="Then turn the free shaft to find inertia and friction.")
]
SaveOption = Annotated[bool, typer.Option("--save", help="Set and save the result in the drive.")]


def register(app: typer.Typer) -> None:
    """Add `zh commission` and `zh trial`."""
    app.command("commission")(commission)
    app.command("trial")(trial)


def register_campaign(campaign: typer.Typer) -> None:
    """Add `zh campaign commissioning`."""
    campaign.command("commissioning")(commissioning)


def commission(
    folder: FolderArgument = None,
    rig: RigOption = None,
    plate: PlateOption = None,
    out: OutOption = None,
    board: BoardOption = None,
    rotate: RotateOption = False,
    save: SaveOption = False,
    unlock: UnlockOption = False,
    key: KeyOption = None,
    port: PortOption = None,
    baud: BaudOption = DEFAULT_BAUD,
    sil: SilOption = False,
    tcp: TcpOption = DEFAULT_TCP_PORT,
    seed: Annotated[int, typer.Option(min=1, help="Seed of the sensor noise.")] = 1,
    as_json: Json = False,
) -> None:
    """Identify a motor at standstill with the firmware, and derive all parameters.

    --rig identifies the motor of a simulated rig. --plate identifies the motor of a drive, reached
    by --port or --sil and unlocked. The section [nameplate] is the only input: kW, line voltage and
    current (V, A rms), Hz, min^-1, cos phi, star or delta. With --out it writes motor.toml for
    `zh design`, board.toml and firmware.toml. With a configuration, plate and board are its own,
    and the circuit goes into its motor.toml. Exit 1 if the firmware rejects its result.
    """
    linked = port is not None or sil
    asked = _asked(folder, rig, plate, board, out, linked)
    _require_its_options(board, save, linked)
    # Here and not above: other commands need not wait for scipy.
    from zerohertz.commission import finding
    from zerohertz.commission.plate import warnings

    told = asked.plate
    notes = Console(stderr=True, highlight=False)
    for doubt in warnings(told):
        notes.print(f"warning: nameplate: {doubt}")
    if linked:
        with open_client(port, baud, sil, tcp, key, share=True) as drive:
            unlock_drive(drive, unlock, key)
            found = finding.of_drive(
                drive, asked.name, told, notes.print, rotate, board=asked.board
            )
            if save:
                _keep(drive, found, notes)
    else:
        found = finding.of_rig(asked.file, told, asked.board, rotate, seed)
    if folder is not None:
        _fill_in(folder, found, notes)
    elif out is not None:
        _write(found, out, notes)
    print(json.dumps(found.as_dict()) if as_json else found.text(), flush=True)
    if folder is not None and found.motor is not None:
        from zerohertz.configuration.derive import derive

        derive(folder, table=False)
    raise typer.Exit(0 if found.refusal is None else 1)


@dataclasses.dataclass(frozen=True)
class _Asked:
    """file: the rig, where it is simulated; board: None for one of the motor's size."""

    name: str
    file: Path
    plate: Plate
    board: Board | None


def _asked(
    folder: Path | None,
    rig: str | None,
    plate: str | None,
    board: Path | None,
    out: Path | None,
    linked: bool,
) -> _Asked:
    from zerohertz.commission.board import Board
    from zerohertz.commission.folder import rig_file
    from zerohertz.commission.plate import read_plate, require_same

    if folder is None:
        _require_one_motor(rig, plate, linked)
        path = rig_file(rig or plate or "")
        return _Asked(path.stem, path, read_plate(path), board and Board.of_file(board))
    for option, given in (("--plate", plate), ("--board", board), ("--out", out)):
        if given is not None:
            raise UserError(f"{option}: {folder} says it; leave it out")
    if (rig is not None) == linked:
        raise UserError("give --rig NAME, or --port DEVICE or --sil")
    from zerohertz.configuration.checks import require_consistent
    from zerohertz.configuration.derive import board_of
    from zerohertz.configuration.files import read_configuration

    c = read_configuration(folder)
    require_consistent(c)
    path = rig_file(rig) if rig is not None else Path()
    if rig is not None:
        require_same(rig, read_plate(path), c.motor.plate)
    return _Asked(rig or c.name, path, c.motor.plate, board_of(c))


def _require_one_motor(rig: str | None, plate: str | None, linked: bool) -> None:
    if (rig is not None) == linked or (plate is not None) != linked:
        raise UserError("give --rig NAME, or --plate FILE with --port DEVICE or --sil")


def _require_its_options(board: Path | None, save: bool, linked: bool) -> None:
    if linked and board is not None:
        raise UserError("--board: only with --rig; a drive reports its own board")
    if not linked and save:
        raise UserError("--save: only with --port or --sil")


def _keep(drive: Client, found: Finding, notes: Console) -> None:
    """In the drive, unless nothing was found."""
    from zerohertz.commission import board_run

    if found.motor is not None:
        board_run.keep(drive, found.motor, found.plate, found.board)
        notes.print("set and saved in the drive, gain table off until it has this motor's")


def _fill_in(folder: Path, found: Finding, notes: Console) -> None:
    from zerohertz.configuration.command import fill_in

    if found.motor is None:
        notes.print(f"{folder}: left as it is")
        return
    fill_in(folder, found)
    notes.print(f"written to {folder / 'motor.toml'}; next: tools/zh design {folder}")


def _write(found: Finding, out: Path, notes: Console) -> None:
    """As files, unless nothing was found."""
    if found.motor is not None:
        folder = out.parent if out.suffix == ".toml" else out
        found.write(folder)
        notes.print(f"written to {folder}; next: tools/zh design {folder}")


@dataclasses.dataclass(frozen=True)
class _Tried:
    """asked: the nameplate with the application's speed and load."""

    folder: Path
    rig: Path
    asked: Nameplate | None = None
    slowest_pu: float = 0.0

    @property
    def speed(self) -> str:
        return "rated speed" if self.asked is None else "the largest speed"

    @property
    def load(self) -> str:
        return "rated load" if self.asked is None else f"a load of {self.asked.torque_Nm:.3g} Nm"


def _tried(folder: Path, rig: str | None) -> _Tried:
    from zerohertz.commission.folder import rig_file
    from zerohertz.configuration.files import is_configuration

    if is_configuration(folder):
        from zerohertz.configuration.checks import speed_rpm
        from zerohertz.configuration.derive import derive, nameplate_asked, rig_of

        c = derive(folder)
        path = rig_of(c) if rig is None else rig_file(rig)
        slowest_pu = c.application.slowest_rpm / speed_rpm(c)
        return _Tried(c.derived, path, nameplate_asked(c), slowest_pu)
    if not folder.is_dir():
        raise UserError(f"{folder}: no such folder; correct the path")
    if rig is None:
        raise UserError(f"--rig: is missing; {folder} is no configuration, which has its own")
    if not (folder / "l_gain.json").exists():
        raise UserError(f"{folder}: has no l_gain.json; run tools/zh design {folder} first")
    return _Tried(folder, rig_file(rig))


def trial(
    folder: Annotated[
        Path,
        typer.Argument(help="Configuration, or a folder of zh commission with a gain table."),
    ],
    rig: Annotated[
        str | None,
        typer.Option(
            help="Simulated rig: a name in host_sim/rigs/motors, or a file; a "
            "configuration has its own."
        ),
    ] = None,
    seed: Annotated[int, typer.Option(min=1, help="Seed of the sensor noise.")] = 1,
    as_json: Json = False,
) -> None:
    """Try a commissioned motor: a speed step, rated load on and off, and operation near zero.

    Near zero: rated load in both directions at 5 % and 2 % of rated speed, drifting Rs, slow
    crossings. A configuration is asked for its own speed and load, and for nothing below its
    slowest speed. Exit 1 if the drive does not hold all of them.
    """
    from zerohertz.commission.slow import run_slow
    from zerohertz.commission.trial import run_trial

    tried = _tried(folder, rig)
    seen = run_trial(tried.folder, tried.rig, seed, tried.asked)
    slow = run_slow(tried.folder, tried.rig, seed, tried.asked, tried.slowest_pu)
    if as_json:
        fields = {f.name: getattr(seen, f.name) for f in dataclasses.fields(seen)}
        del fields["record"]
        print(json.dumps(fields | {"slow": [dataclasses.asdict(mission) for mission in slow]}))
    else:
        fault = f", fault bits {seen.fault:#x}" if seen.fault else ""
        print(f"{folder.name}: {seen.word}{fault}")
        print(f"  speed step to 90 % in {seen.rise_s:.2f} s; {tried.load} takes", end=" ")
        print(f"{100.0 * seen.dip_pu:.1f} % of {tried.speed} for a moment")
        print(f"  settled: speed off by {100.0 * seen.speed_err_pu:.2f} %", end=", ")
        print(f"flux angle by {seen.angle_err_deg:.1f} degrees")
        for mission in slow:
            off = f"speed off by {100.0 * mission.speed_err_pu:.2f} % at most"
            print(f"  {mission.mission}: {mission.word}, {off}")
        if tried.slowest_pu > 0.0:
            print(f"  below {100.0 * tried.slowest_pu:.0f} % of the largest speed: not asked for")
    raise typer.Exit(0 if seen.held and all(mission.held for mission in slow) else 1)


def _print_row(row: Row, output: TextIO) -> None:
    from zerohertz.commission import campaign

    print(campaign.row_text(row), campaign.slow_text(row), sep="\n", file=output)


def commissioning(
    motor: Annotated[
        list[str] | None,
        typer.Option(help="Motor, a name in host_sim/rigs/motors; may be repeated; default: all."),
    ] = None,
    seed: Annotated[int, typer.Option(min=1, help="Seed of the sensor noise.")] = 1,
    write: Annotated[bool, typer.Option(help="Write tools/docs/commissioning.md.")] = False,
    as_json: Json = False,
) -> None:
    """Commission motors from their nameplates, and check that they run with the result."""
    from zerohertz.commission import campaign
    from zerohertz.commission.folder import all_rigs

    if write and motor:
        raise UserError("--write: the page needs every motor; leave out --motor")
    names = motor or [path.stem for path in all_rigs()]
    output = sys.stderr if as_json else sys.stdout
    rows = campaign.run_all(names, seed, lambda row: _print_row(row, output))
    if write:
        campaign.PAGE.write_text(campaign.page_text(rows, seed), encoding="utf-8")
    if as_json:
        print(json.dumps({"seed": seed, "motors": [campaign.as_dict(row) for row in rows]}))
    raise typer.Exit(0 if all(row.good and row.held_slowly for row in rows) else 1)
