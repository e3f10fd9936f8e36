"""The operating point of motor and deceived firmware: a fixed point of the one-period map.

Newton from the error-free point, whose equations are explicit, along the parameter error. Where a
branch turns back (the fold: there is no such operating point beyond) the step goes to zero: that is
the verdict, not a failure.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from zerohertz.stability.firmware import Real
from zerohertz.stability.loop import SCALE, STATES, Loop, N, Points, step

_TOLERANCE = 1e-9  # of a state, in units of SCALE
_LARGEST_MOVE = 0.5  # of any state in one Newton step, in units of SCALE
_SMALLEST_STEP = 1.0 / 256.0  # of the way from no error to all of it
_SPEEDS = slice(STATES.index("omega_e_hat"), STATES.index("omega_filtered") + 1)


@dataclasses.dataclass(frozen=True)
class Equilibrium:
    """x is meaningful only where found; reached: share of the parameter error that was."""

    x: Real
    found: npt.NDArray[np.bool_]
    reached: Real
    steering: npt.NDArray[np.bool_]


def jacobian(function: Callable[[Real], Real], x: Real, accurate: bool = False) -> Real:
    """d function / d x at every point, by differences: one-sided for Newton, central of 4th order
    for eigenvalues, whose clusters near 1 magnify an error."""
    h = 1e-4 if accurate else 1e-7
    # [state moved, point, state]
    moves = np.eye(N)[:, None, :] * (h * SCALE)
    if accurate:
        total = np.zeros((N, *x.shape))
        for size, weight in ((1.0, 8.0 / 12.0), (2.0, -1.0 / 12.0)):
            total += weight * (function(x + size * moves) - function(x - size * moves))
    else:
        total = function(x + moves) - function(x)
    return np.moveaxis(total / (h * SCALE)[:, None, None], 0, -1)


def first_guess(loop: Loop, p: Points, steering: npt.NDArray[np.bool_]) -> Real:
    """The operating point when the firmware is right, continuous time."""
    fw, bench = loop.firmware, loop.bench
    c, T = fw.circuit, fw.period_s
    omega = p.omega_ref_rad_s
    mechanical = omega / fw.pole_pairs
    torque = p.load_Nm + bench.viscous_Nms * mechanical
    torque = torque + p.coulomb_Nm * np.tanh(mechanical / bench.creep_rad_s)
    below = fw.steering.below_Wb(omega, torque, steering)
    flux = fw.lambda_nominal_Wb - below
    i = flux / c.M_H + 1j * torque / (fw.pole_pairs * fw.kr * flux)
    omega_s = omega + c.M_H * c.tau_per_s * i.imag / flux
    u = c.Rs_ohm * i + 1j * omega_s * (c.sigma_Ls_H * i + fw.kr * flux)
    feed = fw.decoupling * 1j * (omega_s * c.sigma_Ls_H * i + fw.kr * omega * flux)
    x = np.zeros((len(p), N))

    def put(name: str, value: Real) -> None:
        if name in STATES:
            x[:, STATES.index(name)] = value
        else:
            k = STATES.index(name + ".re")
            x[:, k], x[:, k + 1] = np.real(value), np.imag(value)

    put("i_s", i)
    put("i_s_hat", i)
    put("lambda_r", flux + 0j)
    put("lambda_hat", flux)
    for name in ("omega_e", "x_adaptation", "omega_e_hat", "omega_filtered"):
        put(name, omega)
    put("omega_s_hat", omega_s)
    late_s = 2.0 * bench.filter_damping / (2.0 * np.pi * bench.filter_cutoff_Hz)
    put("filter", u * np.exp(-1j * omega_s * late_s))
    put("u_acting", u * np.exp(0.5j * omega_s * T))
    put("u_pending", u * np.exp(1.5j * omega_s * T))
    lagging = u * np.exp(-1j * omega_s * late_s)
    put("lagging", lagging)
    put("lag_step", lagging * (1.0 - np.exp(-1j * omega_s * T)))
    put("x_speed", i.imag * flux / fw.lambda_nominal_Wb)
    put("x_d", (u - feed).real)
    put("x_q", (u - feed).imag)
    put("torque_filtered", torque)
    put("flux_below", below)
    return x


def newton(
    loop: Loop, p: Points, steering: npt.NDArray[np.bool_], x: Real
) -> tuple[Real, npt.NDArray[np.bool_]]:
    """The fixed point near x, and where it was reached."""
    x = x.copy()
    done = np.zeros(len(p), dtype=bool)
    for _ in range(12):
        active = np.flatnonzero(~done)
        if len(active) == 0:
            break
        here, s = p.pick(active), steering[active]

        def residual(y: Real, here: Points = here, s: npt.NDArray[np.bool_] = s) -> Real:
            return step(loop, here, s, y)[0] - y

        move = _move(jacobian(residual, x[active]), residual(x[active]))
        x[active] += move * np.minimum(1.0, _LARGEST_MOVE / _size(move))[:, None]
        done[active] = _size(move) < _TOLERANCE
    return x, done


def _size(move: Real) -> Real:
    return np.maximum(np.max(np.abs(move / SCALE), axis=-1), 1e-300)


def _move(matrix: Real, residual: Real) -> Real:
    """Newton's step in scaled states. Exactly singular (zero stator frequency without error) or not
    a number: infinite, so that it is refused."""
    a = matrix / SCALE[:, None] * SCALE
    try:
        with np.errstate(all="ignore"):
            move = np.linalg.solve(a, (-residual / SCALE)[..., None])[..., 0] * SCALE
    except np.linalg.LinAlgError:
        move = np.full_like(residual, np.inf)
    return np.where(np.isfinite(move), move, 1e3 * SCALE)


def solve(
    loop: Loop, exact: Points, points: Points, progress: Callable[[int], None] | None = None
) -> Equilibrium:
    """Operating points of `points`, followed from `exact`, where the firmware is right."""
    # Friction is part of the torque the steering sees come up with the load.
    mechanical = points.omega_ref_rad_s / loop.firmware.pole_pairs
    friction = points.coulomb_Nm * np.tanh(mechanical / loop.bench.creep_rad_s)
    steering = loop.firmware.steering.steers(points.omega_ref_rad_s, points.load_Nm + friction)
    n = len(points)
    x = first_guess(loop, exact, steering)
    at_start, found = newton(loop, exact, steering, x)
    # At zero stator frequency the exact drive has a line of equilibria; the guess is one of them.
    x[found] = at_start[found]
    slope = np.zeros_like(x)
    share, ahead = np.zeros(n), np.full(n, 0.25)
    while True:
        active = np.flatnonzero((share < 1.0) & (ahead >= _SMALLEST_STEP))
        if progress:
            progress(n - len(active))
        if len(active) == 0:
            break
        to = np.minimum(share[active] + ahead[active], 1.0)
        here = exact.pick(active).toward(points.pick(active), to)
        guess = x[active] + slope[active] * (to - share[active])[:, None]
        y, good = newton(loop, here, steering[active], guess)
        # A point far from where its branch was heading belongs to another one.
        good &= _size(y - guess) < 2.0
        kept, lost = active[good], active[~good]
        slope[kept] = (y[good] - x[kept]) / (to[good] - share[kept])[:, None]
        x[kept], share[kept] = y[good], to[good]
        ahead[kept] *= 1.7
        ahead[lost] *= 0.5
    return Equilibrium(x, share >= 1.0, share, steering)
