"""`zh wheel`, `zh fmu` and `zh release`: the drive for Python, for simulators, for the world."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from zerohertz.options import Json

Into = Annotated[Path, typer.Option(help="Folder for the files.")]


def register(app: typer.Typer) -> None:
    """Add `zh wheel`, `zh fmu` and `zh release`."""
    app.command("wheel")(wheel)
    app.command("fmu")(fmu)
    app.command("release")(release)


def wheel(into: Into = Path("build/dist"), as_json: Json = False) -> None:
    """Build the Python package: a wheel for this platform, and the source distribution.

    The wheel holds the firmware and the plant as a library, motors, boards, rigs, scenarios and
    configurations. It needs numpy alone, no compiler and no checkout. The library runs on any
    x86-64 and gives the bits of the build in the checkout.
    """
    from zerohertz.paths import make_folder
    from zerohertz.release.wheel import build_sdist, build_wheel

    make_folder(into, "--into")
    files = [build_wheel(into), build_sdist(into)]
    _show(files, as_json)


def fmu(
    config: Annotated[
        str, typer.Option(help="Configuration: a name in host_sim/configs, or a TOML file.")
    ] = "recommended",
    into: Into = Path("build/dist"),
    as_json: Json = False,
) -> None:
    """Build functional mock-up units for co-simulation, FMI 2.0 and 3.0.

    One is the drive: ADC words or amperes and volts in, duties out. The other is the drive with
    inverter, motor and sensors. Firmware parameters are parameters of the unit. A step may be any
    number of control periods.
    """
    from zerohertz.paths import make_folder
    from zerohertz.release.fmu import build_fmus

    make_folder(into, "--into")
    _show(build_fmus(into, config), as_json)


def release(
    into: Annotated[Path, typer.Option(help="Empty folder for the files.")] = Path("build/release"),
    without: Annotated[
        list[str] | None,
        typer.Option(help="Leave out 'site', 'images', 'FMUs' or 'wheel and sources'; repeatable."),
    ] = None,
    as_json: Json = False,
) -> None:
    """Make everything of this version in one folder.

    Wheel and source distribution, flash images, FMUs, the site as an archive, a software bill of
    materials (CycloneDX), the notes of CHANGELOG.md, and checksums of all.
    """
    from zerohertz.console import tell
    from zerohertz.errors import UserError
    from zerohertz.paths import make_folder
    from zerohertz.release import bundle

    parts = bundle.parts()
    for name in without or []:
        if name not in parts:
            raise UserError(f"--without: no '{name}'; there are {', '.join(parts)}")
        del parts[name]
    make_folder(into, "--into")
    _show(bundle.make(into, parts, tell), as_json)


def _show(files: list[Path], as_json: bool) -> None:
    from zerohertz.console import short_paths

    if as_json:
        print(json.dumps({"files": {path.name: path.stat().st_size for path in files}}))
        return
    for path in files:
        print(f"{short_paths(path.absolute())}: {path.stat().st_size / 1e6:.2f} MB")
