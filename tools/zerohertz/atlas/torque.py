"""The special test `torque`: torque mode, true air-gap torque against what was asked for.

A dynamometer keeps the speed: a brake in proportion to the speed, less what it takes at the speed
that is wanted and the torque that is asked for. A run looks at 600 min^-1 first, where M is found,
then holds three torques at one speed, each driving or braking. Every run draws plant, sensors and
inverter; run k of a seed is the same for every number of runs.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from zerohertz import sim
from zerohertz.atlas.bench_run import (
    RATED_TORQUE_NM,
    RR_OHM,
    Experiment,
    impressed,
    run,
    started,
    window,
)
from zerohertz.atlas.ensembles import plant_of
from zerohertz.atlas.zero_hertz import INVERTERS, SWITCHED_SHARE, drawn_sensors
from zerohertz.motor import load_motor
from zerohertz.paths import ROOT
from zerohertz.scenario.setup import Setup

Row = dict[str, Any]

BRAKE_NMS = 1.3  # 10 % of rated torque is 6 min^-1
RAD_S_PER_RPM = math.pi / 30.0
RATED_FLUX_WB = 0.52
M_SPREAD, RR_SPREAD = 0.15, 0.3
# Main flux at which M has halved; 0: none. The exponents and the soft law as in the envelope.
SATURATIONS: tuple[Mapping[str, Any], ...] = (
    {},
    {"motor.saturation.flux_knee_Wb": 1.54 * RATED_FLUX_WB, "motor.saturation.exponent": 4},
    {"motor.saturation.flux_knee_Wb": 1.25 * RATED_FLUX_WB, "motor.saturation.exponent": 8},
    {"motor.saturation.flux_knee_Wb": 1.7 * RATED_FLUX_WB, "motor.saturation.law": "soft"},
)
HOLDS_PU = (1.0, 0.5, 0.75)  # of rated torque, in turn; the sign is drawn for each
HOLD_S, SETTLE_S, UP_S = 3.0, 2.0, 3.0
RPM_PER_S = 450.0
LOOK_RPM, LOOK_S = 600.0, 10.0


@dataclasses.dataclass(frozen=True)
class Band:
    """Speeds of either direction, and how far the torque may be off, of rated torque."""

    low_rpm: float
    high_rpm: float
    limit_pu: float


BANDS: Mapping[str, Band] = {"fast": Band(300.0, 1500.0, 0.02), "slow": Band(30.0, 60.0, 0.05)}


@dataclasses.dataclass(frozen=True)
class Drawn:
    what: Experiment
    rig: Mapping[str, Any]
    speed_rpm: float
    torques_Nm: tuple[float, ...]
    from_s: float
    numbers: Mapping[str, float]


def plant(rng: np.random.Generator) -> dict[str, Any]:
    """M at rated flux within 15 % of what is told, Rr 30 %, one of the saturation laws."""
    circuit = load_motor(ROOT / "gain_tables" / "hasegawa2005").circuit
    values = plant_of(rng)
    law = SATURATIONS[int(rng.integers(len(SATURATIONS)))]
    ratio = float(rng.uniform(1.0 - M_SPREAD, 1.0 + M_SPREAD))
    M_H = ratio * circuit.M_H * unsaturated(law, ratio)
    leakage = float(rng.uniform(0.85, 1.15))
    return (
        values
        | dict(law)
        | {
            "motor.Rr_ohm": RR_OHM * float(rng.uniform(1.0 - RR_SPREAD, 1.0 + RR_SPREAD)),
            "motor.M_H": M_H,
            "motor.Ls_H": M_H + leakage * (circuit.Ls_H - circuit.M_H),
            "motor.Lr_H": M_H + leakage * (circuit.Lr_H - circuit.M_H),
        }
    )


def unsaturated(law: Mapping[str, Any], ratio: float) -> float:
    """Main inductance without saturation over the one at the flux of the rated current."""
    knee_Wb = law.get("motor.saturation.flux_knee_Wb")
    if not knee_Wb:
        return 1.0
    q = ratio * RATED_FLUX_WB / knee_Wb
    if "motor.saturation.law" in law:
        return 1.0 + 2.0 * q**4 / (1.0 + q**2)
    return 1.0 + q ** int(law["motor.saturation.exponent"])


def _way_to(speed_rpm: float) -> list[tuple[float, float]]:
    """From standstill, by a speed at which the drive finds M."""
    sign = math.copysign(1.0, speed_rpm)
    fast_rpm = max(LOOK_RPM, abs(speed_rpm))
    up_s = 0.5 + fast_rpm / RPM_PER_S
    down_s = up_s + LOOK_S
    end_s = down_s + (fast_rpm - abs(speed_rpm)) / RPM_PER_S + 1e-3
    points = [(0.0, 0.0), (0.5, 0.0), (up_s, sign * fast_rpm), (down_s, sign * fast_rpm)]
    return [*points, (end_s, speed_rpm)]


def draw(seed: int, k: int, band: Band) -> Drawn:
    rng = np.random.default_rng((seed, k))
    speed_rpm = float(rng.uniform(band.low_rpm, band.high_rpm)) * float(rng.choice((-1.0, 1.0)))
    true = plant(rng)
    law = INVERTERS[int(rng.integers(len(INVERTERS)))]
    switched, duty = rng.random() < SWITCHED_SHARE, rng.random() < 0.5
    torques = tuple(float(rng.choice((-1.0, 1.0))) * share * RATED_TORQUE_NM for share in HOLDS_PU)
    rig = true | dict(law) | drawn_sensors(rng)
    rig |= {
        "mechanics.viscous_Nms": BRAKE_NMS,
        "mechanics.coulomb_Nm": 0.0,
        "inverter.model": "switched" if switched else "averaged",
    }
    speeds = _way_to(speed_rpm)
    from_s = speeds[-1][0] + UP_S
    taken_Nm = BRAKE_NMS * speed_rpm * RAD_S_PER_RPM
    load = [(t_s, -BRAKE_NMS * rpm * RAD_S_PER_RPM) for t_s, rpm in speeds]
    load += [(from_s, -taken_Nm)]
    asked: list[tuple[float, float]] = []
    for n, torque_Nm in enumerate(torques):
        at_s = from_s + n * HOLD_S
        asked += [(at_s + 1e-3, torque_Nm), (at_s + HOLD_S, torque_Nm)]
        load += [(t_s, value - taken_Nm) for t_s, value in asked[-2:]]
    what = Experiment(
        duration_s=from_s + len(torques) * HOLD_S,
        speed_rpm=speeds,
        load_Nm=load,
        torque_Nm=[(from_s, torques[0]), *asked],
        rs_ratio=float(rng.uniform(0.8, 1.25)),
        seed=int(rng.integers(1, 2**31)),
        firmware={"voltage_source": 1} if duty else {},
    )
    numbers = {"duty": float(duty), "switched": float(switched)}
    numbers |= {key.split(".")[1]: float(true[key]) for key in ("motor.Rr_ohm", "motor.M_H")}
    return Drawn(what, rig, speed_rpm, torques, from_s, numbers)


def one(setup: Setup, seed: int, k: int, band: Band) -> tuple[list[Row], sim.Record]:
    """A row for each torque of run k, and its record."""
    drawn = draw(seed, k, band)
    rig = {**setup.rig_overrides, **drawn.rig}
    record = run(dataclasses.replace(setup, rig_overrides=rig), drawn.what)
    gone = record.t_s[window(record, 0.0) & ((record["gates_on"] == 0) | impressed(record))]
    lost_s = float(gone[0]) if len(gone) else float(record.t_s[-1]) + 0.1
    rows = []
    for n, torque_Nm in enumerate(drawn.torques_Nm):
        begin_s = drawn.from_s + n * HOLD_S
        part = window(record, begin_s + SETTLE_S, begin_s + HOLD_S)
        off_Nm = float(record["torque_Nm"][part].mean(dtype=np.float64)) - torque_Nm
        lost = not started(record) or lost_s < begin_s + HOLD_S
        flux = record["lambda_hat_Wb"][part] / record["lambda_Wb"][part] - 1.0
        row: Row = {
            "run": k,
            "speed_rpm": drawn.speed_rpm,
            "torque_Nm": torque_Nm,
            "driving": torque_Nm * drawn.speed_rpm > 0.0,
            "lost": lost,
            "fault": record.first_fault,
            "error_pu": off_Nm / RATED_TORQUE_NM,
            "flux_error_pu": float(flux.mean()),
            "value": math.inf if lost else abs(off_Nm) / RATED_TORQUE_NM,
        }
        rows.append(row | dict(drawn.numbers))
    return rows, record


def summary(band: Band, rows: list[Row]) -> dict[str, Any]:
    """Quantiles over all torques; one of a run that was lost is beyond every limit."""
    values = np.array([row["value"] for row in rows])
    found: dict[str, Any] = {"torques": len(rows), "limit_pu": band.limit_pu}
    for word, q in {"median": 0.5, "p95": 0.95, "p99": 0.99, "worst": 1.0}.items():
        at = float(np.quantile(values, q, method="higher"))
        found[f"{word}_pu"] = at if math.isfinite(at) else None
    for word, driving in {"driving": True, "braking": False}.items():
        some = [row["value"] for row in rows if row["driving"] == driving]
        at = float(np.quantile(some, 0.95, method="higher")) if some else math.inf
        found[f"{word}_p95_pu"] = at if math.isfinite(at) else None
        found[f"{word}_within"] = sum(value <= band.limit_pu for value in some)
        found[f"{word}_torques"] = len(some)
    found["within"] = int((values <= band.limit_pu).sum())
    found["lost"] = sorted({row["run"] for row in rows if row["lost"]})
    return found
