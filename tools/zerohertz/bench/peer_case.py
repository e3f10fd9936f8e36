"""The bench's closed loop on motulator: run by its own interpreter, never imported.

    python peer_case.py < case.json

Prints simulated seconds per CPU second and the last speed. Same motor, shaft, dc link, control
period, speed and load as the SIL's run; motulator's own sensorless vector control. It has no dead
time, no friction at standstill, no filters, noise or ADC, and when it switches one edge per leg and
control period instead of two: all of that saves it time.
"""

from __future__ import annotations

import json
import sys
import time
from typing import Any

import numpy as np
from motulator.drive import model
from motulator.drive.control import im
from motulator.drive.utils import InductionMachineInvGammaPars, InductionMachinePars

MAX_CURRENT_A = 20.0
FLUX_WB = 0.4  # peak


def simulation(case: dict[str, Any]) -> Any:
    """Model and control, ready to run."""
    motor = case["motor"]
    coupling = motor["M_H"] / motor["Lr_H"]
    par = InductionMachineInvGammaPars(
        n_p=motor["pole_pairs"],
        R_s=motor["Rs_ohm"],
        R_R=coupling**2 * motor["Rr_ohm"],
        L_sgm=motor["Ls_H"] - coupling * motor["M_H"],
        L_M=coupling * motor["M_H"],
    )
    mdl = model.Drive(
        model.VoltageSourceConverter(u_dc=case["u_dc_V"]),
        model.InductionMachine(InductionMachinePars.from_inv_gamma_model_pars(par)),
        model.StiffMechanicalSystem(
            J=case["J_kg_m2"], B_L=case["viscous_Nms"], tau_L=_polyline(case["load_torque_Nm"])
        ),
    )
    if case["model"] == "switched":
        mdl.pwm = model.CarrierComparison()
    cfg = im.CurrentReferenceCfg(par, max_i_s=MAX_CURRENT_A, nom_psi_R=FLUX_WB)
    ctrl = im.CurrentVectorControl(par, cfg, J=case["J_kg_m2"], T_s=case["period_s"])
    speed_rpm = _polyline(case["speed_ref_rpm"])
    ctrl.ref.w_m = lambda t: motor["pole_pairs"] * np.pi / 30.0 * speed_rpm(t)
    return model.Simulation(mdl, ctrl)


def _polyline(points: list[list[float]]) -> Any:
    times, values = np.transpose(points)
    return lambda t: np.interp(t, times, values)


def main() -> None:
    case = json.load(sys.stdin)
    sim = simulation(case)
    start_s = time.process_time()
    sim.simulate(t_stop=case["duration_s"])
    cpu_s = time.process_time() - start_s
    speed_rpm = 30.0 / np.pi * float(sim.mdl.mechanics.data.w_M[-1].real)
    print(json.dumps({"sim_s_per_cpu_s": case["duration_s"] / cpu_s, "speed_rpm": speed_rpm}))


if __name__ == "__main__":
    main()
