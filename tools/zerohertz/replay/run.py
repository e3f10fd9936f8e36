"""The estimator over a log, as the settings say."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np

from zerohertz.errors import UserError
from zerohertz.motor import Motor
from zerohertz.replay.estimate import run_estimator
from zerohertz.replay.lag import Tables, corrected_rad_s
from zerohertz.replay.log import FloatArray, Log
from zerohertz.replay.resample import Stream, resample
from zerohertz.replay.tuning import TABLE, Tuning, tuning_of

METHODS = {"euler": 0, "second": 1}
HEADROOM = 4.0
FULL_SCALES_A = (0.1, 1e4)  # param_list.def: current_full_scale_A


@dataclasses.dataclass(frozen=True)
class Settings:
    """How the log is run."""

    period_s: float
    method: str
    gain: str
    initial_rad_s: float
    overrides: dict[str, float]
    corner_rad_s: float | None = None  # of the lag correction; None: that of the tuning


@dataclasses.dataclass(frozen=True)
class Voltage:
    """What a recording does not say about its voltage."""

    gain: float = 1.0  # voltage that acted over the logged one
    delay_s: float = 0.0  # it acted so much later


@dataclasses.dataclass(frozen=True)
class Replay:
    """A log made ready: the tuning is that of the log as it stands, whatever voltage is tried."""

    log: Log
    motor: Motor
    settings: Settings
    tuning: Tuning
    tables: Tables

    @classmethod
    def of(cls, log: Log, motor: Motor, motor_dir: Path, settings: Settings) -> Replay:
        tuning = tuning_of(motor, motor_dir, settings.gain, log)
        return cls(log, motor, settings, tuning, Tables.read(motor.circuit, tuning.folder / TABLE))

    @property
    def corner_rad_s(self) -> float:
        own = self.settings.corner_rad_s
        return self.tuning.corner_rad_s if own is None else own

    def parameters(self) -> dict[str, float]:
        """Of the firmware. The observer bounds its states at twice the full scale of a board, which
        a log does not have: wide enough that a wrong start is not held back."""
        full_scale_A = float(np.clip(HEADROOM * np.max(np.abs(self.log.i_s_A)), *FULL_SCALES_A))
        return {
            "current_full_scale_A": full_scale_A,
            "observer_method": METHODS[self.settings.method],
            **self.tuning.overrides,
            **self.settings.overrides,
        }

    def run(self, voltage: Voltage) -> tuple[Stream, FloatArray]:
        """The log at the control period, and the estimated speed."""
        settings, log = self.settings, self.log
        acted = dataclasses.replace(log, u_s_V=voltage.gain * log.u_s_V)
        stream = resample(acted, settings.period_s, voltage.delay_s)
        if len(stream.t_s) == 0:
            raise UserError(
                f"{log.file}: too short for a period of {settings.period_s:g} s and a voltage "
                f"delay of {voltage.delay_s:g} s"
            )
        folder, parameters = self.tuning.folder, self.parameters()
        estimate = run_estimator(folder, parameters, stream, settings.initial_rad_s)
        if self.corner_rad_s == 0.0:
            return stream, estimate.omega_e_rad_s
        least = self.tuning.least_gain_Wb_A_s
        speed = corrected_rad_s(estimate, self.tables, self.corner_rad_s, least, settings.period_s)
        return stream, speed
