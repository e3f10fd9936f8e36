"""The firmware on motulator's induction machine (0.5.0), which shares no code with ours.

The example users copy is what is tested. Judged by the plant's own speed, torque and current; the
limits are those of issue 13 where it names one, else twice what was measured.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from itertools import pairwise

import numpy as np
import pytest
from motulator.drive import model

from zerohertz.drive import State
from zerohertz.examples.motulator_plant import (
    J_KG_M2,
    RPM,
    T_S,
    Plant,
    machine_parameters,
    simulate,
)
from zerohertz.replay.log import FloatArray
from zerohertz.scenario.setup import load_setup

RATED_NM = 8.4
LOADED_S = 5.5  # magnetised after 4.9 s; at speed before this
DIP_RPM = RATED_NM / J_KG_M2 * 15e-3 * RPM  # of a step of the rated torque: T/J x 15 ms
PHASE_A = 14.0  # largest phase current; the trip is at 22.5 A
FLUX_WB = 0.458  # stator flux, peak, of i_d 5.1 A without load
MACHINES = pytest.mark.parametrize("saturated_at_Wb", [None, FLUX_WB], ids=["linear", "saturable"])


@dataclass(frozen=True)
class Run:
    """Columns of a run; `ref_rpm` is what was asked for."""

    t_s: FloatArray
    speed_rpm: FloatArray
    torque_Nm: FloatArray
    phase_A: FloatArray
    said_rpm: FloatArray
    state: FloatArray
    ref_rpm: FloatArray

    def between(self, begin_s: float, end_s: float) -> Run:
        chosen = (self.t_s > begin_s) & (self.t_s < end_s)
        return Run(*(getattr(self, f.name)[chosen] for f in fields(self)))

    @property
    def error_rpm(self) -> FloatArray:
        return np.abs(self.speed_rpm - self.ref_rpm)


def run(
    duration_s: float,
    speed_ref_rpm: Callable[[float], float],
    load_Nm: Callable[[float], float],
    saturated_at_Wb: float | None,
) -> Run:
    moments = simulate(duration_s, speed_ref_rpm, load_Nm, saturated_at_Wb=saturated_at_Wb)
    rows = [
        (
            now.t_s,
            now.speed_rpm,
            now.torque_Nm,
            now.phase_A,
            now.out.speed_hat_rpm,
            now.out.state,
            speed_ref_rpm(now.t_s),
        )
        for now in moments
    ]
    return Run(*np.array(rows).T)


def polyline(*points: tuple[float, float]) -> Callable[[float], float]:
    """As np.interp, to the bit; for one number at a time that takes ten times as long."""
    (first_s, first), (last_s, last) = points[0], points[-1]
    pieces = [
        (t0_s, t1_s, v0, (v1 - v0) / (t1_s - t0_s)) for (t0_s, v0), (t1_s, v1) in pairwise(points)
    ]

    def value(t_s: float) -> float:
        if t_s <= first_s or t_s >= last_s:
            return first if t_s <= first_s else last
        t0_s, _, v0, slope = next(piece for piece in pieces if t_s < piece[1])
        return slope * (t_s - t0_s) + v0

    return value


def drove(done: Run, duration_s: float) -> bool:
    """To the end, in RUN, without the over-current that a lost orientation makes."""
    driven = done.between(LOADED_S, duration_s)
    complete = len(done.t_s) == round(duration_s / T_S)
    return complete and bool((driven.state == State.RUN).all() and driven.phase_A.max() < PHASE_A)


@MACHINES
def test_it_runs_up_and_carries_a_step_of_the_rated_load(saturated_at_Wb: float | None) -> None:
    done = run(9.0, lambda t_s: 300.0, lambda t_s: RATED_NM * (6.0 <= t_s < 7.5), saturated_at_Wb)
    assert drove(done, 9.0)
    assert done.between(0.0, 5.5).speed_rpm.max() < 312.0  # run-up: overshoot 4 %
    loaded = done.between(6.0, 7.5)
    assert loaded.error_rpm.max() < DIP_RPM
    assert done.between(6.4, 7.5).error_rpm.max() < 5.0
    settled = done.between(7.2, 7.5)
    assert settled.error_rpm.max() < 1.5
    assert settled.torque_Nm.std() < 0.01 * RATED_NM
    assert done.between(7.5, 9.0).error_rpm.max() < DIP_RPM


@MACHINES
def test_it_regenerates_at_60_rpm(saturated_at_Wb: float | None) -> None:
    load_Nm = polyline((5.5, 0.0), (6.0, -RATED_NM))
    done = run(10.0, lambda t_s: 60.0, load_Nm, saturated_at_Wb)
    assert drove(done, 10.0)
    assert done.between(5.5, 7.0).error_rpm.max() < 25.0
    settled = done.between(7.5, 10.0)
    assert settled.error_rpm.max() < 1.0
    assert np.abs(settled.said_rpm - settled.speed_rpm).max() < 1.0
    assert settled.torque_Nm.mean() == pytest.approx(-RATED_NM, rel=0.01)
    assert settled.torque_Nm.std() < 0.01 * RATED_NM


@MACHINES
@pytest.mark.parametrize(("load_pu", "slope_rpm_s"), [(-1.0, 5.0), (1.0, 20.0)])
def test_it_crosses_zero_frequency_slowly(
    load_pu: float, slope_rpm_s: float, saturated_at_Wb: float | None
) -> None:
    end_s = 7.0 + 120.0 / slope_rpm_s
    speed_rpm = polyline((7.0, 60.0), (end_s, -60.0))
    load_Nm = polyline((5.5, 0.0), (6.5, load_pu * RATED_NM))
    done = run(end_s + 2.0, speed_rpm, load_Nm, saturated_at_Wb)
    assert drove(done, end_s + 2.0)
    assert done.between(7.0, end_s + 2.0).error_rpm.max() < 30.0
    assert done.between(end_s + 1.0, end_s + 2.0).error_rpm.max() < 2.0


def test_a_load_it_cannot_carry_is_seen() -> None:
    """The predicates fail where they should."""
    done = run(7.5, lambda t_s: 300.0, lambda t_s: 3.0 * RATED_NM * (t_s >= 6.0), None)
    assert done.between(6.0, 7.5).error_rpm.max() > DIP_RPM
    assert done.between(0.0, 5.5).speed_rpm.max() < 312.0


class OpenLoop:
    """What motulator's Simulation takes for a control system: duties of time."""

    def __init__(self) -> None:
        self.acting: list[tuple[float, ...]] = []

    def __call__(self, mdl: model.Drive) -> tuple[float, tuple[float, ...]]:
        turns = 20.0 * mdl.t0 + np.array([0.0, 1.0, 2.0]) / 3.0
        duties = tuple(0.5 + 0.1 * np.cos(2.0 * np.pi * turns))
        self.acting.append(duties)
        return T_S, duties

    def post_process(self) -> None:
        pass


def test_our_step_gives_what_motulator_gives() -> None:
    """Runge-Kutta of 200 us against its own simulation with solve_ivp, saturable machine."""
    par = machine_parameters(load_setup("recommended").motor_dir, FLUX_WB)
    theirs, ours = (Plant(par, lambda t_s: 0.0 * t_s) for _ in range(2))
    duties = OpenLoop()
    model.Simulation(theirs.model, duties).simulate(t_stop=0.1)
    for acting in [(0.5, 0.5, 0.5), *duties.acting[:-1]]:
        ours.advance(acting)
    assert ours.model.t0 == pytest.approx(theirs.model.t0)
    assert abs(ours.machine.i_ss) > 2.0
    assert abs(ours.machine.i_ss - theirs.machine.i_ss) < 5e-3
    assert abs(ours.shaft.meas_speed() - theirs.shaft.meas_speed()) < 5e-3
    assert T_S == load_setup("recommended").parameters()["period_s"]
