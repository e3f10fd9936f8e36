"""Hermitian matrix inequalities as cones of the solver Clarabel, called directly.

A complex Hermitian H >= 0 holds exactly when the real symmetric [[Re, -Im], [Im, Re]] >= 0. A
symmetric matrix enters the solver as its upper triangle by columns, off-diagonal times sqrt 2.

The solver and its sparse matrices are 150 MB: they are imported when a table is designed.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    import clarabel
    from scipy import sparse

RealArray = npt.NDArray[np.float64]

# Every inequality is asked for with this much to spare (in coordinates where its entries are of
# the order of one to a hundred), so that it survives the rounding of L and X.
STRICTNESS = 1.0e-6
# The objective is scaled to about one; what the solver returns is proven afterwards anyway.
TOLERANCE = 1.0e-7


class InfeasibleError(Exception):
    """The solver found no point, or proved that there is none."""


def triangles(matrices: Sequence[npt.NDArray[np.complex128]]) -> RealArray:
    """Complex Hermitian matrices (..., n, n) as one vector (..., m) for the solver."""
    return np.concatenate([_triangle(matrix) for matrix in matrices], axis=-1)


def _triangle(matrix: npt.NDArray[np.complex128]) -> RealArray:
    n = matrix.shape[-1]
    real = np.empty((*matrix.shape[:-2], 2 * n, 2 * n))
    real[..., :n, :n] = real[..., n:, n:] = matrix.real
    real[..., n:, :n] = matrix.imag
    real[..., :n, n:] = -matrix.imag
    rows, columns, weights = _upper_by_columns(2 * n)
    return real[..., rows, columns] * weights


@functools.cache
def _upper_by_columns(n: int) -> tuple[npt.NDArray, npt.NDArray, RealArray]:
    columns, rows = np.tril_indices(n)
    return rows, columns, np.where(rows == columns, 1.0, np.sqrt(2.0))


def psd_cones(sizes: Sequence[int]) -> list[clarabel.PSDTriangleConeT]:
    """Cones for complex Hermitian matrices of these sizes."""
    import clarabel

    return [clarabel.PSDTriangleConeT(2 * n) for n in sizes]


def strictness(sizes: Sequence[int]) -> RealArray:
    """STRICTNESS times the identity, in the solver's vector, for matrices of these sizes."""
    return STRICTNESS * triangles([np.eye(n, dtype=complex) for n in sizes])


class Solver:
    """Clarabel, and how often it was run."""

    def __init__(self) -> None:
        self.solves = 0

    def minimise(
        self, objective: RealArray, rows: RealArray, right: RealArray, cones: list
    ) -> RealArray:
        """min objective'x with right - rows x in the cones; InfeasibleError without a point."""
        import clarabel
        from scipy import sparse

        no_quadratic, columns = _zeros(len(objective)), sparse.csc_matrix(rows)
        # The coordinates are well scaled: equilibration and iterative refinement would only cost
        # time. The rare problem on which the solver gets stuck is given both, in a second try.
        for careful in (False, True):
            problem = (no_quadratic, objective, columns, right, cones)
            solution = clarabel.DefaultSolver(*problem, _settings(careful)).solve()
            self.solves += 1
            status = str(solution.status)
            # "Almost" is good enough: every result is proven in exact arithmetic before it is used.
            if status in ("Solved", "AlmostSolved"):
                return np.array(solution.x)
            if "Infeasible" in status:
                break
        raise InfeasibleError(status)


@functools.cache
def _zeros(size: int) -> sparse.csc_matrix:
    from scipy import sparse

    return sparse.csc_matrix((size, size))


def _settings(careful: bool) -> clarabel.DefaultSettings:
    import clarabel

    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.max_threads = 1
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = TOLERANCE
    settings.equilibrate_enable = settings.iterative_refinement_enable = careful
    settings.presolve_enable = False  # nothing can be presolved away
    settings.chordal_decomposition_enable = False
    return settings
