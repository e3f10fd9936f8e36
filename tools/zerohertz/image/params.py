"""`zh params`: the C header with the parameters of a flash image, and the pages of parameters."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from zerohertz.errors import UserError
from zerohertz.image import canopen_eds, fault_page, modbus_page, param_page, terminal_page
from zerohertz.image.param_header import header
from zerohertz.paths import ROOT

_PAGES = (param_page, fault_page, modbus_page, canopen_eds, terminal_page)


def register(app: typer.Typer) -> None:
    """Add `zh params`."""
    app.command("params")(params)


def params(
    config: Annotated[
        str, typer.Option(help="Configuration: a name in host_sim/configs, or a TOML file.")
    ] = "recommended",
    board: Annotated[
        str | None,
        typer.Option(
            help="Board instead of the configuration's: a name in host_sim/boards, or a file."
        ),
    ] = None,
    motor: Annotated[
        Path | None, typer.Option(help="Motor folder instead of the configuration's.")
    ] = None,
    write: Annotated[Path | None, typer.Option(help="File to write; default: stdout.")] = None,
    check: Annotated[
        bool, typer.Option("--check", help="Exit 1 if a generated page is out of date.")
    ] = False,
    page: Annotated[
        bool,
        typer.Option(
            "--page",
            help="Write parameters.md, faults.md, terminals.md, modbus.md and zerohertz.eds.",
        ),
    ] = False,
) -> None:
    """Write a configuration as the C header that a flash image is built with.

    The build does this itself (tools/generate_params.py, -DZH_CONFIG=, -DZH_MOTOR=).
    """
    if check:
        _check(Console())
        return
    if page:
        for made in _PAGES:
            made.write()
        return
    text = header(config, board, motor).text
    if write is None:
        print(text, end="")
        return
    try:
        write.write_text(text, encoding="utf-8")
    except OSError as error:
        raise UserError(f"{write}: {error.strerror}; give a file in an existing folder") from None
    Console(stderr=True).print(f"wrote {write}", highlight=False)


def _check(console: Console) -> None:
    stale = [page.PAGE.relative_to(ROOT) for page in _PAGES if page.stale()]
    for path in stale:
        console.print(f"{path}: not fresh; run tools/zh params --page", highlight=False)
    if stale:
        raise typer.Exit(1)
    console.print("the pages of parameters, faults and registers are fresh", highlight=False)
