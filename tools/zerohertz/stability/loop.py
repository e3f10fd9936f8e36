"""One period of the whole loop as one function, state -> next state, in double precision.

The state is what stands after step k of the firmware, at carrier crest t_k, seen from the estimated
flux: every vector is divided by the unit vector along lambda_hat. In that frame the operating point
does not move, and the angle of the whole drawing, which matters to nobody, is not a state. Written
after firmware/law/drive.c and the averaged plant of host_sim, in their order; limits (current,
voltage, speed) are not in it: an operating point at a limit is not one of these equations.
"""

from __future__ import annotations

import dataclasses
import functools
from typing import Any

import numpy as np
import numpy.typing as npt

from zerohertz.stability.firmware import Complex, Firmware, Real

STATES = (
    "i_s.re i_s.im lambda_r.re lambda_r.im omega_e filter.re filter.im filter_slope.re "
    "filter_slope.im i_s_hat.re i_s_hat.im lambda_hat x_adaptation omega_e_hat omega_s_hat "
    "omega_filtered x_speed x_d x_q u_acting.re u_acting.im u_pending.re u_pending.im "
    "lagging.re lagging.im lag_step.re lag_step.im torque_filtered flux_below"
).split()
N = len(STATES)
# What is a small change of each: A, Wb, rad/s, V, Nm. Steps and residuals are measured in these.
SCALE = np.array(
    (
        *(5.0, 5.0, 0.4, 0.4, 10.0, 20.0, 20.0, 20.0, 20.0, 5.0, 5.0, 0.4, 10.0, 10.0, 10.0, 10.0),
        *(5.0, 20.0, 20.0, 20.0, 20.0, 20.0, 20.0, 20.0, 20.0, 20.0, 20.0, 5.0, 0.4),
    )
)


@dataclasses.dataclass(frozen=True)
class Bench:
    """The rig around the motor, the same for all points."""

    viscous_Nms: float = 0.0
    # Coulomb friction is T tanh(w / this), mechanical: within about this speed the shaft creeps
    # instead of sticking, which gives standstill a torque balance (README).
    creep_rad_s: float = 0.05
    filter_cutoff_Hz: float = 800.0
    filter_damping: float = float(np.sqrt(0.5))
    u_dc_V: float = 283.0
    z_noise_Wb_A: float = 2e-3  # what noise makes of |z| in the eps1 leak, rms


@dataclasses.dataclass(frozen=True)
class Points:
    """Operating points and the true machine at each: arrays of one length."""

    omega_ref_rad_s: Real  # electrical
    load_Nm: Real
    Rs_ohm: Real
    Rr_ohm: Real
    Ls_H: Real
    Lr_H: Real
    M_H: Real
    Rs_hat_ohm: Real  # what the firmware uses
    J_kg_m2: Real
    coulomb_Nm: Real
    # Measured over true, positive sequence; a difference between the phases is ripple, not here.
    current_gain: Complex
    voltage_gain: Complex

    def __len__(self) -> int:
        return len(self.load_Nm)

    def pick(self, mask: npt.NDArray[Any]) -> Points:
        return Points(*(value[mask] for value in self.values()))

    def toward(self, other: Points, share: Real) -> Points:
        pairs = zip(self.values(), other.values(), strict=True)
        return Points(*(a + share * (b - a) for a, b in pairs))

    def values(self) -> tuple[npt.NDArray[Any], ...]:
        return tuple(getattr(self, f.name) for f in dataclasses.fields(self))


@dataclasses.dataclass(frozen=True)
class Loop:
    firmware: Firmware
    bench: Bench


@functools.cache
def filter_transition(bench: Bench, period_s: float) -> Real:
    """exp of the 800 Hz filter over a period, states output and slope / w_c."""
    from scipy.linalg import expm

    theta = 2.0 * np.pi * bench.filter_cutoff_Hz * period_s
    return expm(theta * np.array([[0.0, 1.0], [-1.0, -2.0 * bench.filter_damping]]))


def step(loop: Loop, points: Points, steering: npt.NDArray[np.bool_], x: Real) -> tuple[Real, Real]:
    """x[..., points, N] -> the next state and by how much the frame turned, rad."""
    fw = loop.firmware
    s = _Unpacked(x)
    i_s, lambda_r, omega = _motor(loop, points, s)
    output, slope = _filter(loop, s)
    i_seen = points.current_gain * i_s
    u = s.u_acting
    # What the sensors do not show yet of a change.
    lag_step = fw.lag_keep * s.lag_step + (1.0 - fw.voltage_lag) * (u - s.lagging)
    lagging = s.lagging + lag_step
    late = u - lagging
    if not fw.voltage_from_duty:
        u = points.voltage_gain * output + late
    # What the firmware knows of Rs beyond the nameplate acts on the measured current.
    u = u - (points.Rs_hat_ohm - fw.circuit.Rs_ohm) * i_seen
    l1, l2 = fw.table.at(s.omega_e_hat)
    e1 = s.i_s_hat - points.current_gain * s.i_s
    i_hat, lambda_hat = _observer(fw, s, u, l1 * e1, l2 * e1)
    e1 = i_hat - i_seen
    x_a, omega_hat = _adaptation(loop, points, s, lambda_hat, e1, l1, l2)
    size = np.abs(lambda_hat)
    axis = lambda_hat / size
    pull = fw.circuit.M_H * fw.circuit.tau_per_s * i_hat + l2 * e1
    omega_s_hat = omega_hat + np.imag(lambda_hat.conj() * pull) / size**2
    i_dq = i_seen * axis.conj()
    i_ref, speed_states = _references(fw, points, steering, s, omega_hat, size, i_dq)
    u_dq, x_dq = _current(fw, s, i_ref, i_dq, omega_s_hat, omega_hat, size)
    u_new = u_dq * np.exp(1j * omega_s_hat * fw.delay_comp_s) * axis
    vectors = (i_s, lambda_r, output, slope, i_hat, s.u_pending, u_new, lagging, lag_step)
    turned = (v * axis.conj() for v in vectors)
    i_s, lambda_r, output, slope, i_hat, acting, pending, lagging, lag_step = turned
    columns = (
        *_parts(i_s, lambda_r),
        omega,
        *_parts(output, slope, i_hat),
        size,
        x_a,
        omega_hat,
        omega_s_hat,
        *speed_states[:2],
        x_dq.real,
        x_dq.imag,
        *_parts(acting, pending, lagging, lag_step),
        *speed_states[2:],
    )
    return np.stack(columns, axis=-1), np.angle(axis)


def _parts(*vectors: Complex) -> list[Real]:
    return [part for v in vectors for part in (v.real, v.imag)]


class _Unpacked:
    """Columns of x under their names, pairs as complex numbers."""

    def __init__(self, x: Real) -> None:
        k = 0
        while k < N:
            name, _, part = STATES[k].partition(".")
            setattr(self, name, x[..., k] + 1j * x[..., k + 1] if part else x[..., k])
            k += 2 if part else 1

    def __getattr__(self, name: str) -> Any:  # only for names that are not there
        raise AttributeError(name)


def _motor(loop: Loop, p: Points, s: Any) -> tuple[Complex, Complex, Real]:
    """Eq. (1) with the shaft over one period of constant voltage, Runge-Kutta as in host_sim.
    4th order at 200 us is exact to 1e-7 of the exponential."""
    kr, tau = p.M_H / p.Lr_H, p.Rr_ohm / p.Lr_H
    sigma_Ls = p.Ls_H - kr * p.M_H
    pole_pairs, bench = loop.firmware.pole_pairs, loop.bench

    def rate(i: Complex, flux: Complex, omega: Real) -> tuple[Complex, Complex, Real]:
        flux_rate = p.M_H * tau * i - (tau - 1j * omega) * flux
        i_rate = (s.u_acting - p.Rs_ohm * i - kr * flux_rate) / sigma_Ls
        mechanical = omega / pole_pairs
        friction = p.coulomb_Nm * np.tanh(mechanical / bench.creep_rad_s)
        friction = friction + bench.viscous_Nms * mechanical
        torque = pole_pairs * kr * np.imag(flux.conj() * i)
        return i_rate, flux_rate, pole_pairs / p.J_kg_m2 * (torque - p.load_Nm - friction)

    h = loop.firmware.period_s
    x = (s.i_s, s.lambda_r, s.omega_e)
    k1 = rate(*x)
    k2 = rate(*(a + 0.5 * h * b for a, b in zip(x, k1, strict=True)))
    k3 = rate(*(a + 0.5 * h * b for a, b in zip(x, k2, strict=True)))
    k4 = rate(*(a + h * b for a, b in zip(x, k3, strict=True)))
    out = [
        a + h / 6.0 * (b + 2.0 * (c + d) + e)
        for a, b, c, d, e in zip(x, k1, k2, k3, k4, strict=True)
    ]
    return out[0], out[1], out[2]


def _filter(loop: Loop, s: Any) -> tuple[Complex, Complex]:
    e = filter_transition(loop.bench, loop.firmware.period_s)
    away = s.filter - s.u_acting
    return (
        s.u_acting + e[0, 0] * away + e[0, 1] * s.filter_slope,
        e[1, 0] * away + e[1, 1] * s.filter_slope,
    )


def _observer(
    fw: Firmware, s: Any, u: Complex, i_correction: Complex, flux_correction: Complex
) -> tuple[Complex, Complex]:
    """observer_step: eq. (3) with the correction L e1 of the interval's start."""
    c, T = fw.circuit, fw.period_s

    def rates(i: Complex, flux: Complex) -> tuple[Complex, Complex]:
        decay = (c.tau_per_s - 1j * s.omega_e_hat) * flux
        return decay / c.eps_H - c.a11_per_s * i, c.M_H * c.tau_per_s * i - decay

    i_rate, flux_rate = rates(s.i_s_hat, s.lambda_hat)
    i_rate = i_rate + u / c.sigma_Ls_H
    if fw.second_order:
        more = rates(i_rate, flux_rate)
        i_rate, flux_rate = i_rate + 0.5 * T * more[0], flux_rate + 0.5 * T * more[1]
    return (
        s.i_s_hat + T * (i_rate + i_correction),
        s.lambda_hat + T * (flux_rate + flux_correction),
    )


def _adaptation(
    loop: Loop, p: Points, s: Any, lambda_hat: Complex, e1: Complex, l1: Complex, l2: Complex
) -> tuple[Real, Real]:
    """speed_adaptation_step: phi and K_I from the operating point of the period before."""
    fw, c = loop.firmware, loop.firmware.circuit
    g = c.tau_per_s - 1j * s.omega_e_hat
    D = (c.a11_per_s - l1 + 1j * s.omega_s_hat) * (g + 1j * s.omega_s_hat)
    D = D - g * (c.M_H * c.tau_per_s + l2) / c.eps_H
    # arg G1 = sign(w_s) 90 deg - arg D; both signs meet where the ramp is zero.
    ramp = np.minimum(np.abs(s.omega_s_hat) / fw.phi_ramp_rad_s, 1.0)
    arg_G1 = np.angle(1j * np.where(s.omega_s_hat < 0.0, -1.0, 1.0) * D.conj())
    z = np.imag((lambda_hat * np.exp(1j * fw.phi_factor * ramp * arg_G1)).conj() * e1)
    growth = 1.0 - fw.ki_from_rad_s / np.maximum(np.abs(s.omega_s_hat), fw.ki_from_rad_s)
    x = s.x_adaptation + fw.adapt_ki_T * (1.0 + fw.ki_growth * growth) * z
    if fw.leak_mode:
        share = fw.leak_T * np.sqrt(z**2 + loop.bench.z_noise_Wb_A**2)
        near = (np.abs(s.omega_s_hat) < fw.leak_on_rad_s) | (fw.leak_mode == 1)
        x = x - np.where(near, share, 0.0) * s.x_adaptation
    return x, fw.adapt_kp * z + x


def _references(
    fw: Firmware,
    p: Points,
    steering: npt.NDArray[np.bool_],
    s: Any,
    omega_hat: Real,
    size: Real,
    i_dq: Complex,
) -> tuple[Complex, tuple[Real, ...]]:
    """Steering, flux control and speed control; new states: filtered speed, x_speed, filtered
    torque, flux below nominal."""
    torque = fw.pole_pairs * fw.kr * size * i_dq.imag
    filtered = s.torque_filtered + fw.steering.filter_gain * (torque - s.torque_filtered)
    target = fw.steering.below_Wb(p.omega_ref_rad_s, filtered, steering)
    below = s.flux_below + fw.steering.follow * (target - s.flux_below)
    rate = (s.flux_below - below) / fw.period_s  # of the reference
    less = below - rate / fw.circuit.tau_per_s
    i_d = fw.i_d_A - less / fw.circuit.M_H
    omega_f = s.omega_filtered + fw.speed_filter_gain * (omega_hat - s.omega_filtered)
    above = np.abs(omega_f) - fw.speed_slow_rad_s
    more = np.clip(fw.speed_more_per_rad_s * above, 0.0, fw.speed_more_max)
    flux_pu = 1.0 - below / fw.lambda_nominal_Wb
    faster = 1.0 + more * (1.0 - fw.speed_weakening * (1.0 - flux_pu))
    error = faster * (p.omega_ref_rad_s - omega_f)
    asked = fw.speed.kp * error + s.x_speed
    x_speed = s.x_speed + fw.speed.ki_T * faster * error
    i_q = asked / flux_pu
    return i_d + 1j * i_q, (omega_f, x_speed, filtered, below)


def _current(
    fw: Firmware,
    s: Any,
    i_ref: Complex,
    i_dq: Complex,
    omega_s_hat: Real,
    omega_hat: Real,
    size: Real,
) -> tuple[Complex, Complex]:
    error = i_ref - i_dq
    x = s.x_d + 1j * s.x_q
    leakage = omega_s_hat * fw.circuit.sigma_Ls_H
    feed = 1j * (leakage * i_dq + fw.kr * omega_hat * size)
    return fw.current.kp * error + x + fw.decoupling * feed, x + fw.current.ki_T * error
