"""`zh atlas --features`: every recipe over the maps; table, JSON and tools/docs/features.md."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from zerohertz.atlas.features import Recipe
from zerohertz.atlas.points import Point, random_sample, standard_map
from zerohertz.atlas.run import Progress, RunOptions, Tell, run_map
from zerohertz.atlas.simulate import make_bench
from zerohertz.atlas.summary import counts, percent
from zerohertz.gain_design.command import JSON_NAME
from zerohertz.gain_design.table import design_table, table_json
from zerohertz.motor import Motor, load_motor, motor_from_dict, motor_toml
from zerohertz.paths import ROOT
from zerohertz.scenario.setup import Setup, load_setup

# Nothing was tuned on this sample.
SEED = 4711
# Runs of 70 s: a fifth of the drift map's points is as much computing as the other maps together.
SIZES = {"map_i": 245, "map_ii": 245, "drift": 49, "random": 300}
PAGE = ROOT / "tools" / "docs" / "features.md"
# Column: what it runs, and what the firmware is told besides the recipe.
COLUMNS: Mapping[str, tuple[str, Mapping[str, float]]] = {
    "map_i": ("map_i", {}),
    "map_ii": ("map_ii", {}),
    "map_ii_duty": ("map_ii", {"voltage_source": 1}),
    "drift": ("drift", {}),
    "random": ("random", {}),
}

Counts = dict[str, dict[str, int]]  # by column
Bar = Callable[[str, int], AbstractContextManager[Progress]]


def run_recipes(
    chosen: Sequence[Recipe], points: int, options: RunOptions, tell: Tell, bar: Bar
) -> Iterator[tuple[Recipe, Counts]]:
    """Recipe by recipe, what it holds in each column. `points` > 0: so many of each map only."""
    for recipe in chosen:
        folder = options.out / recipe.name
        setup, told = setup_of(recipe, folder)
        found: Counts = {}
        for column, (name, extra) in COLUMNS.items():
            bench = make_bench(setup, {**told, **extra})
            where = dataclasses.replace(options, out=folder / column)
            which = column_points(name, points)
            with bar(f"{recipe.name} {column}", len(which)) as progress:
                found[column] = counts(run_map(bench, which, where, tell, progress))
        yield recipe, found


def column_points(name: str, points: int) -> list[Point]:
    """The points of a map or of the sample; with `points`, so many of them from all over it."""
    size = min(points or SIZES[name], SIZES[name])
    if name == "random":
        return random_sample(size, SEED)
    every = standard_map(name)
    picked = np.random.default_rng(SEED).choice(len(every), size, replace=False)
    return [every[k] for k in sorted(picked)]


def setup_of(recipe: Recipe, folder: Path) -> tuple[Setup, dict[str, float]]:
    """Configuration and overrides; `folder` receives the gain table of a recipe with its own."""
    setup = load_setup(recipe.config)
    known = setup.parameters()
    told = {**recipe.firmware, **{k: known[k] * f for k, f in recipe.scaled.items()}}
    if recipe.table is not None:
        setup = dataclasses.replace(setup, motor_dir=ROOT / "gain_tables" / recipe.table)
    if recipe.design_Rs_ratio != 1.0:
        nameplate = load_motor(setup.motor_dir)
        # The firmware goes on knowing the nameplate; only its table is another.
        told = dataclasses.asdict(nameplate.circuit) | told
        path = _design(nameplate, recipe.design_Rs_ratio, folder / "gain_table")
        setup = dataclasses.replace(setup, motor_dir=path)
    return setup, told


def _design(nameplate: Motor, Rs_ratio: float, folder: Path) -> Path:
    inputs = nameplate.inputs()
    inputs["circuit"]["Rs_ohm"] *= Rs_ratio
    motor = motor_from_dict(inputs, str(folder / "motor.toml"))
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "motor.toml").write_text(motor_toml(motor), encoding="utf-8")
    table = table_json(design_table(motor, certificate=False))
    (folder / JSON_NAME).write_text(table, encoding="utf-8")
    return folder


def as_json(found: Sequence[tuple[Recipe, Counts]], run_s: float) -> dict[str, Any]:
    table = {
        recipe.name: {"overrides": f"{recipe.config}: {recipe.overrides()}", **by_column}
        for recipe, by_column in found
    }
    return {"features": table, "run_s": round(run_s, 1)}


def _cell(count: dict[str, int]) -> str:
    oriented, held = (percent(count[k], count["points"]) for k in ("oriented", "held"))
    return f"{oriented:.1f} / {held:.1f}"


def _bad(by_column: Counts) -> tuple[str, str]:
    """Unsafe and silent points of all columns together."""
    unsafe, silent = (sum(c[k] for c in by_column.values()) for k in ("unsafe", "silent"))
    return str(unsafe), str(silent)


def print_table(found: Sequence[tuple[Recipe, Counts]]) -> None:
    table = Table(title="oriented % / held %; unsafe and silent points", title_justify="left")
    for text in ("recipe", *COLUMNS, "unsafe", "silent"):
        table.add_column(text, justify="left" if text == "recipe" else "right", no_wrap=True)
    for recipe, by_column in found:
        table.add_row(recipe.name, *(_cell(c) for c in by_column.values()), *_bad(by_column))
    Console(width=max(Console().width, 130)).print(table)


_HEAD = """\
# What each feature is worth

Made by `tools/zh atlas --features{names} --write` from the recipes and reasons of
`tools/zerohertz/atlas/features.py`. The firmware knows only the nameplate. Cells: % of the points
oriented / held ([classes](../zerohertz/atlas/README.md#classes)). Columns: maps i and ii of the
atlas (245 points each); map ii with the voltage from the duty alone; Rs drifting by
+20 % under load ({drift} of that map's 245 points, drawn once for all rows); a random sample with
every error at once ({random} points, seed {seed}: nothing was tuned on it). Unsafe and silent:
points of all five columns together. A verdict judges what the recipe tries: "kept" in a row that
removes a feature says that the recommended configuration has the feature.
"""


def page(found: Sequence[tuple[Recipe, Counts]], names: Sequence[str]) -> str:
    """The page to be committed; `names` are those the command was given."""
    lines = [_HEAD.format(names="".join(f" {n}" for n in names), seed=SEED, **SIZES)]
    for group in dict.fromkeys(recipe.group for recipe, _ in found):
        rows = [(r, c) for r, c in found if r.group == group]
        lines += [f"## {group}", "", _row("recipe", *COLUMNS, "unsafe", "silent")]
        lines.append("|---|" + "---:|" * (len(COLUMNS) + 2))
        lines += [_row(r.name, *(_cell(c) for c in by.values()), *_bad(by)) for r, by in rows]
        lines += ["", _row("recipe", "configuration: what differs", "", "why"), "|---|---|---|---|"]
        lines += [
            _row(r.name, f"{r.config}: {r.overrides()}", r.verdict, r.reason) for r, _ in rows
        ]
        lines.append("")
    return "\n".join(lines)


def _row(*cells: str) -> str:
    return "| " + " | ".join(cells) + " |"


def write_page(found: Sequence[tuple[Recipe, Counts]], names: Sequence[str]) -> None:
    PAGE.write_text(page(found, names), encoding="utf-8")
