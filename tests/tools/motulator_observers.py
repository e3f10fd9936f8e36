"""motulator's sensorless observers of an induction machine (0.5.0) on a record of signals."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace

import numpy as np
from driven_motor import POLE_PAIRS, T_S, Record
from motulator.drive.control.im import (
    FullOrderObserver,
    FullOrderObserverCfg,
    Observer,
    ObserverCfg,
)
from motulator.drive.utils import InductionMachineInvGammaPars

Gain = Callable[[float], complex]


def _parameters(record: Record) -> InductionMachineInvGammaPars:
    m = record.machine
    coupling = m.M_H / m.Lr_H
    return InductionMachineInvGammaPars(
        n_p=POLE_PAIRS,
        R_s=m.Rs_ohm,
        R_R=coupling**2 * m.Rr_ohm,
        L_sgm=m.Ls_H - coupling * m.M_H,
        L_M=coupling * m.M_H,
    )


def _run(observer: Observer | FullOrderObserver, record: Record) -> tuple[np.ndarray, np.ndarray]:
    """Rotor flux and electrical speed as it delivers them at each sample, from a known start."""
    coupling = record.machine.M_H / record.machine.Lr_H
    start = record.lambda_Wb[0]
    observer.est.psi_R, observer.est.theta_s = coupling * abs(start), float(np.angle(start))
    observer.est.w_m = record.omega_e_rad_s[0]
    flux = np.empty(len(record.t_s), dtype=complex)
    omega = np.empty(len(record.t_s))
    for k in range(len(record.t_s)):
        flux[k] = observer.est.psi_R / coupling * np.exp(1j * observer.est.theta_s)
        omega[k] = observer.est.w_m
        sample = SimpleNamespace(u_ss=record.u_s_V[k], i_ss=record.i_s_A[k])
        observer.update(T_S, observer.output(sample))
    return flux, omega


def reduced_order(record: Record, k_o: Gain | None = None) -> tuple[np.ndarray, np.ndarray]:
    observer = Observer(ObserverCfg(_parameters(record), T_S, sensorless=True, k_o=k_o))
    turned = np.exp(-1j * np.angle(record.lambda_Wb[0]))
    observer._work.old_i_s = record.i_s_A[0] * turned
    return _run(observer, record)


def full_order(record: Record) -> tuple[np.ndarray, np.ndarray]:
    observer = FullOrderObserver(FullOrderObserverCfg(_parameters(record), T_S, sensorless=True))
    observer.est.i_s = record.i_s_A[0] * np.exp(-1j * np.angle(record.lambda_Wb[0]))
    return _run(observer, record)
