"""Does a mission ask for more torque, voltage or braking power than there is? Known before the run.

From the plant's motor, in the steady state, with no code of the firmware. In the frame of the rotor
flux, power-invariant vectors:
  T = p M/Lr psi_r i_q                          less the iron's p w_s psi_r^2 / R_fe
  u_d = Rs i_d - w_s sigma Ls i_q,  u_q = Rs i_q + w_s (sigma Ls i_d + M/Lr psi_r)
  i_d = psi_r / M,  w_s = p w_m + Rr M i_q / (Lr psi_r)
Limits: |i| of the drive, |u| of the dc link's inscribed circle less what the legs lose, psi_r of
the nameplate: nobody has to over-excite a motor. What the motor gives back at its terminals, less
the iron's loss, the brake resistor has to take:
  -(u_d i_d + u_q i_q) - (w_s psi_r)^2 / R_fe
The legs take voltage and no power: in the dead time the current flows on through a diode, from or
to the link, and the plant's link gets what passes the motor's terminals.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import numpy.typing as npt

from zerohertz.envelope.plant import TrueMotor

Array = npt.NDArray[np.float64]
FLUXES, CURRENTS = 60, 121  # of the search
COARSE = 6  # every so many of both: what is possible on these is possible
LEAST_FLUX = 0.05
MARGIN = 0.95  # a demand closer to the limit than this cannot be told from an impossible one


@dataclasses.dataclass(frozen=True)
class Limits:
    """What bounds motor and drive."""

    motor: TrueMotor
    i_max_A: float
    flux_Wb: float
    lost_V: float = 0.0  # of the largest voltage vector, in the legs
    iron_ohm: float = 0.0
    brake_W: float = math.inf  # of the brake resistor


def lost_V(dead_V: float, drop_V: float) -> float:
    """Vector of three square waves: 4/pi of the leg's loss, sqrt(3/2) for the vector."""
    return 4.0 / math.pi * math.sqrt(1.5) * (dead_V + drop_V)


def torque_range_Nm(
    limits: Limits, speed_rad_s: float, u_dc_V: float, every: int = 1
) -> tuple[float, float]:
    """Smallest and largest steady torque at a speed of the shaft; of every so many points of the
    search, a range inside that."""
    motor, c = limits.motor, limits.motor.circuit
    flux = np.linspace(LEAST_FLUX, 1.0, FLUXES)[::every, None] * limits.flux_Wb
    i_q = np.linspace(-1.0, 1.0, CURRENTS)[None, ::every] * limits.i_max_A
    leak_s_H, leak_r_H = c.Ls_H - c.M_H, c.Lr_H - c.M_H
    M = motor.M_H(flux)
    M = motor.M_H(np.hypot(flux, M * leak_r_H / (M + leak_r_H) * i_q))
    Lr = M + leak_r_H
    ratio = M / Lr
    sigma_Ls = M + leak_s_H - M * ratio
    i_d = flux / M
    omega = motor.pole_pairs * speed_rad_s + c.Rr_ohm * ratio * i_q / flux
    u_d = c.Rs_ohm * i_d - omega * sigma_Ls * i_q
    u_q = c.Rs_ohm * i_q + omega * (sigma_Ls * i_d + ratio * flux)
    room_V = max(u_dc_V / math.sqrt(2.0) - limits.lost_V, 0.0)
    i = np.hypot(i_d, i_q)
    iron = omega * flux**2 / limits.iron_ohm if limits.iron_ohm else 0.0 * flux  # per pole pair
    taken_W = u_d * i_d + u_q * i_q + omega * iron
    possible = (i <= limits.i_max_A) & (np.hypot(u_d, u_q) <= room_V)
    possible &= taken_W >= -limits.brake_W
    torque = (motor.pole_pairs * (ratio * flux * i_q - iron))[possible]
    return (float(torque.min()), float(torque.max())) if torque.size else (0.0, 0.0)


@dataclasses.dataclass(frozen=True)
class Demand:
    """What a mission asks of the motor, at every moment that matters."""

    speed_rad_s: Array
    torque_Nm: Array
    u_dc_V: Array


def _share(torque_Nm: float, possible_Nm: tuple[float, float]) -> float:
    low, high = possible_Nm
    if not low < 0.0 < high:
        return math.inf
    return torque_Nm / (high if torque_Nm > 0.0 else low)


def impossible(limits: Limits, demand: Demand) -> str:
    """Why the mission cannot be done; empty: it can."""
    table: dict[tuple[int, int, int], tuple[float, float]] = {}

    def range_Nm(speed: int, u_dc: int, every: int) -> tuple[float, float]:
        key = (speed, u_dc, every)
        if key not in table:
            table[key] = torque_range_Nm(limits, float(speed), float(u_dc), every)
        return table[key]

    worst, text = MARGIN, ""
    for speed, torque, u_dc in zip(
        demand.speed_rad_s.tolist(), demand.torque_Nm.tolist(), demand.u_dc_V.tolist(), strict=True
    ):
        key = (round(speed), round(u_dc))
        # The share of a range inside the true one is the larger: most need no closer look.
        if torque == 0.0 or _share(torque, range_Nm(*key, COARSE)) <= worst:
            continue
        low, high = range_Nm(*key, 1)
        share = _share(torque, (low, high))
        if share > worst:
            worst = share
            text = (
                f"{torque:.1f} Nm at {speed * 30.0 / math.pi:.0f} min^-1 and {u_dc:.0f} V, "
                f"where {low:.1f} to {high:.1f} Nm are possible"
            )
    return text
