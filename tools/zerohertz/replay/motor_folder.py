"""The folder the SIL library reads: motor.toml beside its gain table."""

from __future__ import annotations

from pathlib import Path

from zerohertz.errors import UserError
from zerohertz.gain_design.table import design_table, table_json
from zerohertz.motor import Motor, motor_toml
from zerohertz.paths import BUILD

TABLE = "l_gain.json"


def folder_with_table(motor: Motor, motor_dir: Path) -> Path:
    """`motor_dir` when its table is there, else a copy under build/ with a table just designed.

    So a motor.toml alone is enough for a first look at one's own machine.
    """
    folder = motor_dir if motor_dir.is_dir() else motor_dir.parent
    if (folder / TABLE).is_file():
        return folder
    if motor.design.method == "gamma_pr":
        raise UserError(f"{folder / TABLE}: no such file; make it with tools/zh design {folder}")
    copy = BUILD / "replay" / motor.name
    copy.mkdir(parents=True, exist_ok=True)
    (copy / "motor.toml").write_text(motor_toml(motor), encoding="utf-8")
    table = design_table(motor, certificate=False)
    (copy / TABLE).write_text(table_json(table), encoding="utf-8")
    return copy
