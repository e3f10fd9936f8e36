"""The points of the atlas: what is true of motor, board and shaft in one run, and what is asked.

Standard maps are grids of speed x load x Rs; a random sample draws everything that can be wrong
at once. The firmware is told only the nameplate (simulate.py), never what stands here, but for the
board's dead time, which a data sheet gives.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np

from zerohertz.errors import UserError

SPEEDS_RPM = (0.0, 15.0, 30.0, 60.0, 120.0, 300.0, 900.0)
LOADS_PU = (-1.0, -0.66, -0.33, 0.0, 0.33, 0.66, 1.0)
RS_RATIOS = (0.67, 0.8, 1.0, 1.25, 1.5)
STANDARD = ("map_i", "map_ii", "drift")

BOARD_DEAD_TIME_S = 2e-6
NOMINAL_J_KG_M2 = 0.035
# Of the random sample: takes 13 % of the unsaturated M at rated flux (simulate.py).
SATURATION_KNEE_WB = 0.8


@dataclasses.dataclass(frozen=True)
class Point:
    """One run. Ratios are true over nameplate; load > 0 opposes positive rotation."""

    map: str
    index: int
    seed: int
    speed_rpm: float
    load_pu: float
    rs_ratio: float
    rr_ratio: float = 1.0
    m_ratio: float = 1.0
    leakage_ratio: float = 1.0
    knee_Wb: float = 0.0  # main-flux saturation; 0: none
    J_kg_m2: float = NOMINAL_J_KG_M2
    coulomb_Nm: float = 0.4
    dead_time_s: float = 0.0
    told_dead_time_s: float = 0.0
    drift_pu: float = 0.0  # Rs rises by this share ...
    drift_s: float = 1.0  # ... within this time from t = 0 on
    loaded_s: float = 5.0  # from t = 0 to the end
    judged_s: float = 2.0  # the last of it
    offset_u_A: float = 0.03
    offset_v_A: float = -0.02
    offset_w_A: float = -0.01
    gain_u: float = 1.005
    gain_v: float = 0.995
    gain_w: float = 1.0
    offset_uv_V: float = 0.0
    offset_vw_V: float = 0.0
    gain_uv: float = 1.005
    gain_vw: float = 0.995


def _grid(
    name: str, variants: tuple[dict[str, float], ...] = ({},), **common: float
) -> list[Point]:
    cells = [
        variant | {"rs_ratio": rs, "speed_rpm": speed, "load_pu": load}
        for variant in variants
        for rs in RS_RATIOS
        for speed in SPEEDS_RPM
        for load in LOADS_PU
    ]
    return [Point(map=name, index=k, seed=k + 1, **(common | cell)) for k, cell in enumerate(cells)]


def _off_by(name: str, share: float) -> tuple[dict[str, float], ...]:
    return ({name: 1.0 - share}, {name: 1.0 + share})


_MAPS: dict[str, Callable[[], list[Point]]] = {
    "map_i": lambda: _grid("map_i"),
    "map_ii": lambda: _grid(
        "map_ii", dead_time_s=BOARD_DEAD_TIME_S, told_dead_time_s=BOARD_DEAD_TIME_S
    ),
    "drift": lambda: _grid("drift", drift_pu=0.2, drift_s=60.0, loaded_s=70.0, judged_s=5.0),
    "rr": lambda: _grid("rr", _off_by("rr_ratio", 0.3)),
    "m": lambda: _grid("m", _off_by("m_ratio", 0.15)),
}
_SHORT = {"i": "map_i", "ii": "map_ii"}


def standard_map(name: str) -> list[Point]:
    """The points of a map by its name; `i` and `ii` are short for map_i and map_ii."""
    full = _SHORT.get(name, name)
    if full not in _MAPS:
        raise UserError(f"--map: '{name}': no such map; known are i, ii, drift, rr, m")
    return _MAPS[full]()


def random_sample(count: int, seed: int, loaded_s: float = 12.0) -> list[Point]:
    """Points off the grid with every error at once.

    Speed, load and Rs are drawn as dense as the map has them: evenly between neighbouring lines of
    the grid, so that low speeds keep their weight. Point k is the same for every count.
    """
    return [_random_point(k, np.random.default_rng((seed, k)), loaded_s) for k in range(count)]


def _random_point(index: int, rng: np.random.Generator, loaded_s: float) -> Point:
    def between(lines: tuple[float, ...]) -> float:
        return float(np.interp(rng.uniform(0.0, len(lines) - 1.0), range(len(lines)), lines))

    def about(centre: float, width: float) -> float:
        return float(rng.uniform(centre - width, centre + width))

    return Point(
        map="random",
        index=index,
        seed=int(rng.integers(1, 2**32)),
        speed_rpm=between(SPEEDS_RPM),
        load_pu=between(LOADS_PU),
        rs_ratio=between(RS_RATIOS),
        rr_ratio=about(1.0, 0.2),
        m_ratio=about(1.0, 0.08),
        leakage_ratio=about(1.0, 0.15),
        knee_Wb=SATURATION_KNEE_WB,
        J_kg_m2=float(rng.uniform(0.6, 1.6)) * NOMINAL_J_KG_M2,
        coulomb_Nm=float(rng.uniform(0.0, 0.3)),
        dead_time_s=float(rng.uniform(1.5e-6, 2.5e-6)),
        told_dead_time_s=BOARD_DEAD_TIME_S,
        drift_pu=float(rng.uniform(0.0, 0.05)),
        drift_s=8.0,
        loaded_s=loaded_s,
        judged_s=min(2.0, 0.25 * loaded_s),
        **{name: about(0.0, 0.03) for name in ("offset_u_A", "offset_v_A", "offset_w_A")},
        **{name: about(0.0, 0.05) for name in ("offset_uv_V", "offset_vw_V")},
        **{
            name: about(1.0, 0.005) for name in ("gain_u", "gain_v", "gain_w", "gain_uv", "gain_vw")
        },
    )
