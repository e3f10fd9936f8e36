"""A run of the envelope: from its number to its row."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from zerohertz import sim
from zerohertz.atlas.simulate import RIG, Bench, library_sha256, make_bench
from zerohertz.campaign.faults.judge import RPM, UNDECLARED, Limits, judge
from zerohertz.campaign.faults.run import maximum_rpm, torque_limit_Nm
from zerohertz.campaign.rig import OVER_PU, bit_names
from zerohertz.drive import State
from zerohertz.envelope import axes, feasible, measure, plans
from zerohertz.envelope import mission as missions
from zerohertz.envelope.axes import Value
from zerohertz.envelope.case import Case
from zerohertz.envelope.mission import Mission
from zerohertz.envelope.motors import CONFIG, Drive, drive_for
from zerohertz.envelope.plant import drifts, friction_Nm, inertia_kg_m2, rig_overrides
from zerohertz.errors import UserError
from zerohertz.estimators.chosen import chosen_name, is_foreign
from zerohertz.scenario.setup import load_setup

# A row depends on these besides the firmware: a change of one makes stored rows old.
_HERE = Path(__file__).parent
_TOOLS = _HERE.parent
SOURCES = (
    *sorted(_HERE.glob("*.py")),
    *(_TOOLS / "campaign" / "faults" / f"{name}.py" for name in ("judge", "run")),
    _TOOLS / "campaign" / "rig.py",
    *sorted((_TOOLS / "commission").glob("*.py")),
)
# What a row is made of: judge.py, measure.py, row_of. More would take time and memory.
COLUMNS = (
    *("t_s", "speed_ref_rpm", "speed_rpm", "torque_Nm", "load_Nm", "f_s_Hz", "i_peak_A"),
    *("lambda_Wb", "lambda_hat_Wb", "flux_angle_err_deg", "state", "faults", "gates_on"),
    *("confidence", "speed_unknown"),
)
AT_ONCE = 16  # runs in one thread: in memory together, and side by side
RUN_ON_S = 0.01
LONGEST_START_S = 60.0
AFTER_START_S = 0.3
FOREIGN_START_S = 6.0  # of an estimator of somebody else's with which the drive never gets ready
# Verdicts of runs that the estimator ended itself.
OWN_ENDS = {sim.TOO_SLOW: "too_slow", sim.NOT_FINITE: "nan"}
NOMINAL: tuple[tuple[str, Value], ...] = (
    *((name, 1.0) for name in ("Rs_ratio", "Rr_ratio", "M_ratio", "leakage_ratio", "J_ratio")),
    *((name, 0.0) for name in ("offset_A", "gain_error", "dead_time_us", "load_pu")),
    ("saturation", "none"),
    ("J_told", 1.0),
    ("inverter", "averaged"),
)


def bench_of_envelope() -> Bench:
    """What the rows depend on besides motors and cases: configuration and firmware library."""
    return make_bench(load_setup(CONFIG))


@dataclasses.dataclass(frozen=True)
class Sample:
    """Which runs: a seed, axes that are not drawn, parameters of the firmware that are set."""

    seed: int
    fixed: Mapping[str, Value] = dataclasses.field(default_factory=dict)
    firmware: Mapping[str, float] = dataclasses.field(default_factory=dict)
    motor_dir: str = ""  # as of a case

    def case(self, index: int) -> Case:
        fixed, firmware = sorted(self.fixed.items()), sorted(self.firmware.items())
        return Case("", index, self.seed, tuple(fixed), tuple(firmware), self.motor_dir)

    @property
    def options(self) -> str:
        """As the command line has them."""
        words = [f" --fix {name}={value}" for name, value in self.fixed.items()]
        words += [f" --set {name}={value:g}" for name, value in self.firmware.items()]
        return f"--seed {self.seed}" + "".join(words)


def cases_of(sample: Sample, runs: int, block: int) -> list[list[Case]]:
    """Blocks of cases: a larger number of runs finds the smaller one's blocks done."""
    every = [sample.case(k) for k in range(runs)]
    return [
        [
            dataclasses.replace(case, map=f"runs-{first:06d}")
            for case in every[first : first + block]
        ]
        for first in range(0, runs, block)
    ]


@functools.cache
def start_s(motor: str, period_us: str = "200") -> float:
    """When the drive of this motor is ready for a speed, measured once with nothing wrong."""
    case = Case("", 0, 0, (*NOMINAL, ("motor", motor), ("period_us", period_us)))
    rest = Mission(LONGEST_START_S, [[0.0, 0.0]], [[0.0, 0.0]], [[0.0, drive_for(case).u_dc_V]])
    record = sim.run(dataclasses.replace(_job(case, rest), decimate=50))
    running = np.flatnonzero(record["state"] == State.RUN)
    if not len(running) and chosen_name():
        return FOREIGN_START_S
    if not len(running):
        raise UserError(f"envelope: the drive of {motor} does not start with nothing wrong")
    return float(record.t_s[running[0]]) + AFTER_START_S


@dataclasses.dataclass(frozen=True)
class Planned:
    """A run before it is run."""

    case: Case
    drive: Drive
    mission: Mission
    impossible: str  # why it cannot be done
    job: sim.Job


def planned(case: Case) -> Planned:
    drive = drive_for(case)
    mission = plans.plan(case, start_s(case.word("motor"), case.word("period_us")))
    why = feasible.impossible(missions.limits_of(case), missions.demand(case, mission, drive))
    return Planned(case, drive, mission, why, _job(case, mission))


def _job(case: Case, mission: Mission) -> sim.Job:
    drive = drive_for(case)
    rig = rig_overrides(case)
    begin_s = min(1.0, 0.5 * mission.end_s)
    return sim.Job(
        scenario=_scenario(case, mission),
        rig=RIG,
        board=drive.board,
        motor_dir=case.motor_dir or drive.motor_dir,
        firmware_config=drive.params,
        firmware=_told(case, drive),
        rig_overrides=rig,
        scenario_overrides=drifts(case, begin_s, mission.end_s),
        board_overrides={"adc.bits": int(case.word("adc_bits"))},
        seed=case.noise_seed,
    )


def _told(case: Case, drive: Drive) -> dict[str, float]:
    """What the firmware is told otherwise than its configuration says."""
    J = case.number("J_told") * inertia_kg_m2(case)
    told = {
        "dead_time_s": axes.TOLD_FACTOR[case.word("dead_time_told")]
        * 1e-6
        * case.number("dead_time_us"),
        "speed_J_kg_m2": J,
    }
    voltage = case.word("voltage")
    if voltage != axes.SHIPPED:
        told["voltage_source"] = (axes.SENSORS, axes.DUTY).index(voltage)
    # A derived drive limits its slew by the inertia that it is told.
    for name in ("speed_slew_rad_s2", "ramp_down_rad_s2"):
        if name in drive.params and "speed_slew_rad_s2" in drive.params:
            told[name] = float(drive.params[name]) * float(drive.params["speed_J_kg_m2"]) / J
    return told | dict(case.firmware)


def _scenario(case: Case, mission: Mission) -> str:
    profiles = {
        "speed_ref_rpm": mission.speed,
        "load_torque_Nm": mission.load,
        "u_dc_V": mission.u_dc,
        "rs_factor": _heated(case.number("Rs_heating"), mission),
        "rr_factor": _heated(case.number("Rr_heating"), mission),
        **({"torque_ref_Nm": mission.torque} if mission.torque else {}),
    }
    mode = ""
    if math.isfinite(mission.torque_s):
        mode = f"torque_mode_on_s = {mission.torque_s:.6f}\n"
    reference = f"reference_rpm = {mission.reference_rpm}\n" if mission.law != "constant" else ""
    lines = "\n".join(f"{name} = {points}" for name, points in profiles.items())
    return (
        f'[scenario]\nname = "envelope"\nduration_s = {mission.end_s:.6f}\n'
        f"run_on_s = {RUN_ON_S}\n{mode}[profiles]\n{lines}\n"
        f'[load]\nlaw = "{mission.law}"\n{reference}'
        f"pulse_pu = {mission.pulse_pu}\npulse_Hz = {mission.pulse_Hz}\n"
    )


def _heated(share: float, mission: Mission) -> list[list[float]]:
    """From the calibration on, evenly."""
    return [[1.0, 1.0], [mission.end_s, 1.0 + share]]


def limits_of(plan: Planned) -> Limits:
    """What the judge of the fault campaign has to know."""
    known = plan.drive.known | dict(plan.job.firmware)
    possible_Nm = feasible.torque_range_Nm(missions.limits_of(plan.case), 0.0, plan.drive.u_dc_V)[1]
    # A torque may change the speed faster than the drive ramps its speed reference.
    slew_rpm_s = float(known["speed_slew_rad_s2"]) / plan.drive.pole_pairs / RPM
    if math.isfinite(plan.mission.torque_s):
        slew_rpm_s = math.inf
    return Limits(
        over_A=OVER_PU * float(known["i_trip_A"]),
        maximum_rpm=maximum_rpm(known),
        torque_Nm=min(torque_limit_Nm(known), possible_Nm),
        slew_rpm_s=slew_rpm_s,
        J_kg_m2=inertia_kg_m2(plan.case),
        friction_Nm=friction_Nm(plan.case),
        rated_rpm=plan.drive.rated_rpm,
    )


def judged(record: sim.Record, mission: Mission) -> sim.Record:
    """In torque mode no speed is asked for: any speed is the one that was asked."""
    if not math.isfinite(mission.torque_s):
        return record
    free = record.t_s >= mission.torque_s
    asked = np.where(free, record["speed_rpm"], record["speed_ref_rpm"])
    return dataclasses.replace(record, columns=record.columns | {"speed_ref_rpm": asked})


def row_of(plan: Planned, record: sim.Record) -> dict[str, Any]:
    """The row of a run."""
    case, drive = plan.case, plan.drive
    scale = measure.Scale(drive.speed_unit, drive.rated_Nm)
    verdict = judge(judged(record, plan.mission), limits_of(plan), 0.0)
    numbers = measure.numbers(record, plan.mission, scale)
    if plan.mission.pulse_pu > 0.0:
        numbers["torque_ripple_pu"] = None  # the load's as much as the drive's
    fault = int(verdict["bits"]) != 0
    return {
        "index": case.index,
        **case.values,
        "duration_s": plan.mission.end_s,
        "impossible": plan.impossible,
        **verdict,
        **({"verdict": OWN_ENDS[record.cause]} if record.cause in OWN_ENDS else {}),
        "cause": record.cause,
        "cause_s": record.cause_s,
        "fault": bit_names(int(verdict["bits"])),
        "false_trip": fault and not plan.impossible,
        "undeclared_harm": verdict["verdict"] == UNDECLARED,
        "taken_over": bool(np.any(record["confidence"] == 2)),
        "unknown_s": float(np.count_nonzero(record["speed_unknown"])) * record.period_s,
        **numbers,
    }


def run_case(case: Case) -> tuple[dict[str, Any], Planned, sim.Record]:
    plan = planned(case)
    record = sim.run(plan.job)
    return row_of(plan, record), plan, record


def run_cases(bench: Bench, cases: Iterable[Case]) -> list[dict[str, Any]]:
    """A worker's share, with the very firmware that the campaign was started with."""
    if library_sha256() != bench.library_sha256:
        raise UserError("firmware library: differs from the one the envelope was started with")
    if is_foreign():  # sim.run ends what takes too long
        return [run_case(case)[0] for case in cases]
    plans = [planned(case) for case in cases]
    groups = [plans[first : first + AT_ONCE] for first in range(0, len(plans), AT_ONCE)]
    return [row for group in groups for row in _rows_at_once(group)]


def _model_and_length(plan: Planned) -> tuple[str, float]:
    return plan.case.word("inverter"), -plan.mission.end_s / plan.drive.period_s


def _rows_at_once(plans: Sequence[Planned]) -> list[dict[str, Any]]:
    """The rows of run_case, in less time: one model of the inverter after the other, for they are
    stepped together, and the longest first, so that few end alone."""
    ordered = sorted(plans, key=_model_and_length)
    records = sim.run_batch([dataclasses.replace(plan.job, columns=COLUMNS) for plan in ordered])
    records.reverse()
    rows = [row_of(plan, records.pop()) for plan in ordered]  # each record goes when it is judged
    return sorted(rows, key=lambda row: row["index"])
