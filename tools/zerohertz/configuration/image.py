"""The flash image of a configuration."""

from __future__ import annotations

from pathlib import Path

from zerohertz.build import build_own_image
from zerohertz.commission.folder import BOARD
from zerohertz.configuration.derive import derive, firmware_file
from zerohertz.configuration.files import BUILD

IMAGE = "image"


def image_of(path: Path | str, preset: str | None = None) -> Path:
    """firmware.elf, built when anything of it is out of date. preset: instead of the board's."""
    c = derive(path, guessed=True)
    port = preset or c.board.port
    folder = c.folder / BUILD / (IMAGE if preset is None else f"{IMAGE}_{preset}")
    options = (
        f"-DZH_MOTOR={c.derived}",
        f"-DZH_CONFIG={firmware_file(c)}",
        f"-DZH_BOARD={c.derived / BOARD}",
    )
    return build_own_image(folder, port, options)
