"""A motor of its own, for faults that host_sim has no name for: Table 1, ideal, sensed voltage."""

from __future__ import annotations

from cmath import exp
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import pi

from zerohertz.drive import Drive, Output
from zerohertz.paths import ROOT
from zerohertz.scenario.setup import load_setup

RS, RR, LS, LR, M, POLES, J = 0.93, 0.50, 0.110, 0.102, 0.102, 2, 0.035
U_DC, T_S, PARTS, MID = 283.0, 2e-4, 8, 8192
AXES = [exp(2j * pi / 3 * n) * (2 / 3) ** 0.5 for n in range(3)]
RPM = 30.0 / pi


@dataclass(frozen=True)
class Moment:
    """After one control period: the truth, and what the drive says."""

    t_s: float
    speed_rpm: float
    phase_A: float
    out: Output


def _word(value: float, full_scale: float) -> int:
    return min(max(round(MID + MID * value / full_scale), 0), 2 * MID - 1)


def simulate(
    duration_s: float,
    speed_ref_rpm: Callable[[float], float],
    load_Nm: Callable[[float, float], float],
    params: dict[str, float],
    voltage_gain: Callable[[float], float] = lambda t_s: 1.0,
) -> Iterator[Moment]:
    """Period by period; the load is of time and speed (rad/s), and opposes positive rotation."""
    given = dict(load_setup("recommended").params) | {"voltage_filter_comp_s": T_S / 2} | params
    psi_s, psi_r, omega, duty, u_uv, u_vw = 0j, 0j, 0.0, (0.5,) * 3, 0.0, 0.0
    board = ROOT / "host_sim" / "boards" / "paper.toml"
    with Drive(ROOT / "gain_tables" / "hasegawa2005_recommended", board, given) as drive:
        for k in range(round(duration_s / T_S)):
            t_s, gain = k * T_S, voltage_gain(k * T_S)
            i_s = (LR * psi_s - M * psi_r) / (LS * LR - M * M)
            phases = [(i_s * a.conjugate()).real for a in AXES]
            out = drive.step(
                *(_word(x, 25.0) for x in phases),
                _word(gain * u_uv, 400.0),
                _word(gain * u_vw, 400.0),
                round(U_DC / 400 * 2 * MID),
                speed_ref_rpm=speed_ref_rpm(t_s),
                run=k > 1000,
            )
            acting, duty = duty, (out.duty_u, out.duty_v, out.duty_w)
            u = [U_DC * x if out.gates_on else 0.0 for x in acting]
            psi_s = psi_s if out.gates_on else 0.9 * psi_s
            u_uv, u_vw = u[0] - u[1], u[1] - u[2]
            u_s = sum(x * a for x, a in zip(u, AXES, strict=True))
            for _ in range(PARTS):
                i_s = (LR * psi_s - M * psi_r) / (LS * LR - M * M)
                torque = POLES * (psi_s.conjugate() * i_s).imag
                omega += T_S / PARTS * (torque - load_Nm(t_s, omega)) / J
                psi_s += T_S / PARTS * (u_s - RS * i_s)
                psi_r += T_S / PARTS * (-RR / LR * (psi_r - M * i_s) + 1j * POLES * omega * psi_r)
            yield Moment(t_s, RPM * omega, max(map(abs, phases)), out)
