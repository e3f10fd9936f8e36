"""A dwell at zero stator frequency as an animation: speed, flux angle, frequency and Rs grow."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from zerohertz import sim
from zerohertz.report import gif, style

FRAMES = 60
FRAME_S = 0.12
LAST_S = 3.0  # the complete picture, before it begins again
COLUMNS = 2400  # points of a line: more would not be seen

PANELS = (
    ("speed\nmin⁻¹", (("true", "speed_rpm"), ("estimated", "speed_hat_rpm"))),
    ("flux angle\nerror, deg", (("estimated - true", "flux_angle_err_deg"),)),
    ("stator\nfrequency, Hz", (("true", "f_s_Hz"),)),
    ("Rs, ohm", (("true", "Rs_true_ohm"), ("in use", "Rs_hat_ohm"))),
)


def write_gif(path: Path, row: dict[str, Any], record: sim.Record) -> None:
    """From two seconds before t = 0 of the experiment on; each frame shows more of it."""
    on = np.flatnonzero(record.t_s > -2.0)
    on = on[np.linspace(0, len(on) - 1, min(COLUMNS, len(on))).astype(int)]
    t_s = record.t_s[on]
    frames = []
    with style.figure(6.4, 5.2) as drawn:
        lines = _lines(drawn, t_s, record, on)
        drawn.suptitle(
            f"Zero stator frequency at {row['speed_rpm']:g} min⁻¹, kept there by the load",
            x=0.01, ha="left", fontsize=10,
        )  # fmt: skip
        for end in np.linspace(1, len(t_s), FRAMES).astype(int):
            for line, values in lines:
                line.set_data(t_s[:end], values[:end])
            drawn.canvas.draw()
            frames.append(gif.frame(drawn))
    gif.save(path, frames, FRAME_S, LAST_S)


def _lines(
    drawn: Any, t_s: NDArray[np.float64], record: sim.Record, on: NDArray[np.intp]
) -> list[tuple[Any, NDArray[Any]]]:
    """Empty lines in panels that already have the limits of the whole run."""
    found = []
    every = drawn.subplots(len(PANELS), 1, sharex=True)
    for axes, (label, asked) in zip(every, PANELS, strict=True):
        for (name, column), colour in zip(asked, (style.TRUE, style.ESTIMATE), strict=False):
            values = record[column][on]
            found.append(
                (axes.plot(t_s, values, linewidth=0.7, color=colour, label=name)[0], values)
            )
        axes.set_xlim(t_s[0], t_s[-1])
        axes.set_ylim(axes.get_ylim())
        axes.set_ylabel(label)
        axes.legend(
            loc="lower right", bbox_to_anchor=(1.0, 0.95), ncol=2, fontsize=7, borderpad=0.0
        )
    every[-1].set_xlabel("s")
    return found
