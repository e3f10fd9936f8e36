"""The special test `zero_hertz`: dwelling at exactly zero stator frequency, kept there by the load.

A servo in the plant adds load torque until the rotor flux stands still on average, whatever the
drive does: a drive cannot hold by creeping away from zero. Flux steering, which would, is off: the
flux is fixed by the user. Every run draws plant, sensors, inverter, Rs and how the load arrives;
run k of a seed is the same for every number of runs.
"""

from __future__ import annotations

import dataclasses
import math
import multiprocessing
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from zerohertz import sim
from zerohertz.atlas.bench_run import I_D_A, Experiment, error_rpm, impressed, run, started, window
from zerohertz.atlas.classes import FAR_RPM
from zerohertz.atlas.ensembles import plant_of
from zerohertz.atlas.special import dwell_load_Nm
from zerohertz.motor import load_motor
from zerohertz.paths import ROOT
from zerohertz.scenario.setup import Setup, Value

Row = dict[str, Any]

DWELL_S = 600.0
DRIFT_S = 300.0  # Rs to .8 or 1.2 of what it was
DRIFT_FROM_S = 20.0
LOAD_AT_S = 5.0
SETTLED_S = 30.0  # judged from so long after the load has arrived
SERVO_NM_PER_TURN = 0.3
MEAN_S = 10.0
RATED_RPM, RATED_I_D_A = 60.0, 4.0  # i_d at which 60 min^-1 at rated torque is zero frequency
DEAD_TIME_S = 2e-6
# Threshold of the dead time's law, drop of the devices, capacitance of a leg.
INVERTERS: tuple[Mapping[str, Value], ...] = (
    {},
    {"inverter.i_threshold_A": 0.05, "inverter.dead_time_s": DEAD_TIME_S},
    {"inverter.i_threshold_A": 0.6, "inverter.dead_time_s": DEAD_TIME_S},
    {"inverter.drop_V": 0.7, "inverter.dead_time_s": DEAD_TIME_S},
    {"inverter.leg_F": 2e-9, "inverter.dead_time_s": DEAD_TIME_S},
)
SWITCHED_SHARE = 0.25


@dataclasses.dataclass(frozen=True)
class Dwell:
    """What is asked of every run."""

    speeds_rpm: tuple[float, ...] = (0.0, 15.0, 30.0)  # in turn, either sign
    limit_rpm: float = 15.0
    limit_deg: float = 15.0
    limit_Nm: float = 0.3  # of the torque's modulation, rms
    seconds: float = DWELL_S
    arrival_pu: float = 0.2  # Rs is off by up to this share of what the drive believes
    load_step_pu: float = 0.0  # of the load, on and off in the dwell
    firmware: Mapping[str, Value] = dataclasses.field(default_factory=dict)


RATED = Dwell(speeds_rpm=(RATED_RPM,), limit_rpm=30.0, limit_Nm=math.inf)
LIMIT_HZ = 0.05


@dataclasses.dataclass(frozen=True)
class Drawn:
    what: Experiment
    rig: Mapping[str, Any]
    numbers: Mapping[str, float]
    arrived_s: float


def drawn_sensors(rng: np.random.Generator) -> dict[str, list[float]]:
    def about(centre: float, width: float, count: int) -> list[float]:
        return [float(x) for x in rng.uniform(centre - width, centre + width, count)]

    return {
        "sensors.current_offset_A": about(0.0, 0.03, 3),
        "sensors.current_gain": about(1.0, 0.005, 3),
        "sensors.voltage_gain": about(1.0, 0.005, 2),
    }


def draw(ask: Dwell, seed: int, k: int) -> Drawn:
    """Run k: its plant, and how load and Rs go."""
    rng = np.random.default_rng((seed, k))
    speed_rpm = ask.speeds_rpm[k % len(ask.speeds_rpm)] * float(rng.choice((-1.0, 1.0)))
    duty, switched = rng.random() < 0.5, rng.random() < SWITCHED_SHARE
    plant = plant_of(rng)
    law = int(rng.integers(len(INVERTERS)))
    rig = plant | dict(INVERTERS[law]) | drawn_sensors(rng)
    rig |= {"mechanics.coulomb_Nm": float(rng.uniform(0.0, 0.3))}
    rig |= {"inverter.model": "switched" if switched else "averaged"}
    arrival = 1.0 + ask.arrival_pu * float(rng.uniform(-1.0, 1.0))
    drift = arrival * float(rng.choice((0.8, 1.2)))
    arrived_s = LOAD_AT_S + float(rng.uniform(2.0, 8.0))
    i_d_A = RATED_I_D_A if abs(speed_rpm) >= RATED_RPM else None
    # Steering would lower the flux, overload protection end a test that is about the estimate.
    told = {"steer_min_Hz": 0.0, "overload_motor_A": 0.0, **ask.firmware}
    told |= {} if i_d_A is None else {"i_d_A": i_d_A}
    what = Experiment(
        duration_s=arrived_s + ask.seconds,
        speed_rpm=[(0.0, speed_rpm)],
        load_Nm=_load(ask, speed_rpm, i_d_A, arrived_s),
        rs_ratio=float(rng.uniform(0.8, 1.25)),
        rs_drift=[
            (0.0, 1.0),
            (LOAD_AT_S - 3.0, 1.0),
            (LOAD_AT_S - 2.0, arrival),
            (arrived_s + DRIFT_FROM_S, arrival),
            (arrived_s + DRIFT_FROM_S + DRIFT_S, drift),
        ],
        servo_Nm_per_turn=SERVO_NM_PER_TURN,
        servo_from_s=arrived_s,
        decimate=50,
        seed=int(rng.integers(1, 2**31)),
        firmware=told | ({"voltage_source": 1} if duty else {}),
    )
    numbers = {"speed_rpm": speed_rpm, "arrival": arrival, "drift": drift / arrival}
    numbers |= {"duty": float(duty), "switched": float(switched), "inverter": float(law)}
    return Drawn(what, rig, numbers | _plant_numbers(plant), arrived_s)


def _plant_numbers(plant: Mapping[str, Value]) -> dict[str, float]:
    return {key.split(".")[1]: float(plant[key]) for key in ("motor.Rr_ohm", "motor.M_H")} | {
        "J_kg_m2": float(plant["mechanics.J_kg_m2"])
    }


def _load(
    ask: Dwell, speed_rpm: float, i_d_A: float | None, arrived_s: float
) -> list[tuple[float, float]]:
    """Zero stator frequency for the nameplate's motor; the servo does the rest."""
    M_H = load_motor(ROOT / "gain_tables" / "hasegawa2005").circuit.M_H
    flux_Wb = M_H * (I_D_A if i_d_A is None else i_d_A)
    load_Nm = math.copysign(dwell_load_Nm(flux_Wb, abs(speed_rpm)), -speed_rpm)
    load_Nm = 0.0 if speed_rpm == 0.0 else load_Nm
    points = [(0.0, 0.0), (LOAD_AT_S, 0.0), (arrived_s, load_Nm)]
    step_Nm = ask.load_step_pu * load_Nm
    for n in range(1, int(ask.seconds // 60.0)):
        on_s = arrived_s + 60.0 * n
        before, after = (0.0, step_Nm) if n % 2 else (step_Nm, 0.0)
        if step_Nm:
            points += [(on_s, load_Nm + before), (on_s + 1e-3, load_Nm + after)]
    return points


def one(setup: Setup, ask: Dwell, seed: int, k: int) -> tuple[Row, sim.Record]:
    """Run k of a seed, judged, and its record."""
    drawn = draw(ask, seed, k)
    rig = {**setup.rig_overrides, **drawn.rig}
    record = run(dataclasses.replace(setup, rig_overrides=rig), drawn.what)
    row: Row = {"run": k, **drawn.numbers, **judge(record, drawn.arrived_s, drawn.what.duration_s)}
    i_trip_A = float(setup.parameters()["i_trip_A"])
    row["within"] = (
        row["held"]
        and row["error_rpm"] <= ask.limit_rpm
        and row["angle_deg"] <= ask.limit_deg
        and row["mean_frequency_Hz"] <= LIMIT_HZ
        and row["torque_rms_Nm"] <= ask.limit_Nm
        and row["i_peak_A"] <= i_trip_A
    )
    return row, record


def judge(record: sim.Record, arrived_s: float, end_s: float) -> Row:
    """Held: torque to the end, no take-over, the shaft never far from its reference."""
    on, late = window(record, 0.0), window(record, arrived_s + SETTLED_S)
    error = np.abs(error_rpm(record))
    gone = (error > FAR_RPM) | (record["gates_on"] == 0) | impressed(record)
    lost = np.flatnonzero(gone & on)
    whole = started(record) and bool(late.any()) and record.t_s[-1] > end_s - 0.1
    row: Row = {
        "held": whole and not len(lost),
        "lost_s": float(record.t_s[lost[0]] - arrived_s) if len(lost) else None,
        "fault": record.first_fault,
    }
    return row | (_measured(record, late, on) if row["held"] else dict.fromkeys(MEASURED, math.nan))


MEASURED = (
    "error_rpm", "angle_deg", "mean_frequency_Hz", "torque_rms_Nm", "i_peak_A", "i_rms_A",
    "arrival_error_rpm", "Rs_error_pu", "closed_pu", "bound_kept_pu",
)  # fmt: skip


def _measured(
    record: sim.Record, late: NDArray[np.bool_], on: NDArray[np.bool_]
) -> dict[str, float]:
    error = np.abs(error_rpm(record))
    rows = max(1, round(MEAN_S / float(np.median(np.diff(record.t_s)))))
    f_Hz = np.concatenate(([0.0], np.cumsum(record["f_s_Hz"][late].astype(np.float64))))
    closed = record["confidence"][late] == 0
    off = np.abs(record["speed_hat_rpm"] - record["speed_rpm"])[late]
    kept = off[closed] <= record["omega_bound_rpm"][late][closed]
    Rs_pu = record["Rs_hat_ohm"][late] / record["Rs_true_ohm"][late] - 1.0
    values = (
        error[late].max(), np.abs(record["flux_angle_err_deg"][late]).max(),
        np.abs((f_Hz[rows:] - f_Hz[:-rows]) / rows).max(initial=0.0),
        _pulsation(record["torque_Nm"][late], rows), record["i_peak_A"][on].max(),
        math.sqrt(float((record["i_abs_A"][late].astype(np.float64) ** 2).mean())),
        error[on].max(), np.abs(Rs_pu).max(), closed.mean(),
        kept.mean() if len(kept) else math.nan,
    )  # fmt: skip
    return {name: float(value) for name, value in zip(MEASURED, values, strict=True)}


def _pulsation(torque_Nm: NDArray[np.float32], rows: int) -> float:
    """RMS of the torque about its mean of 10 s, the largest: what the modulation costs."""
    blocks = [torque_Nm[k : k + rows].std() for k in range(0, len(torque_Nm) - rows + 1, rows)]
    return float(max(blocks, default=math.nan))


def rows_of(
    setup: Setup,
    ask: Dwell,
    runs: int,
    seed: int,
    workers: int = 1,
    progress: Callable[[int], None] | None = None,
) -> list[Row]:
    """All runs, side by side in processes."""
    rows: list[Row] = []
    # spawn: the library's threads and handles must not be inherited half open.
    with multiprocessing.get_context("spawn").Pool(workers) as pool:
        for row in pool.imap(_row, [(setup, ask, seed, k) for k in range(runs)], chunksize=1):
            rows.append(row)
            if progress:
                progress(len(rows))
    return rows


def _row(job: tuple[Setup, Dwell, int, int]) -> Row:
    return one(*job)[0]


def summary(ask: Dwell, rows: list[Row]) -> dict[str, Any]:
    """The worst of all runs that were held; a run that was not is counted, and told or not."""
    held = [row for row in rows if row["held"]]
    lost = [row for row in rows if not row["held"]]

    def worst(name: str) -> float | None:
        return max((row[name] for row in held), default=None)

    closed = [row["bound_kept_pu"] for row in held if not math.isnan(row["bound_kept_pu"])]
    return {
        "speeds_rpm": list(ask.speeds_rpm),
        "seconds": ask.seconds,
        "arrival_pu": ask.arrival_pu,
        "runs": len(rows),
        "held": len(held),
        "within": sum(bool(row["within"]) for row in rows),
        "error_worst_rpm": worst("error_rpm"),
        "angle_worst_deg": worst("angle_deg"),
        "mean_frequency_worst_Hz": worst("mean_frequency_Hz"),
        "torque_rms_worst_Nm": worst("torque_rms_Nm"),
        "i_peak_worst_A": worst("i_peak_A"),
        "i_rms_worst_A": worst("i_rms_A"),
        "arrival_error_worst_rpm": worst("arrival_error_rpm"),
        "closed_mean_pu": float(np.mean([r["closed_pu"] for r in held])) if held else None,
        "bound_kept_least_pu": min(closed, default=None),
        "lost_undeclared": sum(not row["fault"] for row in lost),
        "lost_runs": [row["run"] for row in lost],
    }
