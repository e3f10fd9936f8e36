"""The monitor's other half: no alarm where nothing is broken.

Random missions of `zh detection` (speeds, loads, sensor errors, noise) with a true Rs anywhere from
half to one and a half of the rig's, averaged and switched inverter, voltage from sensors and from
the duty in turns. Every fault bit counts in a mission that the drive holds; one that it does not
hold is no false alarm, and is counted apart. Beside the false ones stands in how many of them the
true torque swings before the word: there the law is to blame, not the guard. And for which share of
the held time above 1 Hz the drive says that it does not know its speed.
"""

from __future__ import annotations

import dataclasses
import itertools
import multiprocessing
from collections import Counter
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from zerohertz import sim
from zerohertz.atlas.detection import MISSION_S, RUN_STATE, SPLIT_HZ, held, lost, mission_job
from zerohertz.campaign.faults.conditions import INVERTERS
from zerohertz.campaign.rig import FIRMWARE
from zerohertz.scenario.setup import Setup, load_setup

RS_SHARE = 0.5
DUTY = 1  # voltage_source; else that of the configuration
PLANTS = tuple(itertools.product(INVERTERS, ("sensors", "duty")))
UNKNOWN_SHARE = 0.01  # of the held time above SPLIT_HZ, at most
SWING_S, SWING_NM = 0.5, 4.2  # before the word; standard deviation, half of rated torque


@dataclasses.dataclass(frozen=True)
class Quiet:
    """One mission: what it held and what was said."""

    seed: int
    held: bool
    run_s: float
    bits: int  # latched, warnings included
    plant: str = ""
    fast_s: float = 0.0  # with torque above SPLIT_HZ ...
    unknown_s: float = 0.0  # ... and the speed unknown in it
    swings: bool = False  # before the first bit


def job(setup: Setup, seed: int) -> sim.Job:
    usual = mission_job(setup, seed)
    rng = np.random.default_rng((seed, 5))
    rig = dict(usual.rig_overrides)
    rig["motor.Rs_ohm"] *= float(rng.uniform(1.0 - RS_SHARE, 1.0 + RS_SHARE))
    inverter, voltage = PLANTS[seed % len(PLANTS)]
    rig["inverter.model"] = inverter
    told = {**FIRMWARE, **({"voltage_source": DUTY} if voltage == "duty" else {})}
    return dataclasses.replace(usual, rig_overrides=rig, firmware=told)


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
    running = record["state"] == RUN_STATE
    fast = running & (np.abs(record["f_s_Hz"]) > SPLIT_HZ)
    return Quiet(
        seed,
        bool(good),
        step_s * int(running.sum()),
        int(np.bitwise_or.reduce(faults)),
        ", ".join(PLANTS[seed % len(PLANTS)]),
        step_s * int(fast.sum()),
        step_s * int((fast & (record["speed_unknown"] > 0)).sum()),
        swings_before(record, faults != 0),
    )


def swings_before(record: sim.Record, told: np.ndarray) -> bool:
    """By the true torque, in the last moment before the first bit."""
    if not told.any():
        return False
    at_s = record.t_s[np.argmax(told)]
    before = (record.t_s >= at_s - SWING_S) & (record.t_s < at_s)
    return float(record["torque_Nm"][before].std()) > SWING_NM


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
    """Of all missions, and beside it of each plant alone."""
    every = list(missions)
    plants = dict.fromkeys(m.plant for m in every)
    alone = {name: _of([m for m in every if m.plant == name]) for name in plants}
    return {**_of(every), "plants": alone}


def good(quiet: dict[str, Any]) -> bool:
    """No false alarm, and the speed nearly always known."""
    return quiet["false_alarms"] == 0 and (quiet["unknown_share"] or 0.0) <= UNKNOWN_SHARE


def _of(every: list[Quiet]) -> dict[str, Any]:
    held_ = [m for m in every if m.held]
    fast_s, unknown_s = (sum(getattr(m, name) for m in held_) for name in ("fast_s", "unknown_s"))
    return {
        "missions": len(every),
        "held": len(held_),
        "held_hours": round(sum(m.run_s for m in held_) / 3600.0, 2),
        "unknown_share": round(unknown_s / fast_s, 5) if fast_s else None,
        "alarms_not_held": sum(m.bits != 0 for m in every if not m.held),
        **_told([m for m in held_ if m.bits]),
    }


def _told(alarms: list[Quiet]) -> dict[str, Any]:
    return {
        "false_alarms": len(alarms),
        "of_a_swing": sum(m.swings for m in alarms),
        "false_bits": {hex(bits): n for bits, n in Counter(m.bits for m in alarms).items()},
        "alarms": {m.seed: hex(m.bits) for m in alarms},
    }
