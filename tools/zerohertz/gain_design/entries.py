"""L and X of every speed of a table, with a solve at few of them.

X varies smoothly with the speed. In an interval of which both ends are solved, the middle is solved
too and compared with the straight line between the ends. Where the line is as good, the speeds of
both halves try its X before they solve; where it is not, each half is an interval of its own. What
is tried is checked against all LMIs, and L never depends on it.
"""

from __future__ import annotations

import contextlib
import dataclasses
from collections.abc import Callable, Sequence

import numpy as np

from zerohertz.gain_design.closed_form import closed_form_gain
from zerohertz.gain_design.cones import InfeasibleError
from zerohertz.gain_design.gamma_positive_real import GUESS_ROOM, GammaPositiveReal, Multiplier
from zerohertz.gain_design.machine import ComplexArray, as_stored
from zerohertz.gain_design.pole_shift import pole_shift_gain
from zerohertz.gain_design.zero import zero_gain
from zerohertz.motor import Motor, MotorError

# Longest interval, in entries: from 400 elec. min^-1 on X is straight over this.
LONGEST = 64

Progress = Callable[[int], None]


@dataclasses.dataclass(frozen=True)
class Entry:
    """L at one speed, and the X that proves its gamma."""

    gain: ComplexArray
    multiplier: Multiplier | None  # None: the LMIs do not all hold, or nobody asked


def design_entries(
    motor: Motor, speeds_rad_s: Sequence[float], certificate: bool, progress: Progress
) -> tuple[list[Entry], int]:
    """The entries at these rising speeds, and how often the solver was run."""
    sweep = _Sweep(motor, speeds_rad_s, certificate, progress)
    last = len(speeds_rad_s) - 1
    sweep.design(0)
    for low in range(0, last, LONGEST):
        high = min(low + LONGEST, last)
        sweep.design(high)
        sweep.fill(low, high)
    return [sweep.entries[k] for k in range(len(speeds_rad_s))], sweep.lmi.solver.solves


class _Sweep:
    """The entries designed so far."""

    def __init__(
        self, motor: Motor, speeds_rad_s: Sequence[float], certificate: bool, progress: Progress
    ) -> None:
        self.lmi = GammaPositiveReal(motor)
        self.entries: dict[int, Entry] = {}
        self._motor, self._speeds_rad_s = motor, speeds_rad_s
        self._certificate, self._progress = certificate, progress

    def design(self, k: int, guess: Multiplier | None = None) -> None:
        """One entry."""
        omega_rad_s = self._speeds_rad_s[k]
        if self._motor.design.method == "gamma_pr":
            try:
                entry = Entry(*self.lmi.gain(omega_rad_s, guess))
            except InfeasibleError:
                raise _infeasible(self._motor, omega_rad_s) from None
        else:
            gain, multiplier = _explicit_gain(self._motor, omega_rad_s), None
            if self._certificate:
                with contextlib.suppress(InfeasibleError):
                    multiplier = self.lmi.multiplier(omega_rad_s, gain, guess)
            entry = Entry(gain, multiplier)
        self.entries[k] = entry
        self._progress(len(self.entries))

    def fill(self, low: int, high: int) -> None:
        """All entries between two that are designed."""
        middle = (low + high) // 2
        if middle == low:
            return
        self.design(middle)
        straight = self._is_good(self._guess(low, high, middle), middle)
        for first, last in ((low, middle), (middle, high)):
            if straight:
                for k in range(first + 1, last):
                    self.design(k, self._guess(first, last, k))
            else:
                self.fill(first, last)

    def _guess(self, low: int, high: int, k: int) -> Multiplier | None:
        ends = [(self._speeds_rad_s[end], self.entries[end].multiplier) for end in (low, high)]
        if any(multiplier is None for _, multiplier in ends):
            return None
        return self.lmi.between(self._speeds_rad_s[k], *ends)

    def _is_good(self, guess: Multiplier | None, k: int) -> bool:
        """Neither the gamma expected nor the one proven by the guess is far above the solved."""
        gain, solved = self.entries[k].gain, self.entries[k].multiplier
        if guess is None or solved is None or guess.gamma > GUESS_ROOM * solved.gamma:
            return False
        tried = self.lmi.with_X_of(guess, self._speeds_rad_s[k], gain)
        return tried is not None and tried.gamma <= GUESS_ROOM * solved.gamma


def _explicit_gain(motor: Motor, omega_rad_s: float) -> ComplexArray:
    """L of the methods that need no solver, as the table holds it."""
    design, circuit = motor.design, motor.circuit
    if design.method == "closed_form":
        p1_per_s = design.p1_at(omega_rad_s)
        exact = closed_form_gain(circuit, omega_rad_s, p1_per_s=p1_per_s, a=design.a, b=design.b)
    elif design.method == "pole_shift":
        factors = {"real_factor": design.real_factor, "imag_factor": design.imag_factor}
        exact = pole_shift_gain(circuit, omega_rad_s, **factors)
    else:
        exact = zero_gain()
    gain = as_stored(exact, omega_rad_s)
    if not np.all(np.isfinite(gain)):
        raise MotorError(f"{motor.file}: circuit: L is beyond float32; correct the five numbers")
    return gain


def _infeasible(motor: Motor, omega_rad_s: float) -> MotorError:
    elec_per_min = omega_rad_s * 60.0 / (2.0 * np.pi)
    return MotorError(
        f"{motor.file}: design.radius_per_s, design.decay_per_s: no gain meets the LMIs at "
        f"{elec_per_min:.0f} elec. min^-1; enlarge radius_per_s, or lower decay_per_s or dw0_rad_s"
    )
