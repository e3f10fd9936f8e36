"""Looks for X where a table brings none, L fixed: the real 8x8 form of (14), as printed.

The search is numerical and proves nothing; what it returns is rounded to decimals, and only the
exact check counts. By symmetry X may be taken to commute with J, so four numbers describe it.
"""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np

from zerohertz.check.exact import Matrix, is_negative_definite, is_positive_definite
from zerohertz.check.inequalities import MS_PER_S, Machine, failing, gamma_inequality, hermitian

X4 = tuple[Fraction, Fraction, Fraction, Fraction]

_J = np.array([[0.0, -1.0], [1.0, 0.0]])
_MARGIN = 1.0e-6  # strictness asked of the solver
_ROOM = 1.01  # gamma kept over the least one
_TOLERANCE = 1.0e-7


def find_multiplier(machine: Machine, A: Matrix) -> tuple[Fraction, X4] | tuple[None, None]:
    """gamma and X for which every inequality is proven, or (None, None)."""
    found = _search(machine, A, together=True)
    if found is None or failing(machine, A, found[0], hermitian(*found[1])):
        return None, None
    return found


def gamma_multiplier(machine: Machine, A: Matrix) -> Fraction | None:
    """A gamma proven by (14) at both vertices with an X of its own, or None."""
    found = _search(machine, A, together=False)
    if found is None:
        return None
    gamma, X = found[0], hermitian(*found[1])
    proven = is_positive_definite(X) and all(
        is_negative_definite(gamma_inequality(machine, A, gamma, X, dw))
        for dw in (machine.dw0_rad_s, -machine.dw0_rad_s)
    )
    return gamma if proven else None


def _search(machine: Machine, A: Matrix, together: bool) -> tuple[Fraction, X4] | None:
    import clarabel  # with its sparse matrices 150 MB; few tables need them
    from scipy import sparse

    matrices = [_upper(m) for m in _images(machine, _as_real(A), together)]
    rows = np.hstack([vectors[1:] - vectors[0] for vectors in matrices]).T
    right = np.concatenate([-vectors[0] for vectors in matrices])
    cones = [clarabel.PSDTriangleConeT(_side(vectors.shape[1])) for vectors in matrices]
    right -= _MARGIN * np.concatenate([_upper(np.eye(cone.dim)[None])[0] for cone in cones])
    settings = clarabel.DefaultSettings()
    settings.verbose, settings.max_threads = False, 1
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = _TOLERANCE
    solver = clarabel.DefaultSolver(
        sparse.csc_matrix((5, 5)),
        np.array([0.0, 0.0, 0.0, 0.0, 1.0]),
        sparse.csc_matrix(rows),
        right,
        cones,
        settings,
    )
    solution = solver.solve()
    if "Solved" not in str(solution.status):
        return None
    *X, gamma = solution.x
    return Fraction(f"{_ROOM * gamma:.7g}"), tuple(Fraction(f"{x:.9g}") for x in X)


def _images(machine: Machine, A: np.ndarray, together: bool) -> list[np.ndarray]:
    """Every matrix to be negative definite, for zero and for each unknown in turn: (6, n, n)."""
    unknowns = np.vstack([np.zeros((1, 5)), np.eye(5)])
    X = np.array([_real_X(*x[:4]) for x in unknowns])
    gamma = unknowns[:, 4]
    dw0_rad_s = float(machine.dw0_rad_s)
    images = [_bounded_real(X, A, gamma, dw) for dw in (dw0_rad_s, -dw0_rad_s)]
    if together:
        radius = float(machine.radius_per_s) / MS_PER_S
        euler = 1.0 / (float(machine.period_s) * MS_PER_S)
        XA = X @ A
        decay = float(machine.decay_per_s) / MS_PER_S
        images.append(A.T @ XA / radius - radius * X)
        images.append(XA + XA.swapaxes(1, 2) + 2.0 * decay * X)
        about = A + euler * np.eye(4)
        images.append(about.T @ X @ about / euler - euler * X)
    else:
        images.append(-X)
    return images


def _bounded_real(X: np.ndarray, A: np.ndarray, gamma: np.ndarray, dw_rad_s: float) -> np.ndarray:
    """(14), real."""
    Be = np.vstack([-_J, _J]) * dw_rad_s / MS_PER_S
    C2 = np.hstack([np.zeros((2, 2)), np.eye(2)])
    XG, XBe = X @ (A - Be @ C2 / 2.0), X @ Be / math.sqrt(2.0)
    image = np.zeros((len(X), 8, 8))
    image[:, :4, :4] = XG + XG.swapaxes(1, 2)
    image[:, :4, 4:6] = XBe
    image[:, 4:6, :4] = XBe.swapaxes(1, 2)
    image[:, :4, 6:] = C2.T / math.sqrt(2.0)
    image[:, 6:, :4] = C2 / math.sqrt(2.0)
    image[:, 4:, 4:] = -gamma[:, None, None] * np.eye(4)
    return image


def _as_real(A: Matrix) -> np.ndarray:
    """x + j y as x I + y J, entry by entry."""
    return np.block([[float(x[0]) * np.eye(2) + float(x[1]) * _J for x in row] for row in A])


def _real_X(x11: float, x12_re: float, x12_im: float, x22: float) -> np.ndarray:
    edge = x12_re * np.eye(2) + x12_im * _J
    return np.block([[x11 * np.eye(2), edge], [edge.T, x22 * np.eye(2)]])


def _upper(matrices: np.ndarray) -> np.ndarray:
    """Upper triangles by columns, off-diagonal times sqrt 2, one row per matrix."""
    columns, rows = np.tril_indices(matrices.shape[-1])
    weight = np.where(rows == columns, 1.0, math.sqrt(2.0))
    return matrices[..., rows, columns] * weight


def _side(length: int) -> int:
    return (math.isqrt(8 * length + 1) - 1) // 2
