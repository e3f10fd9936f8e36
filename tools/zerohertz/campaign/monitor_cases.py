"""What the monitor is tried with: faults of the plant at operating points, and when each is good.

t = 0 is the atlas': run up, then the load within a second; the fault comes FAULT_S later.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from typing import Any

from zerohertz.campaign.rig import U_DC_V

SIGNALS = ("i_u", "i_v", "i_w", "u_uv", "u_vw", "u_dc")
# One severity per kind; None: the kind has none. Gain: factor; offset: share of full scale (2.5 A,
# 40 V); delayed: periods (2 ms); intermittent: share of the samples that read zero.
SEVERITY: Mapping[str, float | None] = {
    "off": None,
    "stuck": None,
    "garbage": None,
    "gain": 0.7,
    "offset": 0.1,
    "delayed": 10,
    "intermittent": 0.2,
}
# min^-1 and share of rated torque; load > 0 opposes positive rotation.
OPERATING_POINTS = (
    *((0.0, 0.0), (0.0, 1.0), (30.0, 0.5), (60.0, 1.0), (60.0, -1.0), (120.0, 0.0)),
    *((300.0, 0.5), (300.0, -1.0), (900.0, 0.0), (900.0, 1.0), (900.0, -1.0), (1500.0, 1.0)),
)
SAG_POINTS = tuple(
    (speed, load) for speed in (0.0, 60.0, 300.0, 900.0) for load in (-0.5, 0.0, 0.25, 0.5)
)
FAULT_S = 2.0
AFTER_S = 3.0
SAG_S = 1.0
EARTH_OHM = (0.5, 20.0)
# Wired crosswise with the next of its kind: the three pairs of currents, and the line voltages.
EXCHANGED = ("i_u", "i_v", "i_w", "u_uv")
AT_START = "exchanged_at_start"


@dataclasses.dataclass(frozen=True)
class Case:
    """One run: an operating point and what breaks there."""

    map: str  # the group
    index: int
    seed: int
    what: str
    kind: str
    speed_rpm: float
    load_pu: float
    start_share: float  # of a period of 20 ms, so that faults come at any phase of the current
    loaded_s: float = FAULT_S + AFTER_S

    @property
    def fault_s(self) -> float:
        """Of the fault, from t = 0 on."""
        return FAULT_S + 0.02 * self.start_share

    @property
    def at_start(self) -> bool:
        """Broken before the gates were ever on."""
        return self.map == AT_START


def groups() -> dict[str, list[Case]]:
    """Every case by its group, in the order of the page."""
    plain = {
        "sensor": [(signal, kind) for signal in SIGNALS for kind in SEVERITY],
        "open_phase": [(phase, "open") for phase in "uvw"],
        "earth": [(phase, f"{ohm:g} ohm") for phase in "uvw" for ohm in EARTH_OHM],
        "short": [("u-v", "short")],
        "collapse": [("u_dc", "collapse")],
        AT_START: [(signal, "exchanged") for signal in EXCHANGED],
        "exchanged": [(signal, "exchanged") for signal in EXCHANGED],
    }
    made = {name: list(_cases(name, what, OPERATING_POINTS)) for name, what in plain.items()}
    return made | {"sag": list(_cases("sag", [("u_dc", "sag to 50 %")], SAG_POINTS))}


def _cases(
    name: str, what: list[tuple[str, str]], points: tuple[tuple[float, float], ...]
) -> Iterator[Case]:
    every = [(w, kind, speed, load) for w, kind in what for speed, load in points]
    for k, (w, kind, speed, load) in enumerate(every):
        yield Case(name, k, k + 1, w, kind, speed, load, (0.381966 * k) % 1.0)


def scenario_overrides(case: Case, begin_s: float) -> dict[str, Any]:
    """The fault as keys of the scenario."""
    at_s = 0.0 if case.at_start else begin_s + case.fault_s
    if case.map in ("sensor", AT_START, "exchanged"):
        severity = SEVERITY.get(case.kind)
        given = {} if severity is None else {"faults.severity": severity}
        return {
            "faults.sensor": case.what,
            "faults.kind": case.kind,
            "faults.start_s": at_s,
        } | given
    if case.map == "open_phase":
        return {"faults.open_phase": case.what, "faults.open_s": at_s}
    if case.map == "short":
        return {"faults.short_s": at_s}
    if case.map == "earth":
        return {
            "faults.earth_phase": case.what,
            "faults.earth_s": at_s,
            "faults.earth_ohm": float(case.kind.split()[0]),
        }
    low_V, back_s = (0.0, at_s + 1e3) if case.map == "collapse" else (0.5 * U_DC_V, at_s + SAG_S)
    line = [[0.0, U_DC_V], [at_s, U_DC_V], [at_s, low_V], [back_s, low_V], [back_s, U_DC_V]]
    return {"profiles.u_dc_V": line}
