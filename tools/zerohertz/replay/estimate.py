"""The firmware's estimator on recorded signals."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from zerohertz.estimator import Estimator, Verb, events
from zerohertz.replay.log import FloatArray
from zerohertz.replay.resample import Stream


@dataclasses.dataclass(frozen=True)
class Estimate:
    """What the estimator believed after each sample; power invariant, electrical."""

    omega_e_rad_s: FloatArray
    omega_s_rad_s: FloatArray  # stator frequency
    lambda_r_Wb: FloatArray  # magnitude
    z_Wb_A: FloatArray  # Im(conj(lambda) e1), what the adaptation integrates


def run_estimator(
    motor_dir: Path,
    overrides: Mapping[str, float],
    stream: Stream,
    initial_omega_e_rad_s: float,
) -> Estimate:
    """A step of the estimator for every sample, from flux zero."""
    steps = events(
        len(stream.t_s),
        u_alpha_V=stream.u_s_V.real,
        u_beta_V=stream.u_s_V.imag,
        i_alpha_A=stream.i_s_A.real,
        i_beta_A=stream.i_s_A.imag,
    )
    start = events(1, verb=Verb.SEED, omega_e_rad_s=initial_omega_e_rad_s)
    with Estimator(motor_dir, overrides, period_s=stream.period_s) as estimator:
        out = estimator.run(np.concatenate((start, steps)))[1:]
    flux_Wb = out["lambda_alpha_Wb"] + 1j * out["lambda_beta_Wb"].astype(np.float64)
    residual_A = out["residual_alpha_A"] + 1j * out["residual_beta_A"].astype(np.float64)
    return Estimate(
        omega_e_rad_s=out["omega_e_rad_s"].astype(np.float64),
        omega_s_rad_s=out["omega_s_rad_s"].astype(np.float64),
        lambda_r_Wb=np.abs(flux_Wb),
        z_Wb_A=np.imag(np.conj(flux_Wb) * residual_A),
    )
