"""What each feature is worth: each alone, added or taken away, as data for `zh atlas --features`.

A recipe is a configuration with firmware parameters changed. `reason` is what the table in
tools/docs/features.md says about it; numbers stay out of it: they are the table's.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

from zerohertz.errors import UserError

KEPT, DROPPED, REFERENCE = "kept", "dropped", "reference"


@dataclasses.dataclass(frozen=True)
class Recipe:
    """One row of the table."""

    name: str
    group: str
    verdict: str  # of what the recipe tries
    reason: str
    config: str = "recommended"
    firmware: Mapping[str, float] = dataclasses.field(default_factory=dict)
    scaled: Mapping[str, float] = dataclasses.field(default_factory=dict)  # of the configuration's
    table: str | None = None  # another folder of gain_tables
    design_Rs_ratio: float = 1.0  # the table designed anew for this Rs over the nameplate's

    def overrides(self) -> str:
        """What differs from the configuration, for the reader."""
        parts = [f"{name} = {value:g}" for name, value in self.firmware.items()]
        parts += [f"{name} x {factor:g}" for name, factor in self.scaled.items()]
        if self.table:
            parts.append(f"table {self.table}")
        if self.design_Rs_ratio != 1.0:
            parts.append(f"table designed for Rs x {self.design_Rs_ratio:g}")
        return ", ".join(parts) or "nothing"


_WITHOUT = {
    "rs_measure": 0,
    "dead_time_identify": 0,
    "rs_track_gain": 0.0,
    "steer_min_Hz": 0.0,
    "lost_action": 0,
}


def _only(*names: str, **values: float) -> dict[str, float]:
    """None of the features but those named, which stay as the configuration has them."""
    return {k: v for k, v in _WITHOUT.items() if k not in names} | values


def _leak(mode: int, c: float) -> dict[str, float]:
    return {"eps1_mode": mode, "eps1_unit": 0, "eps1": c}


_ADDED = "One more at a time"
_MINUS = "All but one"
_GAINS = "Other gain tables, all other features on"
_EPS1 = "eps1 leak, all other features on: no form of it gains anything"
_TUNING = "Neighbours in tuning: the choice is not sharp"

RECIPES: tuple[Recipe, ...] = (
    Recipe("no_gain", _ADDED, REFERENCE, "L = 0, nameplate Rs, no features", "no_gain"),
    Recipe("paper", _ADDED, REFERENCE, "the paper's law and tuning, no features", "paper"),
    Recipe(
        "no_gain_rs",
        _ADDED,
        REFERENCE,
        "L = 0 with measured Rs: the measurement alone does most",
        "no_gain",
        {"rs_measure": 1, "rs_bias": 1.02},
    ),
    Recipe(
        "pr",
        _ADDED,
        KEPT,
        "exactly positive real gains and phi; dead time ends map ii at the start",
        firmware=_only(),
    ),
    Recipe(
        "pr_rs_100",
        _ADDED,
        DROPPED,
        "Rs as measured; unknown dead time ends map ii in VOLTAGE_SENSOR",
        firmware=_only("rs_measure", rs_bias=1.0),
    ),
    Recipe(
        "pr_rs_102",
        _ADDED,
        KEPT,
        "2 % high; steering brings back the orientation that it costs",
        firmware=_only("rs_measure", rs_bias=1.02),
    ),
    Recipe(
        "pr_rs_105",
        _ADDED,
        DROPPED,
        "5 % high: the orientation suffers",
        firmware=_only("rs_measure", rs_bias=1.05),
    ),
    Recipe(
        "dead_time",
        _ADDED,
        KEPT,
        "and the inverter's loss, from the same measurement: duty and sensors agree",
        firmware=_only("rs_measure", "dead_time_identify"),
    ),
    Recipe(
        "steering",
        _ADDED,
        KEPT,
        "and a lower flux keeps the stator frequency away from zero",
        firmware=_only("rs_measure", "dead_time_identify", "steer_min_Hz"),
    ),
    Recipe(
        "tracking",
        _ADDED,
        KEPT,
        "and Rs tracked while running: holds the drift",
        firmware=_only("rs_measure", "dead_time_identify", "steer_min_Hz", "rs_track_gain"),
    ),
    Recipe(
        "recommended",
        _ADDED,
        KEPT,
        "and I-f operation when lost, a net that nothing here falls into: all of them",
    ),
    Recipe("no_phi", _MINUS, KEPT, "without the adaptation angle", firmware={"phi_factor": 0.0}),
    Recipe("no_steering", _MINUS, KEPT, "without steering", firmware={"steer_min_Hz": 0.0}),
    Recipe("no_tracking", _MINUS, KEPT, "without Rs tracking", firmware={"rs_track_gain": 0.0}),
    Recipe(
        "no_measurement",
        _MINUS,
        KEPT,
        "neither Rs nor the inverter measured at start: VOLTAGE_SENSOR where there is dead time",
        firmware={"rs_measure": 0, "dead_time_identify": 0},
    ),
    Recipe(
        "no_dead_time",
        _MINUS,
        KEPT,
        "Rs measured, no dead-time compensation: VOLTAGE_SENSOR where there is dead time",
        firmware={"dead_time_identify": 0},
    ),
    Recipe(
        "told_dead_time",
        _MINUS,
        DROPPED,
        "dead time by its data sheet instead of measured: as good where there is one",
        firmware={"dead_time_identify": 0, "dead_time_fraction": 1.0},
    ),
    Recipe(
        "euler",
        _MINUS,
        KEPT,
        "the paper's Euler observer: holds as much here; second order is more exact at speed",
        firmware={"observer_method": 0},
    ),
    Recipe(
        "slow_speed_loop",
        _MINUS,
        KEPT,
        "one bandwidth of the speed loop at all speeds",
        firmware={"speed_fast_bandwidth_rad_s": 0.0},
    ),
    Recipe("told_only", _MINUS, KEPT, "a loss is only told", firmware={"lost_action": 0}),
    Recipe(
        "lost_is_fault",
        _MINUS,
        DROPPED,
        "a loss is a fault: no better here, and the load falls",
        firmware={"lost_action": 1},
    ),
    Recipe(
        "L_0",
        _GAINS,
        DROPPED,
        "no gain: with the voltage from the duty it loses points",
        firmware={"observer_gain_enable": 0},
    ),
    Recipe(
        "gamma_pr",
        _GAINS,
        DROPPED,
        "the LMI design of the paper: loses points of the drift",
        table="hasegawa2005",
    ),
    Recipe(
        "pole_shift",
        _GAINS,
        DROPPED,
        "the table of configuration paper: loses a seventh of the maps",
        table="hasegawa2005_paper",
    ),
    Recipe(
        "vertex_low",
        _GAINS,
        DROPPED,
        "closed form for an Rs vertex: nothing to gain",
        design_Rs_ratio=0.8,
    ),
    Recipe("vertex_high", _GAINS, DROPPED, "the other vertex: likewise", design_Rs_ratio=1.25),
    *(
        Recipe(
            f"eps1_{when}_{c}",
            _EPS1,
            DROPPED,
            f"c = {c} 1/(s Wb A), {when.replace('_', ' ')}",
            firmware=_leak(mode, float(c)),
        )
        for when, mode in (("always", 1), ("near_zero", 2))
        for c in (8, 40)
    ),
    *(
        Recipe(f"{name}_x{factor:g}", _TUNING, DROPPED, f"{what}", scaled={name: factor})
        for name, what, factors in (
            ("steer_min_Hz", "distance that steering keeps", (0.67, 1.4)),
            ("rs_track_gain", "speed of the tracking", (0.33, 3.0)),
            ("adapt_kp", "adaptation", (0.5, 2.0)),
            ("adapt_ki", "adaptation", (0.5, 2.0)),
        )
        for factor in factors
    ),
    Recipe(
        "rs_bias_100",
        _TUNING,
        DROPPED,
        "Rs as measured: as good with all features on, not without",
        firmware={"rs_bias": 1.0},
    ),
    Recipe(
        "rs_bias_105",
        _TUNING,
        DROPPED,
        "5 % high: the orientation suffers",
        firmware={"rs_bias": 1.05},
    ),
)


def recipes(names: Sequence[str] = ()) -> tuple[Recipe, ...]:
    """All, or those named, in the order of the table."""
    known = {recipe.name for recipe in RECIPES}
    for name in names:
        if name not in known:
            raise UserError(
                f"--features: '{name}' is unknown; known are {', '.join(sorted(known))}"
            )
    return tuple(r for r in RECIPES if not names or r.name in names)
