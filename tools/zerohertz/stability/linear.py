"""Eigenvalues of the one-period map at its operating points, and what they say."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from zerohertz.stability.equilibrium import Equilibrium, jacobian, solve
from zerohertz.stability.firmware import Real
from zerohertz.stability.loop import SCALE, STATES, Loop, Points, step

VERDICTS = ("oriented", "stable, not oriented", "unstable", "no equilibrium")
ORIENTED, MISORIENTED, UNSTABLE, NONE = range(4)
ANGLE_MAX_DEG, MAGNITUDE_MAX_PU, SPEED_MAX_RPM = 25.0, 0.25, 30.0
# A mode that grows this slowly changes nothing within a minute: neutral, as at zero stator
# frequency without error, where nothing tells the speed.
NEUTRAL_PER_S = 0.02
_CHUNK = 512  # points at a time: what fits the cache's big brother


@dataclasses.dataclass(frozen=True)
class Modes:
    """One entry per point; NaN where there is no equilibrium."""

    verdict: npt.NDArray[np.int8]
    reached: Real  # share of the parameter error that has an equilibrium
    growth_per_s: Real  # of the dominant mode: ln|z| / T
    frequency_Hz: Real  # of the dominant mode, in the frame of the estimated flux
    damping: Real  # of the dominant mode: -Re s / |s|
    dominant: npt.NDArray[np.str_]  # the state that takes the largest part in it
    angle_err_deg: Real  # estimated minus true flux angle
    magnitude_err_pu: Real  # estimated over true flux, minus 1
    speed_rpm: Real  # true
    stator_frequency_Hz: Real  # true
    torque_Nm: Real  # true, in the air gap
    lambda_Wb: Real  # true


def jacobians(loop: Loop, p: Points, e: Equilibrium) -> Real:
    """d next state / d state at the equilibria."""
    return jacobian(lambda y: step(loop, p, e.steering, y)[0], e.x, accurate=True)


def analyse(
    loop: Loop, exact: Points, points: Points, progress: Callable[[int], None] | None = None
) -> Modes:
    """Equilibrium, eigenvalues and verdict of every point."""
    parts = []
    for start in range(0, len(points), _CHUNK):
        some = np.arange(start, min(start + _CHUNK, len(points)))
        here = points.pick(some)
        equilibrium = solve(loop, exact.pick(some), here)
        parts.append(_modes(loop, here, equilibrium))
        if progress:
            progress(int(some[-1]) + 1)
    fields = [f.name for f in dataclasses.fields(Modes)]
    return Modes(*(np.concatenate([getattr(part, name) for part in parts]) for name in fields))


def _modes(loop: Loop, p: Points, e: Equilibrium) -> Modes:
    fw = loop.firmware
    T = fw.period_s
    found = e.found & _within_limits(loop, e.x)
    growth, frequency, damping = (np.full(len(p), np.nan) for _ in range(3))
    dominant = np.full(len(p), "", dtype="<U20")
    some = np.flatnonzero(found)
    if len(some):
        picked = Equilibrium(e.x[some], e.found[some], e.reached[some], e.steering[some])
        z, taking = _dominant(jacobians(loop, p.pick(some), picked))
        s = np.log(z) / T
        growth[some], frequency[some] = s.real, np.abs(s.imag) / (2.0 * np.pi)
        damping[some] = -s.real / np.maximum(np.abs(s), 1e-12)
        dominant[some] = np.array(STATES)[taking]
    _, turned = step(loop, p, e.steering, e.x)
    at = {name: e.x[:, k] for k, name in enumerate(STATES)}
    flux = at["lambda_r.re"] + 1j * at["lambda_r.im"]
    current = at["i_s.re"] + 1j * at["i_s.im"]
    angle_deg = -np.degrees(np.angle(flux))
    magnitude = at["lambda_hat"] / np.abs(flux) - 1.0
    speed_rpm = at["omega_e"] / fw.pole_pairs * 30.0 / np.pi
    ref_rpm = p.omega_ref_rad_s / fw.pole_pairs * 30.0 / np.pi
    oriented = (np.abs(angle_deg) < ANGLE_MAX_DEG) & (np.abs(magnitude) < MAGNITUDE_MAX_PU)
    oriented &= np.abs(speed_rpm - ref_rpm) < SPEED_MAX_RPM
    verdict = np.where(oriented, ORIENTED, MISORIENTED)
    verdict = np.where(growth > NEUTRAL_PER_S, UNSTABLE, verdict)
    verdict = np.where(found, verdict, NONE).astype(np.int8)
    torque = fw.pole_pairs * p.M_H / p.Lr_H * np.imag(flux.conj() * current)
    values = (angle_deg, magnitude, speed_rpm, turned / T / (2.0 * np.pi), torque, np.abs(flux))
    shown = [np.where(found, value, np.nan) for value in values]
    return Modes(verdict, e.reached, growth, frequency, damping, dominant, *shown)


def _within_limits(loop: Loop, x: Real) -> npt.NDArray[np.bool_]:
    """The drive can do it: current and voltage below their limits."""
    fw = loop.firmware
    at = {name: x[:, k] for k, name in enumerate(STATES)}
    i_d, i_q = at["i_s.re"], np.abs(at["i_s.im"])
    room = np.sqrt(np.maximum(fw.i_max_A**2 - i_d**2, 0.0))
    u = np.hypot(at["u_acting.re"], at["u_acting.im"])
    return (i_q <= np.minimum(fw.i_q_max_A, room)) & (u <= loop.bench.u_dc_V / np.sqrt(2.0))


def _dominant(matrix: Real) -> tuple[npt.NDArray[np.complex128], npt.NDArray[np.intp]]:
    """The eigenvalue farthest out and the state with the largest participation in it."""
    scaled = matrix / SCALE[:, None] * SCALE
    z, right = np.linalg.eig(scaled)
    k = np.argmax(np.abs(z), axis=-1)
    rows = np.arange(len(z))
    try:
        left = np.linalg.inv(right)
        part = np.abs(right[rows, :, k] * left[rows, k, :])
    except np.linalg.LinAlgError:  # a defective matrix has no left basis: the vector itself
        part = np.abs(right[rows, :, k])
    return z[rows, k], np.argmax(part, axis=-1)
