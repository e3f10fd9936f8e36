"""Maps: the verdict over a plane of operating points, one panel per true Rs."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from zerohertz.stability import plane
from zerohertz.stability.command import Request
from zerohertz.stability.firmware import Firmware, Real
from zerohertz.stability.linear import ORIENTED, VERDICTS, Modes, analyse
from zerohertz.stability.loop import Bench, Loop
from zerohertz.stability.picture import Map, Panel

_JSON_NAMES = ("oriented", "stable_not_oriented", "unstable", "no_equilibrium")


def count(asked: Request) -> int:
    x, y = axes(asked)
    return len(x) * len(y) * len(asked.rs_ratios)


def axes(asked: Request) -> tuple[Real, Real]:
    """x in Hz or min^-1, y in % of rated torque."""
    if asked.plane == "speed":
        return np.array(plane.SPEEDS_RPM), 100.0 * np.array(plane.LOADS_PU)
    n, m = asked.cells
    top = 100.0 * asked.torque_pu
    return np.linspace(-asked.frequency_Hz, asked.frequency_Hz, n), np.linspace(-top, top, m)


def make(fw: Firmware, asked: Request, progress: Callable[[int], None]) -> Map:
    """Every panel of the map."""
    x, y = axes(asked)
    columns, rows = (a.ravel() for a in np.meshgrid(x, y))
    torque = rows / 100.0 * plane.RATED_TORQUE_NM
    even = asked.plane == "frequency"
    if even:
        omega = plane.speed_for_frequency(fw, columns, torque)
    else:
        omega = plane.omega_from_rpm(fw, columns)
    slip_Hz = -plane.speed_for_frequency(fw, np.zeros(len(y)), y / 100.0 * plane.RATED_TORQUE_NM)
    panels = []
    for k, ratio in enumerate(asked.rs_ratios):
        # The frequency plane shows air-gap torque: friction would only shift it.
        truth = plane.Truth(
            rs_ratio=ratio,
            rr_ratio=asked.rr_ratio,
            m_ratio=asked.m_ratio,
            leakage_ratio=asked.leakage_ratio,
            coulomb_Nm=0.0 if even else 0.4,
            rs_hat_pu=asked.rs_hat,
        )
        exact, true = plane.points_of(fw, omega, torque, truth)
        done = k * len(exact)
        modes = analyse(Loop(fw, Bench()), exact, true, lambda n, done=done: progress(done + n))
        share = 100.0 * np.mean(modes.verdict == ORIENTED)
        title = f"true Rs {ratio:g}: {share:.0f} % oriented"
        panels.append(Panel(title, modes, slip_Hz / (2.0 * np.pi) if even else None))
    x_label = "stator frequency, error-free, Hz" if even else "speed, min⁻¹"
    y_label = "torque, % of rated" if even else "load, % of rated"
    return Map(_title(fw, asked), x_label, y_label, x, y, even, tuple(panels))


def _title(fw: Firmware, asked: Request) -> str:
    off = {"Rr": asked.rr_ratio, "M": asked.m_ratio, "leakage": asked.leakage_ratio}
    wrong = [f"true {name} {ratio:g}" for name, ratio in off.items() if ratio != 1.0]
    if asked.rs_hat is not None:
        used = f"Rs in use {asked.rs_hat:g} of the true"
    elif fw.rs_measured:
        used = f"Rs in use {fw.rs_bias:g} of the true"
    else:
        used = "Rs in use the nameplate's"
    gain = "L from the table" if np.any(fw.table.l1_per_s) else "L = 0"
    flux = ["flux steered"] if fw.steering.min_rad_s > 0.0 else []
    return ", ".join([asked.config, gain, f"phi {fw.phi_factor:g}", used, *flux, *wrong])


def table(shown: Map) -> list[str]:
    """Lines for the terminal: how many points of each verdict."""
    lines = [shown.title, f"{'':10s}" + "".join(f"{name:>22s}" for name in VERDICTS)]
    for panel in shown.panels:
        share = 100.0 * np.bincount(panel.modes.verdict, minlength=len(VERDICTS))
        share /= len(panel.modes.verdict)
        name = panel.title.partition(":")[0].removeprefix("true ")
        lines.append(f"{name:10s}" + "".join(f"{value:20.1f} %" for value in share))
    return lines


def as_json(shown: Map, asked: Request) -> dict[str, Any]:
    return {
        "config": asked.config,
        "title": shown.title,
        "plane": asked.plane,
        "x": shown.x.tolist(),
        "y_pct": shown.y.tolist(),
        "verdicts": list(_JSON_NAMES),
        "panels": [
            {"rs_ratio": ratio, **_counts(panel.modes), **_fields(shown, panel.modes)}
            for ratio, panel in zip(asked.rs_ratios, shown.panels, strict=True)
        ],
    }


def _counts(modes: Modes) -> dict[str, int]:
    counts = np.bincount(modes.verdict, minlength=len(VERDICTS))
    return {"points": len(modes.verdict)} | dict(
        zip(_JSON_NAMES, (int(n) for n in counts), strict=True)
    )


def _fields(shown: Map, modes: Modes) -> dict[str, Any]:
    """Rows of y, columns of x; null where there is no equilibrium."""
    found: dict[str, Any] = {"verdict": shown.grid(modes.verdict).tolist()}
    for name in ("growth_per_s", "frequency_Hz", "damping", "angle_err_deg", "magnitude_err_pu"):
        rounded = np.round(np.asarray(getattr(modes, name), dtype=float), 5)
        values = np.where(np.isfinite(rounded), rounded, None)
        found[name] = shown.grid(values).tolist()
    return found
