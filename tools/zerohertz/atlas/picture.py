"""The maps to look at: PNG, and a page that needs no network.

One panel per Rs ratio, speed x load, coloured by class. A sample off the grid is drawn where it
lies, in the panel of the nearest ratio.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from zerohertz.atlas.classes import Outcome
from zerohertz.atlas.points import LOADS_PU, RS_RATIOS, SPEEDS_RPM
from zerohertz.atlas.simulate import RIG_NAME
from zerohertz.atlas.summary import counts, percent
from zerohertz.report import style

Rows = Sequence[dict[str, Any]]

# Okabe and Ito's palette, and a marker each: the class can be told without colour, too.
LOOK = {
    Outcome.ORIENTED: ("#009E73", "s", "square", "oriented"),
    Outcome.HELD: ("#56B4E9", "D", "diamond", "held, orientation off"),
    Outcome.TAKEOVER: ("#F0E442", "o", "circle", "take-over declared"),
    Outcome.SAFE_STOP: ("#E69F00", "^", "triangle-up", "safe stop"),
    Outcome.UNSAFE: ("#B2182B", "X", "x", "unsafe"),
}
SILENT = "silent: CLOSED while the orientation was lost"
WIDTH_PX = 1800
MOST_IN_PAGE = 5000  # a browser stays quick, and the page below 10 MB


def title(config: str, rows: Rows) -> str:
    """What was run, and how much of it holds."""
    count = counts(rows)
    parts = [f"{percent(count[k], len(rows)):.1f} % {k}" for k in ("oriented", "held")]
    parts += [f"{count[k]} {k.replace('_', ' ')}" for k in ("unsafe", "silent")]
    name = rows[0]["map"].replace("_", " ")
    return f"{config}, {RIG_NAME}, {name}, {len(rows)} points: {', '.join(parts)}"


def write_png(path: Path, config: str, rows: Rows) -> None:
    """Small multiples; one row of panels per value of Rr and M in a map that varies them."""
    groups = _groups(rows)
    with style.figure(12.0, 3.0 * len(groups) + 0.7) as drawn:
        all_axes = drawn.subplots(len(groups), len(RS_RATIOS), squeeze=False, sharey=True)
        for axes_row, (text, group) in zip(all_axes, groups.items(), strict=True):
            for axes, ratio in zip(axes_row, RS_RATIOS, strict=True):
                some = [r for r in group if nearest_ratio(r) == ratio]
                # A sample's points overlap.
                panel(axes, some, size=110 if len(some) <= 60 else 40)
                style.panel_title(axes, f"Rs {ratio:g} of nameplate{text}")
            axes_row[0].set_ylabel("load, % of rated")
        for axes in all_axes[-1]:
            axes.set_xlabel("speed, min⁻¹")
        handles, labels = legend()
        drawn.legend(handles, labels, loc="outside lower center", ncols=len(labels))
        drawn.suptitle(title(config, rows), x=0.01, ha="left", fontsize=11)
        path.write_bytes(style.png(drawn, WIDTH_PX))


def write_html(path: Path, config: str, rows: Rows) -> None:
    """The same, to point at: every number of a point appears under the mouse.

    Of a very large sample every n-th point; the figures of the title are those of all.
    """
    from plotly.subplots import make_subplots

    every = -(-len(rows) // MOST_IN_PAGE)
    groups = _groups(rows[::every])
    heading = title(config, rows) + (f"; one point in {every} is drawn" if every > 1 else "")
    names = [f"Rs {ratio:g} of nameplate{text}" for text in groups for ratio in RS_RATIOS]
    page = make_subplots(len(groups), len(RS_RATIOS), subplot_titles=names, shared_yaxes=True)
    known: set[str] = set()
    for k, group in enumerate(groups.values(), start=1):
        for column, ratio in enumerate(RS_RATIOS, start=1):
            some = [r for r in group if nearest_ratio(r) == ratio]
            for trace in _traces(some, known):
                page.add_trace(trace, row=k, col=column)
    page.update_xaxes(
        title="speed, min⁻¹",
        tickvals=list(range(len(SPEEDS_RPM))),
        ticktext=[f"{s:g}" for s in SPEEDS_RPM],
        range=[-0.6, len(SPEEDS_RPM) - 0.4],
    )
    page.update_yaxes(
        tickvals=list(range(len(LOADS_PU))), ticktext=[f"{100 * p:g}" for p in LOADS_PU]
    )
    page.update_layout(
        title=heading,
        template="plotly_white",
        height=360 * len(groups) + 160,
        legend={"orientation": "h", "y": -0.25 / len(groups)},
    )
    page.write_html(path, include_plotlyjs=True, full_html=True, div_id="atlas")


def nearest_ratio(row: dict[str, Any]) -> float:
    return min(RS_RATIOS, key=lambda ratio: abs(np.log(row["rs_ratio"] / ratio)))


def _groups(rows: Rows) -> dict[str, list[dict[str, Any]]]:
    """Rows of panels: by Rr and M where they take a few values; a sample has one row."""
    found: dict[str, list[dict[str, Any]]] = {}
    sample = rows[0]["map"] == "random"
    for row in rows:
        text = ""
        if not sample and row["rr_ratio"] != 1.0:
            text += f", Rr {row['rr_ratio']:g}"
        if not sample and row["m_ratio"] != 1.0:
            text += f", M {row['m_ratio']:g}"
        found.setdefault(text, []).append(row)
    return found


def _place(rows: Rows) -> tuple[Any, Any]:
    """Position in lines of the grid: every line of the map gets the same room."""
    speed = np.interp([r["speed_rpm"] for r in rows], SPEEDS_RPM, range(len(SPEEDS_RPM)))
    load = np.interp([r["load_pu"] for r in rows], LOADS_PU, range(len(LOADS_PU)))
    return speed, load


def panel(axes: Any, rows: Rows, size: int) -> None:
    """The points of one Rs ratio: a marker per class, a dot on the silent ones."""
    for outcome, (colour, marker, _, _) in LOOK.items():
        some = [r for r in rows if r["outcome"] == outcome]
        axes.scatter(*_place(some), s=size, c=colour, marker=marker, edgecolors="none", zorder=2)
    silent = [r for r in rows if r["silent"]]
    axes.scatter(*_place(silent), s=9, c="#111111", marker="o", zorder=3)
    axes.set_xticks(range(len(SPEEDS_RPM)), [f"{s:g}" for s in SPEEDS_RPM])
    axes.set_yticks(range(len(LOADS_PU)), [f"{100 * p:g}" for p in LOADS_PU])
    axes.set_xlim(-0.6, len(SPEEDS_RPM) - 0.4)
    axes.set_ylim(-0.6, len(LOADS_PU) - 0.4)


def legend() -> tuple[list[Any], list[str]]:
    """Handles and texts: every class, and silent."""
    from matplotlib.lines import Line2D

    def key(marker: str, colour: str, size: float) -> Line2D:
        return Line2D([], [], marker=marker, color=colour, linestyle="none", markersize=size)

    handles = [key(marker, colour, 9.0) for colour, marker, _, _ in LOOK.values()]
    texts = [text for *_, text in LOOK.values()]
    return [*handles, key("o", "#111111", 3.5)], [*texts, SILENT]


def _traces(rows: Rows, known: set[str]) -> list[Any]:
    """One trace per class and one for silent, each once in the legend."""
    from plotly.graph_objects import Scatter

    def trace(name: str, some: Rows, marker: dict[str, Any], hover: bool) -> Scatter:
        first = name not in known
        known.add(name)
        x, y = _place(some)
        return Scatter(
            x=x,
            y=y,
            name=name,
            legendgroup=name,
            showlegend=first,
            mode="markers",
            marker=marker,
            text=[_hover(r) for r in some] if hover else None,
            hoverinfo="text" if hover else "skip",
        )

    found = []
    for outcome, (colour, _, symbol, text) in LOOK.items():
        some = [r for r in rows if r["outcome"] == outcome]
        if some:
            found.append(trace(text, some, {"color": colour, "symbol": symbol, "size": 14}, True))
    silent = [r for r in rows if r["silent"]]
    if silent:
        found.append(trace(SILENT, silent, {"color": "#111111", "size": 4}, False))
    return found


def _hover(row: dict[str, Any]) -> str:
    shown = {k: v for k, v in row.items() if k != "map" and v is not None}
    return "<br>".join(
        f"{key}: {value:.4g}" if isinstance(value, float) else f"{key}: {value}"
        for key, value in shown.items()
    )
