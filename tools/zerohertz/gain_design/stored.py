"""l_gain.json read back: what `zh design` wrote, checked as far as a reader can.

Python's standard library alone: the build reads the tables too.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from zerohertz.errors import UserError
from zerohertz.motor import Motor, MotorError, load_motor

JSON_NAME = "l_gain.json"


def read_table_json(path: Path | str) -> dict[str, Any]:
    """Content of a l_gain.json; UserError when it is none."""
    try:
        content = json.loads(Path(path).read_text(encoding="utf-8"))
        if len(content["l_words"]) != 4 * content["entries"]:
            raise UserError(f"{path}: l_words: not 4 words per entry; run zh design")
    except FileNotFoundError:
        raise UserError(f"{path}: no such file; run zh design") from None
    except (json.JSONDecodeError, UnicodeDecodeError, KeyError, TypeError) as error:
        raise UserError(f"{path}: not a gain table ({error!r}); run zh design") from None
    return content


def read_motor_table(folder: Path) -> dict[str, Any]:
    """The table of a motor folder; UserError unless it belongs to motor.toml and to the folder."""
    motor = load_motor(folder / "motor.toml")
    require_folder_name(motor, folder)
    path = folder / JSON_NAME
    content = read_table_json(path)
    if content.get("inputs_sha256") != motor.inputs_sha256():
        raise UserError(
            f"{path}: inputs_sha256: was designed for another motor.toml; run zh design {folder}"
        )
    return content


def require_folder_name(motor: Motor, folder: Path) -> None:
    """One name for folder, C identifier and image: two tables of one name cannot be linked."""
    name = folder.resolve().name
    if motor.name != name:
        raise MotorError(
            f"{motor.file}: motor.name: is '{motor.name}', the folder is '{name}'; "
            "give both one name"
        )
