"""From what the firmware found at the terminals to a T-equivalent circuit and its rated flux.

Terminals do not tell how the leakage is shared: it is taken as equal on both sides, which is what
most published circuits do. Any other share is the same machine with the rotor rescaled.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from zerohertz.commission.curve import monotone_cubic
from zerohertz.commission.plate import Plate
from zerohertz.motor import Circuit
from zerohertz.sim import Commissioned


@dataclass(frozen=True)
class Identified:
    """The motor at rated flux; vectors power invariant."""

    circuit: Circuit
    main_flux_Wb: float  # what "rated flux" is: main flux at rated voltage, current and cos phi
    rotor_flux_Wb: float
    i_d_A: float  # makes that rotor flux
    lost_V: float  # per leg
    curve: tuple[tuple[float, float], ...]  # main flux, magnetising current


def equal_leakage(total_H: float, sigma_Ls_H: float) -> tuple[float, float]:
    """M and the leakage l of either side that give Ls = total and sigma Ls."""
    gamma_H = total_H - sigma_Ls_H  # M^2/Lr
    M_H = math.sqrt(gamma_H * total_H)
    return M_H, total_H - M_H


def rated_main_flux_Wb(plate: Plate, Rs_ohm: float, leak_H: float) -> float:
    """Main flux at rated voltage, frequency, current and cos phi."""
    current_A = plate.current_vector_A * complex(plate.cos_phi, -math.sqrt(1.0 - plate.cos_phi**2))
    stator_Wb = (plate.voltage_V - Rs_ohm * current_A) / (1j * plate.omega_rad_s)
    return abs(stator_Wb - leak_H * current_A)


def solve(found: Commissioned, plate: Plate) -> Identified:
    """The circuit at rated flux."""
    # Small changes about the bias: the leakage is constant, M is the curve's slope there.
    slope_H, leak_H = equal_leakage(found.M_gamma_H + found.sigma_Ls_H, found.sigma_Ls_H)
    Rr_ohm = found.Rr_gamma_ohm * ((slope_H + leak_H) / slope_H) ** 2
    curve = [(0.0, 0.0)]
    curve += [(psi - leak_H * i, i) for psi, i in zip(found.flux_Wb, found.level_A, strict=True)]
    flux_Wb, current_A = zip(*curve, strict=True)
    main_Wb = rated_main_flux_Wb(plate, found.Rs_ohm, leak_H)
    M_H = main_Wb / _current_at(flux_Wb, current_A, main_Wb)
    circuit = Circuit(
        Rs_ohm=found.Rs_ohm, Rr_ohm=Rr_ohm, Ls_H=M_H + leak_H, Lr_H=M_H + leak_H, M_H=M_H
    )
    rotor_Wb = rotor_flux_Wb(circuit, plate)
    return Identified(
        circuit=circuit,
        main_flux_Wb=main_Wb,
        rotor_flux_Wb=rotor_Wb,
        i_d_A=rotor_Wb / M_H,
        lost_V=found.lost_V,
        curve=tuple(curve),
    )


def identified(circuit: Circuit, plate: Plate) -> Identified:
    """A circuit that is known, as it would have been found; its magnetising curve is not known."""
    leak_H = circuit.Ls_H - circuit.M_H
    rotor_Wb = rotor_flux_Wb(circuit, plate)
    return Identified(
        circuit=circuit,
        main_flux_Wb=rated_main_flux_Wb(plate, circuit.Rs_ohm, leak_H),
        rotor_flux_Wb=rotor_Wb,
        i_d_A=rotor_Wb / circuit.M_H,
        lost_V=0.0,
        curve=(),
    )


def rotor_flux_Wb(circuit: Circuit, plate: Plate) -> float:
    """Rotor flux at rated voltage, frequency, current and cos phi."""
    current_A = plate.current_vector_A * complex(plate.cos_phi, -math.sqrt(1.0 - plate.cos_phi**2))
    stator_Wb = (plate.voltage_V - circuit.Rs_ohm * current_A) / (1j * plate.omega_rad_s)
    return circuit.Lr_H / circuit.M_H * abs(stator_Wb - circuit.sigma_Ls_H * current_A)


def _current_at(flux_Wb: tuple[float, ...], current_A: tuple[float, ...], at_Wb: float) -> float:
    """On the magnetising curve, i/psi interpolated in psi: smooth and without a kink at zero."""
    pairs = list(zip(flux_Wb, current_A, strict=True))[1:]
    ratio = [current / flux for flux, current in pairs]
    return monotone_cubic([flux for flux, _ in pairs], ratio, at_Wb) * at_Wb
