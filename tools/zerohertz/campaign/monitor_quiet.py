"""The monitor's other half: no alarm where nothing is broken.

Random missions of `zh detection` (speeds, loads, sensor errors, noise) with a true Rs anywhere from
half to one and a half of the rig's. Every fault bit counts in a mission that the drive holds; one
that it does not hold is no false alarm, and is counted apart.
"""

from __future__ import annotations

import dataclasses
import multiprocessing
from collections import Counter
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from zerohertz import sim
from zerohertz.atlas.detection import MISSION_S, RUN_STATE, held, lost, mission_job
from zerohertz.campaign.rig import FIRMWARE
from zerohertz.scenario.setup import Setup, load_setup

RS_SHARE = 0.5


@dataclasses.dataclass(frozen=True)
class Quiet:
    """One mission: what it held and what was said."""

    seed: int
    held: bool
    run_s: float
    bits: int  # latched, warnings included


def job(setup: Setup, seed: int) -> sim.Job:
    usual = mission_job(setup, seed)
    rng = np.random.default_rng((seed, 5))
    rig = dict(usual.rig_overrides)
    rig["motor.Rs_ohm"] *= float(rng.uniform(1.0 - RS_SHARE, 1.0 + RS_SHARE))
    return dataclasses.replace(usual, rig_overrides=rig, firmware=FIRMWARE)


def mission(task: tuple[Setup, int]) -> Quiet:
    setup, seed = task
    record = sim.run(job(setup, seed))
    quiet = dataclasses.replace(record, trip=sim.Trip(0))
    # A trip that the firmware makes of nothing ends the mission: what came before decides.
    faults = record["faults"].astype(np.int64)
    silent = faults == 0
    good = held(quiet) and not lost(record).any()
    if not silent.all():
        until = int(np.argmin(silent))
        error_rpm = np.abs(record["speed_rpm"] - record["speed_ref_rpm"])[:until]
        good = not lost(record)[:until].any() and float(error_rpm[-50:].max(initial=0.0)) < 150.0
    step_s = float(record.t_s[1] - record.t_s[0])
    running_s = step_s * int((record["state"] == RUN_STATE).sum())
    return Quiet(seed, bool(good), running_s, int(np.bitwise_or.reduce(faults)))


def run_all(hours: float, workers: int, progress: Callable[[float], None]) -> list[Quiet]:
    """Missions until so many hours of held ones have run, twice as many at most."""
    setup = load_setup("recommended")
    sim.column_texts()  # build once, before there are processes
    done: list[Quiet] = []
    held_s, batch = 0.0, 8 * workers
    with multiprocessing.get_context("spawn").Pool(workers) as pool:
        while held_s < 3600.0 * hours and MISSION_S * len(done) < 2.0 * 3600.0 * hours:
            part = pool.map(mission, [(setup, len(done) + k + 1) for k in range(batch)])
            done += part
            held_s += sum(m.run_s for m in part if m.held)
            progress(held_s / 3600.0)
    return done


def summary(missions: Iterable[Quiet]) -> dict[str, Any]:
    every = list(missions)
    good = [m for m in every if m.held]
    return {
        "missions": len(every),
        "held": len(good),
        "held_hours": round(sum(m.run_s for m in good) / 3600.0, 2),
        "false_alarms": sum(m.bits != 0 for m in good),
        "false_bits": {hex(b): n for b, n in Counter(m.bits for m in good if m.bits).items()},
        "alarms_not_held": sum(m.bits != 0 for m in every if not m.held),
    }
