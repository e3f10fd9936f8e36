"""A speed controller found by random search: `tools/zh setup gym; tools/zh python <this file>`."""

import gymnasium
import numpy as np

env = gymnasium.make("zerohertz.gym:ZeroHertz/SpeedLoop-v0")
rng = np.random.default_rng(1)


def episode(gains: np.ndarray, seed: int) -> float:
    """A PI controller as the agent; the same seed has the same load, reference and noise."""
    seen, _ = env.reset(seed=seed)
    integral, total, ended = 0.0, 0.0, False
    while not ended:
        integral = np.clip(integral + gains[1] * seen[2], -1.0, 1.0)
        action = np.clip([gains[0] * seen[2] + integral], -1.0, 1.0)
        seen, reward, fault, over, _ = env.step(action.astype(np.float32))
        total, ended = total + reward, fault or over
    return total


best, score = np.array([0.05, 0.0005]), -np.inf
for trial in range(12):
    gains = best * (np.exp(rng.normal(0.0, 0.7, 2)) if trial else 1.0)
    if (found := sum(episode(gains, seed) for seed in range(3)) / 3.0) > score:
        best, score = gains, found
        print(f"trial {trial:2}: kp {best[0]:.3f}, ki {best[1]:.5f}, reward {score:.1f}")
