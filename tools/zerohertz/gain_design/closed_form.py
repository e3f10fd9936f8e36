"""Gain in closed form: real poles, and G1 exactly positive real ("complete stability").

G1(s) = (s/eps)/D(s), D = det(sI - A - L C1). Re G1(j w_s) >= 0 for all w_s if and only if
det(A + L C1) is real and the poles are stable. det(A + L C1) = q (Rs/(sigma Ls) - l1 - l2/eps)
with q = tau - j w; it is set to the real number p1 p2, and the trace to p1 + p2.
"""

from __future__ import annotations

import numpy as np

from zerohertz.gain_design.machine import ComplexArray
from zerohertz.motor import Circuit


def gain_for_poles(circuit: Circuit, omega_rad_s: float, p1: complex, p2: complex) -> ComplexArray:
    """The one L that gives A(w) + L C1 the poles p1, p2 (1/s)."""
    q = circuit.tau_per_s - 1j * omega_rad_s
    l1_per_s = p1 + p2 + circuit.a11_per_s + q
    l2_ohm = circuit.eps_H * (circuit.Rs_ohm / circuit.sigma_Ls_H - p1 * p2 / q - l1_per_s)
    return np.array([l1_per_s, l2_ohm])


def closed_form_gain(
    circuit: Circuit, omega_rad_s: float, *, p1_per_s: float, a: float, b: float
) -> ComplexArray:
    """L with the poles p1 and -(a tau + b |w|), both real."""
    p2_per_s = -(a * circuit.tau_per_s + b * abs(omega_rad_s))
    return gain_for_poles(circuit, omega_rad_s, p1_per_s, p2_per_s)
