"""Where it breaks: what the drive does at that moment, under which load, with which settings."""

from __future__ import annotations

import dataclasses
import functools
import itertools
from collections.abc import Sequence

from zerohertz.atlas.points import BOARD_DEAD_TIME_S
from zerohertz.errors import UserError

RUNNING, STARTING, REVERSING = "running", "starting", "reversing"
COMMISSIONING, I_F, V_F = "commissioning", "i_f", "v_f"
VECTOR = (RUNNING, STARTING, REVERSING)
MODES = (*VECTOR, COMMISSIONING, I_F, V_F)
SPEEDS_RPM = (0.0, 9.0, 60.0, 300.0, 900.0, 1710.0)
ACTIVE_LOADS_PU = (-1.0, -0.5, 0.0, 0.5, 1.0)
PASSIVE = "passive"  # friction of rated torque: never drives
LOADS = (*(f"{load:+g}" for load in ACTIVE_LOADS_PU), PASSIVE)
INVERTERS = ("averaged", "switched")
VOLTAGES = ("sensors", "duty")
LOST_ACTIONS = (0, 1, 2)
COVERING = 24
AXES = ("mode", "speed_rpm", "load", "lost_action", "inverter", "voltage")


@dataclasses.dataclass(frozen=True)
class Condition:
    """Speed and active load in the positive direction; load > 0 opposes it."""

    mode: str
    speed_rpm: float
    load: str
    lost_action: int
    inverter: str
    voltage: str  # the acting voltage from the sensors or from the duty

    @property
    def name(self) -> str:
        """As it stands in the name of a case."""
        head = f"{self.mode},{self.speed_rpm:g},{self.load},la{self.lost_action}"
        return f"{head},{self.inverter},{self.voltage}"

    @property
    def load_pu(self) -> float:
        """Of the load machine."""
        return 0.0 if self.load == PASSIVE else float(self.load)

    def rig(self) -> dict[str, float | str]:
        """What the condition is to the rig; the firmware is told the dead time."""
        return {"inverter.model": self.inverter, "inverter.dead_time_s": BOARD_DEAD_TIME_S}

    def firmware(self) -> dict[str, float]:
        return {
            "lost_action": self.lost_action,
            "voltage_source": VOLTAGES.index(self.voltage),
            "control_mode": {V_F: 1, I_F: 2}.get(self.mode, 0),
            "dead_time_s": BOARD_DEAD_TIME_S,
        }


def condition_of(name: str) -> Condition:
    """From its name."""
    for condition in every_condition():
        if condition.name == name:
            return condition
    raise UserError(f"--case: {name}: no such condition; write {every_condition()[0].name}")


@functools.cache
def every_condition() -> tuple[Condition, ...]:
    """The whole grid but for what does not exist."""
    grid = itertools.product(MODES, SPEEDS_RPM, LOADS, LOST_ACTIONS, INVERTERS, VOLTAGES)
    return tuple(
        condition for condition in itertools.starmap(Condition, grid) if _exists(condition)
    )


def _exists(c: Condition) -> bool:
    if c.mode == COMMISSIONING:
        return c.speed_rpm == 0.0 and c.load in ("+0", PASSIVE) and c.lost_action == 0
    if c.mode == REVERSING and c.speed_rpm == 0.0:
        return False
    # Without an estimator there is no orientation to lose.
    return c.mode in VECTOR or c.lost_action == 0


def _pairs(c: Condition) -> set[tuple[str, object, str, object]]:
    """Every two settings that meet here."""
    values = [(axis, getattr(c, axis)) for axis in AXES]
    return {(*a, *b) for a, b in itertools.combinations(values, 2)}


@functools.cache
def covering(count: int = COVERING) -> tuple[tuple[Condition, ...], float]:
    """So many conditions that cover as many pairs of settings as a greedy choice finds.

    Also the share of all pairs that exist.
    """
    all_pairs = {c: _pairs(c) for c in every_condition()}
    wanted = set().union(*all_pairs.values())
    missing = set(wanted)
    chosen: list[Condition] = []
    while len(chosen) < count:
        best = max(all_pairs, key=lambda c: (len(all_pairs[c] & missing), c not in chosen))
        chosen.append(best)
        missing -= all_pairs[best]
    return tuple(chosen), 1.0 - len(missing) / len(wanted)


def names(conditions: Sequence[Condition]) -> str:
    return "\n".join(f"- `{c.name}`" for c in conditions)
