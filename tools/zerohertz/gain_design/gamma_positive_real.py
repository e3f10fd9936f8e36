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
from collections.abc import Callable

import clarabel
import numpy as np

from zerohertz.gain_design import cones
from zerohertz.gain_design.closed_form import closed_form_gain
from zerohertz.gain_design.cones import InfeasibleError, RealArray
from zerohertz.gain_design.machine import (
    C1,
    C2,
    MS_PER_S,
    ComplexArray,
    as_stored,
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


@dataclasses.dataclass(frozen=True)
class Multiplier:
    """X of the LMIs with the gamma it proves, for a given L."""

    gamma: float
    X: ComplexArray


# The functions below take any number of leading dimensions: the rows of the cones are the images
# of all unit vectors at once.


def _transposed(matrix: ComplexArray) -> ComplexArray:
    return matrix.conj().swapaxes(-1, -2)


def _he(matrix: ComplexArray) -> ComplexArray:
    return matrix + _transposed(matrix)


def _hermitian(p: RealArray) -> ComplexArray:
    matrix = np.empty((*p.shape[:-1], 2, 2), dtype=complex)
    matrix[..., 0, 0], matrix[..., 1, 1] = p[..., 0], p[..., 3]
    matrix[..., 0, 1] = p[..., 1] + 1j * p[..., 2]
    matrix[..., 1, 0] = matrix[..., 0, 1].conj()
    return matrix


def _column(k: RealArray) -> ComplexArray:
    return np.stack([k[..., 0] + 1j * k[..., 1], k[..., 2] + 1j * k[..., 3]], axis=-1)[..., None]


class GammaPositiveReal:
    """The LMIs of one motor. The cone rows are affine in w and 1/g: built once, then combined."""

    def __init__(self, motor: Motor) -> None:
        self._motor = motor
        self._rows, constant = _affine(lambda x: self._stack(x, 0.0, 0.0), _UNKNOWNS)
        self._rows_per_w = _affine(lambda x: self._stack(x, 1.0, 0.0), _UNKNOWNS)[0] - self._rows
        self._rows_per_floor = (
            _affine(lambda x: self._stack(x, 0.0, 1.0), _UNKNOWNS)[0] - self._rows
        )
        self._right = -constant - cones.strictness(_SIZES)

    def gain(self, omega_rad_s: float) -> tuple[ComplexArray, Multiplier]:
        """L at one speed (SI units, float32 values) and its X; InfeasibleError without one."""
        design = self._motor.design
        exact = closed_form_gain(
            self._motor.circuit,
            omega_rad_s,
            p1_per_s=design.p1_at(omega_rad_s),
            a=design.a,
            b=design.b,
        )
        reference = as_stored(exact, omega_rad_s)
        try:
            of_reference = self.multiplier(omega_rad_s, reference)
            gamma_reference = of_reference.gamma
        except InfeasibleError:
            gamma_reference = float("inf")
        # The floor is a lower bound of gamma*: a reference this near to it needs no stage one,
        # and at distance zero it is what stage two would return.
        if gamma_reference <= design.relax * self._floor(omega_rad_s):
            return reference, of_reference
        gamma_limit = design.relax * self.least_gamma(omega_rad_s)
        if gamma_reference <= gamma_limit:
            return reference, of_reference
        nearest = as_stored(self._nearest_gain(omega_rad_s, exact, gamma_limit), omega_rad_s)
        return nearest, self.multiplier(omega_rad_s, nearest)

    def multiplier(self, omega_rad_s: float, gain: ComplexArray) -> Multiplier:
        """Least gamma and its X for the given L; InfeasibleError when the LMIs do not hold."""
        rows, right = self._fixed(omega_rad_s, gain)
        objective = np.array([0.0, 0.0, 0.0, 0.0, 1.0])
        x = cones.minimise(objective, rows, right, cones.psd_cones(_SIZES_FIXED))
        gamma = self._floor(omega_rad_s) * float(np.sqrt(x[4]))
        return Multiplier(gamma, _hermitian(x[_P]) / gamma)

    def _floor(self, omega_rad_s: float) -> float:
        return gamma_floor(self._motor.circuit, self._motor.design.dw0_rad_s, omega_rad_s)

    def least_gamma(self, omega_rad_s: float) -> float:
        """Stage one: gamma*, over all gains."""
        objective = np.zeros(_UNKNOWNS)
        objective[_RHO] = 1.0
        x = cones.minimise(
            objective, self._rows_at(omega_rad_s), self._right, cones.psd_cones(_SIZES)
        )
        return self._floor(omega_rad_s) * float(np.sqrt(x[_RHO]))

    def _nearest_gain(
        self, omega_rad_s: float, reference: ComplexArray, gamma_limit: float
    ) -> ComplexArray:
        """Stage two: min |K - P Lref| (ties: largest P) subject to gamma <= gamma_limit."""
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
        x = cones.minimise(objective, extended, right, all_cones)
        gain = np.linalg.solve(_hermitian(x[_P]), _column(x[_K]))[:, 0]  # (17)
        return si_gain(self._motor.circuit, gain)

    def _product_columns(self, gain: ComplexArray) -> RealArray:
        """The map from the four numbers of P to those of K = P L."""
        scaled = scaled_gain(self._motor.circuit, gain)
        products = _hermitian(np.eye(4)) @ scaled
        return np.stack([products.real, products.imag], axis=-1).reshape(4, 4).T

    def _rows_at(self, omega_rad_s: float) -> RealArray:
        per_floor = self._rows_per_floor / self._floor(omega_rad_s)
        return self._rows + omega_rad_s * self._rows_per_w + per_floor

    def _stack(self, x: RealArray, omega_rad_s: float, per_floor: float) -> RealArray:
        """All matrices that have to be negative definite, as the solver's vector."""
        design = self._motor.design
        P, T_ms = _hermitian(x[..., _P]), design.period_s * MS_PER_S
        N = P @ scaled_state_matrix(self._motor.circuit, omega_rad_s) + _column(x[..., _K]) @ C1
        matrices = [
            *self._vertices(P, N, x[..., _RHO], per_floor),
            _disc(P, N, design.radius_per_s / MS_PER_S),
            _he(N) + 2.0 * design.decay_per_s / MS_PER_S * P,
            _disc(P, N + P / T_ms, 1.0 / T_ms),
        ]
        return cones.triangles(matrices)

    def _fixed(self, omega_rad_s: float, gain: ComplexArray) -> tuple[RealArray, RealArray]:
        """Rows and right side of the LMIs in P and rho alone, L given."""
        design, circuit = self._motor.design, self._motor.circuit
        A = scaled_state_matrix(circuit, omega_rad_s)
        A[:, 0] += scaled_gain(circuit, gain)
        per_floor, T_ms = 1.0 / self._floor(omega_rad_s), design.period_s * MS_PER_S

        def stack(x: RealArray) -> RealArray:
            P = _hermitian(x[..., _P])
            matrices = [
                *self._vertices(P, P @ A, x[..., 4], per_floor),
                _stein(P, A, design.radius_per_s / MS_PER_S),
                _he(P @ A) + 2.0 * design.decay_per_s / MS_PER_S * P,
                _stein(P, A + np.eye(2) / T_ms, 1.0 / T_ms),
            ]
            return cones.triangles(matrices)

        rows, constant = _affine(stack, 5)
        return rows, -constant - cones.strictness(_SIZES_FIXED)

    def _vertices(
        self, P: ComplexArray, N: ComplexArray, rho: RealArray, per_floor: float
    ) -> list[ComplexArray]:
        """(14) for +dw0 and -dw0, in the form of the module's header; N = P A + K C1."""
        dw0_rad_s = self._motor.design.dw0_rad_s
        matrices = []
        for dw_rad_s in (dw0_rad_s, -dw0_rad_s):
            PBe = P @ speed_error_input(dw_rad_s)
            matrix = np.empty((*P.shape[:-2], 3, 3), dtype=complex)
            matrix[..., :2, :2] = _he(N - PBe @ C2 / 2.0) + C2.T @ C2 / 2.0
            matrix[..., :2, 2:] = PBe * (per_floor / np.sqrt(2.0))
            matrix[..., 2:, :2] = _transposed(matrix[..., :2, 2:])
            matrix[..., 2, 2] = -rho
            matrices.append(matrix)
        return matrices


def _affine(function: Callable[[RealArray], RealArray], n: int) -> tuple[RealArray, RealArray]:
    """Matrix and constant of an affine function of n unknowns."""
    images = function(np.vstack([np.zeros((1, n)), np.eye(n)]))
    return (images[1:] - images[0]).T, images[0]


def _disc(P: ComplexArray, N: ComplexArray, radius: float) -> ComplexArray:
    """(15): the eigenvalues of P^-1 N are inside the disc."""
    matrix = np.empty((*P.shape[:-2], 4, 4), dtype=complex)
    matrix[..., :2, :2] = matrix[..., 2:, 2:] = -radius * P
    matrix[..., :2, 2:] = N
    matrix[..., 2:, :2] = _transposed(N)
    return matrix


def _stein(P: ComplexArray, A: ComplexArray, radius: float) -> ComplexArray:
    """(15) for a given A by Schur's complement: A^H P A / r - r P."""
    return A.conj().T @ P @ A / radius - radius * P
