"""A control interrupt that hangs, and what the motor draws meanwhile: FINDINGS A5.

The last duties stay for 3 periods, then the gates are off. tests/fault shows on the emulated core
that they open 1.5 to 2.5 periods after the hang. The table of firmware/guard/README.md, 200 seeds
and phases of each condition: `tools/zh python tests/sil/test_hung_interrupt.py 200`.
"""

from __future__ import annotations

import dataclasses
import sys
from collections.abc import Iterable

import numpy as np
import pytest
from harm import fault_at_s, point_at, recommended

from zerohertz import sim
from zerohertz.atlas.simulate import job_of
from zerohertz.campaign.faults.judge import OVER_PERIODS
from zerohertz.campaign.rig import OVER_PU

PERIODS = 3
AFTER_S = 0.1
CONDITIONS = ((0.0, 1.0), (9.0, 1.0), (60.0, -1.0), (300.0, 1.0), (900.0, 1.0), (900.0, -1.0))
CONDITIONS = (*CONDITIONS, (900.0, 1.4), (1500.0, 1.0), (1500.0, 0.0), (1500.0, -0.9))
CONDITIONS = (*CONDITIONS, (1700.0, 0.5))
INVERTERS = ("averaged", "switched")


@dataclasses.dataclass(frozen=True)
class Outcome:
    before_A: float  # largest leg current in the 20 ms before the hang
    peak_A: float  # from the hang on
    off_periods: int  # after the hang
    harm: bool


def outcome(
    speed_rpm: float, load_pu: float, inverter: str, seed: int, periods: int = PERIODS
) -> Outcome:
    """One run; the duty is the acting voltage, as a switched inverter needs it at speed."""
    plant = {"inverter.model": inverter}
    bench = dataclasses.replace(recommended(), firmware={"voltage_source": 1.0}, plant=plant)
    point = point_at(speed_rpm, load_pu, seed, AFTER_S)
    hang_s = fault_at_s(bench, point)
    given = {"faults.hang_s": hang_s, "faults.hang_periods": periods}
    job = dataclasses.replace(job_of(bench, point), scenario_overrides=given, decimate=1)
    record = sim.run(job)
    t_s = record.t_s.astype(np.float64)
    hung = int(np.argmax(t_s >= hang_s - 1e-6))
    on, leg_A = record["gates_on"] > 0, record["i_peak_A"]
    assert bool(np.all(on[hung - 100 : hung]))
    over = leg_A[hung:] > OVER_PU * bench.i_trip_A
    return Outcome(
        before_A=float(leg_A[hung - 100 : hung].max()),
        peak_A=float(leg_A[hung:].max()),
        off_periods=int(np.argmin(on[hung:])),
        harm=bool(np.any(over[OVER_PERIODS - 1 :] & over[: 1 - OVER_PERIODS])),
    )


@pytest.mark.parametrize("inverter", INVERTERS)
@pytest.mark.parametrize(("speed_rpm", "load_pu"), CONDITIONS)
def test_a_hung_interrupt_does_no_harm(speed_rpm: float, load_pu: float, inverter: str) -> None:
    for seed in range(1, 6):
        seen = outcome(speed_rpm, load_pu, inverter, seed)
        assert seen.off_periods == PERIODS
        assert not seen.harm
        assert seen.peak_A < 20.0  # i_trip_A: not even that


def test_a_watchdog_alone_would_be_too_late() -> None:
    """The negative control: 68 ms, the independent watchdog of before."""
    seen = outcome(1500.0, 1.0, "averaged", 1, periods=340)
    assert seen.harm
    assert seen.peak_A > 60.0


def _shares(values_A: Iterable[float]) -> str:
    ordered = sorted(values_A)
    last = len(ordered) - 1
    return " / ".join(f"{ordered[round(share * last)]:.1f}" for share in (0.5, 0.99, 1.0))


def table(seeds: int) -> None:
    """As published."""
    print("| speed, load | inverter | before, A | from the hang on, A | harm |")
    print("|---|---|---|---|---|")
    for speed_rpm, load_pu in CONDITIONS:
        for inverter in INVERTERS:
            seen = [outcome(speed_rpm, load_pu, inverter, 1 + n) for n in range(seeds)]
            print(
                f"| {speed_rpm:g} min^-1, {100 * load_pu:g} % | {inverter} "
                f"| {_shares(s.before_A for s in seen)} | {_shares(s.peak_A for s in seen)} "
                f"| {sum(s.harm for s in seen)} |"
            )


if __name__ == "__main__":
    table(int(sys.argv[1]))
