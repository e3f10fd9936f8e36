"""Pictures of a gain table: root loci like Fig. 4 of the paper, and gamma over speed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FormatStrFormatter, LogLocator, NullLocator

from zerohertz.check import loci

MOTOR_COLOUR, OBSERVER_COLOUR, FLOOR_COLOUR = "#4c72b0", "#c44e52", "#8c8c8c"
_STYLE = {"font.size": 9, "axes.grid": True, "grid.color": "#e4e4e4", "axes.axisbelow": True}


def figure_4(motor_json: Path | str, path: Path | str) -> None:
    """Root loci of motor and observer from standstill to the table's end, upper half plane.

    In the paper's real notation poles come in conjugate pairs; the upper one of each is drawn.
    """
    table = loci.read(motor_json)
    speeds = table.speeds_elec_per_min
    with mpl.rc_context(_STYLE):
        figure = Figure(figsize=(7.0, 4.2), layout="constrained")
        axes = figure.add_subplot()
        _locus(axes, speeds, table.motor_poles, MOTOR_COLOUR, "o", "motor")
        _locus(axes, speeds, table.observer_poles, OBSERVER_COLOUR, "s", "observer")
        axes.set_xlabel("real part [1/s]")
        axes.set_ylabel("imaginary part [rad/s]")
        axes.set_title(
            f"{table.motor} ({table.method}): poles, 0 to {speeds[-1]:.0f} elec. "
            f"min$^{{-1}}$, a mark every {loci.MARKED_ELEC_PER_MIN}",
            fontsize=9,
        )
        axes.axhline(0.0, color="#606060", linewidth=0.8)
        axes.legend(loc="upper left", frameon=False)
        _save(figure, path)


def figure_gamma(motor_json: Path | str, path: Path | str) -> None:
    """gamma over speed, with the floor that no gain can go below, and the angle 2 atan(gamma)."""
    table = loci.read(motor_json)
    speeds = table.speeds_elec_per_min
    with mpl.rc_context(_STYLE):
        figure = Figure(figsize=(7.0, 3.6), layout="constrained")
        axes = figure.add_subplot()
        axes.semilogy(speeds, table.gamma, color=OBSERVER_COLOUR, label="proven for the table")
        axes.semilogy(speeds, table.floor, "--", color=FLOOR_COLOUR, label="floor for any gain")
        axes.set_xlim(0.0, speeds[-1])
        axes.set_xlabel("electrical speed [min$^{-1}$]")
        axes.set_ylabel("gamma [1]")
        axes.set_title(
            f"{table.motor} ({table.method}): gamma for speed errors up to "
            f"{table.dw0_rad_s:g} rad/s (electrical)",
            fontsize=9,
        )
        angle = axes.secondary_yaxis("right", functions=(loci.degrees, _gamma_of_degrees))
        angle.set_ylabel("orientation error bound 2 atan(gamma) [deg]")
        for axis in (axes.yaxis, angle.yaxis):
            axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            axis.set_major_formatter(FormatStrFormatter("%g"))
            axis.set_minor_locator(NullLocator())
        axes.legend(loc="upper right", frameon=False)
        _save(figure, path)


def _locus(
    axes: Any, speeds: np.ndarray, poles: np.ndarray, colour: str, marker: str, label: str
) -> None:
    marked = np.flatnonzero(np.isclose(speeds % loci.MARKED_ELEC_PER_MIN, 0.0))
    for column in range(2):
        real, imag = poles[:, column].real, np.abs(poles[:, column].imag)
        axes.plot(
            real,
            imag,
            color=colour,
            marker=marker,
            markersize=4,
            clip_on=False,
            zorder=3,
            markevery=list(marked),
            linewidth=1.4,
            label=label if column == 0 else None,
        )


def _gamma_of_degrees(angle_deg: np.ndarray) -> np.ndarray:
    return np.tan(np.radians(angle_deg) / 2.0)


def _save(figure: Figure, path: Path | str) -> None:
    Path(path).parent.mkdir(parents=True, exist_ok=True)
    # Without a date the same table gives the same file.
    metadata = {"Software": None} if str(path).endswith(".png") else {"Date": None}
    figure.savefig(path, dpi=150, metadata=metadata)
