"""The special test `hot_motor`: an hour at rated torque from cold, and how far the speed is off.

The plant heats by a law that is not the firmware's: three bodies (winding, rotor, iron with frame),
losses that grow with the resistances, iron loss by speed; conductances, capacities and the cage's
temperature coefficient are drawn. The firmware has two bodies, one time constant and one rise.

What the plant does (`Thermal`): it heats; or it was warm before the processor started and keeps
its last Rs and Rr, while the firmware begins as for a cold motor; or it stays as cool as it was,
whatever the firmware's model adds. The last two then cross zero under load: Rs in use is wrong.

`speed_up` divides every thermal time constant, of the plant and of the firmware, and the hour with
it; electrically nothing is faster. Run k of a seed is the same for every number of runs.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from zerohertz import sim
from zerohertz.atlas.bench_run import (
    NAMEPLATE_RS_OHM,
    POLE_PAIRS,
    RATED_SPEED_RPM,
    RATED_TORQUE_NM,
    RR_OHM,
    Experiment,
    error_rpm,
    run,
    window,
)
from zerohertz.atlas.ensembles import is_lost, plant_of
from zerohertz.atlas.thermal import Thermal
from zerohertz.atlas.zero_hertz import INVERTERS, drawn_sensors
from zerohertz.scenario.setup import Setup

Row = dict[str, Any]

HOUR_S, SPEED_UP = 3600.0, 60.0
SLIP_RPM = 1800.0 - RATED_SPEED_RPM
LIMIT_RPM = 0.05 * SLIP_RPM
LEAST_RPM = 300.0
SWITCHED_EVERY = 10  # one switched run to so many averaged ones
LOAD_AT_S, SETTLED_S, JUDGED_S = 1.0, 3.0, 2.0
LOADED_S = 2.0  # a pilot run gives the losses
POINTS = 120
COPPER_PER_K = 0.0039

CROSSING_RPM, CROSSING_RPM_PER_S = 150.0, 3.0  # from, to the same in the other direction
RAMP_RPM_PER_S, PAUSE_S = 300.0, 2.0  # down to the crossing, and there before it begins

# The bodies of a 1.5 kW motor with fan, class B at rated current: winding +80 K, rotor +100 K.
GROUND: Mapping[str, float] = {
    "winding_W_per_K": 5.6,
    "rotor_W_per_K": 1.4,
    "frame_W_per_K": 4.2,
    "winding_J_per_K": 800.0,
    "rotor_J_per_K": 1400.0,
    "frame_J_per_K": 5800.0,
    "cage_per_K": 0.0040,
    "iron_W": 30.0,
}
SPREAD: Mapping[str, float] = {
    "winding_W_per_K": 0.15,
    "rotor_W_per_K": 0.15,
    "frame_W_per_K": 0.15,
    "winding_J_per_K": 0.3,
    "rotor_J_per_K": 0.3,
    "frame_J_per_K": 0.3,
    "cage_per_K": 0.08,
    "iron_W": 0.5,
}
RR_TOLD_PU = 0.03  # of the cold motor: what commissioning leaves


@dataclasses.dataclass(frozen=True)
class Drawn:
    what: Experiment
    rig: Mapping[str, Any]
    bodies: Mapping[str, float]
    speed_rpm: float
    speed_up: float
    k: int
    switched: bool


def draw(setup: Setup, seed: int, k: int, switched: bool, speed_up: float) -> Drawn:
    """Run k: its plant, before anybody knows how warm it gets."""
    rng = np.random.default_rng((seed, k, switched))
    speed_rpm = float(rng.uniform(LEAST_RPM, RATED_SPEED_RPM)) * float(rng.choice((-1.0, 1.0)))
    plant = plant_of(rng) | {"motor.Rr_ohm": RR_OHM * float(rng.uniform(*about(RR_TOLD_PU)))}
    law = INVERTERS[int(rng.integers(len(INVERTERS)))]
    bodies = {
        name: value * float(rng.uniform(*about(SPREAD[name]))) for name, value in GROUND.items()
    }
    duty = bool(rng.random() < 0.5)
    rig = plant | dict(law) | drawn_sensors(rng)
    rig |= {"inverter.model": "switched" if switched else "averaged"}
    known = setup.parameters()
    told = {"heat_s": float(known["heat_s"]) / speed_up} if known.get("heat_s") else {}
    sign = math.copysign(1.0, speed_rpm)
    what = Experiment(
        duration_s=LOAD_AT_S + HOUR_S / speed_up,
        speed_rpm=[(0.0, speed_rpm)],
        load_Nm=[(0.0, 0.0), (LOAD_AT_S, sign * RATED_TORQUE_NM)],
        rs_ratio=float(rng.uniform(0.8, 1.25)),
        decimate=50,
        seed=int(rng.integers(1, 2**31)),
        firmware=told | ({"voltage_source": 1} if duty else {}),
    )
    return Drawn(what, rig, bodies, speed_rpm, speed_up, k, switched)


def about(width: float) -> tuple[float, float]:
    return 1.0 - width, 1.0 + width


def warm(drawn: Drawn, record: sim.Record) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Factors of Rs and Rr over the hour, by what the pilot's currents lose."""
    on = window(record, LOAD_AT_S + SETTLED_S - LOADED_S)
    i2_A2 = float((record["i_abs_A"][on].astype(np.float64) ** 2).mean())
    slip = record["torque_Nm"][on].astype(np.float64) / (POLE_PAIRS * record["lambda_Wb"][on])
    Rs_W = drawn.what.rs_ratio * NAMEPLATE_RS_OHM * i2_A2
    Rr_W = float(drawn.rig["motor.Rr_ohm"]) * float((slip**2).mean())
    b = drawn.bodies
    iron_W = b["iron_W"] * (abs(drawn.speed_rpm) / RATED_SPEED_RPM) ** 1.5
    winding = rotor = frame = 0.0
    step_s = 1.0
    factors = [(1.0, 1.0)]
    for n in range(1, int(HOUR_S) + 1):
        stator_pu, rotor_pu = 1.0 + COPPER_PER_K * winding, 1.0 + b["cage_per_K"] * rotor
        to_frame_W = b["winding_W_per_K"] * (winding - frame)
        from_rotor_W = b["rotor_W_per_K"] * (rotor - frame)
        winding += step_s * (Rs_W * stator_pu - to_frame_W) / b["winding_J_per_K"]
        rotor += step_s * (Rr_W * rotor_pu - from_rotor_W) / b["rotor_J_per_K"]
        lost_W = to_frame_W + from_rotor_W + iron_W - b["frame_W_per_K"] * frame
        frame += step_s * lost_W / b["frame_J_per_K"]
        if n % (int(HOUR_S) // POINTS) == 0:
            factors.append((1.0 + COPPER_PER_K * winding, 1.0 + b["cage_per_K"] * rotor))
    Rs, Rr = np.array(factors).T
    return Rs, Rr


def one(
    setup: Setup,
    seed: int,
    k: int,
    switched: bool = False,
    speed_up: float = SPEED_UP,
    thermal: Thermal = Thermal.HEATS,
) -> tuple[Row, sim.Record]:
    """Run k of a seed, and its record."""
    drawn = draw(setup, seed, k, switched, speed_up)
    setup = dataclasses.replace(setup, rig_overrides={**setup.rig_overrides, **drawn.rig})
    pilot = run(setup, dataclasses.replace(drawn.what, duration_s=LOAD_AT_S + SETTLED_S))
    Rs, Rr = warm(drawn, pilot)
    what, rig = drawn.what, dict(drawn.rig)
    hour_end_s = what.duration_s
    if thermal is Thermal.HEATS:
        t_s = LOAD_AT_S + np.linspace(0.0, HOUR_S / speed_up, POINTS + 1)
        what = dataclasses.replace(what, rs_drift=profile(t_s, Rs), rr_drift=profile(t_s, Rr))
    else:
        what = then_crossing(what, drawn.speed_rpm)
    if thermal is Thermal.WARM:
        what = dataclasses.replace(what, rs_ratio=what.rs_ratio * float(Rs[-1]))
        rig["motor.Rr_ohm"] *= float(Rr[-1])
        setup = dataclasses.replace(setup, rig_overrides={**setup.rig_overrides, **rig})
    record = run(setup, what)
    return judged(drawn, record, (Rs, Rr), hour_end_s), record


def then_crossing(what: Experiment, speed_rpm: float) -> Experiment:
    """The same, and after the hour a slow ramp through zero with the load of the hour."""
    begin = math.copysign(CROSSING_RPM, speed_rpm)
    down_s = what.duration_s + abs(speed_rpm - begin) / RAMP_RPM_PER_S
    end_s = down_s + PAUSE_S + 2.0 * CROSSING_RPM / CROSSING_RPM_PER_S
    corners = [(what.duration_s, speed_rpm), (down_s, begin), (down_s + PAUSE_S, begin)]
    return dataclasses.replace(
        what, duration_s=end_s + PAUSE_S, speed_rpm=[*what.speed_rpm, *corners, (end_s, -begin)]
    )


def judged(
    drawn: Drawn,
    record: sim.Record,
    factors: tuple[NDArray[np.float64], NDArray[np.float64]],
    hour_end_s: float,
) -> Row:
    """The row of a run: errors in the hour, at its end, and in the crossing if there was one."""
    Rs, Rr = factors
    end = window(record, hour_end_s - JUDGED_S, hour_end_s)
    on = window(record, LOAD_AT_S + SETTLED_S, hour_end_s)
    after = window(record, hour_end_s)
    error = error_rpm(record)
    rows = max(1, round(1.0 / float(np.median(np.diff(record.t_s)))))
    means = [float(error[on][j : j + rows].mean()) for j in range(0, int(on.sum()), rows)]
    lost = is_lost(record, hour_end_s)
    crossed = bool((record.t_s > hour_end_s + PAUSE_S).any())
    lost_there = crossed and is_lost(record, float(record.t_s[-1]))
    worst_there = float(abs(error[after]).max()) if crossed else 0.0
    return {
        "run": drawn.k,
        "switched": drawn.switched,
        "speed_rpm": drawn.speed_rpm,
        "Rs_pu": float(Rs[-1]),
        "Rr_pu": float(Rr[-1] * drawn.rig["motor.Rr_ohm"] / RR_OHM),
        "Rs_hat_pu": float(record["Rs_hat_ohm"][end].mean() / record["Rs_true_ohm"][end].mean()),
        "lost": lost,
        "fault": record.first_fault,
        "error_rpm": float(error[end].mean()) * math.copysign(1.0, drawn.speed_rpm),
        "value": math.inf if lost else abs(float(error[end].mean())),
        "worst_of_hour_rpm": math.inf if lost else max(map(abs, means), default=math.inf),
        "crossing_worst_rpm": math.inf if lost_there else worst_there,
        "crossed": crossed,
    }


def profile(t_s: NDArray[np.float64], factor: NDArray[np.float64]) -> list[tuple[float, float]]:
    return [(0.0, 1.0), *((float(t), float(x)) for t, x in zip(t_s, factor, strict=True))]


def summary(rows: list[Row]) -> dict[str, Any]:
    """Quantiles over runs; a lost one is beyond every limit."""
    found: dict[str, Any] = {"runs": len(rows), "limit_rpm": LIMIT_RPM}
    found |= quantiles("error", "_rpm", [row["value"] for row in rows])
    found |= quantiles("worst_of_hour", "_rpm", [row["worst_of_hour_rpm"] for row in rows])
    found["within"] = sum(row["value"] <= LIMIT_RPM for row in rows)
    found["lost"] = [row["run"] for row in rows if row["lost"]]
    found["Rr_worst_pu"] = max(row["Rr_pu"] for row in rows)
    found |= quantiles("Rs_hat", "_pu", [row["Rs_hat_pu"] for row in rows])
    if rows[0]["crossed"]:
        there = [row["crossing_worst_rpm"] for row in rows]
        found |= quantiles("crossing", "_rpm", there)
        found["crossing_lost"] = [
            row["run"] for row in rows if math.isinf(row["crossing_worst_rpm"])
        ]
    return found


def quantiles(name: str, unit: str, values: list[float]) -> dict[str, float | None]:
    """Median, 95 %, 99 % and worst; None where a run was lost."""
    found: dict[str, float | None] = {}
    for word, q in {"median": 0.5, "p95": 0.95, "p99": 0.99, "worst": 1.0}.items():
        at = float(np.quantile(np.array(values), q, method="higher"))
        found[f"{name}_{word}{unit}"] = at if math.isfinite(at) else None
    return found
