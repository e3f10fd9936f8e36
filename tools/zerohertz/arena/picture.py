"""The maps of all entrants side by side, as one SVG: an entrant per row, a panel per map and Rs."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import Any
from xml.sax.saxutils import escape

from zerohertz.atlas.classes import Outcome
from zerohertz.atlas.points import LOADS_PU, RS_RATIOS, SPEEDS_RPM, standard_map
from zerohertz.atlas.summary import percent

# As the atlas draws them (atlas/picture.py).
COLOURS = {
    Outcome.ORIENTED: ("#009E73", "oriented"),
    Outcome.HELD: ("#56B4E9", "held, orientation off"),
    Outcome.TAKEOVER: ("#F0E442", "take-over declared"),
    Outcome.SAFE_STOP: ("#E69F00", "safe stop"),
    Outcome.UNSAFE: ("#B2182B", "unsafe"),
}
SHOWN = {"map_i": "map i", "map_ii": "map ii", "drift": "drift"}
CELL, GAP, ROW, LEFT, TOP = 7, 5, 64, 150, 36
PANEL = CELL * len(SPEEDS_RPM)
MAP = (PANEL + GAP) * len(RS_RATIOS) + 12

Maps = Mapping[str, Mapping[str, Any]]


def svg(found: Mapping[str, Maps]) -> str:
    """Rows in the order given."""
    width = LEFT + MAP * len(SHOWN)
    height = TOP + ROW * len(found) + 24
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" '
        f'width="{width}" height="{height}" font-family="sans-serif" font-size="9">',
        f'<rect width="{width}" height="{height}" fill="#fff"/>',
        *_heads(),
    ]
    for row, (name, maps) in enumerate(found.items()):
        parts += _row(TOP + ROW * row, name, maps)
    parts += _legend(TOP + ROW * len(found) + 8)
    return "\n".join([*parts, "</svg>"]) + "\n"


def _heads() -> list[str]:
    parts = []
    for k, text in enumerate(SHOWN.values()):
        x = LEFT + MAP * k
        parts.append(f'<text x="{x}" y="12" font-weight="bold">{text}</text>')
        for j, ratio in enumerate(RS_RATIOS):
            parts.append(f'<text x="{x + (PANEL + GAP) * j}" y="28">Rs {ratio:g}</text>')
    return parts


def _row(y: int, name: str, maps: Maps) -> list[str]:
    parts = [f'<text x="4" y="{y + 14}" font-size="10">{escape(name)}</text>']
    for k, map_name in enumerate(SHOWN):
        if map_name not in maps:
            continue
        counted = maps[map_name]
        text = ", ".join(
            f"{percent(counted[key], counted['points']):.0f} %" for key in ("oriented", "held")
        )
        parts.append(f'<text x="4" y="{y + 26 + 11 * k}">{SHOWN[map_name]}: {text}</text>')
        parts += _cells(LEFT + MAP * k, y, map_name, counted["classes"])
    return parts


def _cells(x: int, y: int, map_name: str, classes: Mapping[str, str]) -> list[str]:
    """One path per class; neighbours to the right are one rectangle."""
    at: dict[str, dict[tuple[int, int], list[int]]] = {}
    for point in standard_map(map_name):
        outcome = classes.get(str(point.index), classes.get(point.index))
        if outcome is not None:
            panel = RS_RATIOS.index(point.rs_ratio)
            line = len(LOADS_PU) - 1 - LOADS_PU.index(point.load_pu)
            column = SPEEDS_RPM.index(point.speed_rpm)
            at.setdefault(outcome, {}).setdefault((panel, line), []).append(column)
    return [
        f'<path fill="{COLOURS[Outcome(outcome)][0]}" d="{_path(x, y, lines)}"/>'
        for outcome, lines in sorted(at.items())
    ]


def _path(x: int, y: int, lines: Mapping[tuple[int, int], Sequence[int]]) -> str:
    words = []
    for (panel, line), columns in sorted(lines.items()):
        for _, run in itertools.groupby(enumerate(sorted(columns)), lambda pair: pair[1] - pair[0]):
            taken = [column for _, column in run]
            left = x + (PANEL + GAP) * panel + CELL * taken[0]
            wide = CELL * len(taken)
            words.append(f"M{left} {y + CELL * line}h{wide}v{CELL}h-{wide}z")
    return "".join(words)


def _legend(y: int) -> list[str]:
    parts, x = [], LEFT
    for colour, text in COLOURS.values():
        parts.append(f'<rect x="{x}" y="{y}" width="9" height="9" fill="{colour}"/>')
        parts.append(f'<text x="{x + 13}" y="{y + 8}">{text}</text>')
        x += 120
    return parts
