"""Where things are in the checkout, and where results may go."""

from __future__ import annotations

import os
from pathlib import Path

from zerohertz.errors import UserError

ROOT = Path(__file__).resolve().parents[2]
BUILD = ROOT / "build"
VENV_PYTHON = ROOT / ".venv" / "bin" / "python"


def make_folder(folder: Path, option: str) -> None:
    """Before minutes of work: UserError when nothing can be written there."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UserError(f"{option}: {folder}: {error.strerror}; name another folder") from None
    if not os.access(folder, os.W_OK):
        raise UserError(f"{option}: {folder}: may not be written; name another folder")
