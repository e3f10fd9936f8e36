"""From a point to a judged row: the real firmware on the atlas' bench.

The firmware is told its configuration and, over that, what the nameplate and the board's data sheet
say; the rig gets what the point says is true.
"""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from zerohertz import sim
from zerohertz.atlas.classes import RAMP_S, Confidence, Judgement, Trace, judge
from zerohertz.atlas.points import NOMINAL_J_KG_M2, Point
from zerohertz.build import ensure_built
from zerohertz.drive import State
from zerohertz.errors import UserError
from zerohertz.estimators.chosen import python_digest
from zerohertz.motor import load_motor
from zerohertz.paths import ROOT
from zerohertz.scenario.setup import Setup, Value

RIG = sim.HOST_SIM / "rigs" / "atlas.toml"
RIG_NAME = f"rig {RIG.stem}"
DECIMATE = 5  # 1 ms of 200 us: ten rows in the shortest time that is judged
RATED_TORQUE_NM = 8.4
RATED_FLUX_WB = 0.5
SATURATION_EXPONENT = 4

RUN_ON_S = 0.01
RPM_PER_S = 450.0
SETTLE_S = 0.5
LONGEST_START_S = 10.0
RUNAWAY_RPM = 3000.0
_BOARD_SECTIONS = ("adc", "full_scale", "filter", "control")


@dataclasses.dataclass(frozen=True)
class Bench:
    """Everything of a run but the point. Paths relative to the checkout: workers have their own."""

    config: str
    motor_dir: str
    board: str
    params: Mapping[str, Value]  # of the configuration
    firmware: Mapping[str, Value]  # set by the user, last word
    plant: Mapping[str, Any]  # rig or board overrides, last word
    run_s: float = 0.0  # when state RUN is reached, measured
    i_trip_A: float = 0.0
    library_sha256: str = ""


def make_bench(
    setup: Setup,
    firmware: Mapping[str, Value] | None = None,
    plant: Mapping[str, Any] | None = None,
) -> Bench:
    """The bench of a configuration; how long its start takes is measured, not computed."""
    nameplate = load_motor(setup.motor_dir)
    told = {
        **{name: getattr(nameplate.circuit, name) for name in ("Rs_ohm", "Rr_ohm")},
        **{name: getattr(nameplate.circuit, name) for name in ("Ls_H", "Lr_H", "M_H")},
        "speed_J_kg_m2": NOMINAL_J_KG_M2,
        "device_drop_V": 0.0,
        "dead_time_i_threshold_A": 0.25,
    }
    bench = Bench(
        config=setup.name,
        motor_dir=_relative(setup.motor_dir),
        board=_relative(setup.board),
        params=dict(setup.params) | told,
        firmware=dict(firmware or {}),
        plant=dict(plant or {}),
        library_sha256=library_sha256(),
    )
    known = setup.parameters() | dict(bench.firmware)
    return dataclasses.replace(bench, run_s=_run_s(bench), i_trip_A=float(known["i_trip_A"]))


def begin_s(bench: Bench, point: Point) -> float:
    """t = 0 of a point in the run's own time."""
    return bench.run_s + max(0.2, abs(point.speed_rpm) / RPM_PER_S) + SETTLE_S


def job_of(bench: Bench, point: Point) -> sim.Job:
    """The run of a point."""
    plant, board = dict(_rig(point)), {}
    for key, value in bench.plant.items():
        (board if key.split(".")[0] in _BOARD_SECTIONS else plant)[key] = value
    return sim.Job(
        scenario=_scenario(bench, point),
        rig=RIG,
        board=ROOT / bench.board,
        motor_dir=ROOT / bench.motor_dir,
        firmware_config=bench.params,
        firmware={"dead_time_s": point.told_dead_time_s} | dict(bench.firmware),
        rig_overrides=plant,
        board_overrides=board,
        seed=point.seed,
        decimate=DECIMATE,
    )


def trace_of(bench: Bench, point: Point, record: sim.Record) -> Trace:
    """What the classes need of a record. A firmware without a supervisor always claims CLOSED."""
    said = record.columns.get("confidence")
    return Trace(
        t_s=record.t_s - np.float32(begin_s(bench, point)),
        step_s=DECIMATE * record.period_s,
        error_rpm=record["speed_rpm"] - record["speed_ref_rpm"],
        angle_err_deg=record["flux_angle_err_deg"],
        lambda_Wb=record["lambda_Wb"],
        lambda_hat_Wb=record["lambda_hat_Wb"],
        f_s_Hz=record["f_s_Hz"],
        i_abs_A=record["i_abs_A"],
        state=record["state"],
        gates_on=record["gates_on"],
        confidence=np.full(len(record.t_s), Confidence.CLOSED) if said is None else said,
    )


def judge_record(bench: Bench, point: Point, record: sim.Record) -> Judgement:
    """The class of a point from its record."""
    driven = record["gates_on"] > 0
    diverged = sim.Trip.DIVERGED in record.trip and bool(driven[-1])
    runaway = bool(np.any(np.abs(record["speed_rpm"][driven]) > RUNAWAY_RPM))
    trace = trace_of(bench, point, record)
    return judge(trace, point.loaded_s, point.judged_s, bench.i_trip_A, diverged or runaway)


def run_point(bench: Bench, point: Point) -> dict[str, Any]:
    """One row of the atlas: the point, its class, what stopped it, the firmware's first fault."""
    record = sim.run(job_of(bench, point))
    fault_s = record.first_fault_s
    return {
        **vars(point),
        **vars(judge_record(bench, point, record)),
        "cause": record.cause,
        "cause_s": record.cause_s,  # since the run began
        "first_fault": sim.fault_names(record.first_fault),
        "first_fault_s": None if fault_s is None else fault_s - begin_s(bench, point),
    }


def run_points(bench: Bench, points: Iterable[Point]) -> list[dict[str, Any]]:
    """A worker's share. It must run the very firmware the bench was made with."""
    if library_sha256() != bench.library_sha256:
        raise UserError(
            "worker: its firmware library is another one; build the same commit with the same "
            "compiler on every machine, or copy the library and set ZEROHERTZ_SIL"
        )
    return [run_point(bench, point) for point in points]


@functools.cache
def library_sha256() -> str:
    """Of all the code that a run executes but the plant's input."""
    code = ensure_built().sil_library.read_bytes() + python_digest()
    return hashlib.sha256(code).hexdigest()


def _relative(path: Path) -> str:
    path = path.resolve()
    return str(path.relative_to(ROOT) if path.is_relative_to(ROOT) else path)


def _rig(point: Point) -> dict[str, Any]:
    """True motor, mechanics, inverter and sensors of a point."""
    plate = _nameplate_rig()
    # M is what a test at rated flux would show; the unsaturated value is larger. The leakages are
    # separate, so that a wrong M never makes an impossible machine.
    saturation = (RATED_FLUX_WB / point.knee_Wb) ** SATURATION_EXPONENT if point.knee_Wb else 0.0
    M_H = point.m_ratio * plate["M_H"] * (1.0 + saturation)
    values = {
        "motor.Rs_ohm": point.rs_ratio * plate["Rs_ohm"],
        "motor.Rr_ohm": point.rr_ratio * plate["Rr_ohm"],
        "motor.M_H": M_H,
        "motor.Ls_H": M_H + point.leakage_ratio * (plate["Ls_H"] - plate["M_H"]),
        "motor.Lr_H": M_H + point.leakage_ratio * (plate["Lr_H"] - plate["M_H"]),
        "mechanics.J_kg_m2": point.J_kg_m2,
        "mechanics.coulomb_Nm": point.coulomb_Nm,
        "inverter.dead_time_s": point.dead_time_s,
        "sensors.current_offset_A": [point.offset_u_A, point.offset_v_A, point.offset_w_A],
        "sensors.current_gain": [point.gain_u, point.gain_v, point.gain_w],
        "sensors.voltage_offset_V": [point.offset_uv_V, point.offset_vw_V],
        "sensors.voltage_gain": [point.gain_uv, point.gain_vw],
    }
    if point.knee_Wb:
        values["motor.saturation.exponent"] = SATURATION_EXPONENT
        values["motor.saturation.flux_knee_Wb"] = point.knee_Wb
    return values


@functools.cache
def _nameplate_rig() -> dict[str, float]:
    return tomllib.loads(RIG.read_text(encoding="utf-8"))["motor"]


def _scenario(bench: Bench, point: Point) -> str:
    run, begin = bench.run_s, begin_s(bench, point)
    top, full, end = begin - SETTLE_S, begin + RAMP_S, begin + point.loaded_s
    drifted, rs = begin + point.drift_s, 1.0 + point.drift_pu
    load_Nm = point.load_pu * RATED_TORQUE_NM
    return (
        f'[scenario]\nname = "atlas"\nduration_s = {end:.6f}\nrun_on_s = {RUN_ON_S}\n[profiles]\n'
        f"speed_ref_rpm = [[0.0, 0.0], [{run:.6f}, 0.0], [{top:.6f}, {point.speed_rpm!r}]]\n"
        f"load_torque_Nm = [[{begin:.6f}, 0.0], [{full:.6f}, {load_Nm!r}]]\n"
        f"rs_factor = [[{begin:.6f}, 1.0], [{drifted:.6f}, {rs!r}]]\n"
    )


def _run_s(bench: Bench) -> float:
    """When this configuration reaches RUN, on the nominal machine at standstill, and a little more.

    What it does before (offsets, Rs, flux) is its own affair; a start longer than LONGEST_START_S
    leaves the points not started.
    """
    latest_s = LONGEST_START_S - 900.0 / RPM_PER_S - SETTLE_S
    probe = Point(map="", index=0, seed=1, speed_rpm=0.0, load_pu=0.0, rs_ratio=1.0, loaded_s=0.0)
    record = sim.run(job_of(dataclasses.replace(bench, run_s=latest_s), probe))
    running = np.flatnonzero(record["state"] == State.RUN)
    reached_s = float(record.t_s[running[0]]) if len(running) else latest_s
    return min(reached_s + 0.05, latest_s)
