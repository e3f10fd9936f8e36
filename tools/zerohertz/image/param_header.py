"""image_params.h: a configuration as the C header that a flash image is built with.

Python's standard library alone: the build makes it (tools/generate_params.py).
"""

from __future__ import annotations

import dataclasses
import struct
from pathlib import Path

from zerohertz.board import board_file, read_board
from zerohertz.errors import UserError
from zerohertz.gain_design.crc32c import crc32c
from zerohertz.gain_design.stored import JSON_NAME, read_motor_table
from zerohertz.image.param_values import image_values
from zerohertz.motor import load_motor
from zerohertz.param_list import FILES, entries, float32, own_list
from zerohertz.param_rules import RULES
from zerohertz.scenario.setup import config_file, load_setup

_SAME_PERIOD = 1.0 + 1e-6  # float32 of a parameter against the decimals of motor.toml


@dataclasses.dataclass(frozen=True)
class Header:
    """The text, and the files that it was made from."""

    text: str
    inputs: tuple[Path, ...]


def header(
    config: str, board: str | None = None, motor: Path | None = None, fieldbus: bool = False
) -> Header:
    """For a configuration; `board` and `motor` go instead of those that it names."""
    setup = load_setup(config)
    folder = setup.motor_dir if motor is None else motor
    board_toml = setup.board if board is None else board_file(board)
    table = read_motor_table(folder)
    values = image_values(
        load_motor(folder), read_board(board_toml), setup.params, config_file(config)
    )
    if not fieldbus:
        values = {p: value for p, value in values.items() if p in entries(fieldbus=False)}
    _require_period(values, table["inputs"]["design"]["period_s"], folder)
    name = table["motor"]
    whole = {p: parameter.whole for p, parameter in entries().items()}
    words = b"".join(_word(whole[p], value) for p, value in values.items())
    lines = "\n".join(f"        .{p} = {_literal(whole[p], v)}, \\" for p, v in values.items())
    text = f"""\
/* Parameters of configuration {setup.name}, board {board_toml.stem}, motor {name}. Generated. */
#include "{name}/l_gain.h"

#define PARAMS_CONFIG "{setup.name}"
#define PARAMS_MOTOR  "{name}"

#define PARAMS_TABLE        l_gain_{name}
#define PARAMS_TABLE_CRC32C 0x{table["crc32c"]}u

/* Over the 32-bit words in the order of param_list.def. */
#define PARAMS_CRC32C 0x{crc32c(words):08x}u

#define PARAMS_VALUES \\
    {{ \\
{lines}
    }}
"""
    motor_files = (folder / "motor.toml", folder / JSON_NAME)
    lists = (*FILES, own) if (own := own_list()) else FILES
    return Header(text, (config_file(config), board_toml, *motor_files, *lists, RULES))


def _require_period(values: dict[str, float], designed_s: float, folder: Path) -> None:
    if values["observer_gain_enable"] and values["period_s"] > designed_s * _SAME_PERIOD:
        raise UserError(
            f"{folder / JSON_NAME}: inputs.design.period_s: the table is for {1e6 * designed_s:g} "
            f"us at most, the board's period is {1e6 * values['period_s']:g} us; design it for "
            "that period with tools/zh design"
        )


def _word(whole: bool, value: float) -> bytes:
    return struct.pack("<I", int(value)) if whole else struct.pack("<f", value)


def _literal(whole: bool, value: float) -> str:
    """The shortest decimal that a compiler reads as this float32."""
    if whole:
        return f"{int(value)}u"
    text = next(t for digits in range(1, 10) if float32(float(t := f"{value:.{digits}g}")) == value)
    return text + ("f" if "." in text or "e" in text else ".0f")
