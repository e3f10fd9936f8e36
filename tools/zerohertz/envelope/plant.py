"""What is true of motor, inverter, sensors and shaft in one run, as overrides of the rig."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from zerohertz.envelope.axes import CAPACITANCE, ELASTIC, PASSIVE
from zerohertz.envelope.case import Case
from zerohertz.envelope.motors import Drive, drive_for
from zerohertz.motor import Circuit

Array = npt.NDArray[np.float64]

# Main flux at which M has halved, over the flux of the nameplate; and the exponent.
SATURATION: Mapping[str, tuple[float, int]] = {
    "none": (0.0, 4),
    "power4": (1.54, 4),
    "power8": (1.25, 8),
    "soft": (1.7, 4),
}
SOFT = "soft"
STEEPEST = 1.01
STATIC = 1.3  # static over sliding friction
DAMPING = 0.03  # of the elastic shaft
LEAST_IRON_PU = 0.003  # below: none
TABLE1_A = math.sqrt(3.0) * 6.2


@dataclasses.dataclass(frozen=True)
class TrueMotor:
    """The circuit at no saturation, and the law by which its main inductance falls."""

    circuit: Circuit
    pole_pairs: int
    knee_Wb: float
    exponent: int
    soft: bool = False

    def M_H(self, main_Wb: npt.ArrayLike) -> Array:
        """Main inductance at this main flux: induction_motor.hpp."""
        if not self.knee_Wb:
            return np.full_like(np.asarray(main_Wb, dtype=float), self.circuit.M_H)
        ratio = np.asarray(main_Wb, dtype=float) / self.knee_Wb
        power = 2.0 * ratio**4 / (1.0 + ratio**2) if self.soft else ratio**self.exponent
        return self.circuit.M_H / (1.0 + power)


def true_motor(case: Case) -> TrueMotor:
    """M is what a test at rated flux would show; the leakages are separate."""
    drive = drive_for(case)
    plate = drive.circuit
    law = case.word("saturation")
    knee_pu, exponent = SATURATION[law]
    unit = TrueMotor(dataclasses.replace(plate, M_H=1.0), 1, knee_pu, exponent, law == SOFT)
    M_H = case.number("M_ratio") * plate.M_H / float(unit.M_H(1.0))
    leak = case.number("leakage_ratio")
    circuit = Circuit(
        Rs_ohm=case.number("Rs_ratio") * plate.Rs_ohm,
        Rr_ohm=case.number("Rr_ratio") * plate.Rr_ohm,
        Ls_H=M_H + leak * (plate.Ls_H - plate.M_H),
        Lr_H=M_H + leak * (plate.Lr_H - plate.M_H),
        M_H=M_H,
    )
    return TrueMotor(circuit, drive.pole_pairs, knee_pu * drive.flux_Wb, exponent, law == SOFT)


def inertia_kg_m2(case: Case) -> float:
    return case.number("J_ratio") * drive_for(case).J_kg_m2


def friction_Nm(case: Case) -> float:
    """Sliding; a passive load is friction."""
    rated_Nm = drive_for(case).rated_Nm
    load_pu = abs(case.number("load_pu")) if case.word("load") == PASSIVE else 0.0
    return (case.number("friction_pu") + load_pu) * rated_Nm


def rig_overrides(case: Case) -> dict[str, Any]:
    """Every value of rigs/atlas.toml that this run has otherwise."""
    drive, motor = drive_for(case), true_motor(case)
    friction = friction_Nm(case)
    return {
        **{f"motor.{key}": value for key, value in vars(motor.circuit).items()},
        "motor.pole_pairs": motor.pole_pairs,
        "motor.saturation.flux_knee_Wb": motor.knee_Wb,
        "motor.saturation.exponent": motor.exponent,
        "motor.saturation.law": "soft" if motor.soft else "power",
        "motor.iron_loss_ohm": _iron_ohm(case, drive),
        **_masses(case),
        "mechanics.coulomb_Nm": friction,
        "mechanics.static_Nm": STATIC * friction,
        **_inverter(case, drive, motor),
        **drive.rig,
        "dc_link.ripple_pu": case.number("ripple_pu"),
        "dc_link.ripple_Hz": float(case.word("ripple_Hz")),
        **_sensors(case, drive),
    }


def _masses(case: Case) -> dict[str, float]:
    """One, or two that swing against each other at the resonance."""
    J = inertia_kg_m2(case)
    if case.word("coupling") != ELASTIC:
        return {"mechanics.J_kg_m2": J}
    load_J = case.number("load_mass") * J
    together = load_J * (J - load_J) / J
    omega = 2.0 * math.pi * case.number("resonance_Hz")
    return {
        "mechanics.J_kg_m2": J - load_J,
        "mechanics.load_J_kg_m2": load_J,
        "mechanics.stiffness_Nm": together * omega**2,
        "mechanics.damping_Nms": 2.0 * DAMPING * together * omega,
    }


def _iron_ohm(case: Case, drive: Drive) -> float:
    share = case.number("iron_loss_pu")
    if share < LEAST_IRON_PU:
        return 0.0
    emf_V = drive.pole_pairs * drive.rated_rpm * math.pi / 30.0 * drive.flux_Wb
    return emf_V**2 / (share * drive.power_W)


def _inverter(case: Case, drive: Drive, motor: TrueMotor) -> dict[str, Any]:
    dead_s, drop_V = 1e-6 * case.number("dead_time_us"), case.number("drop_V")
    charged = case.word("error_law") == CAPACITANCE and dead_s > 0.0
    dead_A, drop_A = _least_thresholds_A(case, drive, motor)
    amp = drive.rated_A / TABLE1_A
    leg_F = amp * 1e-9 * case.number("leg_nF") if charged else 0.0
    if leg_F > 0.0:
        leg_F = max(leg_F, dead_A * dead_s / (2.0 * drive.u_dc_V))
    least_A = drop_A if leg_F > 0.0 else max(dead_A, drop_A)
    return {
        "inverter.model": case.word("inverter"),
        "inverter.u_dc_V": drive.u_dc_V,
        "inverter.carrier_Hz": 1.0 / drive.period_s,
        "inverter.dead_time_s": dead_s,
        "inverter.i_threshold_A": max(amp * case.number("threshold_A"), least_A),
        "inverter.leg_F": leg_F,
        "inverter.drop_V": drop_V,
        "inverter.drop_difference_V": drop_V * case.number("drop_difference"),
        "inverter.on_ohm": case.number("on_ohm") / amp,
    }


def _least_thresholds_A(case: Case, drive: Drive, motor: TrueMotor) -> tuple[float, float]:
    """The plant refuses a curve so steep that the current passes it within one step: of the dead
    time, and of the drop (with the dead time, where one step of the averaged model has both)."""
    c = motor.circuit
    transient_H = c.Ls_H - c.M_H**2 / c.Lr_H
    half_s, dead_s = 0.5 * drive.period_s, 1e-6 * case.number("dead_time_us")
    drop_A = case.number("drop_V") * half_s / transient_H
    dead_A = 0.5 * drive.u_dc_V * dead_s / transient_H
    if case.word("inverter") == "averaged":
        dead_A += drop_A  # 1/2 and half a period for dead_s: the same volt-seconds
    return STEEPEST * dead_A, STEEPEST * drop_A


def _sensors(case: Case, drive: Drive) -> dict[str, Any]:
    gains = [1.0 + error for error in case.vector("gain_error", 6)]
    amp = drive.rated_A / TABLE1_A
    lsb = case.number("noise_lsb") * 2.0**-13
    return {
        "sensors.current_gain": gains[:3],
        "sensors.voltage_gain": gains[3:5],
        "sensors.dc_gain": gains[5],
        "sensors.current_offset_A": [amp * x for x in case.vector("offset_A", 3)],
        "sensors.current_noise_A": lsb * drive.current_A,
        "sensors.voltage_noise_V": lsb * drive.line_V,
        "sensors.dc_noise_V": 0.5 * lsb * drive.dc_V,
    }


def drifts(case: Case, begin_s: float, end_s: float) -> dict[str, Any]:
    """Offsets of the currents that move after calibration: scenario overrides."""
    drive = drive_for(case)
    amp = drive.rated_A / TABLE1_A
    found: dict[str, Any] = {}
    slots = ("faults", "faults.second", "faults.third")
    for slot, word, drift_A in zip(slots, "uvw", case.vector("offset_drift_A", 3), strict=True):
        found |= {
            f"{slot}.sensor": f"i_{word}",
            f"{slot}.kind": "drift",
            f"{slot}.severity": amp * drift_A / drive.current_A / (end_s - begin_s),
            f"{slot}.start_s": begin_s,
        }
    return found
