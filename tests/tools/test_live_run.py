"""Runs operated by hand (zh_sim_change and its neighbours in host_sim/sim_steps.h)."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from zerohertz import sim
from zerohertz.drive import State
from zerohertz.errors import UserError
from zerohertz.scenario import evaluate
from zerohertz.scenario.setup import load_setup, scenario_file
from zerohertz.sim_steps import Steps

HEAD = '[scenario]\nname = "live"\nduration_s = 3600\nrun_on_s = 0.0\n'
PERIODS_PER_S = 5000


def live(speed_rpm: float = 0.0, load_Nm: float = 0.0, faults: str = "") -> str:
    return (
        f"{HEAD}[profiles]\nspeed_ref_rpm = [[0.0, {speed_rpm}]]\n"
        f"load_torque_Nm = [[0.0, {load_Nm}]]\n{faults}"
    )


def job(scenario: str) -> sim.Job:
    setup = load_setup("recommended")
    run = evaluate.Run(setup, 7, 1, guard_acts=True)
    return dataclasses.replace(evaluate.job(run), scenario=scenario)


def run_s(run: Steps, seconds: float, so_far_s: float) -> float:
    run.advance(int((so_far_s + seconds) * PERIODS_PER_S))
    return so_far_s + seconds


def test_a_run_cut_in_pieces_has_the_bits_of_a_whole_one() -> None:
    whole = sim.run(evaluate.job(evaluate.Run(load_setup("recommended"), 16, 1)))
    with Steps(evaluate.job(evaluate.Run(load_setup("recommended"), 16, 1))) as run:
        for steps in range(0, whole.steps + 1, 9973):
            run.advance(steps)
            # The same scenario once more changes nothing.
            run.change(scenario_file("fig16").read_text())
        run.advance(whole.steps)
        record = run.take()
    for name, column in whole.columns.items():
        assert np.array_equal(column, record[name], equal_nan=True), name


def test_speed_and_load_follow_the_hand() -> None:
    with Steps(job(live()), keep_rows=100) as run:
        now_s = run_s(run, 5.0, 0.0)
        assert run.newest("state") == State.RUN
        run.change(live(speed_rpm=300.0))
        now_s = run_s(run, 3.0, now_s)
        assert abs(run.newest("speed_rpm") - 300.0) < 5.0
        run.change(live(speed_rpm=300.0, load_Nm=4.2))
        now_s = run_s(run, 2.0, now_s)
        assert abs(run.newest("torque_Nm") - 4.2) < 1.0
        assert run.newest("t_s") == pytest.approx(now_s, abs=0.002)


def test_a_broken_phase_stops_the_drive_and_a_whole_one_starts_again() -> None:
    broken = '[faults]\nopen_phase = "u"\nopen_s = 0.0\n'
    with Steps(job(live(speed_rpm=300.0)), keep_rows=100) as run:
        now_s = run_s(run, 8.0, 0.0)
        run.change(live(speed_rpm=300.0, faults=broken))
        now_s = run_s(run, 1.0, now_s)
        assert run.faults() != 0
        assert not run.gates_on()
        # The shaft has to stand first; then whole again, the fault reset, and run has been low.
        now_s = run_s(run, 8.0, now_s)
        again = live(speed_rpm=300.0).replace(
            "run_on_s = 0.0", f"run_on_s = {now_s + 0.2}\nfault_reset_s = {now_s}"
        )
        run.change(again)
        run_s(run, 6.0, now_s)
        assert run.faults() == 0
        assert run.gates_on()


def test_what_is_senseless_is_refused_and_the_run_goes_on() -> None:
    with Steps(job(live()), keep_rows=100) as run:
        run_s(run, 5.0, 0.0)
        with pytest.raises(UserError, match="speed_ref_rpm"):
            run.change(live(speed_rpm=1e9))
        with pytest.raises(UserError, match="gates off"):
            run.set("observer_gain_enable", 0.0)
        run.set("eps1", 1.0)
        run_s(run, 0.5, 5.0)
        assert run.newest("state") == State.RUN
    with pytest.raises(UserError, match="rows"):
        Steps(job(live()), keep_rows=0)
