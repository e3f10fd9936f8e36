"""A dwell at zero stator frequency to look at: speed, flux angle, frequency and Rs over time."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from zerohertz import sim
from zerohertz.atlas.zero_hertz import MEAN_S
from zerohertz.report import style


def write_png(path: Path, row: dict[str, Any], record: sim.Record) -> None:
    """From two seconds before t = 0 of the experiment on."""
    on = record.t_s > -2.0
    t_s = record.t_s[on]
    rows = max(1, round(MEAN_S / float(np.median(np.diff(record.t_s)))))
    mean_Hz = np.convolve(record["f_s_Hz"][on], np.ones(rows) / rows, "same")
    panels = (
        ("min⁻¹", (("true speed", "speed_rpm"), ("estimated", "speed_hat_rpm"))),
        ("flux angle\nerror, deg", (("estimated - true", "flux_angle_err_deg"),)),
        ("stator\nfrequency, Hz", (("true", "f_s_Hz"),)),
        ("Rs, ohm", (("true", "Rs_true_ohm"), ("in use", "Rs_hat_ohm"))),
        ("torque, Nm", (("of the motor", "torque_Nm"),)),
    )
    with style.figure(9.5, 8.0) as drawn:
        every = drawn.subplots(len(panels), 1, sharex=True)
        for axes, (label, lines) in zip(every, panels, strict=True):
            for name, column in lines:
                axes.plot(t_s, record[column][on], linewidth=0.7, label=name)
            if label.startswith("stator"):
                axes.plot(t_s, mean_Hz, linewidth=1.2, label="mean of 10 s")
            axes.set_ylabel(label)
            axes.legend(loc="upper right", fontsize=7)
        every[-1].set_xlabel("s")
        drawn.suptitle(
            f"Zero stator frequency at {row['speed_rpm']:g} min⁻¹, kept there by the load",
            x=0.01, ha="left", fontsize=10,
        )  # fmt: skip
        drawn.savefig(path, dpi=110)
