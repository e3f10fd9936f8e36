"""The firmware on a plant of somebody else: motulator's induction machine, linear or saturable.

    tools/zh setup                    # once; installs motulator among the rest
    tools/zh python tools/zerohertz/examples/motulator_plant.py

motulator's Simulation calls a control system and integrates with solve_ivp. Here the firmware is
the control system, and a Runge-Kutta step per control period integrates: 20 times faster.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from math import pi
from pathlib import Path

from motulator.common.utils import abc2complex
from motulator.drive import model
from motulator.drive.utils import InductionMachineInvGammaPars, InductionMachinePars

from zerohertz.drive import Drive, Output, State
from zerohertz.motor import load_motor
from zerohertz.scenario.setup import load_setup

I_FS_A, U_FS_V, MIDDLE = 25.0, 400.0, 8192  # of boards/paper.toml, 14 bit
T_S, BOOT_S, U_DC_V, J_KG_M2 = 200e-6, 0.2, 283.0, 0.035
RPM = 30.0 / pi
# Saturable: the inductance without flux, per that at the nominal flux, and how sharp the knee is.
UNSATURATED_PU, KNEE = 1.3, 7.0
Profile = Callable[[float], float]  # of time


@dataclass(frozen=True)
class Moment:
    """After one control period: the plant's truth, and what the drive says."""

    t_s: float
    speed_rpm: float
    torque_Nm: float
    phase_A: float  # the largest of the three
    out: Output


def machine_parameters(motor_dir: Path, saturated_at_Wb: float | None) -> InductionMachinePars:
    """The circuit of motor.toml, linear or with its L_s at this stator flux (peak)."""
    motor = load_motor(motor_dir)
    circuit = motor.circuit
    coupling = circuit.M_H / circuit.Lr_H
    par = InductionMachinePars.from_inv_gamma_model_pars(
        InductionMachineInvGammaPars(
            n_p=motor.nameplate.pole_pairs,
            R_s=circuit.Rs_ohm,
            R_R=coupling**2 * circuit.Rr_ohm,
            L_sgm=circuit.sigma_Ls_H,
            L_M=coupling * circuit.M_H,
        )
    )
    if saturated_at_Wb is not None:
        excess = UNSATURATED_PU - 1.0
        unsaturated_H = UNSATURATED_PU * par.L_s
        par.L_s = lambda psi_Wb: unsaturated_H / (1.0 + excess * (psi_Wb / saturated_at_Wb) ** KNEE)
    return par


class Plant:
    """motulator's machine and shaft on an inverter that gives the average of its duties."""

    def __init__(self, par: InductionMachinePars, load_Nm: Profile) -> None:
        self.machine = model.InductionMachine(par)
        self.shaft = model.StiffMechanicalSystem(J=J_KG_M2, tau_L=load_Nm)
        self.model = model.Drive(
            model.VoltageSourceConverter(u_dc=U_DC_V), self.machine, self.shaft
        )

    def advance(self, duties: tuple[float, float, float]) -> None:
        """One control period: classical Runge-Kutta of motulator's right-hand side."""
        drive, h, t_s = self.model, T_S, self.model.t0
        drive.converter.inp.q_cs = abc2complex(duties)
        x = drive.get_initial_values()
        k1 = drive.rhs(t_s, x)
        k2 = drive.rhs(t_s + h / 2, [a + h / 2 * b for a, b in zip(x, k1, strict=True)])
        k3 = drive.rhs(t_s + h / 2, [a + h / 2 * b for a, b in zip(x, k2, strict=True)])
        k4 = drive.rhs(t_s + h, [a + h * b for a, b in zip(x, k3, strict=True)])
        slopes = zip(x, k1, k2, k3, k4, strict=True)
        drive.set_states([a + h / 6 * (p + 2 * q + 2 * r + s) for a, p, q, r, s in slopes])
        drive.t0 = t_s + h


def _word(value: float, full_scale: float) -> int:
    return min(max(round(MIDDLE + MIDDLE * value / full_scale), 0), 2 * MIDDLE - 1)


def simulate(
    duration_s: float,
    speed_ref_rpm: Profile,
    load_Nm: Profile,
    *,
    saturated_at_Wb: float | None = None,
    params: Mapping[str, float] | None = None,
) -> Iterator[Moment]:
    """Configuration `recommended`, period by period; ends early when the drive trips."""
    setup = load_setup("recommended")
    # The line voltages below are the averages of one period: sensors without the board's filter.
    given = {**setup.params, "voltage_filter_comp_s": T_S / 2, **(params or {})}
    plant = Plant(machine_parameters(setup.motor_dir, saturated_at_Wb), load_Nm)
    duty, u_uv_V, u_vw_V = (0.5, 0.5, 0.5), 0.0, 0.0
    with Drive(setup.motor_dir, setup.board, given) as drive:
        for k in range(round(duration_s / T_S)):
            phases_A = plant.machine.meas_currents()
            out = drive.step(
                *(_word(float(i_A), I_FS_A) for i_A in phases_A),
                _word(u_uv_V, U_FS_V),
                _word(u_vw_V, U_FS_V),
                round(U_DC_V / U_FS_V * 2 * MIDDLE),
                speed_ref_rpm=speed_ref_rpm(k * T_S),
                run=k * T_S > BOOT_S,
            )
            if out.state == State.FAULT:
                return  # gates off: motulator's inverter has no such state
            acting, duty = duty, (out.duty_u, out.duty_v, out.duty_w)  # timer preload
            plant.advance(acting)
            u_uv_V, u_vw_V = U_DC_V * (acting[0] - acting[1]), U_DC_V * (acting[1] - acting[2])
            speed_rpm = RPM * plant.shaft.meas_speed()
            torque_Nm = float(plant.machine.tau_M)
            yield Moment((k + 1) * T_S, speed_rpm, torque_Nm, float(max(abs(phases_A))), out)


if __name__ == "__main__":
    # Magnetised after 4.9 s, 300 min^-1 at 5 s, rated torque from 6 s on.
    moments = simulate(7.5, lambda t_s: 300.0, lambda t_s: 8.4 if t_s > 6.0 else 0.0)
    for count, now in enumerate(moments):
        if count % 1250 == 0:
            said = f"{now.speed_rpm:7.1f} min^-1, estimated {now.out.speed_hat_rpm:7.1f}"
            print(f"{now.t_s:5.2f} s: {said}, {now.torque_Nm:5.2f} Nm, {now.phase_A:5.2f} A")
