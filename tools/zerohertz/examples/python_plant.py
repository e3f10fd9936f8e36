"""The firmware against a motor written in Python: `tools/zh python <this file>`."""

from cmath import exp
from math import pi

from zerohertz import Drive
from zerohertz.paths import ROOT

Rs, Rr, Ls, Lr, M, p, J, U_DC, T, STEPS = 0.93, 0.50, 0.110, 0.102, 0.102, 2, 0.015, 283.0, 2e-4, 20
AXES = [exp(2j * pi / 3 * n) * (2 / 3) ** 0.5 for n in range(3)]  # power-invariant u, v, w
word = lambda x, full_scale: min(max(round(8192 + 8192 * x / full_scale), 0), 16383)  # noqa: E731

psi_s, psi_r, w, duty = 0j, 0j, 0.0, (0.5, 0.5, 0.5)
u_uv, u_vw = 0.0, 0.0  # sensors without the board's filter: less delay to compensate
files = ROOT / "gain_tables/hasegawa2005", ROOT / "host_sim/boards/paper.toml"
with Drive(*files, {"voltage_filter_comp_s": T / 2, "speed_J_kg_m2": J}) as drive:
    for k in range(15000):  # 3 s: current offsets, flux, up to 300 min^-1
        i = (Lr * psi_s - M * psi_r) / (Ls * Lr - M * M)
        words = [word((i * a.conjugate()).real, 25.0) for a in AXES]
        words += [word(u_uv, 400.0), word(u_vw, 400.0), round(U_DC / 400.0 * 2**14)]
        out = drive.step(*words, speed_ref_rpm=300.0, run=k > 600)
        acting, duty = duty, (out.duty_u, out.duty_v, out.duty_w)  # the new ones act next period
        u = [U_DC * d * out.gates_on for d in acting]  # gates off: taken for a short circuit
        u_uv, u_vw = u[0] - u[1], u[1] - u[2]
        u_s = sum(x * a for x, a in zip(u, AXES, strict=True))
        for _ in range(STEPS):  # Euler, small enough here
            i = (Lr * psi_s - M * psi_r) / (Ls * Lr - M * M)
            w += T / STEPS * p * (psi_s.conjugate() * i).imag / J
            psi_s += T / STEPS * (u_s - Rs * i)
            psi_r += T / STEPS * (-Rr / Lr * (psi_r - M * i) + 1j * p * w * psi_r)
        if k % 1500 == 0:
            print(f"{k * T:.1f} s: {30 / pi * w:.1f} min^-1, estimated {out.speed_hat_rpm:.1f}")
