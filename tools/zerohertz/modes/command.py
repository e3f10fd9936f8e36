"""`zh modes`: modes and range on the simulated rig, and tools/docs/modes.md."""

from __future__ import annotations

import json
from typing import Annotated, Any

import typer

from zerohertz.errors import UserError
from zerohertz.options import Json
from zerohertz.paths import ROOT

PAGE = ROOT / "tools" / "docs" / "modes.md"
TEXT = {
    "weakening": "Field weakening: to twice rated speed in 2 s, rated power as a step, back; "
    "and a dc link that sags meanwhile",
    "flying_start": "Flying start: the shaft turns when the run command comes; the reference is "
    "its speed",
    "dc_brake": "Braking and holding by direct current",
    "open_loop": "V/f and I-f, without the observer",
    "economy": "Flux of least copper loss at 1200 min^-1, then a step to rated torque",
    "restart": "Automatic restart after a dip of the dc link, shaft turning",
    "mains_loss": "Controlled stop on the energy of the shaft; a mains that comes back in between",
}


def register(app: typer.Typer) -> None:
    """Add `zh modes`."""
    app.command("modes")(modes)


def modes(
    names: Annotated[list[str] | None, typer.Argument(help="Groups to run; default: all.")] = None,
    write: Annotated[bool, typer.Option(help="Write tools/docs/modes.md (all groups).")] = False,
    as_json: Json = False,
) -> None:
    """Test the range and the modes of operation. Exit 1 if a run misses its goal."""
    from zerohertz.modes.cases import GROUPS

    asked = _groups(names, list(GROUPS))
    if write and names:
        raise UserError("modes: --write: the page has every group; name none")
    results = {name: [case().as_json() for case in GROUPS[name]] for name in asked}
    if as_json:
        print(json.dumps(results))
    else:
        for name, rows in results.items():
            print(f"{TEXT[name]}\n\n{table(rows)}\n")
    if write:
        PAGE.write_text(page(results), encoding="utf-8")
    if not all(row["met"] for rows in results.values() for row in rows):
        raise typer.Exit(1)


def _groups(names: list[str] | None, known: list[str]) -> list[str]:
    for name in names or []:
        if name not in known:
            raise UserError(f"modes: {name}: unknown group; known are {', '.join(known)}")
    return names or known


def table(rows: list[dict[str, Any]]) -> str:
    """Rows of one or more kinds as Markdown; a cell that a kind does not have stays empty."""
    keys = list(dict.fromkeys(key for row in rows for key in row if key not in ("met", "verdict")))
    head = "| " + " | ".join([*(key.replace("_", " ") for key in keys), "ended"]) + " |"
    rule = "|" + "---|" * (len(keys) + 1)
    lines = [
        "| " + " | ".join([*(_cell(row.get(key)) for key in keys), row["verdict"]]) + " |"
        for row in rows
    ]
    return "\n".join([head, rule, *lines])


def _cell(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.4g}"
    return "" if value is None else str(value)


def page(results: dict[str, list[dict[str, Any]]]) -> str:
    """The committed result."""
    parts = "\n".join(f"## {TEXT[name]}\n\n{table(rows)}\n" for name, rows in results.items())
    missed = sum(not row["met"] for rows in results.values() for row in rows)
    total = sum(len(rows) for rows in results.values())
    return f"""\
# Modes and range

Made by `tools/zh modes --write`; `tools/zh test` runs a sample. The motor is Table 1's with the
configuration `recommended`; runs and predicates: `tools/zerohertz/modes/cases.py`.
{total - missed} of {total} cases meet their goal.

{parts}"""
