"""Signals over time in the terminal, sampled through the link until interrupted."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable

from zerohertz.link.client import Client

_POINTS = 400
_REDRAW_S = 0.1


def live_plot(
    client: Client, names: list[str], show: Callable[[str], None], size: tuple[int, int]
) -> None:
    """One curve per signal over the last points; `show` gets each picture as text."""
    t_s: deque[float] = deque(maxlen=_POINTS)
    values: dict[str, deque[float]] = {name: deque(maxlen=_POINTS) for name in names}
    drawn_s = 0.0
    while True:
        period, row = client.sample(names)
        t_s.append(period * client.identity.period_s)
        for name, value in zip(names, row, strict=True):
            values[name].append(float(value))
        if time.monotonic() - drawn_s >= _REDRAW_S:
            drawn_s = time.monotonic()
            show(picture(list(t_s), {n: list(v) for n, v in values.items()}, size))


def picture(t_s: list[float], values: dict[str, list[float]], size: tuple[int, int]) -> str:
    """The curves as lines of text."""
    import plotext

    plotext.clear_figure()
    plotext.plot_size(*size)
    for paint in (plotext.canvas_color, plotext.axes_color, plotext.ticks_color):
        paint("default")  # the terminal's own
    for name, column in values.items():
        plotext.plot(t_s, column, label=name)
    plotext.xlabel("s")
    return plotext.build()
