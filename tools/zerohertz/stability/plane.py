"""Which operating points, on which motor: from what is asked to the arrays of loop.Points."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from zerohertz import param_list
from zerohertz.errors import UserError
from zerohertz.motor import load_motor
from zerohertz.scenario.setup import Setup
from zerohertz.stability.firmware import Complex, Firmware, GainTable, Real, from_parameters
from zerohertz.stability.loop import Points

RATED_TORQUE_NM = 8.4
SPEEDS_RPM = (0.0, 15.0, 30.0, 60.0, 120.0, 300.0, 900.0)
LOADS_PU = (-1.0, -0.66, -0.33, 0.0, 0.33, 0.66, 1.0)
RS_RATIOS = (0.67, 0.8, 1.0, 1.25, 1.5)


@dataclasses.dataclass(frozen=True)
class Truth:
    """The true machine over what the firmware is told, and the rig. Numbers, or one per point."""

    rs_ratio: float | Real = 1.0
    rr_ratio: float | Real = 1.0
    m_ratio: float | Real = 1.0
    leakage_ratio: float | Real = 1.0
    J_kg_m2: float | Real = 0.035
    coulomb_Nm: float | Real = 0.4
    current_gain: complex | Complex = 1.0
    voltage_gain: complex | Complex = 1.0
    # Rs as the firmware uses it over the true one; None: as its parameters say.
    rs_hat_pu: float | Real | None = None
    rs_sensed_pu: float | Real = 1.0  # what gain errors make of a dc measurement


def firmware_of(setup: Setup, table: Path | None, changes: Mapping[str, float]) -> Firmware:
    """The firmware of a configuration that is told the nameplate, as in the atlas; `changes` are
    parameters with the last word. table None: the configuration's own."""
    known = param_list.entries()
    for name in changes:
        if name not in known:
            raise UserError(f"--set: {name}: {param_list.no_such(name)}")
    told = dataclasses.asdict(load_motor(setup.motor_dir).circuit)
    parameters = setup.parameters() | told | {"speed_J_kg_m2": 0.035} | dict(changes)
    gain = GainTable.zero()
    if parameters["observer_gain_enable"]:
        gain = GainTable.load(table or setup.motor_dir)
    return from_parameters(parameters, gain)


def points_of(
    fw: Firmware, omega_ref_rad_s: Real, load_Nm: Real, truth: Truth
) -> tuple[Points, Points]:
    """The points as the firmware believes them (where the search for an equilibrium starts), and as
    they are."""
    omega, load = np.broadcast_arrays(np.atleast_1d(omega_ref_rad_s), np.atleast_1d(load_Nm))
    one = np.ones(omega.shape)
    c = fw.circuit
    Rs = truth.rs_ratio * c.Rs_ohm * one
    if truth.rs_hat_pu is not None:
        Rs_hat = truth.rs_hat_pu * Rs
    elif fw.rs_measured:
        Rs_hat = fw.rs_bias * truth.rs_sensed_pu * Rs
    else:
        Rs_hat = c.Rs_ohm * one
    M = truth.m_ratio * c.M_H
    rig = {"J_kg_m2": truth.J_kg_m2 * one, "coulomb_Nm": truth.coulomb_Nm * one}
    asked = {"omega_ref_rad_s": omega * one, "load_Nm": load * one}
    exact = Points(
        **asked,
        Rs_ohm=c.Rs_ohm * one,
        Rr_ohm=c.Rr_ohm * one,
        Ls_H=c.Ls_H * one,
        Lr_H=c.Lr_H * one,
        M_H=c.M_H * one,
        Rs_hat_ohm=c.Rs_ohm * one,
        **rig,
        current_gain=one + 0j,
        voltage_gain=one + 0j,
    )
    true = Points(
        **asked,
        Rs_ohm=Rs,
        Rr_ohm=truth.rr_ratio * c.Rr_ohm * one,
        Ls_H=(M + truth.leakage_ratio * (c.Ls_H - c.M_H)) * one,
        Lr_H=(M + truth.leakage_ratio * (c.Lr_H - c.M_H)) * one,
        M_H=M * one,
        Rs_hat_ohm=Rs_hat,
        **rig,
        current_gain=truth.current_gain * one + 0j,
        voltage_gain=truth.voltage_gain * one + 0j,
    )
    return exact, true


def speed_for_frequency(fw: Firmware, frequency_Hz: Real, torque_Nm: Real) -> Real:
    """The speed at which the error-free drive at nominal flux has this stator frequency, rad/s
    electrical."""
    c = fw.circuit
    slip = c.M_H * c.tau_per_s * torque_Nm / (fw.pole_pairs * fw.kr * fw.lambda_nominal_Wb**2)
    return 2.0 * math.pi * frequency_Hz - slip


def omega_from_rpm(fw: Firmware, speed_rpm: Real) -> Real:
    return np.asarray(speed_rpm) * math.pi / 30.0 * fw.pole_pairs


def current_gain(u: Real, v: Real, w: Real) -> Complex:
    """Positive sequence of three phase gains."""
    return (u + v + w) / 3.0 + 0j


def voltage_gain(uv: Real, vw: Real) -> Complex:
    """Positive sequence of two line-voltage gains: (a11 + a22)/2 + j (a21 - a12)/2 of the matrix
    they make of alpha and beta."""
    return 0.5 * (uv + vw) + 1j * (uv - vw) / (2.0 * math.sqrt(3.0))


def sensed_rs(u: Real, v: Real, w: Real, uv: Real) -> Real:
    """A dc measurement along phase u over the true Rs: line gain over current gain."""
    return uv / (2.0 / 3.0 * u + (v + w) / 6.0)
