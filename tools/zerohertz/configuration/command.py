"""`zh new`: a configuration from a nameplate, a board and an application. `zh build`: its image."""

from __future__ import annotations

import dataclasses
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from zerohertz.check import command as certify
from zerohertz.configuration import new as begin
from zerohertz.configuration import plate_text
from zerohertz.configuration.files import APPLICATION, BOARD, MOTOR, is_configuration
from zerohertz.console import short_paths, tell
from zerohertz.errors import UserError

if TYPE_CHECKING:
    from zerohertz.commission.finding import Finding


def register(app: typer.Typer) -> None:
    """Add `zh new` and `zh build`."""
    app.command("new")(new)
    app.command("build")(build)
    if _derived_folder not in certify.other_folders:
        certify.other_folders.append(_derived_folder)


def _derived_folder(given: Path) -> Path | None:
    """Where the gain table of a configuration is; None: this folder is none."""
    if not is_configuration(given):
        return None
    from zerohertz.configuration.derive import derive

    return derive(given).derived


def register_campaign(campaign: typer.Typer) -> None:
    """Add `zh campaign configurations`."""
    campaign.command("configurations")(configurations)


def configurations() -> None:
    """Run every command of tools/docs/own_motor.md: five motors, from nameplate to image."""
    from zerohertz.configuration.campaign import PAGE, blocks, run_block

    good = True
    for commands in blocks(PAGE.read_text(encoding="utf-8")):
        with tempfile.TemporaryDirectory() as home:
            for ran in run_block(commands, Path(home)):
                print(f"$ {ran.command}\n{ran.output}", flush=True)
                good = good and ran.code == 0
    raise typer.Exit(0 if good else 1)


def new(
    folder: Annotated[Path, typer.Argument(metavar="NAME", help="Folder to make: a-z, 0-9 and _.")],
    nameplate: Annotated[
        str | None,
        typer.Option(help=f"What the plate says: '{plate_text.EXAMPLE}'; asked for else."),
    ] = None,
    connection: Annotated[
        str | None, typer.Option(help="star or delta, as wired, of a plate with two voltages.")
    ] = None,
    board: Annotated[
        str | None,
        typer.Option(help="Preset of an image, or the folder of a port; asked for else."),
    ] = None,
    application: Annotated[
        str | None, typer.Option(help=f"One of {', '.join(begin.APPLICATIONS)}; asked for else.")
    ] = None,
    full_scale_A: Annotated[
        float | None,
        typer.Option("--full-scale-A", min=0.1, help="Phase current at the end of the ADC."),
    ] = None,
    link_V: Annotated[
        float | None,
        typer.Option("--link-V", min=1.0, help="Nominal dc link; default: the board's own."),
    ] = None,
    speed_rpm: Annotated[
        float | None, typer.Option("--speed-rpm", min=1.0, help="Largest speed; default: rated.")
    ] = None,
    current_A: Annotated[
        float | None, typer.Option("--current-A", min=0.01, help="Largest line current, rms.")
    ] = None,
    torque_Nm: Annotated[
        float | None, typer.Option("--torque-Nm", min=0.001, help="Load; default: rated torque.")
    ] = None,
) -> None:
    """Make a configuration: one folder with motor.toml, board.toml and application.toml.

    The folder may be anywhere. What contradicts something else is refused, and nothing is written.
    """
    content = plate_text.plate_of_text(nameplate or "", connection)
    _ask_plate(content)
    plate = begin.require_plate(content)
    known = [name for name, port in begin.ports().items() if port.board is not None]
    port = begin.port_of(board or _ask("--board", f"board ({', '.join(known)})"))
    kind = _application(application)
    limits = begin.Limits(full_scale_A, link_V, speed_rpm, current_A, torque_Nm)
    texts = {
        MOTOR: begin.motor_text(content),
        BOARD: begin.board_text(port, limits),
        APPLICATION: begin.application_text(kind, plate, limits),
    }
    _require_consistent(folder.absolute(), texts)
    begin.write_new(folder, texts)
    tell(
        f"zh: {folder}: {', '.join(texts)}; next: tools/zh commission {folder} --rig NAME or --port"
    )


def _require_consistent(folder: Path, texts: Mapping[str, str]) -> None:
    """The three files of a folder that is not there yet."""
    from zerohertz.configuration.checks import require_consistent
    from zerohertz.configuration.files import read_texts

    begin.require_name(folder)
    try:
        require_consistent(read_texts(folder, texts))
    except UserError as error:
        raise UserError(f"{error}; nothing was written: {_REMEDY}") from None


_REMEDY = "the options are --link-V, --full-scale-A, --speed-rpm, --current-A and --torque-Nm"


def _application(given: str | None) -> str:
    known = ", ".join(begin.APPLICATIONS)
    kind = given or _ask("--application", f"application ({known})")
    if kind not in begin.APPLICATIONS:
        raise UserError(f"--application: no '{kind}'; there are {known}")
    return kind


def somebody_answers() -> bool:
    return sys.stdin.isatty()


def _ask(option: str, question: str) -> str:
    if not somebody_answers():
        raise UserError(f"{option}: is missing; give it, or answer at a terminal")
    return str(typer.prompt(question))


def _ask_plate(content: dict[str, Any]) -> None:
    """What the plate has to say and has not."""
    for key in plate_text.missing(content):
        if not somebody_answers():
            also = "; or give --connection" if key == "connection" else ""
            raise UserError(
                f"--nameplate: {key} is missing ({plate_text.HOW_TO_ASK[key]}); write it like "
                f"'{plate_text.EXAMPLE}'{also}"
            )
        content[key] = plate_text.answer(key, str(typer.prompt(plate_text.HOW_TO_ASK[key])))


def build(
    folder: Annotated[Path, typer.Argument(metavar="NAME", help="Folder of a configuration.")],
    preset: Annotated[
        str | None, typer.Option(help="Another image than board.toml's port, such as qemu_mps2.")
    ] = None,
) -> None:
    """Build the flash image of a configuration, NAME/build/image/firmware.elf, .bin and .hex."""
    from zerohertz.configuration.image import image_of

    elf = image_of(folder, preset)
    size = elf.with_suffix(".bin").stat().st_size
    print(f"{short_paths(elf)}: {size} bytes of flash")


def fill_in(folder: Path, finding: Finding) -> None:
    """What commissioning found goes into motor.toml; the rest of the file stays."""
    from zerohertz.commission.folder import rig_named
    from zerohertz.toml_file import with_section

    file = folder / MOTOR
    text = file.read_text(encoding="utf-8")
    assert finding.motor is not None
    circuit = dataclasses.asdict(finding.motor.circuit)
    head = {"source": f"zh commission {finding.name}: identified, leakage shared equally"}
    if finding.rig is not None:
        head["rig"] = finding.name if rig_named(finding.name) == finding.rig else str(finding.rig)
    text = with_section(text, "motor", head)
    text = with_section(text, "circuit", {k: float(f"{v:.6g}") for k, v in circuit.items()})
    if finding.mechanics is not None:
        J_kg_m2 = float(f"{finding.mechanics.J_kg_m2:.6g}")
        text = with_section(text, "mechanics", {"J_kg_m2": J_kg_m2})
    fresh = file.with_suffix(".new")
    fresh.write_text(text, encoding="utf-8")
    fresh.replace(file)
