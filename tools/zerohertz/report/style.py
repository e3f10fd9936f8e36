"""One look for every plot: palette that colour-blind readers can tell apart, quiet axes, SVG.

matplotlib is imported by the functions that draw, so that `zh --help` stays quick.
"""

from __future__ import annotations

import io
import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

# Okabe and Ito's palette: the role decides the colour, in every plot.
REFERENCE = "#444444"
TRUE = "#0072B2"
ESTIMATE = "#D55E00"
FREQUENCY = "#007A5E"
LOAD = "#8A5FA8"
MUTED = "#6B7280"
GRID = "#E5E7EB"

_RC = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],  # comes with matplotlib: the same picture everywhere
    "font.size": 8.5,
    "axes.labelsize": 8.5,
    "axes.titlesize": 9.5,
    "axes.edgecolor": "#9CA3AF",
    "axes.linewidth": 0.7,
    "axes.labelcolor": "#1F2937",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": GRID,
    "grid.linewidth": 0.6,
    "xtick.color": "#4B5563",
    "ytick.color": "#4B5563",
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "xtick.major.size": 3.0,
    "ytick.major.size": 3.0,
    "legend.frameon": False,
    "legend.fontsize": 8.0,
    "lines.linewidth": 1.0,
    "figure.facecolor": "white",
    "svg.fonttype": "path",
    "svg.hashsalt": "zerohertz",  # the same run gives the same bytes
    "path.simplify_threshold": 0.2,
}


@contextmanager
def figure(width_in: float, height_in: float) -> Iterator[Any]:
    """An empty matplotlib figure in this style."""
    import matplotlib

    matplotlib.use("Agg", force=True)
    import matplotlib.pyplot as plt

    with matplotlib.rc_context(_RC):
        drawn = plt.figure(figsize=(width_in, height_in), layout="constrained")
        try:
            yield drawn
        finally:
            plt.close(drawn)


def svg(drawn: Any) -> bytes:
    """The figure as SVG; coordinates of a hundredth of a point are enough."""
    out = io.StringIO()
    drawn.savefig(out, format="svg", metadata={"Date": None, "Creator": None})
    text = out.getvalue()
    text = text[text.index("<svg") :]
    return re.sub(r' d="[^"]*"', _rounded, text).encode()


def _rounded(path: re.Match[str]) -> str:
    return re.sub(r"(\d+\.\d\d)\d+", r"\1", path.group())


def png(drawn: Any, width_px: int) -> bytes:
    """The figure as PNG of that width, with a palette: a plot has few colours."""
    from PIL import Image

    raw = io.BytesIO()
    drawn.savefig(raw, format="png", dpi=width_px / drawn.get_figwidth())
    raw.seek(0)
    out = io.BytesIO()
    Image.open(raw).convert("RGB").quantize(128).save(out, format="PNG", optimize=True)
    return out.getvalue()


def panel_title(axes: Any, text: str) -> None:
    """What the panel shows and its unit, above its left edge: nothing to turn one's head for."""
    axes.set_title(text, loc="left", fontsize=8.5, color="#1F2937", pad=4.0)


def legend_above(axes: Any) -> None:
    """Legend on one line above the panel, outside the data."""
    axes.legend(
        loc="lower right",
        bbox_to_anchor=(1.005, 0.97),
        ncols=4,
        handlelength=1.6,
        columnspacing=1.4,
        borderaxespad=0.2,
    )
