"""`zh flash`: builds the image of a board and writes it with openocd or st-flash."""

from __future__ import annotations

import shlex
import shutil
import subprocess
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from zerohertz.errors import UserError
from zerohertz.image.ports import Port, ports, ports_at

TOOLS = ("openocd", "st-flash")


def register(app: typer.Typer) -> None:
    """Add `zh flash`."""
    app.command("flash")(flash)


def flash(
    folder: Annotated[
        Path | None, typer.Argument(metavar="[NAME]", help="Configuration; its board is flashed.")
    ] = None,
    board: Annotated[
        str | None,
        typer.Option(
            help="Board: a port in hal whose port.toml has a section [flash]; default: stm32f405."
        ),
    ] = None,
    tool: Annotated[
        str | None, typer.Option(help="openocd or st-flash; default: whichever is installed.")
    ] = None,
    interface: Annotated[
        str, typer.Option(help="Debug probe of openocd.")
    ] = "interface/stlink.cfg",
    loader: Annotated[
        bool, typer.Option("--loader", help="The boot loader instead; then `zh update`.")
    ] = False,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Only print the command.")] = False,
) -> None:
    """Build the image of a board, write it to flash and verify it.

    Stored parameters are kept; they lie in separate sectors. An image written here takes the place
    of a boot loader.
    """
    from zerohertz.build import build_image

    port = _port_of(folder, board)
    chosen = choose(tool, dry_run)
    own = folder is not None and not loader
    target = "zh_boot" if loader else "all"
    elf = _image_of(folder) if own else build_image(port.name, target)
    line = command_line(port, chosen, elf, interface)
    print(shlex.join(line), flush=True)
    if dry_run:
        return
    code = subprocess.run(line, check=False).returncode
    if code != 0:
        raise UserError(
            f"{chosen}: ended with {code}; is the probe plugged in and the board powered?"
        )
    Console(stderr=True).print(f"{elf.name} is in the board", highlight=False)


def _port_of(folder: Path | None, board: str | None) -> Port:
    if folder is not None:
        from zerohertz.configuration.files import read_configuration

        if board is not None:
            raise UserError(f"--board: {folder} says it; leave it out")
        board = read_configuration(folder).board.port
    wanted = board or "stm32f405"
    known = (*ports().values(), *ports_at(wanted))
    boards = {port.name: port for port in known if port.openocd_target}
    if wanted not in boards:
        raise UserError(f"--board: no '{wanted}'; there are {', '.join(boards)}")
    return boards[wanted]


def _image_of(folder: Path) -> Path:
    from zerohertz.configuration.image import image_of

    return image_of(folder)


def choose(tool: str | None, dry_run: bool) -> str:
    """The programmer; UserError when it is unknown, or not there and wanted in earnest."""
    if tool is not None and tool not in TOOLS:
        raise UserError(f"--tool: no '{tool}'; there are {', '.join(TOOLS)}")
    wanted = TOOLS if tool is None else (tool,)
    there = [name for name in wanted if shutil.which(name) is not None]
    if there:
        return there[0]
    if dry_run:
        return wanted[0]
    packages = {"openocd": "openocd", "st-flash": "stlink-tools"}
    remedy = " or ".join(f"apt-get install {packages[name]}" for name in wanted)
    raise UserError(f"{' or '.join(wanted)}: not installed; {remedy}")


def command_line(board: Port, tool: str, elf: Path, interface: str) -> tuple[str, ...]:
    """What writes, verifies and starts the image."""
    if tool == "openocd":
        script = f"program {{{elf}}} verify reset exit"
        return ("openocd", "-f", interface, "-f", board.openocd_target, "-c", script)
    binary = str(elf.with_suffix(".bin"))
    return ("st-flash", "--reset", "write", binary, f"0x{board.flash_address:08x}")
