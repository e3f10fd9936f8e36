"""The machine in complex space-vector notation, eq. (1): x = [i_s; lambda_r], J = j.

Also the coordinates the LMIs are solved in: z = [eps i_s; lambda_r], time in milliseconds. There
every entry of A is of the order of one to ten; in SI units the solver returns nonsense.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from zerohertz.motor import Circuit

ComplexArray = npt.NDArray[np.complex128]

MS_PER_S = 1.0e3
COORDINATES = "z = [eps_H i_s; lambda_r], time in ms"

C1 = np.array([[1.0, 0.0]])
C2 = np.array([[0.0, 1.0]])
# Where gamma_bound looks, in units of Rr/Lr: zero, and both directions.
_STATOR_FREQUENCIES = np.concatenate([[0.0], np.outer((1, -1), np.geomspace(0.1, 30.0, 80)).flat])


def state_matrix(circuit: Circuit, omega_rad_s: float) -> ComplexArray:
    """A(w) of eq. (1), 2x2 complex, SI units."""
    q = circuit.tau_per_s - 1j * omega_rad_s
    return np.array(
        [
            [-circuit.a11_per_s, q / circuit.eps_H],
            [circuit.M_H * circuit.tau_per_s, -q],
        ]
    )


def observer_poles(circuit: Circuit, omega_rad_s: float, gain: ComplexArray) -> ComplexArray:
    """Eigenvalues of A(w) + L C1 in 1/s, the fast one (smaller real part) first."""
    matrix = state_matrix(circuit, omega_rad_s)
    matrix[:, 0] += gain
    poles = np.linalg.eigvals(matrix)
    return poles[np.argsort(poles.real, kind="stable")]


def scaled_state_matrix(circuit: Circuit, omega_rad_s: float) -> ComplexArray:
    """A(w) in the coordinates of the LMIs."""
    scale = np.diag([circuit.eps_H, 1.0])
    return scale @ state_matrix(circuit, omega_rad_s) @ np.linalg.inv(scale) / MS_PER_S


def scaled_gain(circuit: Circuit, gain: ComplexArray) -> ComplexArray:
    """L = [l1 in 1/s; l2 in ohm] in the coordinates of the LMIs: [l1; l2/eps] in 1/ms."""
    return np.array([gain[0], gain[1] / circuit.eps_H]) / MS_PER_S


def si_gain(circuit: Circuit, gain: ComplexArray) -> ComplexArray:
    """Inverse of scaled_gain."""
    return np.array([gain[0], gain[1] * circuit.eps_H]) * MS_PER_S


def as_stored(gain: ComplexArray, omega_rad_s: float) -> ComplexArray:
    """The gain as the table holds it: float32, and real at standstill, where L(-w) = conj L(w)
    leaves no choice; -0 becomes +0, so that equal gains have equal words.
    """
    values = np.asarray(gain, dtype=complex)
    if omega_rad_s <= 0.0:
        values = values.real
    with np.errstate(over="ignore"):  # infinity is refused by the table
        stored = values.astype(np.complex64)
    return stored.astype(complex) + complex(0.0, 0.0)


def speed_error_input(dw_rad_s: float) -> ComplexArray:
    """Be = -Bw dw j of eq. (14) in the coordinates of the LMIs; Bw = [1; -1] there."""
    return np.array([[-1j * dw_rad_s], [1j * dw_rad_s]]) / MS_PER_S


def gamma_floor(circuit: Circuit, dw0_rad_s: float, omega_rad_s: float) -> float:
    """No gain can be gamma-positive real below this, at |dw| = dw0.

    At stator frequency zero the current error vanishes (the zero of G1), and the flux row alone
    gives |(I - G)(I + G)^-1| = |dw| / (2 |tau - j (w - dw/2)|), whatever L.
    """
    nearest = abs(abs(omega_rad_s) - dw0_rad_s / 2.0)
    return dw0_rad_s / (2.0 * abs(complex(circuit.tau_per_s, nearest)))


def gamma_bound(
    circuit: Circuit, dw0_rad_s: float, omega_rad_s: float, gain: ComplexArray
) -> float:
    """This L cannot be gamma-positive real below this, whatever X.

    (14) implies |(I - G)(I + G)^-1| <= gamma at every stator frequency, where (11) gives
    I - G = C2 (sI - A - L C1)^-1 Bw dw j. The bound is tight when a frequency is near the peak.
    """
    A = state_matrix(circuit, omega_rad_s)
    A[:, 0] += gain
    s = 1j * circuit.tau_per_s * _STATOR_FREQUENCIES
    current = s - A[0, 0]
    determinant = current * (s - A[1, 1]) - A[0, 1] * A[1, 0]
    deviation = 1j * dw0_rad_s * (A[1, 0] / circuit.eps_H - current) / determinant
    return float(max(np.max(np.abs(d / (2.0 - d))) for d in (deviation, -deviation)))
