"""L = 0: the observer is a copy of the motor (Figs. 6, 8, 10, 13, 14)."""

from __future__ import annotations

import numpy as np

from zerohertz.gain_design.machine import ComplexArray


def zero_gain() -> ComplexArray:
    return np.zeros(2, dtype=complex)
