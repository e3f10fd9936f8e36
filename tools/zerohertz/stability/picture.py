"""The map to look at: PNG, and a page to point at that needs no network."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np

from zerohertz.report import style
from zerohertz.stability.firmware import Real
from zerohertz.stability.linear import VERDICTS, Modes

# Okabe and Ito's palette, light enough for lines and marks above it.
COLOURS = ("#009E73", "#F0E442", "#D55E00", "#444444")
PX_PER_IN = 120
_PER_ROW = 3
_NARROWEST_IN = 7.5  # for title and legend


@dataclasses.dataclass(frozen=True)
class Panel:
    """One map: verdicts over x (columns) and torque (rows)."""

    title: str
    modes: Modes  # flat, rows of y one after the other
    standstill_x: Real | None = None  # where the shaft stands, for each y


@dataclasses.dataclass(frozen=True)
class Map:
    title: str
    x_label: str
    y_label: str
    x: Real
    y: Real
    even: bool  # False: every value of x has the same room (the atlas' speeds)
    panels: tuple[Panel, ...]

    def grid(self, values: Any) -> Any:
        return np.asarray(values).reshape(len(self.y), len(self.x))

    def places(self) -> Real:
        return self.x if self.even else np.arange(len(self.x), dtype=float)


def write_png(path: Path, shown: Map) -> None:
    columns = min(_PER_ROW, len(shown.panels))
    rows = -(-len(shown.panels) // columns)
    width_in = max(3.6 * columns + 0.4, _NARROWEST_IN)
    with style.figure(width_in, 3.0 * rows + 0.9) as drawn:
        every = drawn.subplots(rows, columns, squeeze=False, sharey=True).ravel()
        for axes, panel in zip(every, shown.panels, strict=False):
            _draw(axes, shown, panel)
        for axes in every[len(shown.panels) :]:
            axes.set_visible(False)
        handles, labels = _legend()
        drawn.legend(handles, labels, loc="outside lower center", ncols=len(labels))
        drawn.suptitle(shown.title, x=0.01, ha="left", fontsize=10)
        path.write_bytes(style.png(drawn, round(PX_PER_IN * width_in)))


def _draw(axes: Any, shown: Map, panel: Panel) -> None:
    from matplotlib.colors import BoundaryNorm, ListedColormap

    x = shown.places()
    verdicts = shown.grid(panel.modes.verdict)
    norm = BoundaryNorm(np.arange(-0.5, len(VERDICTS)), len(VERDICTS))
    axes.grid(visible=False)
    axes.pcolormesh(x, shown.y, verdicts, cmap=ListedColormap(COLOURS), norm=norm, shading="auto")
    if panel.standstill_x is not None:
        inside = (panel.standstill_x >= x[0]) & (panel.standstill_x <= x[-1])
        axes.plot(panel.standstill_x[inside], shown.y[inside], color="black", lw=0.8, ls="--")
        axes.axvline(0.0, color="black", lw=0.8)
    if not shown.even:
        axes.set_xticks(x, [f"{value:g}" for value in shown.x])
    style.panel_title(axes, panel.title)
    axes.set_xlabel(shown.x_label)
    if axes.get_subplotspec().is_first_col():
        axes.set_ylabel(shown.y_label)


def _legend() -> tuple[list[Any], list[str]]:
    from matplotlib.patches import Patch

    return [Patch(color=colour) for colour in COLOURS], list(VERDICTS)


def write_html(path: Path, shown: Map) -> None:
    """The same with the numbers of a point under the mouse."""
    from plotly.graph_objects import Heatmap
    from plotly.subplots import make_subplots

    columns = min(_PER_ROW, len(shown.panels))
    rows = -(-len(shown.panels) // columns)
    page = make_subplots(
        rows, columns, subplot_titles=[p.title for p in shown.panels], shared_yaxes=True
    )
    x = shown.x if shown.even else [f"{value:g}" for value in shown.x]
    for k, panel in enumerate(shown.panels):
        trace = Heatmap(
            x=x,
            y=shown.y,
            z=shown.grid(panel.modes.verdict),
            text=shown.grid(np.array(_hover(panel.modes), dtype=object)),
            hovertemplate="%{x}, %{y}<br>%{text}<extra></extra>",
            colorscale=_steps(),
            zmin=-0.5,
            zmax=len(VERDICTS) - 0.5,
            colorbar={"tickvals": list(range(len(VERDICTS))), "ticktext": list(VERDICTS)},
            showscale=k == 0,
        )
        page.add_trace(trace, row=k // columns + 1, col=k % columns + 1)
    page.update_xaxes(title=shown.x_label, type="linear" if shown.even else "category")
    page.update_yaxes(title=shown.y_label)
    page.update_layout(title=shown.title, template="plotly_white", height=420 * rows + 140)
    page.write_html(path, include_plotlyjs=True, full_html=True, div_id="stability")


def _steps() -> list[tuple[float, str]]:
    """A colour scale without transitions."""
    n = len(VERDICTS)
    return [(edge / n, COLOURS[k]) for k in range(n) for edge in (k, k + 1)]


def _hover(m: Modes) -> list[str]:
    texts = []
    for k, verdict in enumerate(m.verdict):
        text = f"<b>{VERDICTS[verdict]}</b>"
        if np.isfinite(m.growth_per_s[k]):
            text += (
                f"<br>dominant mode {m.growth_per_s[k]:+.2f} 1/s, {m.frequency_Hz[k]:.2f} Hz, "
                f"damping {m.damping[k]:.2f}, in {m.dominant[k]}"
                f"<br>flux {m.angle_err_deg[k]:+.1f} deg, {100 * m.magnitude_err_pu[k]:+.1f} %"
                f"<br>true: {m.speed_rpm[k]:.1f} min⁻¹, {m.stator_frequency_Hz[k]:+.2f} Hz, "
                f"{m.torque_Nm[k]:+.2f} Nm, {m.lambda_Wb[k]:.3f} Wb"
            )
        else:
            text += f"<br>lost at {100 * m.reached[k]:.0f} % of the parameter error"
        texts.append(text)
    return texts
