"""What the control law is made of: the constants of firmware/law, in double precision.

Derived from the parameters of a configuration as unit_config.c and the init functions do it;
nothing here depends on the operating point.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import numpy.typing as npt

from zerohertz.gain_design.stored import JSON_NAME, read_table_json
from zerohertz.gain_design.table import gains_of
from zerohertz.motor import Circuit

Real = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]

# flux_steering.c
_STEERING_I_Q_SHARE, _STEERING_SLIP_PU, _STEERING_FOLLOWS = 0.95, 1.25, 4.0
_STEERING_BEGIN_PU, _STEERING_KEEP_PU = 0.99, 0.5
# Constants of unit_config.c.
_PHI_RAMP_TAU = 1.7760728
_KI_FROM_RAD_S = 20.0  # speed_adaptation.h
_SPEED_FAST_PU = 1.5079365
_SPEED_SLIP_MAX = 2.0
_SPEED_FILTER_PU = 0.35
_STEER_HYSTERESIS_PU = 0.4
_STEER_TORQUE_PU = 0.1
_STEER_FILTER_S = 0.032


@dataclasses.dataclass(frozen=True)
class GainTable:
    """L over |w_hat|. Linear between the entries: the firmware takes the nearest, a staircase of
    .2 rad/s, which noise and ripple average to this line."""

    step_rad_s: float
    l1_per_s: Complex
    l2_ohm: Complex

    @staticmethod
    def zero() -> GainTable:
        return GainTable(1.0, np.zeros(2, complex), np.zeros(2, complex))

    @staticmethod
    def load(folder: Path) -> GainTable:
        content = read_table_json(folder / JSON_NAME)
        rows = gains_of(content).astype(float)
        step_rad_s = float(np.float32(content["step_rad_s"]))
        return GainTable(step_rad_s, rows[:, 0] + 1j * rows[:, 1], rows[:, 2] + 1j * rows[:, 3])

    def at(self, omega_e_rad_s: Real) -> tuple[Complex, Complex]:
        """L(-w) = conj L(w)."""
        k = np.clip(np.abs(omega_e_rad_s) / self.step_rad_s, 0.0, len(self.l1_per_s) - 1)
        low = np.minimum(k.astype(int), len(self.l1_per_s) - 2)
        share = k - low
        pair = []
        for entry in (self.l1_per_s, self.l2_ohm):
            value = entry[low] * (1.0 - share) + entry[low + 1] * share
            pair.append(np.where(omega_e_rad_s < 0.0, value.conj(), value))
        return pair[0], pair[1]


@dataclasses.dataclass(frozen=True)
class Pi:
    """pi.h: output kp e + x, x += ki_T e."""

    kp: float
    ki_T: float


@dataclasses.dataclass(frozen=True)
class Steering:
    """flux_steering.h; min_rad_s = 0: off."""

    min_rad_s: float
    leave_rad_s: float
    lambda_nominal_Wb: float
    lambda_min_Wb: float
    torque_min_Nm: float
    slip_Wb2_per_Nm_s: float
    flux_per_torque_Wb_per_Nm: float
    filter_gain: float
    follow: float  # of the way to its target that the flux goes in a period

    def steers(self, omega_ref_rad_s: Real, torque_Nm: Real) -> npt.NDArray[np.bool_]:
        """Where the hysteresis stands once the torque has come up from zero, slowly."""
        on = np.zeros(np.broadcast(omega_ref_rad_s, torque_Nm).shape, dtype=bool)
        if self.min_rad_s <= 0.0:
            return on
        speed = np.where(torque_Nm < 0.0, -omega_ref_rad_s, omega_ref_rad_s)
        for share in np.linspace(0.0, 1.0, 201):
            torque = share * np.abs(torque_Nm)
            slip_Wb2 = self.slip_Wb2_per_Nm_s * torque
            nominal = speed + slip_Wb2 / self.lambda_nominal_Wb**2
            steered = speed + slip_Wb2 / self.steered_Wb(speed, torque) ** 2
            need = np.where(on | (speed == 0.0), _STEERING_KEEP_PU, _STEERING_BEGIN_PU)
            within = np.where(on, self.leave_rad_s, self.min_rad_s)
            on = (np.abs(nominal) <= within) & (torque >= need * self.torque_min_Nm)
            on &= steered >= need * self.min_rad_s
            on &= speed < self.min_rad_s
        return on

    def steered_Wb(self, speed_with_torque_rad_s: Real, torque_Nm: Real) -> Real:
        """The flux that steering asks for under a torque of this size."""
        asked = np.minimum(speed_with_torque_rad_s, _STEERING_SLIP_PU * speed_with_torque_rad_s)
        slip = np.maximum(self.min_rad_s - asked, 1e-9)
        wanted = np.maximum(
            np.sqrt(self.slip_Wb2_per_Nm_s * torque_Nm / slip),
            self.flux_per_torque_Wb_per_Nm * torque_Nm,
        )
        return np.clip(wanted, self.lambda_min_Wb, self.lambda_nominal_Wb)

    def below_Wb(self, omega_ref_rad_s: Real, torque_Nm: Real, on: npt.NDArray[np.bool_]) -> Real:
        """Nominal flux minus the steered one."""
        speed = np.where(torque_Nm < 0.0, -omega_ref_rad_s, omega_ref_rad_s)
        steered = self.steered_Wb(speed, np.maximum(np.abs(torque_Nm), 1e-9))
        return np.where(on, self.lambda_nominal_Wb - steered, 0.0)


@dataclasses.dataclass(frozen=True)
class Firmware:
    """drive_config_t, as far as an equilibrium in RUN sees it."""

    period_s: float
    circuit: Circuit  # what the firmware believes
    pole_pairs: float
    table: GainTable
    voltage_from_duty: bool
    voltage_lag: float  # share of a change that the sensors do not show in its period
    lag_keep: float  # of their change, from period to period
    delay_comp_s: float
    second_order: bool
    adapt_kp: float
    adapt_ki_T: float
    leak_T: float
    leak_mode: int
    leak_on_rad_s: float
    phi_factor: float
    phi_ramp_rad_s: float
    ki_growth: float  # far from zero frequency K_I is 1 + this times itself
    ki_from_rad_s: float  # stator frequency from which it grows
    speed: Pi
    speed_filter_gain: float
    speed_more_max: float
    speed_more_per_rad_s: float
    speed_weakening: float
    speed_slow_rad_s: float
    i_q_max_A: float
    i_max_A: float
    i_d_A: float
    current: Pi
    decoupling: float
    steering: Steering
    rs_measured: bool
    rs_bias: float

    @property
    def lambda_nominal_Wb(self) -> float:
        return self.circuit.M_H * self.i_d_A

    @property
    def kr(self) -> float:
        return self.circuit.M_H / self.circuit.Lr_H


def from_parameters(p: Mapping[str, float], table: GainTable) -> Firmware:
    """The constants as the firmware's init functions derive them."""
    circuit = Circuit(*(p[name] for name in ("Rs_ohm", "Rr_ohm", "Ls_H", "Lr_H", "M_H")))
    T = p["period_s"]
    late = p["voltage_filter_comp_s"] / T
    lambda_Wb = p["M_H"] * p["i_d_A"]
    slow = p["speed_bandwidth_rad_s"]
    fast = p["speed_fast_bandwidth_rad_s"]
    more_max = fast / slow - 1.0 if fast > slow else 0.0
    leak_per_s = (p["eps1"], p["eps1"] * p["adapt_ki"], p["eps1"] / T)[int(p["eps1_unit"])]
    return Firmware(
        period_s=T,
        circuit=circuit,
        pole_pairs=p["pole_pairs"],
        table=table,
        voltage_from_duty=p["voltage_source"] == 1,
        voltage_lag=1.0 - 2.0 / ((1.0 + late) * (2.0 + late)),
        lag_keep=late / (2.0 + late),
        delay_comp_s=p["delay_comp_periods"] * T,
        second_order=p["observer_method"] == 1,
        adapt_kp=p["adapt_kp"],
        adapt_ki_T=p["adapt_ki"] * T,
        leak_T=leak_per_s * T,
        leak_mode=int(p["eps1_mode"]),
        leak_on_rad_s=2.0 * math.pi * p["eps1_on_Hz"],
        phi_factor=p["phi_factor"],
        phi_ramp_rad_s=circuit.tau_per_s / _PHI_RAMP_TAU,
        ki_growth=1.0 if p["phi_factor"] > 0.0 else 0.0,
        ki_from_rad_s=_KI_FROM_RAD_S,
        speed=_speed_pi(p, circuit, lambda_Wb),
        speed_filter_gain=T / (T + _speed_filter_s(p, circuit, lambda_Wb)),
        speed_more_max=more_max,
        speed_more_per_rad_s=more_max / ((_SPEED_FAST_PU - 1.0) * p["speed_slow_rad_s"]),
        speed_weakening=1.0 + 1.0 / more_max if more_max > 0.0 else 0.0,
        speed_slow_rad_s=p["speed_slow_rad_s"],
        i_q_max_A=p["i_q_max_A"],
        i_max_A=p["i_max_A"],
        i_d_A=p["i_d_A"],
        current=_current_pi(p, circuit),
        decoupling=p["decoupling"],
        steering=_steering(p, circuit, lambda_Wb),
        rs_measured=p["rs_measure"] == 1,
        rs_bias=p["rs_bias"],
    )


def _speed_gains(p: Mapping[str, float], circuit: Circuit, lambda_Wb: float) -> tuple[float, float]:
    """The gain that the bandwidth takes, and the one that the bound leaves of it."""
    bandwidth = p["speed_bandwidth_rad_s"]
    torque_per_A = p["pole_pairs"] ** 2 * circuit.M_H / circuit.Lr_H * lambda_Wb
    wanted = p["speed_J_kg_m2"] * bandwidth / torque_per_A
    # The largest gain, speed_control.h: so much slip of the torque that a speed error asks for.
    faster = max(p["speed_fast_bandwidth_rad_s"] / bandwidth, 1.0)
    slip_per_A = circuit.tau_per_s * circuit.M_H / lambda_Wb
    return wanted, min(wanted, _SPEED_SLIP_MAX / (slip_per_A * faster))


def _speed_filter_s(p: Mapping[str, float], circuit: Circuit, lambda_Wb: float) -> float:
    wanted, kp = _speed_gains(p, circuit, lambda_Wb)
    fast = max(p["speed_fast_bandwidth_rad_s"], p["speed_bandwidth_rad_s"])
    beyond = wanted / kp - 1.0
    return p["speed_filter_s"] + _SPEED_FILTER_PU * beyond**2 / (wanted / kp * fast)


def _speed_pi(p: Mapping[str, float], circuit: Circuit, lambda_Wb: float) -> Pi:
    bandwidth = p["speed_bandwidth_rad_s"]
    wanted, kp = _speed_gains(p, circuit, lambda_Wb)
    left = kp / wanted
    ki_factor = p["speed_ki_factor"] * (1.0 + (1.0 - left) ** 2)
    return Pi(kp, ki_factor * bandwidth * left * kp * p["period_s"])


def _current_pi(p: Mapping[str, float], circuit: Circuit) -> Pi:
    bandwidth = p["current_bandwidth_rad_s"]
    kp = bandwidth * circuit.sigma_Ls_H
    return Pi(kp, p["current_ki_factor"] * bandwidth * kp * p["period_s"])


def _steering(p: Mapping[str, float], circuit: Circuit, lambda_Wb: float) -> Steering:
    kr = circuit.M_H / circuit.Lr_H
    min_rad_s = 2.0 * math.pi * p["steer_min_Hz"]
    filter_gain = p["period_s"] / (p["period_s"] + _STEER_FILTER_S)
    return Steering(
        min_rad_s=min_rad_s,
        leave_rad_s=(1.0 + _STEER_HYSTERESIS_PU) * min_rad_s,
        lambda_nominal_Wb=lambda_Wb,
        lambda_min_Wb=p["steer_flux_min"] * lambda_Wb,
        torque_min_Nm=_STEER_TORQUE_PU * p["pole_pairs"] * kr * lambda_Wb * p["i_q_max_A"],
        slip_Wb2_per_Nm_s=circuit.tau_per_s * circuit.M_H / (kr * p["pole_pairs"]),
        flux_per_torque_Wb_per_Nm=1.0
        / (p["pole_pairs"] * kr * _STEERING_I_Q_SHARE * p["i_q_max_A"]),
        filter_gain=filter_gain,
        follow=min(_STEERING_FOLLOWS * filter_gain, 1.0),
    )
