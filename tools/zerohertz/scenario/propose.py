"""A point of the search as files: rig, configuration and motor with its L design."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path

from zerohertz.motor import load_motor, motor_toml, with_design
from zerohertz.scenario.space import NOMINAL_MOTOR, design_of, firmware_params, rig_overrides

RIG_NAME = "hasegawa2005"
MOTOR_NAME = "hasegawa2005_paper"

_RIG_FIXED = {
    "motor.pole_pairs": "2",
    "motor.saturation.exponent": "4",
    "inverter.model": '"averaged"',
    "inverter.u_dc_V": "283.0",
    "inverter.carrier_Hz": "5000.0",
}


def rig_text(point: Mapping[str, float]) -> str:
    """A rig file, its sections in the order of the plant's."""
    values = _RIG_FIXED | {key: repr(value) for key, value in rig_overrides(point).items()}
    sections = ("motor", "motor.saturation", "mechanics", "inverter", "sensors")
    lines = [
        "# The rig of Hasegawa (2005) as `zh identify` found it: one rig for all thirteen figures.",
        "# Ranges and reasons of every number: tools/zerohertz/scenario/space.py.",
        "",
        "[rig]",
        f'name = "{RIG_NAME}"',
    ]
    for section in sections:
        lines += ["", f"[{section}]"]
        for key, value in values.items():
            head, _, name = key.rpartition(".")
            if head == section:
                lines.append(f"{name} = {value}")
    return "\n".join(lines) + "\n"


def config_text(point: Mapping[str, float]) -> str:
    """A configuration file of zh figures."""
    lines = [
        "# The paper's configuration: with this one tuning the figures are reproduced as far as",
        "# `zh figures` says. Found by `zh identify`; what it may move: scenario/space.py.",
        "",
        "[config]",
        'name = "paper"',
        f'motor = "{MOTOR_NAME}"',
        'board = "paper"',
        f'rig = "{RIG_NAME}"',
        "",
        "[params]",
    ]
    lines += [f"{name} = {value!r}" for name, value in firmware_params(point).items()]
    return "\n".join(lines) + "\n"


def write_proposal(point: Mapping[str, float], folder: Path) -> list[Path]:
    """rig.toml, paper.toml and <motor>/motor.toml; `zh design` makes the table of the last."""
    motor = with_design(load_motor(NOMINAL_MOTOR), **design_of(point))
    text = motor_toml(motor).replace(f'name = "{motor.name}"', f'name = "{MOTOR_NAME}"')
    files = {
        folder / "rigs" / f"{RIG_NAME}.toml": rig_text(point),
        folder / "configs" / "paper.toml": config_text(point),
        folder / MOTOR_NAME / "motor.toml": text,
    }
    for path, content in files.items():
        tomllib.loads(content)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(content, encoding="utf-8")
    return list(files)
