"""The firmware's observer core on recorded signals."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from zerohertz.drive import Observer
from zerohertz.replay.log import FloatArray
from zerohertz.replay.resample import Stream


@dataclasses.dataclass(frozen=True)
class Estimate:
    """What the observer believed after each sample; power invariant, electrical."""

    omega_e_rad_s: FloatArray
    lambda_r_Wb: FloatArray  # magnitude
    e1_A: FloatArray  # magnitude


def run_observer(
    motor_dir: Path,
    overrides: Mapping[str, float],
    stream: Stream,
    initial_omega_e_rad_s: float,
) -> Estimate:
    """Observer, gain table and speed adaptation over the whole stream, from flux zero."""
    with Observer(
        motor_dir, overrides, period_s=stream.period_s, omega_e_rad_s=initial_omega_e_rad_s
    ) as observer:
        out = observer.run(
            stream.u_s_V.real, stream.u_s_V.imag, stream.i_s_A.real, stream.i_s_A.imag
        )
    return Estimate(
        omega_e_rad_s=out["omega_e_hat_rad_s"].astype(np.float64),
        lambda_r_Wb=np.hypot(out["lambda_hat_alpha_Wb"], out["lambda_hat_beta_Wb"]),
        e1_A=np.hypot(out["e1_alpha_A"], out["e1_beta_A"]),
    )
