"""zerohertz.gym: environments that gymnasium accepts, and that mean what they say."""

import re
import runpy
import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from zerohertz import gym
from zerohertz.errors import UserError
from zerohertz.paths import ROOT

SHORT = gym.Setup(episode_s=0.4)


@pytest.fixture(scope="module")
def speed_loop():
    return gym.SpeedLoopEnv()


def played(env, act, **options):
    """Reward in all and the last info of an episode."""
    seen, _ = env.reset(seed=1, options=options)
    total, ended = 0.0, False
    while not ended:
        seen, reward, fault, over, info = env.step(act(seen))
        total, ended = total + reward, fault or over
    return total, info | {"fault": fault}


@pytest.mark.parametrize(
    "make",
    [
        lambda: gym.SpeedLoopEnv(SHORT),
        lambda: gym.EstimatorEnv(),
        lambda: gym.EstimatorEnv(gym.Setup(periods=5), closed=True),
    ],
)
def test_gymnasium_accepts_the_environment(make):
    env = make()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env, skip_render_check=True)
    env.close()


def test_they_are_registered():
    with gymnasium.make("ZeroHertz/SpeedLoop-v0") as env:
        assert isinstance(env.unwrapped, gym.SpeedLoopEnv)


def proportional_integral():
    integral = 0.0

    def act(seen):
        nonlocal integral
        integral = float(np.clip(integral + 0.005 * seen[2], -1.0, 1.0))
        return np.clip([0.1 * seen[2] + integral], -1.0, 1.0).astype(np.float32)

    return act


def test_a_pi_controller_is_a_good_agent_and_idling_a_bad_one(speed_loop):
    wanted = {"speed_ref_rpm": 100.0, "load_Nm": 3.0}
    good, info = played(speed_loop, proportional_integral(), **wanted)
    assert abs(info["speed_rpm"] - 100.0) < 10.0
    assert not info["fault"]
    bad, _ = played(speed_loop, lambda seen: np.zeros(1, np.float32), **wanted)
    assert bad < 3.0 * good < 0.0


def test_an_episode_is_its_seed(speed_loop):
    runs = [played(speed_loop, proportional_integral()) for _ in range(2)]
    assert runs[0] == runs[1]


def estimate(env, error_rpm=0.0):
    """The true speed and flux, the speed wrong by so much."""

    def act(_):
        t = env.plant.truth()
        flux = np.array([t.psi_r_alpha_Wb, t.psi_r_beta_Wb]) / env.flux_max_Wb
        return np.array([(t.speed_rpm + error_rpm) / env.speed_max_rpm, *flux], np.float32)

    return act


def test_the_true_estimate_has_the_best_reward():
    env = gym.EstimatorEnv()
    right, _ = played(env, estimate(env))
    wrong, _ = played(env, estimate(env, 20.0))
    assert -1e-6 < right <= 0.0
    assert wrong == pytest.approx(
        -100.0 * (20.0 / env.speed_max_rpm) ** 2 * env.steps_max, rel=0.01
    )


def test_in_the_closed_loop_a_wrong_speed_is_felt_by_the_motor():
    env = gym.EstimatorEnv(gym.Setup(periods=5, episode_s=1.5), closed=True)
    wanted = {"speed_ref_rpm": 150.0, "load_Nm": 2.0}
    _, right = played(env, estimate(env), **wanted)
    _, wrong = played(env, estimate(env, 30.0), **wanted)
    assert abs(right["speed_rpm"] - 150.0) < 5.0
    assert abs(wrong["speed_rpm"] - 120.0) < 5.0


def test_a_fault_ends_the_episode(speed_loop):
    speed_loop.reset(seed=1)
    speed_loop.plant.disturb(u_dc_V=0.0)
    for _ in range(speed_loop.steps_max):
        _, reward, fault, over, info = speed_loop.step(np.zeros(1, np.float32))
        if fault or over:
            break
    assert fault
    assert reward == -100.0
    assert info["faults"] != 0


@pytest.mark.parametrize("action", [[np.nan], [0.0, 0.0], [np.inf], None, "x", [1j], [[1], [1, 2]]])
def test_an_action_that_is_none_is_named(speed_loop, action):
    speed_loop.reset(seed=1)
    with pytest.raises(UserError, match=r"SpeedLoopEnv.step: action: .* is not 1 finite"):
        speed_loop.step(action)


@pytest.mark.parametrize(
    "wrong",
    [
        *({"periods": 0}, {"periods": 1.5}, {"episode_s": 0.0}, {"episode_s": np.inf}),
        *({"load_Nm": (2.0, 1.0)}, {"load_Nm": None}, {"speed_rpm": (0, np.inf)}),
        *({"speed_rpm": (1, 2, 3)}, {"start_rpm": "x"}, {"config": None}, {"rig": 5}),
        *({"overrides": None}, {"rig_overrides": [1]}),
    ],
)
def test_a_setup_that_is_none_is_named(wrong):
    with pytest.raises(UserError, match=f"Setup: {next(iter(wrong))}: "):
        gym.Setup(**wrong)


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"nothing": 1}, r"options: is \['nothing'\]; give speed_ref_rpm and load_Nm alone"),
        ({"load_Nm": "x"}, "load_Nm: is 'x'"),
        ({"speed_ref_rpm": np.nan}, "speed_ref_rpm: is nan"),
        ([1], r"options: is \[1\]; give a mapping"),
    ],
)
def test_an_option_of_reset_is_named(speed_loop, options, text):
    with pytest.raises(UserError, match=f"SpeedLoopEnv.reset: {text}"):
        speed_loop.reset(options=options)


def test_other_arguments_of_an_environment_are_named(speed_loop):
    with pytest.raises(UserError, match=r"SpeedLoopEnv.reset: seed: -1 is outside"):
        speed_loop.reset(seed=-1)
    with pytest.raises(UserError, match="SpeedLoopEnv: setup: is 'x'; give a Setup"):
        gym.SpeedLoopEnv("x")
    with pytest.raises(UserError, match="EstimatorEnv: closed: is 'x'"):
        gym.EstimatorEnv(closed="x")


def test_the_example_learns(capsys):
    file = ROOT / "tools" / "zerohertz" / "examples" / "gym_speed_loop.py"
    assert len(file.read_text().splitlines()) <= 30
    runpy.run_path(str(file))
    scores = [float(x) for x in re.findall(r"reward (-[\d.]+)", capsys.readouterr().out)]
    assert scores[-1] > 0.2 * scores[0]
