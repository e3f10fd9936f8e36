"""The matrices from which the LMIs are put together.

Every function takes any number of leading dimensions: the rows of the cones are the images of all
unit vectors at once.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from zerohertz.gain_design.cones import RealArray
from zerohertz.gain_design.machine import ComplexArray


def transposed(matrix: ComplexArray) -> ComplexArray:
    return matrix.conj().swapaxes(-1, -2)


def he(matrix: ComplexArray) -> ComplexArray:
    return matrix + transposed(matrix)


def hermitian(p: RealArray) -> ComplexArray:
    matrix = np.empty((*p.shape[:-1], 2, 2), dtype=complex)
    matrix[..., 0, 0], matrix[..., 1, 1] = p[..., 0], p[..., 3]
    matrix[..., 0, 1] = p[..., 1] + 1j * p[..., 2]
    matrix[..., 1, 0] = matrix[..., 0, 1].conj()
    return matrix


def column(k: RealArray) -> ComplexArray:
    return np.stack([k[..., 0] + 1j * k[..., 1], k[..., 2] + 1j * k[..., 3]], axis=-1)[..., None]


def affine(function: Callable[[RealArray], RealArray], n: int) -> tuple[RealArray, RealArray]:
    """Matrix and constant of an affine function of n unknowns."""
    images = function(np.vstack([np.zeros((1, n)), np.eye(n)]))
    return (images[1:] - images[0]).T, images[0]


def disc(P: ComplexArray, N: ComplexArray, radius: float) -> ComplexArray:
    """(15): the eigenvalues of P^-1 N are inside the disc."""
    matrix = np.empty((*P.shape[:-2], 4, 4), dtype=complex)
    matrix[..., :2, :2] = matrix[..., 2:, 2:] = -radius * P
    matrix[..., :2, 2:] = N
    matrix[..., 2:, :2] = transposed(N)
    return matrix


def stein(P: ComplexArray, A: ComplexArray, radius: float) -> ComplexArray:
    """(15) for a given A by Schur's complement: A^H P A / r - r P."""
    return A.conj().T @ P @ A / radius - radius * P
