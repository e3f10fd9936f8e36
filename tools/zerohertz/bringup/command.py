"""`zh bringup`: the first power-up of a board. `zh campaign bringup`: is each fault named?"""

from __future__ import annotations

import contextlib
import json
import sys
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from zerohertz.errors import UserError
from zerohertz.link.command import (
    BaudOption,
    KeyOption,
    PortOption,
    SilOption,
    TcpOption,
    open_client,
    unlock_drive,
)
from zerohertz.link.line import DEFAULT_BAUD, DEFAULT_TCP_PORT
from zerohertz.options import Json, refuse_given

if TYPE_CHECKING:
    from zerohertz.bringup.bench import Bench
    from zerohertz.bringup.campaign import Row
    from zerohertz.bringup.person import Person


def register(app: typer.Typer) -> None:
    """Add `zh bringup`."""
    app.command("bringup")(bringup)


def register_campaign(campaign: typer.Typer) -> None:
    """Add `zh campaign bringup`."""
    campaign.command("bringup")(seeded)


def bringup(
    context: typer.Context,
    out: Annotated[
        Path, typer.Option(help="Folder of report and recordings; a later run goes on there.")
    ] = Path("bringup"),
    answers: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Readings as JSON, instead of the keyboard."),
    ] = None,
    until: Annotated[
        str | None, typer.Option(metavar="STEP", help="Stop behind this step.")
    ] = None,
    fresh: Annotated[bool, typer.Option("--fresh", help="From the first step on.")] = False,
    record: Annotated[
        bool, typer.Option("--record/--no-record", help="Record a flight of each moving step.")
    ] = True,
    rig: Annotated[
        str | None,
        typer.Option(help="Simulated bench: a name in host_sim/rigs/motors, or a file."),
    ] = None,
    board: Annotated[
        Path | None, typer.Option(help="Board file, with --rig; default: one that fits the motor.")
    ] = None,
    fault: Annotated[
        list[str] | None,
        typer.Option(metavar="KEY=VALUE", help="With --rig: of a scenario's [faults], to try it."),
    ] = None,
    seed: Annotated[
        int | None, typer.Option(min=1, help="With --rig: seed of the noise; default: 1.")
    ] = None,
    unlock: Annotated[
        bool, typer.Option("--unlock", help="Unlock with the development key.")
    ] = False,
    key: KeyOption = None,
    port: PortOption = None,
    baud: BaudOption = DEFAULT_BAUD,
    sil: SilOption = False,
    tcp: TcpOption = DEFAULT_TCP_PORT,
    as_json: Json = False,
) -> None:
    """Bring up a board for the first time: wiring, sensors, gates, first turn.

    Each step says what to connect and to measure, and runs the drive's part. A simulation with the
    drive's own parameters predicts it. The first step that does not fit ends it, with the fault's
    name and exit code 1. Exit 130 when stopped by hand, 2 when a reading is missing; run it again
    to go on.
    """
    if rig is not None:
        _require_rig_alone(port, sil)
        refuse_given(
            context,
            {"unlock": "--unlock", "key": "--key", "baud": "--baud", "tcp": "--tcp"},
            "--rig brings a drive along, and this is for a connected one",
        )
        entered = _simulated(rig, board, fault or [], seed or 1, out)
    else:
        _require_rig(board, fault, seed)
        entered = _connected(port, baud, sil, tcp, key, unlock)
    raise typer.Exit(_go_on(entered, out, answers, until, (fresh, record, as_json)))


def _go_on(
    entered: AbstractContextManager[tuple[Bench, Person]],
    out: Path,
    answers: Path | None,
    until: str | None,
    flags: tuple[bool, bool, bool],
) -> int:
    """Exit code. flags: from the first step on, record flights, print JSON."""
    from zerohertz.bringup import procedure, report
    from zerohertz.bringup.person import Answers
    from zerohertz.bringup.steps import NAMES, STEPS

    fresh, record, as_json = flags
    if until is not None and until not in NAMES:
        raise UserError(f"--until {until}: there is no such step; there are {', '.join(NAMES)}")
    notes = Console(stderr=True, highlight=False, markup=False)
    with entered as (bench, reader):
        person = Answers(answers) if answers is not None else reader
        state = procedure.of_drive(bench)
        if not fresh:
            state = procedure.resumed(state, out / report.JSON, notes.print)
        report.write(state, out)
        steps = STEPS[: NAMES.index(until) + 1] if until is not None else STEPS
        try:
            procedure.go_on(
                *(bench, state, person, notes.print, lambda s: report.write(s, out), steps),
                out if record else None,
            )
        except UserError as error:
            kept = f"{out / report.MARKDOWN} keeps the steps before ({len(state.steps)})"
            raise UserError(f"{error}; {kept}") from None
    print(json.dumps(state.as_json()) if as_json else report.verdict(state))
    notes.print(f"report: {out / report.MARKDOWN}")
    return 1 if state.findings else 0


def _require_rig_alone(port: str | None, sil: bool) -> None:
    if port is not None or sil:
        raise UserError("give --rig NAME, or --port DEVICE, or --sil: only one of them")


def _require_rig(board: Path | None, fault: list[str] | None, seed: int | None) -> None:
    for option, given in (("--board", board), ("--fault", fault), ("--seed", seed)):
        if given:
            raise UserError(f"{option}: only with --rig; a connected drive has its own")


@contextlib.contextmanager
def _connected(
    port: str | None, baud: int, sil: bool, tcp: int, key: Path | None, unlock: bool
) -> Iterator[tuple[Bench, Person]]:
    from zerohertz.bringup.bench import Bench
    from zerohertz.bringup.person import Keyboard

    with open_client(port, baud, sil, tcp, key, share=True) as drive:
        unlock_drive(drive, unlock, key)
        if not drive.store().unlocked:
            raise UserError("bring-up moves protected limits and puts them back; give --unlock")
        yield Bench(drive, time.sleep), Keyboard()


@contextlib.contextmanager
def _simulated(
    rig: str, board: Path | None, faults: list[str], seed: int, out: Path
) -> Iterator[tuple[Bench, Person]]:
    from zerohertz.bringup.person import Simulated
    from zerohertz.bringup.rig import bench_of
    from zerohertz.commission.folder import rig_file

    told = {}
    for text in faults:
        name, equals, value = text.partition("=")
        if not equals:
            raise UserError(f"--fault {text}: is not KEY=VALUE")
        told[name] = value
    try:
        texts = [path.read_text(encoding="utf-8") for path in (rig_file(rig), board) if path]
    except OSError as error:
        raise UserError(f"--rig, --board: cannot be read: {error}") from None
    simulated = bench_of(texts[0], texts[1] if board else None, seed, told, keep=out / "motor")
    with simulated as (bench, meter):
        print("zh: the simulated bench reads its own meters", file=sys.stderr)
        yield bench, Simulated(meter)


def seeded(
    seed: Annotated[int, typer.Option(min=1, help="Seed of the sensor noise.")] = 1,
    write: Annotated[bool, typer.Option(help="Write the tables of tools/docs/bringup.md.")] = False,
    as_json: Json = False,
) -> None:
    """Bring up healthy benches, and benches with one wiring fault each. Exit 1 if one is missed."""
    from zerohertz.bringup import campaign

    output = sys.stderr if as_json else sys.stdout

    def show(row: Row) -> None:
        verdict = "good" if row.good else "WRONG"
        text = f"{row.place}, {row.seed or 'healthy'}: step {row.step}, {row.named or 'all fit'}"
        print(f"{verdict}: {text}", file=output)

    rows = campaign.run_all(seed, show)
    if write:
        campaign.write_page(rows, seed)
    if as_json:
        print(json.dumps({"seed": seed, "runs": [asdict(row) for row in rows]}))
    raise typer.Exit(0 if all(row.good for row in rows) else 1)
