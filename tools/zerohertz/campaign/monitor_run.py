"""One case of the monitor's campaign from the real firmware on the simulated bench to its verdict.

detected  a fault is latched, or the supervisor has declared IMPRESSED and stays with it
harmless  nothing is said, and nothing is wrong: in RUN, the speed within 30 min^-1 at the end and
          never beyond 150 min^-1 for longer than 100 ms, the current within its limit
FAILED    neither, or a leg current beyond 22.5 A for more than two periods, whatever is said
A sag has to be ridden through: harmless, or FAILED.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from typing import Any

import numpy as np

from zerohertz import sim
from zerohertz.atlas.classes import Confidence
from zerohertz.atlas.detection import longest_s
from zerohertz.atlas.points import Point
from zerohertz.atlas.simulate import Bench, begin_s, job_of, library_sha256
from zerohertz.campaign.monitor_cases import FAULT_S, Case, scenario_overrides
from zerohertz.campaign.rig import FIRMWARE, LINK, OVER_PU
from zerohertz.drive import State
from zerohertz.errors import UserError
from zerohertz.sil_types import WARNINGS

# A real board has comparators.
BOARD = {"protection.comparator_A": 25.0}
OVER_A = OVER_PU * 20.0
OVER_PERIODS = 2
END_S = 0.2
END_RPM = 30.0
FAR_RPM = 150.0
FAR_S = 0.1
# The largest phase current is sqrt(2/3) of the vector's length; 5 % for ripple and noise.
LIMIT_A = 1.05 * 15.8


def job(bench: Bench, case: Case) -> sim.Job:
    point = Point(
        map="",
        index=case.index,
        seed=case.seed,
        speed_rpm=case.speed_rpm,
        load_pu=case.load_pu,
        rs_ratio=1.0,
        loaded_s=case.loaded_s,
    )
    usual = job_of(bench, point)
    return dataclasses.replace(
        usual,
        scenario_overrides=scenario_overrides(case, begin_s(bench, point)),
        rig_overrides={**usual.rig_overrides, **LINK},
        board_overrides={**usual.board_overrides, **BOARD},
        firmware={**FIRMWARE, **usual.firmware},
        decimate=1,
    )


def judge(case: Case, record: sim.Record, begin: float) -> dict[str, Any]:
    """The row of a case."""
    t_s = record.t_s.astype(np.float64) - begin
    # What is broken from the start begins to matter with the gates.
    fault_s = float(t_s[np.argmax(record["gates_on"] > 0)]) if case.at_start else case.fault_s
    after = t_s >= fault_s
    running = t_s >= max(fault_s, FAULT_S)
    before = (t_s >= FAULT_S - 0.5) & ~after
    error_rpm = np.abs(record["speed_rpm"] - record["speed_ref_rpm"])
    faults = record["faults"].astype(np.int64)
    error_bits = faults & ~WARNINGS  # no verdict rests on a warning
    latched = np.flatnonzero(after & (error_bits != 0))
    taken = after & (record["confidence"] == Confidence.IMPRESSED)
    told = np.flatnonzero(taken)
    over = round(longest_s(after & (record["i_peak_A"] > OVER_A), 1.0))
    end = t_s >= t_s[-1] - END_S
    fine = (
        _runs_on(record, running, error_rpm)
        and float(error_rpm[end].mean()) < END_RPM
        and float(record["i_abs_A"][after].max()) <= LIMIT_A
    )
    started = case.at_start or bool(
        np.all(record["state"][before] == State.RUN) and np.all(error_bits[before] == 0)
    )
    said = "detected" if len(latched) else "taken over" if bool(taken[end].all()) else "nothing"
    first = latched if len(latched) else told
    return {
        "verdict": _verdict(case, said, fine, over, started and _complete(case, t_s)),
        "said": said,
        "bits": int(error_bits[latched[0]]) if len(latched) else 0,
        "delay_s": float(t_s[first[0]] - fault_s) if said != "nothing" else None,
        "over_periods": over,
        "peak_A": float(record["i_peak_A"][after].max()),
        "worst_rpm": float(error_rpm[after & (record["gates_on"] > 0)].max(initial=0.0)),
        "end_rpm": float(error_rpm[end].mean()),
        "started": started,
        "u_dc_low_V": float(record["u_dc_V"][after].min()),
        "u_dc_high_V": float(record["u_dc_V"][after].max()),
    }


def _runs_on(record: sim.Record, running: Any, error_rpm: Any) -> bool:
    """With torque, and nowhere far from the reference for long."""
    far_s = longest_s(running & (error_rpm > FAR_RPM), record.period_s)
    return bool(np.all(record["state"][running] == State.RUN)) and far_s <= FAR_S


def _complete(case: Case, t_s: Any) -> bool:
    return bool(t_s[-1] >= case.loaded_s - 1e-3)


def _verdict(case: Case, said: str, fine: bool, over: int, valid: bool) -> str:
    if not valid or over > OVER_PERIODS:
        return "FAILED"
    if case.map == "sag":
        return "harmless" if said == "nothing" and fine else "FAILED"
    if said != "nothing":
        return "detected"
    return "harmless" if fine else "FAILED"


def run_case(bench: Bench, case: Case) -> dict[str, Any]:
    done = job(bench, case)
    point_begin_s = begin_s(bench, case)  # type: ignore[arg-type]  # has what is asked of a point
    return {**vars(case), **judge(case, sim.run(done), point_begin_s)}


def run_cases(bench: Bench, cases: Iterable[Case]) -> list[dict[str, Any]]:
    """A worker's share, with the very firmware the bench was made with."""
    if library_sha256() != bench.library_sha256:
        raise UserError("firmware library: differs from the one the campaign was started with")
    return [run_case(bench, case) for case in cases]
