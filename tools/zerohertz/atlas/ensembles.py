"""Numbers of a data sheet as ensembles: every run has its own plant, noise, phase and mission.

An ensemble is a draw (what one run is) and a measure (one number of its record). The plant is drawn
as in the atlas' random sample; the firmware is told the nameplate only. Run k of a seed is the same
for every number of runs.
"""

from __future__ import annotations

import dataclasses
import math
import multiprocessing
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

from zerohertz import sim
from zerohertz.atlas.bench_run import (
    RATED_SPEED_RPM,
    RATED_TORQUE_NM,
    Experiment,
    error_rpm,
    run,
    started,
    window,
)
from zerohertz.atlas.classes import FAR_RPM
from zerohertz.atlas.points import NOMINAL_J_KG_M2
from zerohertz.errors import UserError
from zerohertz.motor import load_motor
from zerohertz.paths import ROOT
from zerohertz.scenario.setup import Setup, Value

# A row: run, value (inf: lost), lost, first fault, and the numbers of the draw.
Row = dict[str, Any]
END_S = 0.3  # judged for the load being lost
SETTLE_S = 5.0
CROSSING_RPM = 150.0
CROSSING_WARM_PU = 0.05
LOAD_STEP_S = 3.0
MOTOR_J_KG_M2 = 0.015
DIP_RPM_S2 = RATED_TORQUE_NM / NOMINAL_J_KG_M2 * 30.0 / math.pi
DIP_S = 15e-3
RIPPLE_S = 4.0


@dataclasses.dataclass(frozen=True)
class Drawn:
    """One run: what is done, what the plant is, and what the firmware is told beyond the board."""

    what: Experiment
    plant: Mapping[str, Value]
    numbers: Mapping[str, float]  # for the table of runs
    from_s: float  # the measure looks at the record from here on


@dataclasses.dataclass(frozen=True)
class Ensemble:
    """What is drawn, what is measured, and the goal: a share of the runs within a limit."""

    goal: str
    unit: str
    limit: float
    share: float
    draw: Callable[[np.random.Generator], Drawn]
    measure: Callable[[sim.Record, Drawn], float]


def plant_of(rng: np.random.Generator, J_kg_m2: float | None = None) -> dict[str, Value]:
    """True motor and mechanics, within what the atlas' random sample draws; rig overrides."""
    circuit = load_motor(ROOT / "gain_tables" / "hasegawa2005").circuit
    leakage = rng.uniform(0.85, 1.15)
    M_H = circuit.M_H * rng.uniform(0.92, 1.08)
    J = NOMINAL_J_KG_M2 * rng.uniform(0.6, 1.6)
    return {
        "motor.Rr_ohm": circuit.Rr_ohm * rng.uniform(0.8, 1.2),
        "motor.M_H": M_H,
        "motor.Ls_H": M_H + leakage * (circuit.Ls_H - circuit.M_H),
        "motor.Lr_H": M_H + leakage * (circuit.Lr_H - circuit.M_H),
        "mechanics.J_kg_m2": J if J_kg_m2 is None else J_kg_m2,
    }


def _drawn(
    rng: np.random.Generator,
    what: Experiment,
    from_s: float,
    told: Mapping[str, Value],
    **numbers: float,
) -> Drawn:
    """Adds what every run draws: Rs, noise, the plant and the source of the voltage."""
    duty = bool(rng.random() < 0.5)
    what = dataclasses.replace(
        what,
        rs_ratio=float(rng.uniform(0.67, 1.5)),
        seed=int(rng.integers(1, 2**31)),
        firmware={**told, **({"voltage_source": 1} if duty else {})},
    )
    J_kg_m2 = numbers.get("J_kg_m2")
    more = {"rs_ratio": what.rs_ratio, "duty": float(duty)}
    return Drawn(what, plant_of(rng, J_kg_m2), {**numbers, **more}, from_s)


def _load_Nm(rng: np.random.Generator) -> float:
    return float(rng.uniform(-1.0, 1.0)) * RATED_TORQUE_NM


def draw_crossing(rng: np.random.Generator) -> Drawn:
    """150 -> -150 min^-1 at 2-20 min^-1/s under load, while Rs warms by up to 5 %."""
    rate, load_Nm = float(rng.uniform(2.0, 20.0)), _load_Nm(rng)
    begin_s = SETTLE_S + float(rng.uniform(0.0, 1.0))
    end_s = begin_s + 2.0 * CROSSING_RPM / rate
    warm = 1.0 + CROSSING_WARM_PU * float(rng.uniform(0.0, 1.0))
    what = Experiment(
        duration_s=end_s + 2.0,
        speed_rpm=[(0.0, CROSSING_RPM), (begin_s, CROSSING_RPM), (end_s, -CROSSING_RPM)],
        load_Nm=[(0.0, 0.0), (1.0, load_Nm)],
        rs_drift=[(0.0, 1.0), (begin_s, 1.0), (end_s, warm)],
    )
    return _drawn(rng, what, begin_s, {}, rpm_per_s=rate, load_Nm=load_Nm, warm=warm)


def draw_load_step(rng: np.random.Generator) -> Drawn:
    """Rated torque at once, at 9 to 1500 min^-1, J as told."""
    speed_rpm = float(np.exp(rng.uniform(np.log(9.0), np.log(1500.0))))
    at_s = 1.0 + float(rng.uniform(0.0, 0.5))
    what = Experiment(
        duration_s=at_s + LOAD_STEP_S,
        speed_rpm=[(0.0, speed_rpm)],
        load_Nm=[(0.0, 0.0), (at_s, 0.0), (at_s + 1e-3, RATED_TORQUE_NM)],
        decimate=5,
    )
    return _drawn(rng, what, at_s, {}, speed_rpm=speed_rpm, J_kg_m2=NOMINAL_J_KG_M2)


def draw_reversal(rng: np.random.Generator) -> Drawn:
    """From one direction to the other at once, 100 to 900 min^-1, J as told."""
    speed_rpm = float(rng.uniform(100.0, 900.0)) * float(rng.choice((-1.0, 1.0)))
    at_s = 1.0 + float(rng.uniform(0.0, 0.5))
    what = Experiment(
        duration_s=at_s + LOAD_STEP_S,
        speed_rpm=[(0.0, speed_rpm), (at_s, speed_rpm), (at_s + 1e-3, -speed_rpm)],
        decimate=5,
    )
    return _drawn(rng, what, at_s, {}, speed_rpm=speed_rpm, J_kg_m2=NOMINAL_J_KG_M2)


def draw_ripple(rng: np.random.Generator) -> Drawn:
    """A held point: J .4 to 100 times the motor's own, told half to double."""
    J_kg_m2 = MOTOR_J_KG_M2 * float(np.exp(rng.uniform(np.log(0.4), np.log(100.0))))
    told = J_kg_m2 * float(np.exp(rng.uniform(np.log(0.5), np.log(2.0))))
    speed_rpm = float(rng.uniform(30.0, RATED_SPEED_RPM))
    load_Nm = _load_Nm(rng)
    # The run-up of a large inertia takes its time: half of rated torque accelerates.
    up_s = 2.0 + 2.0 * J_kg_m2 * speed_rpm * math.pi / 30.0 / RATED_TORQUE_NM
    what = Experiment(
        duration_s=up_s + 2.0 + RIPPLE_S,
        speed_rpm=[(0.0, 0.0), (up_s, speed_rpm)],
        load_Nm=[(0.0, 0.0), (up_s, 0.0), (up_s + 1.0, load_Nm)],
        decimate=5,
    )
    numbers = {"J_kg_m2": J_kg_m2, "told_kg_m2": told, "speed_rpm": speed_rpm, "load_Nm": load_Nm}
    return _drawn(rng, what, up_s + 2.0, {"speed_J_kg_m2": told}, **numbers)


def _worst_error(record: sim.Record, drawn: Drawn) -> float:
    return float(np.abs(error_rpm(record))[window(record, drawn.from_s)].max())


def _overshoot_pu(record: sim.Record, drawn: Drawn) -> float:
    """Beyond the new reference, over the step."""
    after = window(record, drawn.from_s + 2e-3)
    sign = math.copysign(1.0, drawn.numbers["speed_rpm"])
    beyond_rpm = -sign * error_rpm(record)[after]
    return float(beyond_rpm.max()) / (2.0 * abs(drawn.numbers["speed_rpm"]))


def _ripple_pu(record: sim.Record, drawn: Drawn) -> float:
    return float(record["torque_Nm"][window(record, drawn.from_s)].std()) / RATED_TORQUE_NM


ENSEMBLES: Mapping[str, Ensemble] = {
    "crossings": Ensemble(
        "150 to -150 min^-1 at 2-20 min^-1/s, +-100 % load, Rs warming by up to 5 %",
        "min^-1",
        30.0,
        0.98,
        draw_crossing,
        _worst_error,
    ),
    "load_steps": Ensemble(
        "dip of a step to rated torque at 9-1500 min^-1", "min^-1", DIP_RPM_S2 * DIP_S, 1.0,
        draw_load_step, _worst_error,
    ),
    "reversals": Ensemble(
        "overshoot of a reversal from 100-900 min^-1, over the step", "", 0.03, 1.0,
        draw_reversal, _overshoot_pu,
    ),
    "ripple": Ensemble(
        "rms of the torque over rated, held; J .4-100 times the motor's, told half to double", "",
        0.03, 1.0, draw_ripple, _ripple_pu,
    ),
}  # fmt: skip


def one(setup: Setup, name: str, seed: int, k: int) -> tuple[Row, sim.Record]:
    """Run k of a seed, and its record."""
    ensemble = ENSEMBLES[name]
    drawn = ensemble.draw(np.random.default_rng((seed, k)))
    rig = {**setup.rig_overrides, **drawn.plant}
    record = run(dataclasses.replace(setup, rig_overrides=rig), drawn.what)
    lost = is_lost(record, drawn.what.duration_s)
    value = math.inf if lost else ensemble.measure(record, drawn)
    row = {"run": k, "value": value, "lost": lost, "fault": record.first_fault}
    return row | dict(drawn.numbers), record


def is_lost(record: sim.Record, duration_s: float) -> bool:
    """No torque at some time until then, or the shaft far from its reference at that time."""
    on = window(record, 0.0, duration_s)
    if not started(record) or not on.any() or record.t_s[-1] < duration_s - 0.1:
        return True
    last = window(record, duration_s - END_S, duration_s)
    off = bool((record["gates_on"][on] == 0).any())
    return off or float(np.abs(error_rpm(record)[last]).max()) > FAR_RPM


def chosen(names: Iterable[str]) -> list[str]:
    """The ensembles asked for; none asked for is all."""
    asked = list(names) or list(ENSEMBLES)
    for name in asked:
        if name not in ENSEMBLES:
            raise UserError(f"ensemble: '{name}' is unknown; known are {', '.join(ENSEMBLES)}")
    return [name for name in ENSEMBLES if name in asked]


def rows_of(
    setup: Setup,
    name: str,
    runs: int,
    seed: int,
    workers: int = 1,
    progress: Callable[[int], None] | None = None,
) -> list[Row]:
    """All runs of an ensemble, side by side in processes."""
    rows: list[Row] = []
    jobs = [(setup, name, seed, k) for k in range(runs)]
    # spawn: the library's threads and handles must not be inherited half open.
    with multiprocessing.get_context("spawn").Pool(workers) as pool:
        for row in pool.imap(_row, jobs, chunksize=4):
            rows.append(row)
            if progress:
                progress(len(rows))
    return rows


def _row(job: tuple[Setup, str, int, int]) -> Row:
    return one(*job)[0]


def summary(name: str, rows: list[Row]) -> dict[str, Any]:
    """Quantiles over all runs; a lost run is beyond every limit."""
    ensemble = ENSEMBLES[name]
    values = np.array([row["value"] for row in rows])
    lost = [row for row in rows if not math.isfinite(row["value"])]
    within = float((values <= ensemble.limit).mean())
    quantiles = {"median": 0.5, "p95": 0.95, "p99": 0.99, "worst": 1.0}
    found = {key: float(np.quantile(values, q, method="higher")) for key, q in quantiles.items()}
    return {
        "goal": ensemble.goal,
        "unit": ensemble.unit,
        "limit": ensemble.limit,
        "runs": len(rows),
        **{key: value if math.isfinite(value) else None for key, value in found.items()},
        "within": within,
        "within_must": ensemble.share,
        "lost": len(lost),
        "lost_undeclared": sum(not row["fault"] for row in lost),
        "met": within >= ensemble.share,
        "worst_runs": [row["run"] for row in sorted(rows, key=lambda row: -row["value"])[:10]],
    }
