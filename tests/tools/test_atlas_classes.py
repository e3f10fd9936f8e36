"""zerohertz.atlas.classes on runs made by hand: every class, and both sides of its limits."""

import dataclasses

import numpy as np
import pytest

from zerohertz.atlas.classes import Confidence, Trace, judge
from zerohertz.drive import State

STEP_S = 1e-3
T_S = np.arange(-0.5, 5.0, STEP_S)
LAST_2_S = T_S >= 3.0


def trace(**changes) -> Trace:
    """Five seconds without a flaw, changed where a test says so."""
    n = len(T_S)
    good = {
        "t_s": T_S,
        "step_s": STEP_S,
        "error_rpm": np.zeros(n),
        "angle_err_deg": np.full(n, 5.0),
        "lambda_Wb": np.full(n, 0.5),
        "lambda_hat_Wb": np.full(n, 0.5),
        "f_s_Hz": np.full(n, 10.0),
        "i_abs_A": np.full(n, 8.0),
        "state": np.full(n, State.RUN),
        "gates_on": np.ones(n),
        "confidence": np.full(n, Confidence.CLOSED),
    }
    return Trace(**(good | changes))


def where(mask, yes, no=0.0):
    return np.where(mask, yes, no)


def judged(run: Trace, trip: bool = False):
    return judge(run, loaded_s=5.0, judged_s=2.0, i_trip_A=20.0, trip=trip)


def stopped(at_s: float, **changes) -> Trace:
    off = at_s <= T_S
    return trace(
        state=where(off, State.FAULT, State.RUN),
        gates_on=where(off, 0.0, 1.0),
        error_rpm=where(off, -600.0),
        **changes,
    )


def test_a_run_without_a_flaw_is_oriented_and_not_silent():
    found = judged(trace())
    assert (found.outcome, found.silent, found.started) == ("oriented", False, True)
    assert found.oriented_share == 1.0
    assert found.closed_share == 1.0
    assert found.above_1Hz_s == found.closed_above_1Hz_s == pytest.approx(5.0, abs=2 * STEP_S)


@pytest.mark.parametrize(
    ("error_rpm", "held"),
    [
        (where(LAST_2_S, 29.0), True),
        (where(LAST_2_S, 31.0), False),
        (where(LAST_2_S, -31.0), False),
        # a sine's standard deviation is its amplitude over sqrt 2
        (20.5 * np.sin(2 * np.pi * 5.0 * T_S), True),
        (22.0 * np.sin(2 * np.pi * 5.0 * T_S), False),
        (where((T_S >= 2.1) & (T_S < 2.2), 149.0), True),
        (where((T_S >= 2.1) & (T_S < 2.2), -151.0), False),
        # in the ramp and the second after it the speed may dip
        (where((T_S >= 0.5) & (T_S < 1.9), -400.0), True),
        (where(LAST_2_S, np.nan), False),
    ],
)
def test_held_is_mean_and_deviation_at_the_end_and_never_far_off(error_rpm, held):
    assert (judged(trace(error_rpm=error_rpm)).outcome == "oriented") == held


@pytest.mark.parametrize(
    ("changes", "outcome"),
    [
        ({"angle_err_deg": where(LAST_2_S, 24.0)}, "oriented"),
        ({"angle_err_deg": where(LAST_2_S, -26.0)}, "held"),
        ({"lambda_hat_Wb": where(LAST_2_S, 0.62, 0.5)}, "oriented"),
        ({"lambda_hat_Wb": where(LAST_2_S, 0.63, 0.5)}, "held"),
        ({"lambda_hat_Wb": where(LAST_2_S, 0.37, 0.5)}, "held"),
        # 99 % of two seconds: 20 ms may be wrong
        ({"angle_err_deg": where(T_S >= 4.985, 90.0)}, "oriented"),
        ({"angle_err_deg": where(T_S >= 4.975, 90.0)}, "held"),
        ({"angle_err_deg": np.full(len(T_S), np.nan)}, "held"),
    ],
)
def test_oriented_is_angle_and_magnitude_for_99_percent(changes, outcome):
    assert judged(trace(**changes)).outcome == outcome


def test_a_declared_takeover_that_keeps_the_load_is_one():
    impressed = where(T_S >= 2.0, Confidence.IMPRESSED, Confidence.CLOSED)
    off = {"error_rpm": where(LAST_2_S, 60.0), "angle_err_deg": where(T_S >= 2.0, 90.0)}
    found = judged(trace(**off, confidence=impressed))
    assert (found.outcome, found.silent) == ("takeover", False)
    assert found.impressed_share == pytest.approx(0.6, abs=1e-3)
    assert judged(trace(**off)).outcome == "unsafe"
    degraded = np.full(len(T_S), Confidence.DEGRADED)
    assert judged(trace(**off, confidence=degraded)).outcome == "unsafe"
    lost = {"error_rpm": where(LAST_2_S, 200.0), "confidence": impressed}
    assert judged(trace(**lost)).outcome == "unsafe"
    # declared early, withdrawn, and then not held: nobody was told
    early = where((T_S >= 1.0) & (T_S < 2.0), Confidence.IMPRESSED, Confidence.CLOSED)
    assert judged(trace(**off, confidence=early)).outcome == "unsafe"


def test_held_with_a_takeover_is_held():
    impressed = np.full(len(T_S), Confidence.IMPRESSED)
    assert judged(trace(confidence=impressed)).outcome == "oriented"


def test_a_declared_fault_with_gates_off_is_a_safe_stop():
    assert judged(stopped(2.5)).outcome == "safe_stop"
    # the gates went off, but nobody said why
    assert judged(dataclasses.replace(stopped(2.5), state=trace().state)).outcome == "unsafe"
    # said, but the gates stayed on
    assert judged(dataclasses.replace(stopped(2.5), gates_on=np.ones(len(T_S)))).outcome == "unsafe"
    # 25 A per phase are 1.25 x 20 A: beyond what a trip lets through
    assert judged(stopped(2.5, i_abs_A=where(T_S >= 2.4, 30.0))).outcome == "safe_stop"
    assert judged(stopped(2.5, i_abs_A=where(T_S >= 2.4, 31.0))).outcome == "unsafe"
    assert judged(stopped(2.5), trip=True).outcome == "unsafe"


def test_a_trip_is_never_held():
    assert judged(trace(), trip=True).outcome == "unsafe"
    # the speed is right at the end, but the torque was off in between
    gap = where((T_S > 1.2) & (T_S < 1.3), 0.0, 1.0)
    assert judged(trace(gates_on=gap)).outcome == "unsafe"


def test_a_failed_start_is_a_failed_point():
    late = where(T_S < 0.0, 40.0)
    found = judged(trace(error_rpm=late))
    assert (found.started, found.outcome) == (False, "unsafe")
    magnetising = where(T_S < 0.0, State.PREMAGNETISE, State.RUN)
    assert judged(trace(state=magnetising)).started is False
    assert judged(stopped(-0.3)).outcome == "safe_stop"


def test_a_run_that_ended_early_is_not_held():
    short = {
        field.name: value[: len(T_S) - 500]
        for field in dataclasses.fields(Trace)
        if isinstance(value := getattr(trace(), field.name), np.ndarray)
    }
    assert judged(Trace(step_s=STEP_S, **short)).outcome == "unsafe"


@pytest.mark.parametrize(
    ("lost_s", "confidence", "silent"),
    [
        (0.099, Confidence.CLOSED, False),
        (0.102, Confidence.CLOSED, True),
        (2.0, Confidence.DEGRADED, False),
        (2.0, Confidence.IMPRESSED, False),
    ],
)
def test_silent_is_100_ms_of_lost_orientation_while_closed(lost_s, confidence, silent):
    lost = (T_S >= 1.0) & (T_S < 1.0 + lost_s)
    found = judged(
        trace(
            angle_err_deg=where(lost, 120.0),
            confidence=where(lost, confidence, Confidence.CLOSED),
        )
    )
    assert found.outcome == "oriented"
    assert found.silent == silent


@pytest.mark.parametrize(("oriented_s", "silent"), [(0.05, True), (0.15, False)])
def test_a_slipping_pole_is_one_loss(oriented_s, silent):
    """Four times 60 ms lost, with what passes for orientation between them."""
    at_s = T_S % (0.06 + oriented_s)
    lost = (T_S >= 0.0) & (at_s >= oriented_s) & (T_S < 4 * (0.06 + oriented_s))
    assert judged(trace(angle_err_deg=where(lost, 120.0))).silent == silent


def test_doubt_before_it_does_not_hide_a_silent_loss():
    lost = (T_S >= 1.0) & (T_S < 2.0)
    doubt = where((T_S >= 1.0) & (T_S < 1.85), Confidence.DEGRADED, Confidence.CLOSED)
    assert judged(trace(angle_err_deg=where(lost, 120.0), confidence=doubt)).silent


def test_silent_needs_torque_and_counts_from_the_load_on():
    assert not judged(trace(angle_err_deg=where(T_S < 0.0, 120.0))).silent
    assert not judged(stopped(2.0, angle_err_deg=where(T_S >= 2.0, 120.0))).silent


def test_shares_above_one_hertz():
    found = judged(
        trace(
            f_s_Hz=where(T_S < 1.0, 0.5, -3.0),
            confidence=where(T_S >= 3.0, Confidence.DEGRADED, Confidence.CLOSED),
        )
    )
    assert found.above_1Hz_s == pytest.approx(4.0, abs=2 * STEP_S)
    assert found.closed_above_1Hz_s == pytest.approx(2.0, abs=2 * STEP_S)
    assert found.degraded_share == pytest.approx(0.4, abs=1e-3)
