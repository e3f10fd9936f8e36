"""The axes of the envelope: what is drawn, from which range, and how one of them is fixed."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from zerohertz.errors import UserError

Value = float | str

SENSORS, DUTY, SHIPPED = "sensors", "duty", "shipped"
RIGHT, HALF, HALF_MORE, UNTOLD = "right", "half", "half_more", "untold"
TOLD_FACTOR = {RIGHT: 1.0, HALF: 0.5, HALF_MORE: 1.5, UNTOLD: 0.0}
CYCLE, CROSSING, NEAR_ZERO, TORQUE, SAG = "cycle", "crossing", "near_zero", "torque", "sag"
DRIVEN = (CYCLE, SAG)  # missions with the drawn speeds
ACTIVE, PASSIVE, LINEAR, SQUARE = "active", "passive", "linear", "square"
THRESHOLD, CAPACITANCE = "threshold", "capacitance"
PULSATING, ELASTIC = "pulsating", "elastic"
BENCH_J, BENCH_THRESHOLD_A = 2.33, 0.25  # of the atlas
TABLE1_MOTORS = ("table1", "table1_p1", "table1_p3", "table1_p4")
TABLE1_WEIGHTS = (0.4, 0.08, 0.08, 0.08)
# Of host_sim/rigs/motors. A motor more would draw other cases: they belong to a fresh envelope.
OWN_MOTORS = (
    *("im_0kw19_220v", "im_1kw5_200v", "im_2kw2_220v", "im_4kw_400v", "im_7kw5_400v"),
    *("im_15kw_400v", "im_37kw_400v", "im_75kw_400v"),
)


@dataclasses.dataclass(frozen=True)
class Axis:
    """One quantity. Choices with weights, or a range that is drawn evenly or evenly in its log."""

    name: str
    group: str
    text: str
    choices: tuple[str, ...] = ()
    weights: tuple[float, ...] = ()
    low: float = 0.0
    high: float = 0.0
    log: bool = False
    when: tuple[str, tuple[str, ...]] | None = None  # it acts where another axis has such a value
    usual: Value | None = None  # where nothing is wrong; None: 0 or the first choice, if there is

    @property
    def values(self) -> str:
        """As help and errors name them."""
        if self.choices:
            return ", ".join(self.choices)
        return f"{self.low:g} to {self.high:g}" + (" (log)" if self.log else "")

    @property
    def plain(self) -> Value | None:
        """The value with which the axis disturbs nothing; None: it has none."""
        if self.usual is not None:
            return self.usual
        if self.choices:
            return self.choices[0]
        return 0.0 if self.low <= 0.0 <= self.high else None

    def acts(self, values: Mapping[str, Any]) -> bool:
        return self.when is None or values[self.when[0]] in self.when[1]

    def draw(self, rng: np.random.Generator) -> Value:
        if self.choices:
            return str(rng.choice(self.choices, p=self.weights or None))
        if self.log:
            return float(math.exp(rng.uniform(math.log(self.low), math.log(self.high))))
        return float(rng.uniform(self.low, self.high))

    def parse(self, text: str) -> Value:
        """A value by its text; UserError names the axis and what it can be."""
        if self.choices:
            if text in self.choices:
                return text
        else:
            try:
                value = float(text)
            except ValueError:
                value = math.nan
            if self.low <= value <= self.high:
                return value
        raise UserError(f"--fix: {self.name}: '{text}' is not one of its values: {self.values}")


AXES: tuple[Axis, ...] = (
    Axis(
        "motor",
        "motor",
        "Table 1's, also rewound for 1, 3 and 4 pole pairs; eight of rigs/motors, their drives "
        "derived from plate and circuit",
        (*TABLE1_MOTORS, *OWN_MOTORS),
        (*TABLE1_WEIGHTS, *([(1.0 - sum(TABLE1_WEIGHTS)) / len(OWN_MOTORS)] * len(OWN_MOTORS))),
    ),
    Axis("Rs_ratio", "motor", "true Rs over nameplate", low=0.67, high=1.5, log=True, usual=1.0),
    Axis("Rr_ratio", "motor", "true Rr over nameplate", low=0.7, high=1.4, log=True, usual=1.0),
    Axis("M_ratio", "motor", "true M at rated flux over nameplate", low=0.85, high=1.15, usual=1.0),
    Axis("leakage_ratio", "motor", "true leakages over nameplate", low=0.8, high=1.2, usual=1.0),
    Axis(
        "saturation",
        "motor",
        "main flux: none; M / (1 + (flux/knee)^n) with n 4 or 8; a softer law (host_sim/README)",
        ("none", "power4", "power8", "soft"),
    ),
    Axis("iron_loss_pu", "motor", "iron loss at rated speed over rated power", high=0.04),
    Axis("Rs_heating", "motor", "Rs rises by this share during the mission", high=0.1),
    Axis("Rr_heating", "motor", "Rr rises by this share during the mission", high=0.1),
    Axis(
        "inverter",
        "inverter",
        "period means, or every switching instant",
        ("averaged", "switched"),
    ),
    Axis("dead_time_us", "inverter", "true dead time", high=4.0),
    Axis(
        "dead_time_told",
        "inverter",
        "what the firmware is told of it: right, half, half more, 0",
        (RIGHT, HALF, HALF_MORE, UNTOLD),
    ),
    Axis(
        "error_law",
        "inverter",
        "what bends the dead-time error at small currents",
        (THRESHOLD, CAPACITANCE),
    ),
    Axis(
        "threshold_A",
        "inverter",
        "leg current below which the error falls in proportion",
        low=0.02,
        high=1.5,
        log=True,
        usual=BENCH_THRESHOLD_A,
    ),
    Axis(
        "leg_nF",
        "inverter",
        "capacitance of a leg, of the other law",
        high=6.0,
        when=("error_law", (CAPACITANCE,)),
    ),
    Axis("drop_V", "inverter", "mean drop of transistor and diode", high=1.5),
    Axis("drop_difference", "inverter", "their difference over the mean", low=-1.0, high=1.0),
    Axis("on_ohm", "inverter", "on-resistance of either", high=0.1),
    Axis("ripple_pu", "inverter", "dc-link source: amplitude of its ripple", high=0.05),
    Axis("ripple_Hz", "inverter", "and its frequency", ("100", "300")),
    Axis(
        "voltage",
        "drive",
        "acting voltage from the sensors, from the duty, or as the configuration has it",
        (SENSORS, DUTY, SHIPPED),
    ),
    Axis(
        "period_us",
        "drive",
        "control and carrier period; the gain table is designed for it",
        ("200", "100", "62.5"),
        (0.5, 0.25, 0.25),
    ),
    Axis("adc_bits", "sensors", "resolution", ("10", "12", "14"), usual="14"),
    Axis("gain_error", "sensors", "largest gain error of any sensor", high=0.01),
    Axis("offset_A", "sensors", "largest current offset at the start", high=0.06),
    Axis("offset_drift_A", "sensors", "largest drift of a current offset after it", high=0.15),
    Axis("noise_lsb", "sensors", "noise of every word, rms, in units of 14 bit", high=2.0),
    Axis(
        "J_ratio",
        "shaft",
        "inertia over the motor's own",
        low=0.4,
        high=100.0,
        log=True,
        usual=BENCH_J,
    ),
    Axis("J_told", "shaft", "told inertia over true", low=0.5, high=2.0, log=True, usual=1.0),
    Axis("friction_pu", "shaft", "Coulomb friction over rated torque", high=0.08),
    Axis(
        "load",
        "shaft",
        "active: keeps its direction, and drives; passive: friction; in proportion to speed; to "
        "its square",
        (ACTIVE, PASSIVE, LINEAR, SQUARE),
        (0.55, 0.15, 0.15, 0.15),
    ),
    Axis("load_pu", "shaft", "load over rated torque", low=-1.0, high=1.0),
    Axis("pulse", "shaft", "does the load pulsate", ("steady", PULSATING), (0.8, 0.2)),
    Axis(
        "pulse_pu",
        "shaft",
        "amplitude over the load's mean",
        low=0.05,
        high=0.3,
        when=("pulse", (PULSATING,)),
    ),
    Axis(
        "pulse_Hz",
        "shaft",
        "and its frequency",
        low=0.5,
        high=50.0,
        log=True,
        when=("pulse", (PULSATING,)),
    ),
    Axis(
        "coupling", "shaft", "one mass, or two on an elastic shaft", ("rigid", ELASTIC), (0.8, 0.2)
    ),
    Axis(
        "resonance_Hz",
        "shaft",
        "of the two masses",
        low=8.0,
        high=60.0,
        log=True,
        when=("coupling", (ELASTIC,)),
    ),
    Axis(
        "load_mass",
        "shaft",
        "share of the second mass in the inertia",
        low=0.2,
        high=0.8,
        when=("coupling", (ELASTIC,)),
    ),
    Axis(
        "mission",
        "mission",
        "run-up, load steps, reversal; slow crossing under load; long hold near zero; torque "
        "steps; dc sag",
        (CYCLE, CROSSING, NEAR_ZERO, TORQUE, SAG),
        (0.35, 0.2, 0.2, 0.1, 0.15),
    ),
    Axis(
        "speed_pu",
        "mission",
        "first speed over rated",
        low=0.01,
        high=2.0,
        log=True,
        when=(
            "mission",
            DRIVEN,
        ),
    ),
    Axis(
        "second_pu",
        "mission",
        "second speed over rated",
        low=-2.0,
        high=2.0,
        when=(
            "mission",
            DRIVEN,
        ),
    ),
    Axis(
        "near_zero_pu",
        "mission",
        "speed of the long hold near zero",
        low=-0.03,
        high=0.03,
        when=("mission", (NEAR_ZERO,)),
    ),
    Axis(
        "slope_rpm_s",
        "mission",
        "of the crossing, at 2 pole pairs",
        low=2.0,
        high=50.0,
        log=True,
        when=("mission", (CROSSING,)),
    ),
    Axis("sag_pu", "mission", "dc link while it sags", low=0.6, high=0.9, when=("mission", (SAG,))),
    Axis("sag_s", "mission", "for how long", low=0.1, high=2.0, log=True, when=("mission", (SAG,))),
)
BY_NAME: Mapping[str, Axis] = {axis.name: axis for axis in AXES}

# What the table asks for and the plant cannot do.
NOT_DRAWN = ("errors that commissioning itself makes: own motors are told their true circuit",)


def fixed(lines: Iterable[str]) -> dict[str, Value]:
    """`axis=value` lines of --fix."""
    found: dict[str, Value] = {}
    for line in lines:
        name, equals, text = line.partition("=")
        if not equals:
            raise UserError(f"--fix: '{line}': write axis=value")
        if name not in BY_NAME:
            raise UserError(f"--fix: no axis '{name}'; there are {', '.join(BY_NAME)}")
        found[name] = BY_NAME[name].parse(text)
    return found
