"""A table with few solves: the same L, a gamma as low, and nothing taken that does not hold."""

from __future__ import annotations

import math

import numpy as np
import pytest

from zerohertz.gain_design.closed_form import closed_form_gain
from zerohertz.gain_design.cones import InfeasibleError
from zerohertz.gain_design.entries import Entry, design_entries
from zerohertz.gain_design.gamma_positive_real import GammaPositiveReal, Multiplier
from zerohertz.gain_design.machine import gamma_bound
from zerohertz.motor import Motor, load_motor, with_design
from zerohertz.paths import ROOT

MOTORS = [load_motor(ROOT / "gain_tables" / name) for name in ("hasegawa2005", "im_4kw_400v")]
BOTH = pytest.mark.parametrize("motor", MOTORS, ids=lambda m: m.name)
# Two rooms of .1 %: of what is tried over what is expected, and of that over the least gamma.
GAMMA_TOLERANCE = 2.5e-3


def speeds_rad_s(first_elec_per_min: int, last_elec_per_min: int) -> list[float]:
    return [k * math.pi / 30.0 for k in range(first_elec_per_min, last_elec_per_min + 1, 2)]


def design(motor: Motor, speeds: list[float]) -> tuple[list[Entry], int]:
    return design_entries(motor, speeds, True, lambda _: None)


@BOTH
@pytest.mark.parametrize(
    ("first", "last", "most_solves"),
    [
        pytest.param(0, 200, 70, id="from standstill"),
        pytest.param(600, 1000, 20, id="closed form"),
        pytest.param(3000, 3200, 180, id="stage two from 3060 on"),  # two solves for each L
    ],
)
def test_few_solves_give_the_gains_and_gammas_of_a_solve_at_every_speed(
    motor: Motor, first: int, last: int, most_solves: int
) -> None:
    speeds = speeds_rad_s(first, last)
    entries, solves = design(motor, speeds)
    lmi = GammaPositiveReal(motor)
    for omega_rad_s, entry in zip(speeds, entries, strict=True):
        gain, least = lmi.gain(omega_rad_s)
        np.testing.assert_array_equal(entry.gain, gain)
        assert entry.multiplier is not None
        assert entry.multiplier.gamma == pytest.approx(least.gamma, rel=GAMMA_TOLERANCE)
    assert solves <= most_solves < lmi.solver.solves


@pytest.mark.parametrize("method", ["closed_form", "zero"])
def test_methods_without_lmi_solve_for_the_certificate_alone(method: str) -> None:
    motor, speeds = with_design(MOTORS[0], method=method), speeds_rad_s(600, 1000)
    assert 0 < design(motor, speeds)[1] <= 20
    assert design_entries(motor, speeds, False, lambda _: None)[1] == 0


def test_where_no_x_exists_every_speed_is_tried() -> None:
    outside = with_design(MOTORS[0], method="closed_form", p1_per_s=-1650.0)  # of a disc of 1500
    entries, solves = design(outside, speeds_rad_s(600, 640))
    assert [entry.multiplier for entry in entries] == [None] * 21
    assert solves == 21


def test_progress_counts_every_entry_once() -> None:
    seen: list[int] = []
    design_entries(MOTORS[0], speeds_rad_s(600, 1000), True, seen.append)
    assert seen == list(range(1, 202))


@BOTH
@pytest.mark.parametrize("elec_per_min", [600, 1000, 3060, 3600])
def test_gamma_bound_is_just_below_the_gamma_of_the_closed_form(
    motor: Motor, elec_per_min: int
) -> None:
    omega_rad_s, d = elec_per_min * math.pi / 30.0, motor.design
    gain = closed_form_gain(motor.circuit, omega_rad_s, p1_per_s=d.p1_per_s, a=d.a, b=d.b)
    bound = gamma_bound(motor.circuit, d.dw0_rad_s, omega_rad_s, gain)
    gamma = GammaPositiveReal(motor).multiplier(omega_rad_s, gain).gamma
    assert gamma * (1.0 - 1e-4) <= bound <= gamma


@BOTH
def test_a_guess_that_does_not_hold_changes_nothing(motor: Motor) -> None:
    omega_rad_s, lmi = 60.0, GammaPositiveReal(motor)
    gain, least = lmi.gain(omega_rad_s)
    inverse = Multiplier(least.gamma, np.linalg.inv(least.X))
    negative = Multiplier(least.gamma, -least.X)
    of_standstill = lmi.gain(0.0)[1]
    too_hopeful = Multiplier(0.99 * least.gamma, least.X)
    for guess in (inverse, negative, of_standstill, too_hopeful):
        before = lmi.solver.solves
        again = lmi.multiplier(omega_rad_s, gain, guess)
        assert lmi.solver.solves == before + 1
        assert again.gamma == least.gamma
        np.testing.assert_array_equal(again.X, least.X)


@BOTH
def test_the_x_of_a_solve_proves_its_own_gamma_and_no_other_gain(motor: Motor) -> None:
    omega_rad_s, lmi = 60.0, GammaPositiveReal(motor)
    gain, least = lmi.gain(omega_rad_s)
    proven = lmi.with_X_of(least, omega_rad_s, gain)
    assert proven is not None
    assert proven.gamma == pytest.approx(least.gamma, rel=1e-4)
    np.testing.assert_allclose(proven.P, least.P, rtol=1e-12)
    unstable = gain * -1.0
    assert lmi.with_X_of(least, omega_rad_s, unstable) is None
    with pytest.raises(InfeasibleError):
        lmi.multiplier(omega_rad_s, unstable, least)
