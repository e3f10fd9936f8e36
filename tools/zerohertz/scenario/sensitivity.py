"""How sharp is the knife edge: mean score when all rig parameters are drawn around the rig's.

32 draws per spread, one noise seed, averaged inverter. Positive numbers are drawn lognormal, the
errors of the sensors (offset; gain minus one) and the residual numbers normal, all with the same
relative standard deviation. Inductances are drawn as M and the two leakages: a spread on Ls and M
apart would be one on the leakage ten times as large.

A drawn rig that the plant refuses (a dead-time threshold below what its carrier allows, say) is no
rig: it is drawn again, by a stream of its own, and the number of such draws is told.
"""

from __future__ import annotations

import dataclasses
import tomllib
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from zerohertz import sim
from zerohertz.errors import UserError
from zerohertz.scenario.evaluate import Run, job, measure_all
from zerohertz.scenario.predicates import FIGURES, NEEDS, judge
from zerohertz.scenario.setup import Setup

SPREADS = (0.01, 0.03, 0.10)
DRAWS = 32
MAX_REDRAWS = 100  # of one draw; more, and it is the rig that is refused
NOISE_SEED = 1

# Constants of the carrier's hardware and switches of the model: they have no spread.
_FIXED = ("pole_pairs", "carrier_Hz", "model", "exponent", "name")


def drawn_rig(rig: Mapping[str, Any], spread: float, rng: np.random.Generator) -> dict[str, Any]:
    """Overrides of a rig file's content, every parameter drawn once."""
    flat = dict(_flat(rig))
    motor = {k: flat[f"motor.{k}"] for k in ("M_H", "Ls_H", "Lr_H")}
    drawn: dict[str, Any] = {}
    for key, value in flat.items():
        name = key.rpartition(".")[2]
        if name in _FIXED or name in ("Ls_H", "Lr_H") or isinstance(value, str):
            continue
        drawn[key] = _drawn(name, value, spread, rng)
    for name in ("Ls_H", "Lr_H"):
        leakage_H = motor[name] - motor["M_H"]
        drawn[f"motor.{name}"] = drawn["motor.M_H"] + _drawn("leakage", leakage_H, spread, rng)
    static, coulomb = "mechanics.static_Nm", "mechanics.coulomb_Nm"
    drawn[static] = max(drawn[static], drawn[coulomb])
    return drawn | {"inverter.model": "averaged"}


def sensitivity(
    setup: Setup,
    draws: int = DRAWS,
    workers: int = 1,
    progress: Callable[[int], None] | None = None,
) -> tuple[dict[str, float], int]:
    """Mean score per spread: {"1%": x, "3%": x, "10%": x}, and how many draws were refused."""
    rig = tomllib.loads(setup.rig.read_text(encoding="utf-8"))
    runs = []
    redrawn = 0
    for spread in SPREADS:
        # The same stream for every spread: the draws differ in size, not in direction.
        rng = np.random.default_rng(2005)
        for draw in range(draws):
            rig_drawn = _with(setup, drawn_rig(rig, spread, rng))
            for attempt in range(MAX_REDRAWS + 1):
                refusal = _refusal(rig_drawn)
                if refusal is None:
                    break
                if attempt == MAX_REDRAWS:
                    raise refusal
                again = np.random.default_rng((2005, draw, attempt))
                rig_drawn = _with(setup, drawn_rig(rig, spread, again))
                redrawn += 1
            runs += [Run(rig_drawn, figure, NOISE_SEED) for figure in FIGURES]
    found = measure_all(runs, workers, progress)
    scores = []
    for first in range(0, len(runs), len(FIGURES)):
        m = dict(zip(FIGURES, found[first : first + len(FIGURES)], strict=True))
        scores.append(
            sum(judge(n, {k: m[k] for k in (n, *NEEDS.get(n, ()))}).match for n in FIGURES)
        )
    means = np.mean(np.reshape(scores, (len(SPREADS), draws)), axis=1)
    named = {f"{100 * s:g}%": round(float(x), 3) for s, x in zip(SPREADS, means, strict=True)}
    return named, redrawn


def redraw_note(redrawn: int) -> str:
    """For the source of a result; nothing to say about none."""
    return f"; {redrawn} draws refused by the plant and drawn again" if redrawn else ""


def _refusal(setup: Setup) -> UserError | None:
    """What the plant has against this rig: it says so before the first step."""
    try:
        sim.run(dataclasses.replace(job(Run(setup, FIGURES[0], NOISE_SEED)), max_steps=1))
    except UserError as error:
        return error
    return None


def run_count(draws: int = DRAWS) -> int:
    return len(SPREADS) * draws * len(FIGURES)


def _with(setup: Setup, overrides: Mapping[str, Any]) -> Setup:
    return dataclasses.replace(setup, rig_overrides=dict(setup.rig_overrides) | dict(overrides))


def _drawn(name: str, value: Any, spread: float, rng: np.random.Generator) -> Any:
    if isinstance(value, list):
        return [_drawn(name, v, spread, rng) for v in value]
    if "gain" in name:
        return 1.0 + (value - 1.0) * (1.0 + spread * rng.normal())
    if value > 0.0 and "offset" not in name:
        return value * float(np.exp(spread * rng.normal()))
    return value * (1.0 + spread * rng.normal())


def _flat(content: Mapping[str, Any], prefix: str = "") -> Any:
    for key, value in content.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value
