"""Linear verdicts against the time domain: the rows of an atlas (tools/zerohertz/atlas)."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from zerohertz.errors import UserError
from zerohertz.stability import plane
from zerohertz.stability.firmware import Firmware, Real
from zerohertz.stability.linear import ORIENTED, VERDICTS, Modes, analyse
from zerohertz.stability.loop import Bench, Loop

_NEEDED = (
    "speed_rpm load_pu rs_ratio rr_ratio m_ratio leakage_ratio knee_Wb drift_pu J_kg_m2 coulomb_Nm "
    "gain_u gain_v gain_w gain_uv gain_vw started outcome"
).split()


@dataclasses.dataclass(frozen=True)
class Comparison:
    """Both verdicts on the points both judge."""

    points: int  # in the atlas
    judged: int  # by both
    not_started: int  # the run never came to the point
    not_linear: int  # saturation or drift: not this model's machine
    agree: int
    rows: list[dict[str, Any]]  # the points on which they differ

    @property
    def agreement(self) -> float:
        return self.agree / self.judged if self.judged else float("nan")


def read(path: Path) -> dict[str, npt.NDArray[Any]]:
    """The columns of an atlas; UserError when there is none."""
    try:
        import pyarrow.parquet
    except ImportError:
        raise UserError("--compare: pyarrow is missing; run tools/zh setup") from None
    if not path.is_file():
        raise UserError(f"--compare: {path}: no such file; name an atlas.parquet of zh atlas")
    try:
        table = pyarrow.parquet.read_table(path)
    except (OSError, ValueError) as error:
        text = str(error).splitlines()[0]
        raise UserError(f"--compare: {path}: {text}; name an atlas.parquet of zh atlas") from None
    missing = [name for name in _NEEDED if name not in table.column_names]
    if missing:
        raise UserError(f"--compare: {path}: column {missing[0]} is missing; run zh atlas anew")
    return {name: np.array(table[name].to_pylist()) for name in _NEEDED}


def compare(
    fw: Firmware,
    rows: dict[str, npt.NDArray[Any]],
    progress: Callable[[int], None] | None = None,
) -> Comparison:
    """Linear `oriented` against the atlas' `oriented`."""
    linear = (rows["knee_Wb"] == 0.0) & (rows["drift_pu"] == 0.0)
    started = rows["started"].astype(bool)
    some = {name: values[linear & started] for name, values in rows.items()}
    modes = _judge(fw, some, progress)
    ours, theirs = modes.verdict == ORIENTED, some["outcome"] == "oriented"
    return Comparison(
        points=len(started),
        judged=len(theirs),
        not_started=int(np.sum(linear & ~started)),
        not_linear=int(np.sum(~linear)),
        agree=int(np.sum(ours == theirs)),
        rows=[_row(some, modes, int(k)) for k in np.flatnonzero(ours != theirs)],
    )


def truth_of(rows: dict[str, npt.NDArray[Any]]) -> plane.Truth:
    """What a row of the atlas says of motor, shaft and sensors."""
    g = {name: rows[f"gain_{name}"] for name in ("u", "v", "w", "uv", "vw")}
    return plane.Truth(
        **{name: rows[name] for name in ("rs_ratio", "rr_ratio", "m_ratio", "leakage_ratio")},
        J_kg_m2=rows["J_kg_m2"],
        coulomb_Nm=rows["coulomb_Nm"],
        current_gain=plane.current_gain(g["u"], g["v"], g["w"]),
        voltage_gain=plane.voltage_gain(g["uv"], g["vw"]),
        rs_sensed_pu=plane.sensed_rs(g["u"], g["v"], g["w"], g["uv"]),
    )


def _judge(
    fw: Firmware, rows: dict[str, npt.NDArray[Any]], progress: Callable[[int], None] | None
) -> Modes:
    omega: Real = plane.omega_from_rpm(fw, rows["speed_rpm"])
    load = rows["load_pu"] * plane.RATED_TORQUE_NM
    exact, true = plane.points_of(fw, omega, load, truth_of(rows))
    return analyse(Loop(fw, Bench()), exact, true, progress)


def _row(rows: dict[str, npt.NDArray[Any]], modes: Modes, k: int) -> dict[str, Any]:
    def number(value: float) -> float | None:
        return round(float(value), 4) if np.isfinite(value) else None

    return {
        **{name: number(rows[name][k]) for name in ("speed_rpm", "load_pu", "rs_ratio")},
        "atlas": str(rows["outcome"][k]),
        "linear": VERDICTS[modes.verdict[k]],
        "growth_per_s": number(modes.growth_per_s[k]),
        "angle_err_deg": number(modes.angle_err_deg[k]),
        "stator_frequency_Hz": number(modes.stator_frequency_Hz[k]),
    }
