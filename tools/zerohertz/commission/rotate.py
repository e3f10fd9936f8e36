"""What only a turning shaft tells: inertia, friction, and the flux that a current makes.

All by signals of the firmware over its link. Power into the air gap over the frequency is the
torque: no angle of an estimator is in it, 1 degree of which would be more than the friction. Up a
ramp it is J a + friction, down the same ramp -J a + friction. Held at three speeds it is Coulomb
friction and what grows with speed; at the middle one reactive power over the square of the current
is Ls, better than integrals at standstill know it: the magnetising curve is scaled to it.
"""

from __future__ import annotations

import dataclasses
import math
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from zerohertz.commission.board import Board
from zerohertz.commission.board_run import Pause, at_rest, put
from zerohertz.commission.curve import monotone_cubic
from zerohertz.commission.folder import BOARD, store, stored_parameters
from zerohertz.commission.plate import Plate
from zerohertz.commission.run import inertia_kg_m2
from zerohertz.commission.solve import solve
from zerohertz.drive import Fault, State
from zerohertz.errors import UserError
from zerohertz.gain_design.command import JSON_NAME
from zerohertz.gain_design.table import design_table, table_json
from zerohertz.link import client as link
from zerohertz.link.client import Client
from zerohertz.link.server import DirectLine, LinkedDrive
from zerohertz.motor import load_motor
from zerohertz.scenario.setup import SCENARIOS
from zerohertz.sim import Commissioned, Job

LOW, MIDDLE, HIGH = 0.3, 0.5, 0.75  # of rated speed
INNER = 0.2  # of the ramp at either end that is left out: the speed controller swings in
TORQUE_PU = 0.2  # of rated torque at most, for the inertia that is assumed
RAMP_S = 1.0  # at least: a serial line gives a hundred samples a second
SAMPLES, TRIES = 10, 4  # inside a ramp; each try on half the slew of the one before
SETTLE_S, HOLD_S = 1.0, 2.0
NEAR_PU = 0.005
SENSORS, BLEND = 0.0, 2.0  # voltage_source
# Without load an estimate need not find zero: friction brings the rest.
SLOW_PU, COAST_S = 0.05, 3.0
ROUNDS = 2
_SIGNALS = (
    *("u_s_alpha_V", "u_s_beta_V", "i_s_alpha_A", "i_s_beta_A"),
    *("omega_e_hat_rad_s", "omega_s_hat_rad_s", "state"),
)
_COMMAND_EVERY, _COMMAND_S = 20, 0.5  # samples; sooner on a line whose samples take longer
_VALID_S = 3.0
_PATIENCE_S = 120.0  # of the drive's time
_PERIODS = 10  # of the simulated drive, from sample to sample
_ANSWER_S = 10.0  # of this machine: far more than it takes, or a loaded one would ask twice


@dataclasses.dataclass(frozen=True)
class Mechanics:
    """Of motor and whatever turns with it; friction is coulomb_Nm + viscous_Nms omega."""

    J_kg_m2: float
    coulomb_Nm: float
    viscous_Nms: float


@dataclasses.dataclass(frozen=True)
class Samples:
    """Of the drive while something was waited for; vectors are complex."""

    t_s: np.ndarray
    u_V: np.ndarray  # mean over the period that ended
    i_A: np.ndarray  # in its middle
    omega_e_rad_s: np.ndarray
    omega_s_rad_s: np.ndarray

    def torque_Nm(self, Rs_ohm: float, pole_pairs: int) -> np.ndarray:
        power_W = np.real(self.u_V * np.conj(self.i_A)) - Rs_ohm * np.abs(self.i_A) ** 2
        return pole_pairs * power_W / self.omega_s_rad_s

    def Ls_H(self) -> tuple[float, float]:
        """And the current that it holds for."""
        current2 = float(np.mean(np.abs(self.i_A) ** 2))
        reactive_W = float(np.mean(np.imag(self.u_V * np.conj(self.i_A))))
        return reactive_W / current2 / float(np.mean(self.omega_s_rad_s)), math.sqrt(current2)


def turn_rig(
    rig: Path, found: Commissioned, plate: Plate, board: Board, seed: int = 1
) -> tuple[Mechanics, Commissioned]:
    """The simulated motor, with the table that belongs to it."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        store(folder, "turning", solve(found, plate), plate, board)
        table = design_table(load_motor(folder), certificate=False)
        (folder / JSON_NAME).write_text(table_json(table), encoding="utf-8")
        job = Job(
            scenario=SCENARIOS / "smoke.toml",
            scenario_overrides={"profiles.load_torque_Nm": [[0.0, 0.0]]},
            rig=rig,
            board=folder / BOARD,
            motor_dir=folder,
            firmware=stored_parameters(folder),
            seed=seed,
        )
        with LinkedDrive(job) as drive:
            line = DirectLine(drive, _PERIODS)
            line.pause(1.0)
            return turn(Client(line, timeout_s=_ANSWER_S), found, plate, line.pause)


def turn(
    drive: Client, found: Commissioned, plate: Plate, pause: Pause = time.sleep
) -> tuple[Mechanics, Commissioned]:
    """Turns the motor: nobody near the shaft. UserError when it does not run.

    The drive has the parameters of the motor found; its inertia and slew are set here.
    """
    J_kg_m2 = inertia_kg_m2(dataclasses.replace(plate, J_kg_m2=None))
    for k in range(ROUNDS):
        with _Run(drive, plate, J_kg_m2, pause) as run:
            J_kg_m2 = inertia(run, found.Rs_ohm, plate)
            holds = [run.hold(pu) for pu in (LOW, MIDDLE, HIGH)] if k == ROUNDS - 1 else []
    coulomb_Nm, viscous_Nms = friction(holds, found.Rs_ohm, plate)
    return Mechanics(J_kg_m2, coulomb_Nm, viscous_Nms), refined(found, *holds[1].Ls_H())


def inertia(run: _Run, Rs_ohm: float, plate: Plate) -> float:
    (up_Nm, up), (down_Nm, down) = (_ramp(ramp, Rs_ohm, plate) for ramp in _ramps(run, plate))
    J_kg_m2 = (up_Nm - down_Nm) / (up - down)
    if not 0.0 < J_kg_m2 < 1e3:
        raise UserError(f"turning: an inertia of {J_kg_m2:.3g} kg m2 is none; is the shaft free?")
    return J_kg_m2


def _ramps(run: _Run, plate: Plate) -> list[Samples]:
    """The middle of a ramp up and of the same down; slower ones where samples are too few."""
    for _ in range(TRIES):
        run.hold(LOW)
        ramps = [_middle(run.go(pu), plate) for pu in (HIGH, LOW)]
        if min(len(ramp.t_s) for ramp in ramps) >= SAMPLES:
            return ramps
        run.slower()
    raise UserError(
        f"turning: fewer than {SAMPLES} samples show the speed on its ramp; is the shaft free, and "
        "the line fast enough?"
    )


def friction(holds: list[Samples], Rs_ohm: float, plate: Plate) -> tuple[float, float]:
    """Coulomb friction in Nm, and Nm per rad/s."""
    p = plate.pole_pairs
    torque = [float(np.mean(hold.torque_Nm(Rs_ohm, p))) for hold in holds]
    speed = [float(np.mean(hold.omega_e_rad_s)) / p for hold in holds]
    viscous_Nms, coulomb_Nm = np.polyfit(speed, torque, 1)
    return float(coulomb_Nm), float(viscous_Nms)


def refined(found: Commissioned, Ls_H: float, current_A: float) -> Commissioned:
    """The magnetising curve through the point that the turning motor showed."""
    ratio_H = [flux / i for flux, i in zip(found.flux_Wb, found.level_A, strict=True)]
    at_standstill_H = monotone_cubic(found.level_A, ratio_H, current_A)
    scale = Ls_H / at_standstill_H
    if not 0.8 < scale < 1.25:
        raise UserError(
            f"turning: Ls is {scale:.0%} of that at standstill; was the motor loaded, or warmed up?"
        )
    return dataclasses.replace(found, flux_Wb=tuple(scale * flux for flux in found.flux_Wb))


def _middle(samples: Samples, plate: Plate) -> Samples:
    """Those in the middle of the speed range."""
    margin = INNER * (HIGH - LOW)
    pu = samples.omega_e_rad_s / plate.pole_pairs / _rad_s(plate)
    inside = (pu > LOW + margin) & (pu < HIGH - margin)
    return Samples(*(getattr(samples, f.name)[inside] for f in dataclasses.fields(Samples)))


def _ramp(ramp: Samples, Rs_ohm: float, plate: Plate) -> tuple[float, float]:
    """Mean torque and acceleration (mechanical)."""
    p = plate.pole_pairs
    slope = np.polyfit(ramp.t_s, ramp.omega_e_rad_s / p, 1)[0]
    return float(np.mean(ramp.torque_Nm(Rs_ohm, p))), float(slope)


def _rad_s(plate: Plate) -> float:
    return plate.speed_rpm * math.pi / 30.0


class _Run:
    """From standstill to standstill."""

    def __init__(self, drive: Client, plate: Plate, J_kg_m2: float, pause: Pause) -> None:
        self._drive, self._rated, self._pause = drive, _rad_s(plate), pause
        self._pole_pairs, self._speed_pu, self._count = plate.pole_pairs, 0.0, 0
        self._told = 0  # period of the last command
        most = TORQUE_PU * plate.torque_Nm / J_kg_m2
        self._slew = min(most, (HIGH - LOW) * self._rated / RAMP_S) * plate.pole_pairs
        values = {"speed_J_kg_m2": J_kg_m2, "speed_slew_rad_s2": self._slew}
        # Power is compared between speeds: from one source, where there are sensors.
        self._source = drive.get(["voltage_source"])
        source = {"voltage_source": SENSORS} if self._source["voltage_source"] == BLEND else {}
        put(drive, values | source)

    def __enter__(self) -> _Run:
        waited_s, step_s = 0.0, 0.1
        while (status := self._command()).state != State.RUN:
            if status.faults & Fault.FLYING_START and waited_s < _PATIENCE_S:
                waited_s += self._coast()
                continue
            if status.state == State.FAULT or waited_s > _PATIENCE_S:
                name = State(status.state).name
                raise UserError(f"turning: the drive does not start; it is {name}")
            self._pause(step_s)
            waited_s += step_s
        return self

    def _coast(self) -> float:
        """A heavy rotor still turned, and the drive refused it: waits, and takes the fault back."""
        self._drive.stop()
        self._pause(COAST_S)
        self._drive.command(link.RESET)
        self._pause(1.0)
        self._drive.stop()
        return COAST_S

    def __exit__(self, kind: object, *_: object) -> None:
        try:
            if kind is None:
                self.go(0.0, SLOW_PU)
        finally:
            self._drive.stop()
            self._pause(COAST_S)
            at_rest(self._drive, self._pause)
            put(self._drive, self._source)

    def _command(self) -> link.Status:
        self._drive.command(link.RUN, self._speed_pu * self._rated, _VALID_S)
        status = self._drive.status()
        self._told = status.period
        return status

    def slower(self) -> None:
        """Half the slew."""
        self._slew /= 2.0
        put(self._drive, {"speed_slew_rad_s2": self._slew})

    def go(self, speed_pu: float, near_pu: float = NEAR_PU) -> Samples:
        """To that speed, by the firmware's own estimate."""
        self._speed_pu = speed_pu
        target = speed_pu * self._rated * self._pole_pairs
        near = near_pu * self._rated * self._pole_pairs
        return self._collect(_PATIENCE_S, lambda row: abs(row[4] - target) < near)

    def hold(self, speed_pu: float) -> Samples:
        """Samples at that speed, once the flux has settled."""
        self.go(speed_pu)
        self._collect(SETTLE_S)
        return self._collect(HOLD_S)

    def _collect(
        self, seconds: float, there: Callable[[list[float]], bool] | None = None
    ) -> Samples:
        """For so long, or until there."""
        period_s = self._drive.identity.period_s
        rows: list[list[float]] = []
        periods: list[int] = []
        while not periods or (periods[-1] - periods[0]) * period_s < seconds:
            silent_s = (periods[-1] - self._told) * period_s if periods else 0.0
            if self._count % _COMMAND_EVERY == 0 or silent_s > _COMMAND_S:
                self._command()
            self._count += 1
            period, row = self._drive.sample(list(_SIGNALS))
            periods.append(period)
            rows.append(row)
            if row[6] != State.RUN:
                raise UserError(f"turning: the drive left RUN for {State(int(row[6])).name}")
            if there is not None and there(row):
                return _samples(periods, rows, period_s)
        if there is not None:
            raise UserError("turning: the speed is not reached; is the shaft free?")
        return _samples(periods, rows, period_s)


def _samples(periods: list[int], rows: list[list[float]], period_s: float) -> Samples:
    u_alpha, u_beta, i_alpha, i_beta, omega_e, omega_s, _ = np.array(rows).T
    # The current is of the period's end, the voltage its mean.
    back = np.exp(-0.5j * omega_s * period_s)
    t_s = np.array(periods) * period_s
    return Samples(t_s, u_alpha + 1j * u_beta, (i_alpha + 1j * i_beta) * back, omega_e, omega_s)
