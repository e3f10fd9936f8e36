"""Gymnasium environments: plant and firmware, and one part of the drive left to an agent.

    import gymnasium, zerohertz.gym
    env = gymnasium.make("ZeroHertz/SpeedLoop-v0")

`SpeedLoopEnv`: the agent is the speed controller. Its action is the torque reference, which the
drive takes in torque mode; estimator, flux and current control and all protections are the
firmware's. `EstimatorEnv`: the agent estimates speed and rotor flux from the voltage and current
that the drive gives its own estimator. The firmware keeps orienting itself by its own estimate: the
agent is judged beside it. With closed=True the agent's speed closes the speed loop (a PI
controller here, torque mode there), and a bad estimate is felt by the motor.

An episode starts from one operating point, by snapshots, with another load, reference and noise.
Needs gymnasium: `tools/zh setup gym`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import pi
from typing import Any, cast

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium import spaces

from zerohertz import arguments
from zerohertz.drive import Drive, State, StrPath
from zerohertz.errors import UserError
from zerohertz.paths import ROOT
from zerohertz.plant import Plant
from zerohertz.scenario.setup import load_setup
from zerohertz.sil_types import Rows

__all__ = ["EstimatorEnv", "Setup", "SpeedLoopEnv"]

Floats = npt.NDArray[np.float32]
Info = dict[str, Any]

_LIMIT = 10.0  # of any observation: everything is scaled to about one
_FLUX_WEIGHT = 0.3  # of the flux error beside the speed error
_CHANGE_WEIGHT = 0.01  # of a change of torque: a reference that rattles is no good drive
_FAULT_REWARD = -100.0
_SEEN = ("u_s_alpha_V", "u_s_beta_V", "i_s_alpha_A", "i_s_beta_A")


@dataclass(frozen=True)
class Setup:
    """What all episodes share: the drive, its plant, and what may happen in an episode."""

    config: str = "recommended"  # of host_sim/configs
    rig: StrPath = ROOT / "host_sim" / "rigs" / "hasegawa2005.toml"
    overrides: dict[str, float] = field(default_factory=dict)  # firmware parameters
    rig_overrides: dict[str, Any] = field(default_factory=dict)
    periods: int = 10  # control periods per step of the environment
    episode_s: float = 2.0
    start_rpm: float = 150.0
    speed_rpm: tuple[float, float] = (60.0, 300.0)  # of the reference
    load_Nm: tuple[float, float] = (0.0, 4.0)

    def __post_init__(self) -> None:
        arguments.whole("Setup", "periods", self.periods, 1, 10**6)
        if not arguments.finite("Setup", "episode_s", self.episode_s) > 0.0:
            raise UserError(f"Setup: episode_s: {self.episode_s} is not positive")
        arguments.finite("Setup", "start_rpm", self.start_rpm)
        for name in ("config", "rig"):
            arguments.path("Setup", name, getattr(self, name))
        for name in ("overrides", "rig_overrides"):
            arguments.mapping("Setup", name, getattr(self, name))
        for name in ("speed_rpm", "load_Nm"):
            _range(name, getattr(self, name))


def _range(name: str, given: Any) -> None:
    remedy = "two finite numbers, the lower one first"
    try:
        low, high = given
    except (TypeError, ValueError):
        arguments.refuse("Setup", name, given, remedy)
    lowest, highest = (arguments.finite("Setup", name, value, remedy) for value in (low, high))
    if lowest > highest:
        arguments.refuse("Setup", name, given, remedy)


class _DriveEnv(gymnasium.Env[Floats, Floats]):
    """Drive and plant, brought to the operating point once."""

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012 (the name is gymnasium's)

    def __init__(self, setup: Setup | None = None) -> None:
        if not isinstance(setup, Setup | None):
            arguments.refuse(type(self).__name__, "setup", setup, "a Setup")
        self.setup = setup or Setup()
        chosen = load_setup(self.setup.config)
        overrides = {**chosen.params, **self.setup.overrides}
        self.drive = Drive(chosen.motor_dir, chosen.board, overrides)
        self.plant = Plant(self.setup.rig, chosen.board, rig_overrides=self.setup.rig_overrides)
        d = self.drive
        lambda_Wb = d["M_H"] * d["i_d_A"]
        per_A = d["pole_pairs"] * d["M_H"] / d["Lr_H"] * lambda_Wb
        self.flux_max_Wb = 1.5 * lambda_Wb
        self.torque_max_Nm = per_A * d["i_q_max_A"]
        self.speed_max_rpm = 1.2 * max(map(abs, (*self.setup.speed_rpm, self.setup.start_rpm)))
        self.steps_max = round(self.setup.episode_s / (self.setup.periods * d["period_s"]))
        self.speed_ref_rpm = self.setup.start_rpm
        self.steps = 0
        self._bring_up()
        self._start = d.snapshot(), self.plant.snapshot()

    def _bring_up(self) -> None:
        """Current offsets, flux, the speed where every episode starts."""
        second = round(1.0 / self.drive["period_s"])
        self.plant.run(self.drive, second // 2, run=False)
        for _ in range(20):
            done = self.plant.run(self.drive, second, speed_ref_rpm=self.setup.start_rpm)
            reached = abs(done.truth["speed_rpm"][-1] - self.setup.start_rpm) < 5.0
            if reached and done.out["state"][-1] == State.RUN:
                return
        raise UserError("Setup: start_rpm: the drive does not reach it within 20 s")

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Floats, Info]:
        """Back to the operating point. options: "speed_ref_rpm", "load_Nm" instead of draws."""
        where = f"{type(self).__name__}.reset"
        if seed is not None:
            arguments.whole(where, "seed", seed, 0, 2**128 - 1, "0 .. 2^128 - 1")
        chosen = arguments.mapping(where, "options", {} if options is None else options)
        if unknown := set(chosen) - {"speed_ref_rpm", "load_Nm"}:
            arguments.refuse(where, "options", sorted(unknown), "speed_ref_rpm and load_Nm alone")
        wanted = {name: arguments.finite(where, name, value) for name, value in chosen.items()}
        super().reset(seed=seed)
        self.drive.restore(self._start[0])
        self.plant.restore(self._start[1])
        drawn = self.np_random.uniform(*self.setup.speed_rpm)
        self.speed_ref_rpm = float(wanted.get("speed_ref_rpm", drawn))
        load_Nm = float(wanted.get("load_Nm", self.np_random.uniform(*self.setup.load_Nm)))
        self.plant.reseed(int(self.np_random.integers(1, 2**63)))
        self.plant.disturb(load_torque_Nm=load_Nm)
        self.steps = 0
        return self._begin(), {"speed_ref_rpm": self.speed_ref_rpm, "load_Nm": load_Nm}

    def _begin(self) -> Floats:
        raise NotImplementedError

    def _checked(self, action: npt.ArrayLike) -> Floats:
        shape = (self.action_space.shape or (0,))[0]
        try:
            values = np.asarray(action, dtype=np.float32).reshape(-1)
        except (TypeError, ValueError):
            values = np.empty(0, np.float32)
        if values.shape != (shape,) or not np.isfinite(values).all():
            name = type(self).__name__
            raise UserError(f"{name}.step: action: {action!r} is not {shape} finite numbers")
        return np.asarray(np.clip(values, -1.0, 1.0), np.float32)

    def _advance(self, torque_Nm: float | None) -> Rows:
        """One step; None: the drive controls the speed itself."""
        done = self.plant.run(
            self.drive,
            self.setup.periods,
            speed_ref_rpm=self.speed_ref_rpm,
            torque_ref_Nm=torque_Nm,
        )
        self.steps += 1
        return done.out

    def _ended(self, out: Rows, reward: float) -> tuple[float, bool, bool, Info]:
        truth = self.plant.truth()
        info = {
            "speed_rpm": truth.speed_rpm,
            "speed_hat_rpm": float(out["speed_hat_rpm"][-1]),
            "speed_ref_rpm": self.speed_ref_rpm,
            "faults": int(out["faults"][-1]),
            "confidence": int(out["confidence"][-1]),
        }
        tripped = bool(out["state"][-1] == State.FAULT) or truth.diverged
        truncated = not tripped and self.steps >= self.steps_max
        return (_FAULT_REWARD if tripped else reward), tripped, truncated, info

    def close(self) -> None:
        """Free drive and plant."""
        self.drive.close()
        self.plant.close()


def _observed(*values: float) -> Floats:
    known = np.nan_to_num(np.array(values), nan=0.0)
    return np.asarray(np.clip(known, -_LIMIT, _LIMIT), np.float32)


def _box(count: int, limit: float) -> spaces.Space[Floats]:
    return cast("spaces.Space[Floats]", spaces.Box(-limit, limit, (count,), np.float32))


class SpeedLoopEnv(_DriveEnv):
    """The agent is the speed controller; its action is the torque reference over torque_max_Nm.

    Observation, each scaled to about one: speed reference, estimated speed, their difference (times
    ten), torque current, magnetising current, the last action, 1 while the speed is unknown.
    Reward per step: minus the square of the true speed error over speed_max_rpm, times 100, and a
    little for each change of the action; -100 ends the episode with a fault.
    """

    def __init__(self, setup: Setup | None = None) -> None:
        super().__init__(setup)
        self.action_space = _box(1, 1.0)
        self.observation_space = _box(7, _LIMIT)
        self.last = 0.0

    def _begin(self) -> Floats:
        self.last = 0.0
        out = self.drive.telemetry()
        return self._observation(out.speed_hat_rpm, out.i_q_A, out.i_d_A, out.speed_unknown)

    def _observation(self, speed_rpm: float, i_q_A: float, i_d_A: float, unknown: bool) -> Floats:
        top, i_max_A = self.speed_max_rpm, self.drive["i_q_max_A"]
        error = 10.0 * (self.speed_ref_rpm - speed_rpm) / top
        return _observed(
            *(self.speed_ref_rpm / top, speed_rpm / top, error),
            *(i_q_A / i_max_A, i_d_A / i_max_A, self.last, float(unknown)),
        )

    def step(self, action: Floats) -> tuple[Floats, float, bool, bool, Info]:
        """Hold this torque reference for setup.periods control periods."""
        wanted = float(self._checked(action)[0])
        out = self._advance(wanted * self.torque_max_Nm)
        change, self.last = wanted - self.last, wanted
        error = (self.plant.truth().speed_rpm - self.speed_ref_rpm) / self.speed_max_rpm
        reward = -100.0 * error**2 - _CHANGE_WEIGHT * change**2
        now = out[-1]
        seen = self._observation(
            float(now["speed_hat_rpm"]),
            float(now["i_q_A"]),
            float(now["i_d_A"]),
            bool(now["speed_unknown"]),
        )
        return seen, *self._ended(out, float(reward))


class EstimatorEnv(_DriveEnv):
    """The agent is an estimator: its action is speed over speed_max_rpm and rotor flux (alpha,
    beta) over flux_max_Wb.

    Observation: voltage and current of this period and of the one before (alpha, beta each; over
    100 V and i_q_max_A), the last action. Reward per step: minus the squares of the speed error,
    times 100, and of the flux error over flux_max_Wb, times 0.3.
    """

    def __init__(self, setup: Setup | None = None, *, closed: bool = False) -> None:
        """closed: the speed loop acts on the agent's speed."""
        super().__init__(Setup(periods=1, episode_s=0.5) if setup is None else setup)
        self.closed = arguments.level("EstimatorEnv", "closed", closed)
        self.action_space = _box(3, 1.0)
        self.observation_space = _box(11, _LIMIT)
        self.last = np.zeros(3, np.float32)
        self.before = (0.0,) * 4
        self.integral_Nm = 0.0

    def _begin(self) -> Floats:
        truth, out = self.plant.truth(), self.drive.telemetry()
        flux = np.array([truth.psi_r_alpha_Wb, truth.psi_r_beta_Wb]) / self.flux_max_Wb
        # Where an estimator of the drive would be seeded.
        self.last = np.array([truth.speed_rpm / self.speed_max_rpm, *flux], np.float32)
        self.before = self._signals(*(getattr(out, name) for name in _SEEN))
        self.integral_Nm = truth.torque_Nm
        return _observed(*self.before, *self.before, *self.last)

    def _signals(self, *u_and_i: float) -> tuple[float, float, float, float]:
        u_alpha_V, u_beta_V, i_alpha_A, i_beta_A = map(float, u_and_i)
        i_max_A = self.drive["i_q_max_A"]
        return u_alpha_V / 100.0, u_beta_V / 100.0, i_alpha_A / i_max_A, i_beta_A / i_max_A

    def step(self, action: Floats) -> tuple[Floats, float, bool, bool, Info]:
        """The estimate for the present crest; then setup.periods control periods pass."""
        said = self._checked(action)
        truth = self.plant.truth()
        flux_error = np.hypot(
            said[1] - truth.psi_r_alpha_Wb / self.flux_max_Wb,
            said[2] - truth.psi_r_beta_Wb / self.flux_max_Wb,
        )
        speed_error = said[0] - truth.speed_rpm / self.speed_max_rpm
        reward = -100.0 * speed_error**2 - _FLUX_WEIGHT * flux_error**2
        speed_rpm = float(said[0]) * self.speed_max_rpm
        out = self._advance(self._speed_loop(speed_rpm) if self.closed else None)
        now = out[-1]
        signals = self._signals(*(now[name] for name in _SEEN))
        seen = _observed(*signals, *self.before, *said)
        self.before, self.last = signals, said
        return seen, *self._ended(out, float(reward))

    def _speed_loop(self, speed_rpm: float) -> float:
        """Torque of a PI controller with the inertia that the drive reckons with."""
        bandwidth_rad_s = 2.0 * pi * 2.0
        gain = self.drive["speed_J_kg_m2"] * bandwidth_rad_s
        error_rad_s = (self.speed_ref_rpm - speed_rpm) * pi / 30.0
        dt_s = self.setup.periods * self.drive["period_s"]
        limit = self.torque_max_Nm
        self.integral_Nm += 0.25 * bandwidth_rad_s * gain * error_rad_s * dt_s
        self.integral_Nm = min(max(self.integral_Nm, -limit), limit)
        return min(max(gain * error_rad_s + self.integral_Nm, -limit), limit)


gymnasium.register("ZeroHertz/SpeedLoop-v0", entry_point="zerohertz.gym:SpeedLoopEnv")
gymnasium.register("ZeroHertz/Estimator-v0", entry_point="zerohertz.gym:EstimatorEnv")
