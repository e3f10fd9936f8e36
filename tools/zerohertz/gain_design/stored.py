"""l_gain.json read back: what `zh design` wrote, checked as far as a reader can.

Python's standard library alone: the build reads the tables too.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from zerohertz.errors import UserError
from zerohertz.gain_design.crc32c import crc32c
from zerohertz.motor import Motor, MotorError, load_motor

JSON_NAME = "l_gain.json"
SCHEMA = 2
_KEYS = ("motor", "inputs", "inputs_sha256", "motor_id", "method", "step_elec_per_min")
_KEYS += ("step_rad_s", "crc32c", "entries")


def float32_text(value: float) -> str:
    """Nine significant digits, which give every float32 back exactly; always with a point or e."""
    text = f"{value:.9g}"
    return text if "." in text or "e" in text else text + ".0"


def read_table_json(path: Path | str) -> dict[str, Any]:
    """Content of a l_gain.json; UserError when it is none or is damaged."""
    try:
        content = json.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise UserError(f"{path}: {error.strerror}; run zh design") from None
    except ValueError as error:
        raise UserError(f"{path}: not valid JSON: {error}; run zh design") from None
    if not isinstance(content, dict) or content.get("schema") != SCHEMA:
        raise UserError(f"{path}: schema: is not {SCHEMA}; run zh design")
    if missing := [key for key in _KEYS if key not in content]:
        raise UserError(f"{path}: {missing[0]}: key is missing; run zh design")
    if f"{crc32c(_little_endian_words(content, path)):08x}" != content["crc32c"]:
        raise UserError(f"{path}: crc32c: does not match the entries' L; run zh design")
    return content


def _little_endian_words(content: Mapping[str, Any], path: Path | str) -> bytes:
    """The gains as they lie in flash."""
    words = bytearray()
    for k, entry in enumerate(content["entries"]):
        try:
            words += struct.pack("<4f", *entry["L"])
        except (TypeError, KeyError, OverflowError, struct.error):
            raise UserError(f"{path}: entries[{k}].L: not four float32; run zh design") from None
    return bytes(words)


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
