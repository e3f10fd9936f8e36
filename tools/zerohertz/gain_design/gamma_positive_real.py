"""Gain by the gamma-positive-real LMIs (14)-(17), in two stages, at one speed at a time.

Unknowns are P = gamma X > 0 and K = P L (complex, Hermitian 2x2 and 2x1) and rho = (gamma/g)^2,
g the floor below which no gain can go. Multiplied by gamma, and with its last row eliminated,
(14) reads
    [ He(P Gamma + K C1) + C2^H C2/2   P Be/(sqrt2 g) ;  *  -rho ] < 0,  Gamma = A - Be C2/2,
imposed for the speed errors +dw0 and -dw0 with one P. The others are homogeneous in X:
    disc radius r (15): [ -r P  P A + K C1 ; *  -r P ] < 0;   decay h (16): He(P A + K C1) + 2hP < 0
    Euler disc, ours:   the same as (15) for A + 1/T and 1/T, so that every pole has |1 + T s| < 1.
The optimum of gamma leaves L almost free; stage two takes, within gamma <= relax gamma*, the gain
nearest to the exactly positive real one of closed_form.py.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from zerohertz.gain_design import cones
from zerohertz.gain_design.closed_form import closed_form_gain
from zerohertz.gain_design.cones import InfeasibleError, RealArray
from zerohertz.gain_design.hermitian import (
    affine,
    column,
    disc,
    he,
    hermitian,
    stein,
    transposed,
)
from zerohertz.gain_design.machine import (
    C1,
    C2,
    MS_PER_S,
    ComplexArray,
    as_stored,
    gamma_bound,
    gamma_floor,
    scaled_gain,
    scaled_state_matrix,
    si_gain,
    speed_error_input,
)
from zerohertz.motor import Motor

# The unknowns: p11, Re p12, Im p12, p22; Re k1, Im k1, Re k2, Im k2; rho.
_P, _K, _RHO = slice(0, 4), slice(4, 8), 8
_UNKNOWNS = 9
_SIZES = (3, 3, 4, 2, 4)  # (14) twice, (15), (16), Euler disc
_SIZES_FIXED = (3, 3, 2, 2, 2)  # with L given the discs are Stein inequalities
# The least |K - P Lref| leaves P free along a line (L moves by .3 % with the solver's scaling): of
# these points the largest trace of P is taken, where L = Lref + P^-1 (K - P Lref) is nearest.
_TIE_BREAK = 1.0e-4
# A guess may prove a gamma this much above the one it expects: a tenth of the room that the table
# keeps over the least gamma.
GUESS_ROOM = 1.001


@dataclasses.dataclass(frozen=True)
class Multiplier:
    """X of the LMIs with the gamma it proves, for a given L."""

    gamma: float
    X: ComplexArray

    @property
    def P(self) -> ComplexArray:
        return self.gamma * self.X


class GammaPositiveReal:
    """The LMIs of one motor. The cone rows are affine in w and 1/g: built once, then combined."""

    def __init__(self, motor: Motor) -> None:
        self._motor = motor
        self._rows, constant = affine(lambda x: self._stack(x, 0.0, 0.0), _UNKNOWNS)
        self._rows_per_w = affine(lambda x: self._stack(x, 1.0, 0.0), _UNKNOWNS)[0] - self._rows
        self._rows_per_floor = affine(lambda x: self._stack(x, 0.0, 1.0), _UNKNOWNS)[0] - self._rows
        self._right = -constant - cones.strictness(_SIZES)
        self.solver = cones.Solver()

    def gain(
        self, omega_rad_s: float, guess: Multiplier | None = None
    ) -> tuple[ComplexArray, Multiplier]:
        """L at one speed (SI units, float32 values) and its X; InfeasibleError without one.

        The guess saves solves where it is good, and changes no gain.
        """
        design = self._motor.design
        exact = closed_form_gain(
            self._motor.circuit,
            omega_rad_s,
            p1_per_s=design.p1_at(omega_rad_s),
            a=design.a,
            b=design.b,
        )
        reference = as_stored(exact, omega_rad_s)
        # The floor is a lower bound of gamma*: a reference this near to it needs no stage one,
        # and at distance zero it is what stage two would return.
        tried = self._tried(guess, omega_rad_s, reference)
        if tried is not None and tried.gamma <= design.relax * self._floor(omega_rad_s):
            return reference, tried
        bound = gamma_bound(self._motor.circuit, design.dw0_rad_s, omega_rad_s, reference)
        of_reference: Multiplier | None = None
        for least_gamma in (self._floor, self.least_gamma):
            gamma_limit = design.relax * least_gamma(omega_rad_s)
            if bound <= gamma_limit:
                of_reference = of_reference or self._multiplier_if_any(omega_rad_s, reference)
                if of_reference.gamma <= gamma_limit:
                    return reference, of_reference
        nearest = as_stored(self._nearest_gain(omega_rad_s, exact, gamma_limit), omega_rad_s)
        return nearest, self.multiplier(omega_rad_s, nearest, guess)

    def multiplier(
        self, omega_rad_s: float, gain: ComplexArray, guess: Multiplier | None = None
    ) -> Multiplier:
        """Least gamma and its X for the given L; InfeasibleError when the LMIs do not hold.

        The X of a guess is taken without a solve when it proves the gamma of the guess.
        """
        tried = self._tried(guess, omega_rad_s, gain)
        if tried is not None:
            return tried
        rows, right = self._fixed(omega_rad_s, gain)
        objective = np.array([0.0, 0.0, 0.0, 0.0, 1.0])
        x = self.solver.minimise(objective, rows, right, cones.psd_cones(_SIZES_FIXED))
        gamma = self._floor(omega_rad_s) * float(np.sqrt(x[4]))
        return Multiplier(gamma, hermitian(x[_P]) / gamma)

    def _multiplier_if_any(self, omega_rad_s: float, gain: ComplexArray) -> Multiplier:
        """The multiplier, with an infinite gamma where the LMIs do not hold."""
        try:
            return self.multiplier(omega_rad_s, gain)
        except InfeasibleError:
            return Multiplier(math.inf, np.eye(2, dtype=complex))

    def _tried(
        self, guess: Multiplier | None, omega_rad_s: float, gain: ComplexArray
    ) -> Multiplier | None:
        """What the X of the guess proves for L, if that is about as much as expected."""
        tried = guess and self.with_X_of(guess, omega_rad_s, gain)
        return tried if tried and tried.gamma <= GUESS_ROOM * guess.gamma else None

    def with_X_of(
        self, guess: Multiplier, omega_rad_s: float, gain: ComplexArray
    ) -> Multiplier | None:
        """The least gamma that P = gamma X of the guess proves for L; None: an LMI fails."""
        P, A = guess.P, self._error_matrix(omega_rad_s, gain)
        vertices = self._vertices(P, P @ A, np.array(0.0), 1.0)
        corners = [matrix[:2, :2] for matrix in vertices]
        negative = np.array([-P, *corners, *self._regions(P, A)])
        if np.linalg.eigvalsh(negative).max() > -cones.STRICTNESS / 2.0:
            return None
        # (14) by Schur's complement, the floor left out: gamma^2 in the place of rho.
        edges = [matrix[:2, 2:] for matrix in vertices]
        solved = np.linalg.solve(np.array(corners), np.array(edges))
        gamma = math.sqrt(np.max(-(transposed(np.array(edges)) @ solved).real))
        return Multiplier(gamma, P / gamma)

    def between(
        self, omega_rad_s: float, low: tuple[float, Multiplier], high: tuple[float, Multiplier]
    ) -> Multiplier:
        """A guess from two other speeds: P, and gamma over its floor, on straight lines."""
        (low_rad_s, low_end), (high_rad_s, high_end) = low, high
        share = (omega_rad_s - low_rad_s) / (high_rad_s - low_rad_s)
        ratios = [end.gamma / self._floor(at) for at, end in (low, high)]
        gamma = self._floor(omega_rad_s) * ((1.0 - share) * ratios[0] + share * ratios[1])
        return Multiplier(gamma, ((1.0 - share) * low_end.P + share * high_end.P) / gamma)

    def _floor(self, omega_rad_s: float) -> float:
        return gamma_floor(self._motor.circuit, self._motor.design.dw0_rad_s, omega_rad_s)

    def least_gamma(self, omega_rad_s: float) -> float:
        """Stage one: gamma*, over all gains."""
        objective = np.zeros(_UNKNOWNS)
        objective[_RHO] = 1.0
        x = self.solver.minimise(
            objective, self._rows_at(omega_rad_s), self._right, cones.psd_cones(_SIZES)
        )
        return self._floor(omega_rad_s) * float(np.sqrt(x[_RHO]))

    def _nearest_gain(
        self, omega_rad_s: float, reference: ComplexArray, gamma_limit: float
    ) -> ComplexArray:
        """Stage two: min |K - P Lref| (ties: largest P) subject to gamma <= gamma_limit."""
        import clarabel

        rows = self._rows_at(omega_rad_s)
        count, distance = len(rows), _UNKNOWNS
        extended = np.zeros((count + 6, _UNKNOWNS + 1))
        extended[:count, :_UNKNOWNS] = rows
        extended[count, _RHO] = 1.0  # rho <= its limit
        extended[count + 1, distance] = -1.0  # (distance, K - P Lref) in the second-order cone
        extended[count + 2 :, _P] = self._product_columns(reference)
        extended[count + 2 :, _K] = -np.eye(4)
        rho_limit = (gamma_limit / self._floor(omega_rad_s)) ** 2
        right = np.concatenate([self._right, [rho_limit], np.zeros(5)])
        objective = np.zeros(_UNKNOWNS + 1)
        objective[distance] = 1.0
        objective[[0, 3]] = -_TIE_BREAK
        all_cones = [
            *cones.psd_cones(_SIZES),
            clarabel.NonnegativeConeT(1),
            clarabel.SecondOrderConeT(5),
        ]
        x = self.solver.minimise(objective, extended, right, all_cones)
        gain = np.linalg.solve(hermitian(x[_P]), column(x[_K]))[:, 0]  # (17)
        return si_gain(self._motor.circuit, gain)

    def _product_columns(self, gain: ComplexArray) -> RealArray:
        """The map from the four numbers of P to those of K = P L."""
        scaled = scaled_gain(self._motor.circuit, gain)
        products = hermitian(np.eye(4)) @ scaled
        return np.stack([products.real, products.imag], axis=-1).reshape(4, 4).T

    def _rows_at(self, omega_rad_s: float) -> RealArray:
        per_floor = self._rows_per_floor / self._floor(omega_rad_s)
        return self._rows + omega_rad_s * self._rows_per_w + per_floor

    def _stack(self, x: RealArray, omega_rad_s: float, per_floor: float) -> RealArray:
        """All matrices that have to be negative definite, as the solver's vector."""
        design = self._motor.design
        P, T_ms = hermitian(x[..., _P]), design.period_s * MS_PER_S
        N = P @ scaled_state_matrix(self._motor.circuit, omega_rad_s) + column(x[..., _K]) @ C1
        matrices = [
            *self._vertices(P, N, x[..., _RHO], per_floor),
            disc(P, N, design.radius_per_s / MS_PER_S),
            he(N) + 2.0 * design.decay_per_s / MS_PER_S * P,
            disc(P, N + P / T_ms, 1.0 / T_ms),
        ]
        return cones.triangles(matrices)

    def _fixed(self, omega_rad_s: float, gain: ComplexArray) -> tuple[RealArray, RealArray]:
        """Rows and right side of the LMIs in P and rho alone, L given."""
        A, per_floor = self._error_matrix(omega_rad_s, gain), 1.0 / self._floor(omega_rad_s)

        def stack(x: RealArray) -> RealArray:
            P = hermitian(x[..., _P])
            vertices = self._vertices(P, P @ A, x[..., 4], per_floor)
            return cones.triangles([*vertices, *self._regions(P, A)])

        rows, constant = affine(stack, 5)
        return rows, -constant - cones.strictness(_SIZES_FIXED)

    def _error_matrix(self, omega_rad_s: float, gain: ComplexArray) -> ComplexArray:
        """A(w) + L C1 in the coordinates of the LMIs."""
        A = scaled_state_matrix(self._motor.circuit, omega_rad_s)
        A[:, 0] += scaled_gain(self._motor.circuit, gain)
        return A

    def _regions(self, P: ComplexArray, A: ComplexArray) -> list[ComplexArray]:
        """(15), (16) and the Euler disc, L given."""
        design, T_ms = self._motor.design, self._motor.design.period_s * MS_PER_S
        return [
            stein(P, A, design.radius_per_s / MS_PER_S),
            he(P @ A) + 2.0 * design.decay_per_s / MS_PER_S * P,
            stein(P, A + np.eye(2) / T_ms, 1.0 / T_ms),
        ]

    def _vertices(
        self, P: ComplexArray, N: ComplexArray, rho: RealArray, per_floor: float
    ) -> list[ComplexArray]:
        """(14) for +dw0 and -dw0, in the form of the module's header; N = P A + K C1."""
        dw0_rad_s = self._motor.design.dw0_rad_s
        matrices = []
        for dw_rad_s in (dw0_rad_s, -dw0_rad_s):
            PBe = P @ speed_error_input(dw_rad_s)
            matrix = np.empty((*P.shape[:-2], 3, 3), dtype=complex)
            matrix[..., :2, :2] = he(N - PBe @ C2 / 2.0) + C2.T @ C2 / 2.0
            matrix[..., :2, 2:] = PBe * (per_floor / np.sqrt(2.0))
            matrix[..., 2:, :2] = transposed(matrix[..., :2, 2:])
            matrix[..., 2, 2] = -rho
            matrices.append(matrix)
        return matrices
