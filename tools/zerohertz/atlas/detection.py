"""Judges the firmware's supervisor: does it tell a lost orientation, and only that?

Positives are the paper's experiments that lose the motor, negatives random missions in which the
drive stays oriented. Lost: |flux angle error| > 25 deg or flux magnitude off by more than 25 %.
"""

from __future__ import annotations

import multiprocessing
import tomllib
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from zerohertz import sim
from zerohertz.scenario.setup import Setup, figure_scenario, load_setup, scenario_file

LOSING_FIGURES = (8, 9, 13, 14, 15, 17)
ANGLE_DEG = 25.0
MAGNITUDE_PU = 0.25
SILENT_S = 0.1
SPLIT_HZ = 1.0  # |f_s| above: delays of 50 ms; below: of 1 s
RUN_STATE = 4
IMPRESSED = 2
# Bits of supervisor.h that say "lost"; UNSURE says only "nobody could tell".
LOSS_BITS = 2 | 4 | 8

# A mission: started up, then two demands of speed and load, ramped, each held for a while.
MISSION_S = 15.5
START_S = 6.5  # Rs measured, magnetised and running after this
_PLATEAUS_S = ((9.0, 11.0), (13.5, 15.5))
_SPEEDS_RPM = (0.0, 15.0, 30.0, 60.0, 120.0, 300.0, 900.0)

Flags = NDArray[np.bool_]
Progress = Callable[[int], None]


@dataclass(frozen=True)
class Delay:
    """One crossing of 25 degrees in RUN."""

    f_s_Hz: float
    seconds: float  # until not CLOSED; of an unseen one its own length
    seen: bool


@dataclass(frozen=True)
class Found:
    """What one run shows of the supervisor."""

    name: str
    delays: tuple[Delay, ...]
    silent_s: float  # longest unbroken time lost and CLOSED
    first_lost_s: float | None
    indicated_s: float | None  # first loss indicator, from first_lost_s on
    impressed_s: float | None  # first request, from first_lost_s on


@dataclass(frozen=True)
class Quiet:
    """What one oriented mission shows; `oriented` False: it does not count."""

    oriented: bool
    run_s: float
    loss_alarms: int  # CLOSED left by a loss indicator with |f_s| > 1 Hz
    unsure_alarms: int  # CLOSED left by the bound with |f_s| > 1 Hz
    impressed: int  # requests, at any frequency
    point_s: float  # held points with |f_s| > 1 Hz
    point_closed_s: float
    bound_held_s: float  # CLOSED and the speed error below the bound stated
    closed_s: float
    silent_s: float  # of any mission, oriented or not


def lost(record: sim.Record) -> Flags:
    """Where the orientation is lost, in RUN."""
    flux_Wb = np.maximum(record["lambda_Wb"], 1e-6)
    magnitude = np.abs(record["lambda_hat_Wb"] / flux_Wb - 1.0) > MAGNITUDE_PU
    angle = np.abs(record["flux_angle_err_deg"]) > ANGLE_DEG
    return (record["state"] == RUN_STATE) & (angle | magnitude)


def stretches(flags: Flags) -> list[tuple[int, int]]:
    """[first, end) of every stretch of true flags."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], flags, [False])).astype(np.int8)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def longest_s(flags: Flags, step_s: float) -> float:
    return step_s * max((end - first for first, end in stretches(flags)), default=0)


def find(record: sim.Record, name: str) -> Found:
    """Delays and silence of one losing run."""
    step_s = float(record.t_s[1] - record.t_s[0])
    doubt = record["confidence"] > 0
    gone = lost(record)
    turned = (record["state"] == RUN_STATE) & (np.abs(record["flux_angle_err_deg"]) > ANGLE_DEG)
    delays = []
    for first, end in stretches(turned):
        seen = np.flatnonzero(doubt[first:end])
        count = int(seen[0]) if len(seen) else end - first
        f_s_Hz = float(abs(record["f_s_Hz"][first]))
        delays.append(Delay(f_s_Hz, step_s * count, bool(len(seen))))
    start = int(np.argmax(gone)) if gone.any() else None
    indicated = (record["supervisor_reasons"].astype(np.int64) & LOSS_BITS) != 0
    return Found(
        name,
        tuple(delays),
        longest_s(gone & ~doubt, step_s),
        None if start is None else float(record.t_s[start]),
        _after(indicated, start, step_s),
        _after(record["confidence"] == IMPRESSED, start, step_s),
    )


def _after(flags: Flags, start: int | None, step_s: float) -> float | None:
    if start is None or not flags[start:].any():
        return None
    return step_s * int(np.argmax(flags[start:]))


def losing_run(task: tuple[Setup, int, int]) -> Found:
    """One of the paper's experiments, every period recorded."""
    setup, figure, seed = task
    job = sim.Job(
        scenario=scenario_file(figure_scenario(figure)),
        rig=setup.rig,
        board=setup.board,
        motor_dir=setup.motor_dir,
        firmware_config=setup.params,
        rig_overrides=setup.rig_overrides,
        seed=seed,
    )
    return find(sim.run(job), f"fig{figure:02d}")


def mission_job(setup: Setup, seed: int) -> sim.Job:
    """A random mission: speeds, loads, true Rs, its drift, sensor errors, noise."""
    rng = np.random.default_rng(seed)
    speed_rpm = rng.choice(_SPEEDS_RPM, 2) * rng.uniform(0.8, 1.2, 2) * rng.choice((-1.0, 1.0), 2)
    load_Nm = 8.4 * rng.uniform(-1.0, 1.0, 2)
    warm = rng.uniform(0.98, 1.05)
    with open(setup.rig, "rb") as stream:
        rig = tomllib.load(stream)
    overrides: dict[str, Any] = dict(setup.rig_overrides) | {
        "motor.Rs_ohm": rig["motor"]["Rs_ohm"] * rng.uniform(0.95, 1.05),
        "mechanics.J_kg_m2": 0.035,
        "sensors.current_gain": rng.uniform(0.995, 1.005, 3).tolist(),
        "sensors.current_offset_A": rng.uniform(-0.03, 0.03, 3).tolist(),
        "sensors.voltage_offset_V": rng.uniform(-0.05, 0.05, 2).tolist(),
        "sensors.voltage_gain": rng.uniform(0.995, 1.005, 2).tolist(),
    }
    n, m = speed_rpm.tolist(), load_Nm.tolist()
    # The drive measures, magnetises and runs up unloaded; then load, then the next demand of both.
    speed = [[0, 0], [5.5, 0], [6.2, n[0]], [11.1, n[0]], [11.9, n[1]]]
    load = [[0, 0], [7.0, 0], [8.0, m[0]], [11.1, m[0]], [12.1, m[1]]]
    scenario = (
        f'[scenario]\nname = "mission"\nduration_s = {MISSION_S}\nrun_on_s = 0.1\n'
        f"[profiles]\nspeed_ref_rpm = {speed}\nload_torque_Nm = {load}\n"
        f"rs_factor = [[0, 1.0], [{MISSION_S}, {warm}]]\n"
    )
    return sim.Job(
        scenario=scenario,
        rig=setup.rig,
        board=setup.board,
        motor_dir=setup.motor_dir,
        firmware_config=setup.params,
        rig_overrides=overrides,
        seed=seed,
        decimate=5,
    )


def held(record: sim.Record) -> bool:
    """Speed as the robustness map asks for it, at the end of both demands, and no trip."""
    error_rpm = record["speed_rpm"] - record["speed_ref_rpm"]
    if record.trip:
        return False
    for start_s, end_s in _PLATEAUS_S:
        part = error_rpm[(record.t_s >= start_s) & (record.t_s < end_s)]
        if not (abs(part.mean()) < 30.0 and part.std() < 15.0):
            return False
    return True


def judge_mission(record: sim.Record) -> Quiet:
    step_s = float(record.t_s[1] - record.t_s[0])
    gone = lost(record)
    closed = record["confidence"] == 0
    fast = (record["state"] == RUN_STATE) & (np.abs(record["f_s_Hz"]) > SPLIT_HZ)
    point = fast & np.any([(record.t_s >= a) & (record.t_s < b) for a, b in _PLATEAUS_S], axis=0)
    left = np.concatenate(([False], closed[:-1] & ~closed[1:])) & fast
    lossy = (record["supervisor_reasons"].astype(np.int64) & LOSS_BITS) != 0
    asked = np.diff((record["confidence"] == IMPRESSED).astype(np.int8), prepend=0) > 0
    sure = closed & (record["state"] == RUN_STATE) & (record.t_s > START_S)
    error_rpm = np.abs(record["speed_hat_rpm"] - record["speed_rpm"])
    return Quiet(
        oriented=held(record) and not gone.any(),
        run_s=step_s * int((record["state"] == RUN_STATE).sum()),
        loss_alarms=int((left & lossy).sum()),
        unsure_alarms=int((left & ~lossy).sum()),
        impressed=int(asked.sum()),
        point_s=step_s * int(point.sum()),
        point_closed_s=step_s * int((point & closed).sum()),
        bound_held_s=step_s * int((sure & (error_rpm <= record["omega_bound_rpm"])).sum()),
        closed_s=step_s * int(sure.sum()),
        silent_s=longest_s(gone & closed, step_s),
    )


def mission(task: tuple[Setup, int]) -> Quiet:
    setup, seed = task
    return judge_mission(sim.run(mission_job(setup, seed)))


def summary_of_losses(runs: Iterable[Found]) -> dict[str, Any]:
    """Delays by frequency, silence, and when loss was indicated and take-over asked for."""
    runs = list(runs)
    above = [d for r in runs for d in r.delays if d.f_s_Hz > SPLIT_HZ]
    below = [d for r in runs for d in r.delays if d.f_s_Hz <= SPLIT_HZ]
    return {
        "runs": len(runs),
        "not_lost": sum(r.first_lost_s is None for r in runs),
        "above_1Hz": _delays(above),
        "below_1Hz": _delays(below),
        **_silence([r.silent_s for r in runs]),
        "figures": _by_figure(runs),
    }


def _silence(silent_s: list[float]) -> dict[str, Any]:
    return {
        "silent": sum(s > SILENT_S for s in silent_s),
        "worst_silent_ms": _ms(max(silent_s, default=0.0)),
    }


def _by_figure(runs: list[Found]) -> dict[str, Any]:
    names = dict.fromkeys(r.name for r in runs)
    return {name: _figure([r for r in runs if r.name == name]) for name in names}


def _figure(runs: list[Found]) -> dict[str, Any]:
    indicated = [r.indicated_s for r in runs if r.indicated_s is not None]
    impressed = [r.impressed_s for r in runs if r.impressed_s is not None]
    return {
        "first_lost_s": [round(r.first_lost_s, 3) for r in runs if r.first_lost_s is not None],
        "worst_delay_ms": _ms(max((d.seconds for r in runs for d in r.delays), default=0.0)),
        "worst_silent_ms": _ms(max(r.silent_s for r in runs)),
        "never_indicated": len(runs) - len(indicated),
        "indicated_ms": [_ms(s) for s in indicated],
        "never_impressed": len(runs) - len(impressed),
        "impressed_ms": [_ms(s) for s in impressed],
    }


def _delays(delays: list[Delay]) -> dict[str, Any]:
    times = [d.seconds for d in delays]
    return {
        "crossings": len(times),
        "median_ms": _ms(float(np.median(times))) if times else None,
        "worst_ms": _ms(max(times)) if times else None,
        "unseen": sum(not d.seen for d in delays),
    }


def _ms(seconds: float) -> float:
    return round(1e3 * seconds, 1)


def summary_of_missions(missions: Iterable[Quiet]) -> dict[str, Any]:
    """False alarms over the missions that stayed oriented; silence over all."""
    every = list(missions)
    good = [m for m in every if m.oriented]
    point_closed_s = sum(m.point_closed_s for m in good)
    bound_held_s = sum(m.bound_held_s for m in good)
    return {
        "missions": len(every),
        "oriented": len(good),
        "oriented_hours": round(sum(m.run_s for m in good) / 3600.0, 3),
        "loss_alarms": sum(m.loss_alarms for m in good),
        "unsure_above_1Hz": sum(m.unsure_alarms for m in good),
        "impressed": sum(m.impressed for m in good),
        "closed_share_above_1Hz": _share(point_closed_s, sum(m.point_s for m in good)),
        "bound_held_share": _share(bound_held_s, sum(m.closed_s for m in good)),
        **_silence([m.silent_s for m in every]),
    }


def _share(part_s: float, whole_s: float) -> float | None:
    return round(part_s / whole_s, 4) if whole_s else None


def meets(result: dict[str, Any]) -> bool:
    """What a supervisor has to do; the numbers are the requirement's."""
    losses, quiet = result["losses"], result["missions"]
    fast = losses["above_1Hz"]["worst_ms"]
    slow = losses["below_1Hz"]["worst_ms"]
    share = quiet["closed_share_above_1Hz"]
    return bool(
        (fast is None or fast <= 50.0)
        and (slow is None or slow <= 1000.0)
        and losses["silent"] == quiet["silent"] == 0
        and losses["not_lost"] == 0
        and quiet["loss_alarms"] == quiet["impressed"] == 0
        and (share is not None and share >= 0.9)
    )


def detection(
    hours: float, seeds: int, workers: int, progress: Progress | None = None
) -> dict[str, Any]:
    """Losing runs of configuration paper, missions of configuration recommended.

    Missions go on until `hours` of them stayed oriented, three times as long at most.
    """
    paper, recommended = load_setup("paper"), load_setup("recommended")
    sim.column_texts()  # build once, before there are processes
    told = progress or (lambda _count: None)
    tasks = [(paper, figure, seed + 1) for figure in LOSING_FIGURES for seed in range(seeds)]
    wanted_s, oriented_s = 3600.0 * hours, 0.0
    seed, batch = 1, 8 * workers
    missions: list[Quiet] = []
    with multiprocessing.get_context("spawn").Pool(workers) as pool:
        found = pool.map(losing_run, tasks)
        while oriented_s < wanted_s and MISSION_S * len(missions) < 3.0 * wanted_s:
            done = pool.map(mission, [(recommended, seed + k) for k in range(batch)])
            seed += batch
            missions += done
            gained_s = sum(m.run_s for m in done if m.oriented)
            oriented_s += gained_s
            told(round(gained_s))
    result = {
        "losses": summary_of_losses(found),
        "missions": summary_of_missions(missions),
    }
    return result | {"meets": meets(result)}
