"""What the identification may move: every unknown of rig, tuning and L design, with its range.

The ranges are physical plausibility, not fit: a value outside would not be believed on the paper's
rig. What the paper states is not here and stays fixed: motor data given to the firmware (Table 1),
14 bit, 800 Hz, 5 kHz, 283 V, i_q limit 15 A, line-voltage sensors, forward Euler.
The bound of the flux estimate is not here either: a tight one would hold the observer where the law
itself does not.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from zerohertz.gain_design.table import design_table
from zerohertz.motor import load_motor, with_design
from zerohertz.paths import ROOT
from zerohertz.scenario.setup import Setup

NOMINAL_MOTOR = ROOT / "gain_tables" / "hasegawa2005"

Point = Mapping[str, float]


@dataclasses.dataclass(frozen=True)
class Unknown:
    """One coordinate. kind: log (positive, moved by factors), lin, whole (of low..high)."""

    name: str
    low: float
    high: float
    kind: str
    start: float
    why: str

    def unit_of(self, value: float) -> float:
        """0..1 over the range, on the scale the search moves in."""
        if self.kind == "log":
            return math.log(value / self.low) / math.log(self.high / self.low)
        return (value - self.low) / (self.high - self.low)

    def value_of(self, unit: float) -> float:
        unit = min(1.0, max(0.0, unit))
        if self.kind == "log":
            return self.low * (self.high / self.low) ** unit
        value = self.low + unit * (self.high - self.low)
        return float(round(value)) if self.kind == "whole" else value


# start: the point at the end of PAPER_OUTCOMES.md.
UNKNOWNS = (
    # The true rig. Table 1's data were measured at the mains, "not necessarily true values".
    Unknown("rig.Rs_ohm", 0.78, 1.15, "log", 0.972, "Table 1 .93; cold -15 %, warm +20 %"),
    Unknown("rig.Rr_ohm", 0.38, 0.78, "log", 0.691, "Table 1 .50; slot effects, heat"),
    Unknown("rig.M_H", 0.085, 0.125, "log", 0.1162, "Table 1 .102; measured at full voltage"),
    Unknown("rig.leakage_H", 0.006, 0.012, "log", 0.0101, "Table 1 .008"),
    Unknown("rig.flux_knee_pu", 0.0, 1.0, "lin", 0.0, "saturation: .5 Wb over knee; 0: none"),
    Unknown("rig.J_kg_m2", 0.025, 0.06, "log", 0.0371, "motor .015 and a 2.2 kW load machine"),
    Unknown("rig.coulomb_Nm", 0.02, 0.7, "log", 0.45, "two machines, a torque meter"),
    Unknown("rig.stiction", 1.0, 2.0, "lin", 1.489, "static over Coulomb"),
    Unknown("rig.viscous_Nms", 1e-4, 5e-3, "log", 4.3e-4, ""),
    Unknown("rig.dead_time_s", 1.5e-6, 4.5e-6, "log", 2.91e-6, "IGBT of 2005"),
    Unknown("rig.i_threshold_A", 0.1, 1.0, "log", 0.249, "charging of the legs"),
    Unknown("rig.drop_V", 0.3, 2.5, "log", 1.52, "IGBT and diode"),
    Unknown("rig.i_offset_u_A", -0.15, 0.15, "lin", 0.043, "HCS-20: .6 % of full scale"),
    Unknown("rig.i_offset_v_A", -0.15, 0.15, "lin", 0.092, ""),
    Unknown("rig.i_gain_u", -0.01, 0.01, "lin", 0.007, "gain minus one"),
    Unknown("rig.i_gain_v", -0.01, 0.01, "lin", 0.006, ""),
    Unknown("rig.i_noise_A", 0.002, 0.04, "log", 0.009, "one code is 3 mA"),
    Unknown("rig.u_offset_uv_V", -0.4, 0.4, "lin", -0.022, "LV25: .1 % of full scale"),
    Unknown("rig.u_offset_vw_V", -0.4, 0.4, "lin", 0.144, ""),
    Unknown("rig.u_gain_uv", -0.015, 0.015, "lin", -0.0084, "gain minus one"),
    Unknown("rig.u_gain_vw", -0.015, 0.015, "lin", -0.0037, ""),
    Unknown("rig.u_noise_V", 0.01, 0.2, "log", 0.023, "one code is 49 mV"),
    # The tuning, which the paper does not print.
    Unknown("adapt_kp", 0.5, 150.0, "log", 51.9, ""),
    Unknown("adapt_ki", 1.0, 2e4, "log", 45.3, ""),
    Unknown("eps1", 0.05, 2e3, "log", 7.31, "literal, 1/(s Wb A); .008 per sample is 40"),
    Unknown("eps1_on_Hz", 0.5, 6.0, "log", 2.76, "below the 10 Hz of 300 min^-1"),
    Unknown("eps1_off_ratio", 1.05, 1.6, "lin", 1.25, "hysteresis"),
    Unknown("i_d_A", 3.6, 5.4, "log", 4.99, "flux .37 .. .55 Wb"),
    Unknown(
        "premagnetise_s", 0.3, 1.9, "lin", 1.88, "torque control from .1 s later on; ramp at 2 s"
    ),
    Unknown("current_bandwidth_rad_s", 60.0, 900.0, "log", 150.0, ""),
    Unknown("current_ki_factor", 0.05, 4.0, "log", 2.29, ""),
    Unknown("speed_bandwidth_rad_s", 4.0, 60.0, "log", 15.9, ""),
    Unknown("speed_ki_factor", 0.01, 0.6, "log", 0.080, ""),
    Unknown("speed_filter_s", 0.0, 0.05, "lin", 0.020, ""),
    Unknown("decoupling", 0, 1, "whole", 1, ""),
    Unknown("dead_time_fraction", 0.0, 1.0, "lin", 0.99, ""),
    Unknown("voltage_filter_comp_s", 0.0, 0.5e-3, "lin", 27e-6, "the filter delays .28 ms"),
    Unknown("offset_calibrated", 0, 1, "whole", 0, "the prototype had the offsets in effect"),
    # The L design. method 0: the motor's poles shifted, 1: closed form with real poles, 2: the
    # gamma-positive-real table of gain_tables/hasegawa2005.
    Unknown("L.method", 0, 2, "whole", 0, ""),
    Unknown("L.real_factor", 0.4, 5.0, "log", 0.85, ""),
    Unknown("L.imag_factor", 0.0, 1.0, "lin", 0.30, "Fig. 4: towards the real axis"),
    Unknown("L.p1_per_s", 120.0, 1500.0, "log", 500.0, "minus p1"),
    Unknown("L.a", 0.2, 5.0, "log", 1.0, ""),
    Unknown("L.b", 0.02, 0.6, "log", 0.2, ""),
)
# Unknowns that are firmware parameters under the same name.
_DIRECT = (
    "adapt_kp",
    "adapt_ki",
    "eps1",
    "eps1_on_Hz",
    "i_d_A",
    "premagnetise_s",
    "current_bandwidth_rad_s",
    "current_ki_factor",
    "speed_bandwidth_rad_s",
    "speed_ki_factor",
    "speed_filter_s",
    "dead_time_fraction",
    "voltage_filter_comp_s",
)
BY_NAME = {u.name: u for u in UNKNOWNS}

# Starts of THEORY 2, 3 and 8 beside PAPER_OUTCOMES' own.
STARTS: Mapping[str, Point] = {
    "paper_outcomes": {u.name: u.start for u in UNKNOWNS},
    "softer": {"offset_calibrated": 1.0, "adapt_kp": 15.0},
    "softer_offsets": {"adapt_kp": 15.0},
    "fig18_corner": {"rig.Rs_ohm": 0.84, "i_d_A": 3.9, "adapt_ki": 300.0, "eps1": 7.0},
    "per_sample": {"eps1": 40.0, "adapt_ki": 200.0},
    "closed_form": {"L.method": 1.0, "adapt_kp": 10.0, "adapt_ki": 60.0, "eps1": 12.0},
    "no_offsets": {"offset_calibrated": 1.0},
}


def start_point(name: str) -> dict[str, float]:
    return dict(STARTS["paper_outcomes"]) | dict(STARTS[name])


def rig_overrides(point: Point) -> dict[str, float | list[float]]:
    """The rig's keys. Lr = M as in Table 1; the third current sensor is such that the sum of the
    three is what two sensors would give: offsets add to zero, its gain is the mean of the others.
    """
    p = {k.removeprefix("rig."): v for k, v in point.items() if k.startswith("rig.")}
    i_gain = [1.0 + p["i_gain_u"], 1.0 + p["i_gain_v"]]
    i_gain.append(0.5 * (i_gain[0] + i_gain[1]))
    offset_A = [p["i_offset_u_A"], p["i_offset_v_A"]]
    offset_A.append(-offset_A[0] - offset_A[1])
    knee = p["flux_knee_pu"]
    values: dict[str, float | list[float]] = {
        "motor.Rs_ohm": p["Rs_ohm"],
        "motor.Rr_ohm": p["Rr_ohm"],
        "motor.M_H": p["M_H"],
        "motor.Lr_H": p["M_H"],
        "motor.Ls_H": p["M_H"] + p["leakage_H"],
        "motor.saturation.flux_knee_Wb": 0.5 / knee if knee > 0.2 else 0.0,
        "mechanics.J_kg_m2": p["J_kg_m2"],
        "mechanics.coulomb_Nm": p["coulomb_Nm"],
        "mechanics.static_Nm": p["coulomb_Nm"] * p["stiction"],
        "mechanics.viscous_Nms": p["viscous_Nms"],
        "inverter.dead_time_s": p["dead_time_s"],
        "inverter.i_threshold_A": p["i_threshold_A"],
        "inverter.drop_V": p["drop_V"],
        "sensors.current_offset_A": offset_A,
        "sensors.current_gain": i_gain,
        "sensors.current_noise_A": p["i_noise_A"],
        "sensors.voltage_offset_V": [p["u_offset_uv_V"], p["u_offset_vw_V"]],
        "sensors.voltage_gain": [1.0 + p["u_gain_uv"], 1.0 + p["u_gain_vw"]],
        "sensors.voltage_noise_V": p["u_noise_V"],
    }
    return {key: _digits(value) for key, value in values.items()}


def firmware_params(point: Point) -> dict[str, float | int]:
    """The firmware's tuning; it knows the inverter's dead time, not the sensors' errors."""
    params: dict[str, float | int] = {name: _rounded(point[name]) for name in _DIRECT}
    return params | {
        # Not the paper's: adaptation angle. The flux is never at its bound (a bound
        # that acts made Fig. 16 look stable), the current bound leaves i_q its 15 A.
        "phi_factor": 0.0,
        "lambda_max_Wb": 20.0,
        "i_max_A": 16.0,
        "eps1_unit": 0,
        "voltage_source": 0,
        "observer_method": 0,
        "eps1_off_Hz": _rounded(point["eps1_on_Hz"] * point["eps1_off_ratio"]),
        "decoupling": float(point["decoupling"]),
        "dead_time_s": _rounded(point["rig.dead_time_s"]),
        "device_drop_V": _rounded(point["rig.drop_V"]),
        "dead_time_i_threshold_A": _rounded(point["rig.i_threshold_A"]),
        "offset_calibration_s": 0.1 if point["offset_calibrated"] else 0.0,
        "speed_J_kg_m2": 0.035,
    }


def design_of(point: Point) -> dict[str, float | str]:
    """[design] of motor.toml."""
    if point["L.method"] == 0:
        return {
            "method": "pole_shift",
            "real_factor": _rounded(point["L.real_factor"]),
            "imag_factor": _rounded(point["L.imag_factor"]),
        }
    if point["L.method"] == 2:
        return {"method": "gamma_pr"}
    return {
        "method": "closed_form",
        "p1_per_s": -_rounded(point["L.p1_per_s"]),
        "a": _rounded(point["L.a"]),
        "b": _rounded(point["L.b"]),
    }


@functools.lru_cache(maxsize=64)
def gain_of(design: tuple[tuple[str, float | str], ...]) -> npt.NDArray[np.float32]:
    """Words of the gain table of a design of Table 1's motor."""
    motor = with_design(load_motor(NOMINAL_MOTOR), **dict(design))
    return design_table(motor, certificate=False).gain


def setup_of(point: Point) -> Setup:
    """The point as a configuration that can be run."""
    return Setup(
        name="candidate",
        motor_dir=NOMINAL_MOTOR,
        board=ROOT / "host_sim" / "boards" / "paper.toml",
        rig=ROOT / "host_sim" / "rigs" / "hasegawa2005.toml",
        params=firmware_params(point),
        rig_overrides=rig_overrides(point),
        gain=gain_of(tuple(design_of(point).items())),
    )


def perturbed(point: Point, rng: np.random.Generator, sigma: float, count: int) -> dict[str, float]:
    """Some coordinates moved by a normal step of sigma times their range, or flipped."""
    moved = dict(point)
    for index in rng.choice(len(UNKNOWNS), size=min(count, len(UNKNOWNS)), replace=False):
        unknown = UNKNOWNS[index]
        if unknown.kind == "whole":
            # A switch changes everything at once: rarely.
            if rng.random() < 0.1:
                moved[unknown.name] = float(rng.integers(unknown.low, unknown.high + 1))
            continue
        unit = unknown.unit_of(moved[unknown.name]) + rng.normal(0.0, sigma)
        moved[unknown.name] = unknown.value_of(unit)
    return moved


def _rounded(value: float) -> float:
    return float(f"{value:.6g}")


def _digits(value: float | list[float]) -> float | list[float]:
    return [_rounded(v) for v in value] if isinstance(value, list) else _rounded(value)
