"""Where things are, in the installed package or else in the checkout, and where results may go."""

from __future__ import annotations

import os
from pathlib import Path

from zerohertz.errors import UserError

# What `pip install` brings (tools/cmake/ZhWheel.cmake): the library, and the files that a run reads
# in the folders they have in the checkout.
_PACKED = Path(__file__).resolve().parent / "packed"
INSTALLED = _PACKED.is_dir()
LIBRARIES = _PACKED / "lib"
ROOT = _PACKED if INSTALLED else Path(__file__).resolve().parents[2]
BUILD = Path("build").absolute() if INSTALLED else ROOT / "build"
VENV_PYTHON = ROOT / ".venv" / "bin" / "python"


def need_checkout(what: str) -> None:
    """UserError in the installed package, which has neither sources nor a build."""
    if INSTALLED:
        raise UserError(
            f"{what}: needs the sources, and this is the installed package; "
            "get the checkout and run tools/zh there"
        )


def make_folder(folder: Path, option: str) -> None:
    """Before minutes of work: UserError when nothing can be written there."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UserError(f"{option}: {folder}: {error.strerror}; name another folder") from None
    if not os.access(folder, os.W_OK):
        raise UserError(f"{option}: {folder}: may not be written; name another folder")
