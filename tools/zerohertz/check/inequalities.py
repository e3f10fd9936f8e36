"""The LMIs (14)-(16) and the Euler disc at one speed, for a given gain, in exact rationals.

Everything is built from motor.toml's decimals, the float32 words and the table's step; no number
passes through floating point. Coordinates z = [eps i_s; lambda_r], time in ms (those of X).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from fractions import Fraction

from zerohertz.check.exact import (
    ZERO,
    Matrix,
    Number,
    adjoint,
    blocks,
    conjugate,
    hermitian_part_twice,
    is_negative_definite,
    is_positive_definite,
    product,
    real,
    scaled,
    solve,
    sum_of,
)

MS_PER_S = 1000
# Name of each inequality as it appears in messages, in the order of checking.
ALL = ("X > 0", "gamma (14) at +dw0", "gamma (14) at -dw0", "disc (15)", "decay (16)", "Euler disc")


@dataclasses.dataclass(frozen=True)
class Machine:
    """Exact data of the machine and of the requirements, SI units."""

    Rs_ohm: Fraction
    Rr_ohm: Fraction
    Ls_H: Fraction
    Lr_H: Fraction
    M_H: Fraction
    dw0_rad_s: Fraction
    radius_per_s: Fraction
    decay_per_s: Fraction
    period_s: Fraction

    @property
    def sigma(self) -> Fraction:
        return 1 - self.M_H**2 / (self.Ls_H * self.Lr_H)

    @property
    def eps_H(self) -> Fraction:
        return self.sigma * self.Ls_H * self.Lr_H / self.M_H

    def error_matrix(self, omega_rad_s: Fraction, l1: Number, l2: Number) -> Matrix:
        """A(w) + L C1 of eq. (1), (3), in z and ms."""
        R, sigma_Ls = self.Rr_ohm / self.Lr_H, self.sigma * self.Ls_H
        eps = self.eps_H
        a11 = -(self.Rs_ohm + self.M_H**2 * self.Rr_ohm / self.Lr_H**2) / sigma_Ls
        current = [(a11 + l1[0], l1[1]), (R / eps, -omega_rad_s / eps)]
        flux = [(self.M_H * R + l2[0], l2[1]), (-R, omega_rad_s)]
        # z = S x with S = diag(eps, 1): S A S^-1.
        in_z = [
            [current[0], (eps * current[1][0], eps * current[1][1])],
            [(flux[0][0] / eps, flux[0][1] / eps), flux[1]],
        ]
        return scaled(Fraction(1, MS_PER_S), in_z)

    def speed_error_input(self, dw_rad_s: Fraction) -> Matrix:
        """-Bw dw j in z and ms; Bw = [1/eps; -1] becomes [1; -1]."""
        return [[(Fraction(0), -dw_rad_s / MS_PER_S)], [(Fraction(0), dw_rad_s / MS_PER_S)]]


def failing(machine: Machine, A: Matrix, gamma: Fraction, X: Matrix) -> list[str]:
    """Names of the inequalities that X and gamma do not prove; A = A(w) + L C1."""
    verdicts = (
        is_positive_definite(X),
        is_negative_definite(gamma_inequality(machine, A, gamma, X, machine.dw0_rad_s)),
        is_negative_definite(gamma_inequality(machine, A, gamma, X, -machine.dw0_rad_s)),
        is_negative_definite(disc_inequality(A, X, machine.radius_per_s / MS_PER_S)),
        is_negative_definite(decay_inequality(machine, A, X)),
        is_negative_definite(euler_inequality(machine, A, X)),
    )
    return [name for name, holds in zip(ALL, verdicts, strict=True) if not holds]


def gamma_inequality(
    machine: Machine, A: Matrix, gamma: Fraction, X: Matrix, dw_rad_s: Fraction
) -> Matrix:
    """(14), its last two rows and columns multiplied by sqrt 2 (a congruence)."""
    Be = machine.speed_error_input(dw_rad_s)
    C2 = [[ZERO, real(1)]]
    Gamma = sum_of(A, scaled(Fraction(-1, 2), product(Be, C2)))  # Gamma + L C1
    XBe, corner = product(X, Be), [[real(-2 * gamma)]]
    return blocks(
        [
            [hermitian_part_twice(product(X, Gamma)), XBe, adjoint(C2)],
            [adjoint(XBe), corner, [[ZERO]]],
            [C2, [[ZERO]], corner],
        ]
    )


def disc_inequality(A: Matrix, X: Matrix, radius: Fraction) -> Matrix:
    """(15)."""
    XA = product(X, A)
    return blocks([[scaled(-radius, X), XA], [adjoint(XA), scaled(-radius, X)]])


def decay_inequality(machine: Machine, A: Matrix, X: Matrix) -> Matrix:
    """(16)."""
    shift = scaled(2 * machine.decay_per_s / MS_PER_S, X)
    return sum_of(hermitian_part_twice(product(X, A)), shift)


def euler_inequality(machine: Machine, A: Matrix, X: Matrix) -> Matrix:
    """(15) about -1/T: every eigenvalue s of A has |1 + T s| < 1."""
    return disc_inequality(_about_euler_centre(machine, A), X, _euler_radius(machine))


def mirrored(A: Matrix) -> Matrix:
    """The conjugate matrix: what the firmware's conj L at -w has to give."""
    return [[conjugate(x) for x in row] for row in A]


def stein_multiplier(A: Matrix, radius: Fraction) -> Matrix | None:
    """X of A^H X A - radius^2 X = -I: positive definite exactly when every |s| < radius."""

    def image(X: Matrix) -> Matrix:
        return sum_of(product(adjoint(A), product(X, A)), scaled(-(radius**2), X))

    return _solution_for_minus_one(image)


def lyapunov_multiplier(machine: Machine, A: Matrix) -> Matrix | None:
    """X of He(X A) + 2 h X = -I: positive definite exactly when every Re s < -h."""
    return _solution_for_minus_one(lambda X: decay_inequality(machine, A, X))


def holds_alone(machine: Machine, A: Matrix) -> dict[str, bool]:
    """Disc, decay and Euler disc, each with an X of its own: exact, true or false."""
    radius = machine.radius_per_s / MS_PER_S
    multipliers = {
        "disc (15)": stein_multiplier(A, radius),
        "decay (16)": lyapunov_multiplier(machine, A),
        "Euler disc": stein_multiplier(_about_euler_centre(machine, A), _euler_radius(machine)),
    }
    return {name: X is not None and is_positive_definite(X) for name, X in multipliers.items()}


def _euler_radius(machine: Machine) -> Fraction:
    return 1 / (machine.period_s * MS_PER_S)


def _about_euler_centre(machine: Machine, A: Matrix) -> Matrix:
    centre = real(_euler_radius(machine))
    return sum_of(A, [[centre, ZERO], [ZERO, centre]])


def _solution_for_minus_one(image: Callable[[Matrix], Matrix]) -> Matrix | None:
    """X Hermitian with image(X) = -I, image linear; four real unknowns."""
    basis = [hermitian(*(Fraction(int(i == k)) for i in range(4))) for k in range(4)]
    images = [_real_numbers(image(X)) for X in basis]
    solution = solve(
        [[column[i] for column in images] for i in range(4)],
        [Fraction(-1), Fraction(0), Fraction(0), Fraction(-1)],
    )
    return None if solution is None else hermitian(*solution)


def hermitian(x11: Fraction, x12_re: Fraction, x12_im: Fraction, x22: Fraction) -> Matrix:
    """X from its four numbers, in the order of l_gain.json."""
    return [[real(x11), (x12_re, x12_im)], [(x12_re, -x12_im), real(x22)]]


def _real_numbers(matrix: Matrix) -> list[Fraction]:
    return [matrix[0][0][0], matrix[0][1][0], matrix[0][1][1], matrix[1][1][0]]
