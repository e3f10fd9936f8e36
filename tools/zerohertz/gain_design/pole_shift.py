"""Gain that moves the motor's own poles: real parts times one factor, imaginary parts another."""

from __future__ import annotations

import numpy as np

from zerohertz.gain_design.closed_form import gain_for_poles
from zerohertz.gain_design.machine import ComplexArray, state_matrix
from zerohertz.motor import Circuit


def pole_shift_gain(
    circuit: Circuit, omega_rad_s: float, *, real_factor: float, imag_factor: float
) -> ComplexArray:
    """L that places the observer's poles at real_factor Re + j imag_factor Im of the motor's."""
    motor = np.linalg.eigvals(state_matrix(circuit, omega_rad_s))
    p1, p2 = real_factor * motor.real + 1j * imag_factor * motor.imag
    return gain_for_poles(circuit, omega_rad_s, p1, p2)
