"""What entrants are compared by: a number each, which way is better, and its scatter."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any

from zerohertz.arena.measure import MAPS
from zerohertz.arena.scatter import interval
from zerohertz.sim import NOT_FINITE, TOO_SLOW

Found = Mapping[str, Mapping[str, Any]]
UNFIT_SHARE = 0.01  # of all points and runs: more that ended by NaN or by CPU time are no chance
MAP_TEXT = {
    "map_i": "map i (ideal inverter)",
    "map_ii": "map ii (dead time)",
    "drift": "drift (Rs +20 %)",
}


@dataclasses.dataclass(frozen=True)
class Measure:
    """One column: how to find its number, which way is better, and how to print it."""

    name: str
    value: Callable[[Mapping[str, Any]], float | None]
    more_is_better: bool
    unit: str = ""
    digits: int = 0
    runs: str = ""  # of the envelope: the statistic of scatter.py

    def better(self, a: float | None, b: float | None) -> bool:
        """Whether a beats b; who has no number beats nobody."""
        if a is None or b is None:
            return False
        return a > b if self.more_is_better else a < b

    def shown(self, value: float | None) -> str:
        return "-" if value is None else f"{value:.{self.digits}f}{self.unit}"

    def with_interval(self, found: Mapping[str, Any]) -> str:
        """The number, and in brackets where 95 % of such samples have it, in percent."""
        value, runs = self.value(found), found.get("envelope", {}).get("rows")
        if value is None or not runs or not self.runs:
            return self.shown(value)
        low, high = interval(runs, self.runs)
        return f"{self.shown(value)} ({100.0 * low:.1f} to {100.0 * high:.1f} %)"


def _map_measure(name: str, key: str) -> Callable[[Mapping[str, Any]], float | None]:
    def value(found: Mapping[str, Any]) -> float | None:
        counted = found.get("maps", {}).get(name)
        return None if counted is None else 100.0 * counted[key] / counted["points"]

    return value


def _envelope_measure(key: str, part: str | None) -> Callable[[Mapping[str, Any]], float | None]:
    def value(found: Mapping[str, Any]) -> float | None:
        counted = found.get("envelope", {}).get(key)
        number = counted if part is None or counted is None else counted[part]
        return 100.0 * number if number is not None and part == "share" else number

    return value


def _number(part: str, key: str) -> Callable[[Mapping[str, Any]], float | None]:
    return lambda found: found.get(part, {}).get(key)


def _ripple_percent(found: Mapping[str, Any]) -> float | None:
    ripple = found.get("envelope", {}).get("torque_ripple_p95_pu")
    return None if ripple is None else 100.0 * ripple


ENVELOPE = (
    Measure("envelope: held", _envelope_measure("held", "share"), True, " %", 1, "held"),
    Measure(
        "envelope: oriented above 1 Hz",
        _envelope_measure("oriented_above_1Hz", "share"),
        *(True, " %", 1, "oriented_above_1Hz"),
    ),
    Measure(
        "envelope: runs with undeclared harm",
        _envelope_measure("undeclared_harm", "count"),
        *(False, "", 0, "undeclared_harm"),
    ),
    Measure(
        "envelope: false trips",
        _envelope_measure("false_trips", "count"),
        *(False, "", 0, "false_trip"),
    ),
    Measure(
        "envelope: torque ripple, 95 %", _ripple_percent, False, " %", 2, "torque_ripple_p95_pu"
    ),
)
OF_MAP = {
    name: tuple(
        Measure(f"{text}: {key}", _map_measure(name, key), key != "unsafe", " %", 1)
        for key in ("oriented", "held", "unsafe")
    )
    for name, text in MAP_TEXT.items()
}
ROBUST = (*(each for of_map in OF_MAP.values() for each in of_map), *ENVELOPE)
SITUATIONS, MEAN, WORST = COST = (
    Measure("the paper's situations held, of 4", _number("figures", "score"), True),
    Measure("instructions per period, mean", _number("instructions", "mean"), False),
    Measure("instructions per period, worst", _number("instructions", "worst"), False),
)


def score(found: Mapping[str, Any]) -> float | None:
    """Percent of all points of the maps that are oriented, less the unsafe ones."""
    counted = [found["maps"][name] for name in MAPS] if "maps" in found else []
    if not counted:
        return None
    points = sum(each["points"] for each in counted)
    return 100.0 * sum(each["oriented"] - each["unsafe"] for each in counted) / points


def unfit(found: Mapping[str, Any]) -> str:
    """Why it is not ranked; empty: it is. With helpers, the estimator itself ended too much."""
    parts = {name: found.get("maps", {}).get(name, {}) for name in MAPS}
    counted = [(name, each, each.get("points", 0)) for name, each in parts.items()]
    runs = found.get("envelope", {})
    counted.append(("envelope", runs, runs.get("runs", 0)))
    said, ended = [], 0
    for name, each, of in counted:
        for cause in (TOO_SLOW, NOT_FINITE):
            if own := each.get("causes", {}).get(cause):
                ended += own["count"]
                said.append(f"{cause} at {own['first_s']:.3f} s, {name}, {own['count']} of {of}")
    return "; ".join(said) if ended > UNFIT_SHARE * sum(of for *_, of in counted) else ""


def fit(found: Found) -> Found:
    """Those that are ranked."""
    return {name: each for name, each in found.items() if not unfit(each)}


def ranked(found: Found) -> list[str]:
    """Names, the best score first; then who has none, then who is not ranked."""

    def place(name: str) -> tuple[bool, float]:
        value = score(found[name])
        return bool(unfit(found[name])), 1e9 if value is None else -value

    return sorted(found, key=place)
