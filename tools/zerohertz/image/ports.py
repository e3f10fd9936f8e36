"""The ports of hal/ that make an image: what their port.toml says."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from zerohertz.errors import UserError
from zerohertz.paths import ROOT

HAL = ROOT / "hal"


@dataclass(frozen=True)
class Port:
    """What the image of a port cannot tell by itself."""

    name: str
    interrupts: tuple[str, ...]  # each can interrupt all before it
    indirect_calls: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    recursive: str = r"(?!)"  # functions whose recursion is meant
    openocd_target: str | None = None
    flash_address: int | None = None


def ports(hal: Path = HAL) -> dict[str, Port]:
    """Every folder with a port.toml, by name."""
    return {path.parent.name: read_port(path) for path in sorted(hal.glob("*/port.toml"))}


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
