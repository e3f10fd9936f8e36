"""The ports of hal/ that make an image: what their port.toml says."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from zerohertz.errors import UserError
from zerohertz.paths import ROOT

HAL = ROOT / "hal"


@dataclass(frozen=True)
class Board:
    """What a configuration for this image begins with."""

    file: Path  # as host_sim/boards has them
    line_voltages: bool
    i_trip_A: float | None


@dataclass(frozen=True)
class Port:
    """What the image of a port cannot tell by itself."""

    name: str
    interrupts: tuple[str, ...]  # each can interrupt all before it
    indirect_calls: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    recursive: str = r"(?!)"  # functions whose recursion is meant
    openocd_target: str | None = None
    flash_address: int | None = None
    board: Board | None = None


def ports(hal: Path = HAL) -> dict[str, Port]:
    """Every image of a folder with a port.toml, by the name of its preset."""
    found = [port for path in sorted(hal.glob("*/port.toml")) for port in read_ports(path)]
    return {port.name: port for port in found}


def ports_at(name: str) -> list[Port]:
    """Of a folder outside this tree: named by its path."""
    file = Path(name) / "port.toml"
    if "/" not in name or not file.is_file():
        return []
    return [replace(port, name=str(Path(name).absolute())) for port in read_ports(file)]


def read_ports(path: Path) -> list[Port]:
    """One image named like the folder, or those of its key `presets`."""
    port = read_port(path)
    names = tomllib.loads(path.read_text(encoding="utf-8")).get("presets", [port.name])
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise UserError(f"{path}: presets: is {names!r}; give a list of names")
    boards = tomllib.loads(path.read_text(encoding="utf-8")).get("boards", {})
    return [replace(port, name=name, board=_board(boards.get(name), path, name)) for name in names]


def _board(content: Any, path: Path, name: str) -> Board | None:
    if content is None:
        return None
    where = f"{path}: boards.{name}"
    if not isinstance(content, Mapping) or not isinstance(content.get("file"), str):
        raise UserError(f"{where}.file: is missing; name the board's TOML file")
    file = (path.parent / content["file"]).resolve()
    if not file.is_file():
        raise UserError(f"{where}.file: there is no {file}; correct the name")
    return Board(file, bool(content.get("line_voltages", True)), content.get("i_trip_A"))


def read_port(path: Path) -> Port:
    """UserError with file and key for anything that is missing or senseless."""
    try:
        content: dict[str, Any] = tomllib.loads(path.read_text(encoding="utf-8"))
    except tomllib.TOMLDecodeError as error:
        raise UserError(f"{path}: not valid TOML: {error}; correct the syntax") from None
    image, flash = content.get("image", {}), content.get("flash", {})
    interrupts = image.get("interrupts")
    if not isinstance(interrupts, list) or not all(isinstance(i, str) for i in interrupts):
        raise UserError(f"{path}: image.interrupts: is {interrupts!r}; give a list of functions")
    recursive = image.get("recursive", Port.recursive)
    try:
        re.compile(recursive)
    except (re.error, TypeError):
        raise UserError(f"{path}: image.recursive: is not a regular expression") from None
    if flash and not (isinstance(flash.get("address"), int) and flash.get("openocd_target")):
        raise UserError(f"{path}: flash: needs openocd_target and address")
    return Port(
        name=path.parent.name,
        interrupts=tuple(interrupts),
        indirect_calls={k: tuple(v) for k, v in image.get("indirect_calls", {}).items()},
        recursive=recursive,
        openocd_target=flash.get("openocd_target"),
        flash_address=flash.get("address"),
    )
