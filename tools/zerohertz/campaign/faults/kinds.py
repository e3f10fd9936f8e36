"""What breaks: every single fault of the campaign by its name.

A word of the ADC, or several, breaks by what it reads (faults.hpp says how each kind reads); the
plant breaks by a change of scenario or rig. What belongs to the rig (motor, inertia) is wrong from
the start; everything else begins when the case says so.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Mapping
from typing import Any

from zerohertz.campaign.faults.conditions import Condition
from zerohertz.campaign.rig import U_DC_V

NOTHING = "nothing"
CURRENTS, LINE_VOLTAGES = ("i_u", "i_v", "i_w"), ("u_uv", "u_vw")
# "all" scaled is a wrong reference of the ADC: bipolar words have their zero at half of it.
# name of the kind -> kind and severity as faults.hpp has them
_READS: Mapping[str, tuple[str, float | None]] = {
    "zero": ("off", None),
    "top": ("fixed", 1.0),
    "bottom": ("fixed", -1.0),
    "frozen": ("stuck", None),
    "gain_0.5": ("gain", 0.5),
    "gain_0.8": ("gain", 0.8),
    "gain_1.5": ("gain", 1.5),
    "offset_0.1": ("offset", 0.1),
    "offset_-0.1": ("offset", -0.1),
    "drift_0.03": ("drift", 0.03),
    "drift_-0.03": ("drift", -0.03),
    "noise_0.05": ("noise", 0.05),
    "late_10": ("delayed", 10.0),
    "swapped": ("exchanged", None),
}
_SINGLE = tuple(name for name in _READS if name not in ("gain_0.8", "swapped"))
_GROUP = ("zero", "frozen", "gain_0.5", "gain_0.8", "gain_1.5", "noise_0.05", "late_10")
_SLOTS = ("faults", "faults.second", "faults.third")


@dataclasses.dataclass(frozen=True)
class Change:
    """What a fault changes; load_pu: of the load, from the moment of the fault on."""

    scenario: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    rig: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    factors: Mapping[str, float] = dataclasses.field(default_factory=dict)  # on the rig's numbers
    firmware: Mapping[str, float] = dataclasses.field(default_factory=dict)
    load_pu: float | None = None

    def keys(self) -> set[str]:
        """What a second fault must not change as well."""
        own = {*self.scenario, *self.rig, *self.factors, *self.firmware}
        return own | (set() if self.load_pu is None else {"load"})


@dataclasses.dataclass(frozen=True)
class Kind:
    """One fault by its name."""

    name: str
    what: str  # the row of the page: word and kind without a number
    word: str | None = None
    change: Callable[[float, Condition], Change] | None = None  # of the plant, from this time on
    from_start: bool = False  # part of it, at least
    fits: Callable[[Condition], bool] = lambda _condition: True

    def keys(self, condition: Condition) -> set[str]:
        return set() if self.change is None else self.change(0.0, condition).keys()

    def sensor_keys(self, slot: int, at_s: float) -> dict[str, Any]:
        """Of the n-th broken sensor of a run, as keys of the scenario."""
        if self.word is None:
            return {}
        kind, severity = _READS[self.name.split(".", 1)[1]]
        at = _SLOTS[slot]
        given = {} if severity is None else {f"{at}.severity": severity}
        return {f"{at}.sensor": self.word, f"{at}.kind": kind, f"{at}.start_s": at_s} | given


def compatible(kinds: tuple[Kind, ...], condition: Condition) -> bool:
    """Each makes sense there, and no two change the same thing."""
    keys = [kind.keys(condition) for kind in kinds]
    apart = len(set().union(*keys)) == sum(map(len, keys))
    return apart and all(kind.fits(condition) for kind in kinds)


@functools.cache
def every_kind() -> Mapping[str, Kind]:
    """All of them, `nothing` first: what a drive does by itself is no fault's doing."""
    kinds = [Kind(NOTHING, NOTHING), *_words(), *_supply(), *_machine()]
    return {kind.name: kind for kind in kinds}


def _words() -> list[Kind]:
    reads = [(word, name) for word in (*CURRENTS, *LINE_VOLTAGES, "u_dc") for name in _SINGLE]
    reads += [(word, "swapped") for word in (*CURRENTS, "u_uv")]
    reads += [(group, name) for group in ("currents", "voltages", "all") for name in _GROUP]
    # A dc link has no negative word: below zero is zero.
    reads.remove(("u_dc", "bottom"))
    return [
        Kind(f"{word}.{name}", f"{word} {name.split('_')[0]}", word=word) for word, name in reads
    ]


def _supply() -> list[Kind]:
    def link(low_share: float, length_s: float) -> Callable[[float, Condition], Change]:
        def change(at_s: float, _condition: Condition) -> Change:
            low_V, back_s = low_share * U_DC_V, at_s + length_s
            line = [[0.0, U_DC_V], [at_s, U_DC_V], [at_s, low_V], [back_s, low_V]]
            return Change({"profiles.u_dc_V": [*line, [back_s, U_DC_V]]})

        return change

    return [
        Kind("sag_0.7_1s", "dc sag", change=link(0.7, 1.0)),
        Kind("sag_0.5_0.2s", "dc sag", change=link(0.5, 0.2)),
        Kind("mains_loss", "mains loss", change=link(0.0, 1e3)),
        Kind(
            "hoist", "hoist lowering without chopper", change=_hoist, from_start=True, fits=_turns
        ),
    ]


def _turns(condition: Condition) -> bool:
    return condition.speed_rpm >= 60.0


def _hoist(_at_s: float, _condition: Condition) -> Change:
    """A load that drives the shaft, and nothing to take its energy."""
    return Change(rig={"dc_link.chopper_ohm": 0.0}, firmware={"chopper_on_V": 0.0}, load_pu=-1.0)


def _load_reversal(_at_s: float, condition: Condition) -> Change:
    return Change(load_pu=-condition.load_pu if condition.load_pu else 1.0)


def _machine() -> list[Kind]:
    def open_(phase: str, length_s: float) -> Callable[[float, Condition], Change]:
        return lambda at_s, _condition: Change(
            {
                "faults.open_phase": phase,
                "faults.open_s": at_s,
                "faults.open_end_s": at_s + length_s,
            }
        )

    def earth(phase: str, ohm: float) -> Callable[[float, Condition], Change]:
        return lambda at_s, _condition: Change(
            {"faults.earth_phase": phase, "faults.earth_s": at_s, "faults.earth_ohm": ohm}
        )

    def scaled(factor: float, *names: str) -> Callable[[float, Condition], Change]:
        return lambda _at_s, _condition: Change(factors=dict.fromkeys(names, factor))

    circuit = tuple(f"motor.{name}" for name in ("Rs_ohm", "Rr_ohm", "Ls_H", "Lr_H", "M_H"))
    jam = lambda at_s, _condition: Change({"faults.jam_s": at_s})  # noqa: E731
    return [
        *(Kind(f"open_{phase}", "phase open", change=open_(phase, 1e3)) for phase in "uvw"),
        *(
            Kind(f"contactor_{1e3 * s:g}ms", "contactor opens and closes", change=open_("all", s))
            for s in (0.005, 0.02, 0.1, 0.3, 1.0)
        ),
        Kind("earth_u_1ohm", "earth fault", change=earth("u", 1.0)),
        Kind("earth_w_20ohm", "earth fault", change=earth("w", 20.0)),
        Kind("locked_rotor", "locked rotor", change=jam),
        Kind("load_reversal", "load reversal", change=_load_reversal),
        *(
            Kind(f"motor_{f:g}", "another motor", change=scaled(f, *circuit), from_start=True)
            for f in (0.4, 2.5)
        ),
        *(
            Kind(f"J_{f:g}", "inertia", change=scaled(f, "mechanics.J_kg_m2"), from_start=True)
            for f in (0.3, 3.0, 10.0, 30.0)
        ),
    ]
