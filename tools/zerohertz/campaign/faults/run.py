"""A case from its name to its row: the real firmware on the true plant, then the judge."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from zerohertz import param_list, sim
from zerohertz.atlas.points import Point
from zerohertz.atlas.simulate import (
    RATED_TORQUE_NM,
    SETTLE_S,
    Bench,
    job_of,
    library_sha256,
    make_bench,
)
from zerohertz.campaign.faults import conditions as where
from zerohertz.campaign.faults import excepted, shared
from zerohertz.campaign.faults.cases import Case
from zerohertz.campaign.faults.conditions import Condition
from zerohertz.campaign.faults.judge import RPM, Limits, judge
from zerohertz.campaign.faults.kinds import Change
from zerohertz.campaign.rig import FIRMWARE, LINK, OVER_PU
from zerohertz.errors import UserError
from zerohertz.scenario.setup import load_setup

# A row depends on these besides the firmware: a change of one makes stored rows old.
_HERE = Path(__file__).parent
SOURCES = (
    *(_HERE / f"{name}.py" for name in ("cases", "conditions", "judge", "kinds", "shared")),
    _HERE.parent / "fork.py",
    _HERE.parent / "rig.py",
)

CONFIG = "recommended"
BEFORE_S = 0.02  # a late word needs those before
LOADED_S = 2.0  # from the beginning of the load to the fault
AFTER_S = 4.0
LOAD_RAMP_S = 1.0
COULOMB_NM = 0.4  # of the bench
RPM_PER_S = {True: 250.0, False: 450.0}  # open loop is slower, see open_loop_slew_rad_s2
COMMISSION_S, LONGEST_COMMISSION_S = 0.3, 60.0
COMMISSION_MEAN_S = 4.0
RATED_SLIP_RPM = 90.0


@dataclasses.dataclass(frozen=True)
class Times:
    """Of a run: load, first fault, end; and where a reversal begins."""

    begin_s: float
    fault_s: float
    end_s: float
    reverse_s: float = math.inf

    @property
    def parting_s(self) -> float:
        """Cases of one stem are the same run until then."""
        return self.begin_s + LOADED_S - BEFORE_S


def bench_of_campaign() -> Bench:
    """The recommended configuration on the bench."""
    return make_bench(load_setup(CONFIG))


def rate_rpm_s(condition: Condition) -> float:
    return RPM_PER_S[condition.mode in (where.I_F, where.V_F)]


def times_of(bench: Bench, case: Case) -> Times:
    c = case.condition
    draw = case.delays_s()[0] / 0.02
    if c.mode == where.COMMISSIONING:
        # Half of them from the start on.
        fault_s = max(0.0, (2.0 * draw - 1.0) * COMMISSION_MEAN_S)
        return Times(0.0, fault_s, LONGEST_COMMISSION_S)
    begin_s = bench.run_s + max(0.2, c.speed_rpm / rate_rpm_s(c)) + SETTLE_S
    if c.mode == where.STARTING:
        return Times(begin_s, 0.0, begin_s + LOAD_RAMP_S + AFTER_S)
    fault_s = begin_s + LOADED_S + 0.02 * draw
    if c.mode == where.REVERSING:
        length_s = max(0.2, 2.0 * c.speed_rpm / rate_rpm_s(c))
        reverse_s = begin_s + LOADED_S
        fault_s = reverse_s + draw * length_s
        return Times(begin_s, fault_s, reverse_s + length_s + AFTER_S, reverse_s)
    return Times(begin_s, fault_s, fault_s + AFTER_S)


def changes_of(case: Case, times: Times) -> list[Change]:
    """Of every fault of the case, each at its own moment."""
    made, slot = [], 0
    for kind, delay_s in zip(case.kinds, case.delays_s(), strict=True):
        first = kind is case.kinds[0] or times.fault_s == 0.0
        at_s = times.fault_s + (0.0 if first else delay_s)
        if kind.word is not None:
            made.append(Change(kind.sensor_keys(slot, at_s)))
            slot += 1
        elif kind.change is not None:
            change = kind.change(at_s, case.condition)
            made.append(change)
    return made


def job(bench: Bench, case: Case) -> sim.Job:
    """The run of a case."""
    times = times_of(bench, case)
    changes = changes_of(case, times)
    point = Point("", case.index, case.seed, case.speed_rpm, 0.0, rs_ratio=1.0)
    usual = job_of(bench, point)
    rig = {**usual.rig_overrides, **LINK, **case.condition.rig()}
    if case.condition.load == where.PASSIVE:
        rig["mechanics.coulomb_Nm"] += RATED_TORQUE_NM
    firmware = {**FIRMWARE, **case.condition.firmware(), **bench.firmware}
    scenario: dict[str, Any] = {}
    for change in changes:
        rig |= change.rig
        rig |= {name: factor * rig[name] for name, factor in change.factors.items()}
        scenario |= change.scenario
        firmware |= change.firmware
    return dataclasses.replace(
        usual,
        scenario=_scenario(bench, case, times, changes),
        scenario_overrides=scenario,
        rig_overrides=rig,
        firmware=firmware,
        decimate=1,
    )


def _scenario(bench: Bench, case: Case, times: Times, changes: list[Change]) -> str:
    c = case.condition
    head = f'[scenario]\nname = "faults"\nduration_s = {times.end_s:.6f}\n'
    if c.mode == where.COMMISSIONING:
        return f"{head}commission_s = {COMMISSION_S}\n[profiles]\nspeed_ref_rpm = [[0.0, 0.0]]\n"
    top_s = times.begin_s - SETTLE_S
    speed = [[0.0, 0.0], [top_s - c.speed_rpm / rate_rpm_s(c), 0.0], [top_s, c.speed_rpm]]
    if math.isfinite(times.reverse_s):
        back_s = times.reverse_s + 2.0 * c.speed_rpm / rate_rpm_s(c)
        speed += [[times.reverse_s, c.speed_rpm], [back_s, -c.speed_rpm]]
    load_Nm = c.load_pu * RATED_TORQUE_NM
    load = [[0.0, 0.0], [times.begin_s, 0.0], [times.begin_s + LOAD_RAMP_S, load_Nm]]
    for change in changes:
        if change.load_pu is not None:
            # With the drive stopped nothing holds the shaft: not before the usual load.
            at_s = max(times.fault_s, times.begin_s + LOAD_RAMP_S)
            load += [[at_s, load_Nm], [at_s, change.load_pu * RATED_TORQUE_NM]]
    return f"{head}run_on_s = 0.01\n[profiles]\nspeed_ref_rpm = {speed}\nload_torque_Nm = {load}\n"


def limits_of(bench: Bench, case: Case, made: sim.Job) -> Limits:
    """What the judge has to know of this run."""
    known = param_list.defaults() | dict(made.firmware_config) | dict(made.firmware)
    rig, c = made.rig_overrides, case.condition
    slew = known["speed_slew_rad_s2"]
    if c.mode == where.I_F:
        slew = min(slew, known["open_loop_slew_rad_s2"])
    elif c.mode == where.V_F:
        slew = known["open_loop_slew_rad_s2"]
    p = known["pole_pairs"]
    return Limits(
        over_A=over_A(bench),
        maximum_rpm=maximum_rpm(known),
        torque_Nm=torque_limit_Nm(known),
        slew_rpm_s=slew / p / RPM,
        J_kg_m2=rig["mechanics.J_kg_m2"],
        friction_Nm=rig["mechanics.coulomb_Nm"],
        jam_s=made.scenario_overrides.get("faults.jam_s", math.inf),
        jam_Nm=100.0,
        slip_rpm=RATED_SLIP_RPM if c.mode == where.V_F else 0.0,
    )


def maximum_rpm(known: Mapping[str, float]) -> float:
    """Of the shaft; the parameter is electrical."""
    return known["speed_max_rad_s"] / known["pole_pairs"] / RPM


def torque_limit_Nm(known: Mapping[str, float]) -> float:
    """At nominal flux."""
    room_A = math.sqrt(known["i_max_A"] ** 2 - known["i_d_A"] ** 2)
    kr = known["M_H"] / known["Lr_H"]
    flux_Wb = known["M_H"] * known["i_d_A"]
    return known["pole_pairs"] * kr * flux_Wb * min(known["i_q_max_A"], room_A)


def run_case(bench: Bench, case: Case) -> dict[str, Any]:
    """One row, with the exceptions looked up."""
    return excepted.looked_up(next(_rows(bench, [case])), over_A(bench))


def over_A(bench: Bench) -> float:
    """The judge's limit of a phase current."""
    return OVER_PU * bench.i_trip_A


def run_cases(bench: Bench, cases: Iterable[Case]) -> list[dict[str, Any]]:
    """A worker's share, with the very firmware the bench was made with."""
    if library_sha256() != bench.library_sha256:
        raise UserError("firmware library: differs from the one the campaign was started with")
    stems: dict[str, list[Case]] = {}
    for case in cases:
        stems.setdefault(case.stem, []).append(case)
    return [row for together in stems.values() for row in _rows(bench, together)]


def _rows(bench: Bench, cases: Sequence[Case]) -> Iterator[dict[str, Any]]:
    """Of cases of one stem, in their order."""
    rests = [_rest(bench, case) for case in cases]
    parting_s = times_of(bench, cases[0]).parting_s if cases[0].shares else 0.0
    for case, row in zip(cases, shared.rows_of(rests, parting_s), strict=True):
        axes = {name: getattr(case.condition, name) for name in where.AXES}
        kinds = " + ".join(kind.what for kind in case.kinds)
        yield {**vars(case), **axes, "kinds": kinds, **row}


def _rest(bench: Bench, case: Case) -> shared.Rest:
    made, times = job(bench, case), times_of(bench, case)
    limits = limits_of(bench, case, made)

    def judged(record: sim.Record) -> dict[str, Any]:
        from_start = any(kind.from_start for kind in case.kinds)
        since_s = 0.0 if from_start else times.reverse_s
        return judge(record, limits, times.fault_s, since_s)

    return shared.Rest(made, times.end_s, judged)
