"""PAPER_OUTCOMES in code: each clause is violated alone, each threshold is met from both sides."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from zerohertz import sim
from zerohertz.scenario import predicates as p
from zerohertz.scenario.signals import (
    Signals,
    lost_at_s,
    ripple,
    sustained,
    worst_share,
)

STEP_S = 2e-3
T0_S = 10.0


def step_signals(**changes) -> Signals:
    """A quiet run of protocol S: 300, a ramp of 1 s down to 0, then 0, for all signals."""
    t_s = np.arange(0.0, T0_S + 30.0 + STEP_S / 2, STEP_S)
    base = {
        "event_s": T0_S,
        "i_q_limit_A": 15.0,
        "lambda_max_Wb": 2.0,
        "speed_hat_max_rpm": 3000.0,
        "trip": 0,
        "trip_s": np.nan,
        "first_fault": 0,
        "t_s": t_s,
        "speed_ref_rpm": np.where(t_s < T0_S, 300.0, 0.0),
        "speed_rpm": np.clip(300.0 * (1.0 - (t_s - T0_S)), 0.0, 300.0),
        "speed_hat_rpm": np.clip(300.0 * (1.0 - (t_s - T0_S)), 0.0, 300.0),
        "i_q_ref_A": np.full_like(t_s, 4.0),
        "i_q_A": np.full_like(t_s, 4.0),
        "load_Nm": np.full_like(t_s, 4.2),
        "f_s_Hz": np.ones_like(t_s),
        "i_abs_A": np.full_like(t_s, 6.0),
        "lambda_hat_Wb": np.full_like(t_s, 0.5),
        "faults": np.zeros_like(t_s),
    }
    return Signals(**(base | changes))


def ramp_signals(lost_s: float = 60.0, f_s_Hz: float = 0.1) -> Signals:
    """Protocol R, ramp from t = 5 s; the speed runs away at lost_s after that."""
    t_s = np.arange(0.0, 85.0 + STEP_S / 2, STEP_S)
    since_s = t_s - 5.0
    return Signals(
        event_s=5.0,
        i_q_limit_A=15.0,
        lambda_max_Wb=2.0,
        speed_hat_max_rpm=3000.0,
        trip=0,
        trip_s=np.nan,
        first_fault=0,
        t_s=t_s,
        speed_ref_rpm=np.full_like(t_s, 60.0),
        speed_rpm=np.where(since_s > lost_s, 500.0, 60.0),
        speed_hat_rpm=np.full_like(t_s, 60.0),
        i_q_ref_A=np.full_like(t_s, -4.0),
        i_q_A=np.full_like(t_s, -4.0),
        load_Nm=-8.4 * np.clip(since_s / 40.0, 0.0, 1.0),
        f_s_Hz=np.full_like(t_s, f_s_Hz),
        i_abs_A=np.full_like(t_s, 6.0),
        lambda_hat_Wb=np.full_like(t_s, 0.5),
        faults=np.zeros_like(t_s),
    )


def during(signals: Signals, start_s: float, end_s: float, name: str, value) -> Signals:
    """One signal changed between two times after t0."""
    changed = getattr(signals, name).copy()
    since_s = signals.t_s - signals.event_s
    inside = (since_s >= start_s) & (since_s < end_s)
    changed[inside] = value(since_s[inside]) if callable(value) else value
    return dataclasses.replace(signals, **{name: changed})


def sine(amplitude: float, mean: float = 0.0, f_Hz: float = 3.0):
    return lambda t_s: mean + amplitude * np.sin(2.0 * np.pi * f_Hz * t_s)


def holds(figure: int, tight: float = 0.0, **signals: Signals) -> bool:
    measures = {int(k[1:]): p.measure(int(k[1:]), s) for k, s in signals.items()}
    return all(c.holds for c in p.clauses(figure, measures, tight))


# ---- measuring --------------------------------------------------------------------------------


@pytest.mark.parametrize("f_Hz", [2.0, 5.0, 20.0])
def test_ripple_of_a_sine_is_its_rms(f_Hz):
    signals = during(step_signals(), -10.0, 31.0, "i_q_A", sine(1.0, 4.0, f_Hz))
    # Second order at 0.5 Hz passes |H|^2 = (f/f_c)^4 / (1 + (f/f_c)^4).
    gain = np.sqrt((f_Hz / 0.5) ** 4 / (1.0 + (f_Hz / 0.5) ** 4))
    assert ripple(signals, signals.i_q_A) == pytest.approx(gain / np.sqrt(2.0), rel=0.01)


def test_ripple_ignores_slow_wander_and_the_step_itself():
    wander = during(step_signals(), 0.0, 31.0, "speed_rpm", sine(50.0, 0.0, 0.02))
    assert ripple(wander, wander.speed_rpm) < 0.15
    quiet = step_signals()
    assert ripple(quiet, quiet.speed_rpm) < 1e-3


def test_ripple_sees_only_from_8_s_after_the_step():
    early = during(step_signals(), 0.0, 6.0, "speed_rpm", sine(80.0))
    assert ripple(early, early.speed_rpm) < 0.1


def test_sustained_is_the_level_kept_for_the_whole_time():
    values = np.zeros(1000)
    values[100:201] = 7.0
    assert sustained(values, 0.2, STEP_S) == 7.0
    assert sustained(values, 0.204, STEP_S) == 0.0
    assert np.isnan(sustained(values[:50], 0.2, STEP_S))


def test_sustained_sees_both_ends_of_the_record():
    values = np.zeros(500)
    values[:101] = 3.0
    assert sustained(values, 0.2, STEP_S) == 3.0
    assert sustained(values[::-1], 0.2, STEP_S) == 3.0


def test_an_empty_window_measures_nothing():
    """0 would be the best of values for a clause "at most"."""
    assert np.isnan(sustained(np.array([]), 0.2, STEP_S))
    assert np.isnan(worst_share(np.array([], dtype=bool), 1.0, STEP_S))
    assert np.isnan(worst_share(np.ones(100, dtype=bool), 1.0, STEP_S))  # .2 s is no second


def test_worst_share_finds_the_worst_second():
    flags = np.zeros(5000, dtype=bool)
    flags[2000:2300] = True
    assert worst_share(flags, 1.0, STEP_S) == pytest.approx(0.6)


def test_lost_by_speed_or_by_current_limit():
    assert lost_at_s(ramp_signals(20.0), 100.0, 0.3) == pytest.approx(20.0, abs=2 * STEP_S)
    limited = during(ramp_signals(1e9), 30.0, 30.31, "i_q_ref_A", -15.0)
    assert lost_at_s(limited, 100.0, 0.3) == pytest.approx(30.3, abs=2 * STEP_S)
    short = during(ramp_signals(1e9), 30.0, 30.29, "i_q_ref_A", -15.0)
    assert lost_at_s(short, 100.0, 0.3) == np.inf


# ---- protocol S -------------------------------------------------------------------------------


@pytest.mark.parametrize("figure", [10, 16])
def test_a_quiet_run_is_stable_and_not_unstable(figure):
    assert holds(figure, **{f"f{figure}": step_signals()})
    assert holds(figure, p.TIGHT, **{f"f{figure}": step_signals()})
    assert not holds(8, f8=step_signals())


STABLE_VIOLATIONS = {
    "over_speed": (2.0, 2.01, "speed_rpm", 3001.0),
    "over_current": (5.0, 5.01, "i_abs_A", 61.0),
    "pre": (-0.5, -0.4, "speed_rpm", 239.0),
    "swing_low": (1.5, 1.6, "speed_rpm", -151.0),
    "swing_high": (0.1, 0.2, "speed_rpm", 351.0),
    "hold": (20.0, 20.01, "speed_rpm", 61.0),
    "hold_end": (29.99, 30.01, "speed_rpm", 61.0),
    "limit_share": (3.0, 4.5, "i_q_ref_A", -15.0),
    "ripple_w_hat": (3.0, 31.0, "speed_hat_rpm", sine(90.0)),
    "ripple_i_q": (3.0, 31.0, "i_q_A", sine(3.0)),
    "not_a_number": (9.0, 31.0, "speed_rpm", np.nan),
}


TRIPS = pytest.mark.parametrize("trip", list(sim.Trip), ids=lambda t: t.name)


@TRIPS
def test_a_trip_between_two_samples_is_seen(trip):
    """The record is every fifth step; its trip is of all."""
    tripped = dataclasses.replace(step_signals(), trip=int(trip), trip_s=20.0)
    assert not holds(10, f10=tripped)
    assert holds(8, f8=tripped)


@TRIPS
def test_only_a_trip_without_threshold_has_margin(trip):
    tripped = dataclasses.replace(step_signals(), trip=int(trip), trip_s=20.0)
    beyond_thresholds = trip not in (sim.Trip.SPEED, sim.Trip.CURRENT)
    assert holds(8, p.TIGHT, f8=tripped) is beyond_thresholds


def test_a_fault_is_the_trips_and_not_the_columns():
    """The column is the sampled one: what counts is the simulation's own account."""
    assert holds(10, f10=during(step_signals(), 5.0, 5.1, "faults", 1.0))


def test_a_trip_is_named():
    assert p.trip_text(0, 0) is None
    assert p.trip_text(1, 64) == "over speed"
    assert p.trip_text(1 | 4, 1) == "over current, |i| > 60 A"
    assert p.trip_text(2 | 8, 0) == "|w| > 3000 min^-1, plant diverged"


BOUNDS = {
    "flux": ("lambda_hat_Wb", 1.97),
    "speed": ("speed_hat_rpm", -2990.0),
}


@pytest.mark.parametrize("name", BOUNDS)
def test_an_estimate_that_stands_at_its_bound_is_no_match(name):
    column, value = BOUNDS[name]
    held = during(step_signals(), 3.0, 4.5, column, value)  # 5.6 % of the hold
    assert p.measure_step(held).flux_bound_share == pytest.approx(1.5 / 27.0, rel=0.01)
    for figure in p.STABLE_FIGURES:
        judgement = p.judge(figure, dict.fromkeys(p.FIGURES, p.measure_step(held)))
        assert p.NOT_HELD_TEXT in [c.text for c in judgement.failing]
    assert p.NOT_HELD_TEXT in [c.text for c in p.judge_held(p.measure_step(held)).failing]
    seldom = during(step_signals(), 3.0, 4.2, column, value)
    assert p.NOT_HELD_TEXT not in [c.text for c in p.judge(10, {10: p.measure(10, seldom)}).failing]


def test_our_own_condition_leaves_the_predicates_alone():
    held = during(step_signals(), 3.0, 30.0, "lambda_hat_Wb", 2.0)
    assert holds(10, p.TIGHT, f10=held)
    unstable = during(held, 10.0, 11.0, "speed_rpm", 150.0)
    assert p.judge(8, {8: p.measure(8, unstable)}).match


@pytest.mark.parametrize("name", STABLE_VIOLATIONS)
def test_each_clause_of_stable_alone_breaks_it(name):
    assert not holds(10, f10=during(step_signals(), *STABLE_VIOLATIONS[name]))


@pytest.mark.parametrize("end_s", [-2.0, 1.0, 5.0, 20.0, 29.9])
def test_a_record_that_ends_early_is_never_stable(end_s):
    whole = step_signals()
    kept = slice(0, int((T0_S + end_s) / STEP_S))
    arrays = {
        f.name: getattr(whole, f.name)[kept]
        for f in dataclasses.fields(Signals)
        if isinstance(getattr(whole, f.name), np.ndarray)
    }
    cut = dataclasses.replace(whole, **arrays)
    assert not holds(10, f10=cut)
    assert not holds(8, f8=cut)


STABLE_ALLOWANCES = {
    "pre_before_its_second": (-1.1, -1.05, "speed_rpm", 200.0),
    "swing": (1.5, 1.6, "speed_rpm", -149.0),
    "between_swing_and_hold": (2.9, 2.95, "speed_rpm", 340.0),
    "hold": (20.0, 20.01, "speed_rpm", 59.0),
    "limit_share": (3.0, 4.3, "i_q_ref_A", -15.0),
    "ripple_w_hat": (3.0, 31.0, "speed_hat_rpm", sine(83.0)),
    "ripple_i_q": (3.0, 31.0, "i_q_A", sine(2.8)),
}


@pytest.mark.parametrize("name", STABLE_ALLOWANCES)
def test_stable_allows_what_it_states(name):
    assert holds(10, f10=during(step_signals(), *STABLE_ALLOWANCES[name]))


@pytest.mark.parametrize(
    ("name", "change"),
    {
        "hold": (20.0, 20.01, "speed_rpm", 59.0),
        "swing": (1.5, 1.6, "speed_rpm", -149.0),
        "limit_share": (3.0, 4.34, "i_q_ref_A", -15.0),
        "ripple_i_q": (3.0, 31.0, "i_q_A", sine(2.8)),
    }.items(),
)
def test_a_match_needs_two_percent_of_margin(name, change):
    signals = during(step_signals(), *change)
    assert holds(10, f10=signals)
    assert not holds(10, p.TIGHT, f10=signals)


UNSTABLE_WAYS = {
    "runs_away": (10.0, 10.52, "speed_rpm", 150.0),
    "limit": (10.0, 10.53, "i_q_ref_A", 15.0),
    "over_speed": (10.0, 10.01, "speed_rpm", -3100.0),
    "over_current": (10.0, 10.01, "i_abs_A", 62.0),
}


@pytest.mark.parametrize("figure", [8, 9, 13, 14, 15])
@pytest.mark.parametrize("name", UNSTABLE_WAYS)
def test_each_way_to_be_unstable(figure, name):
    signals = during(step_signals(), *UNSTABLE_WAYS[name])
    assert holds(figure, p.TIGHT, **{f"f{figure}": signals})


@pytest.mark.parametrize(
    "change",
    [
        (10.0, 10.49, "speed_rpm", 150.0),  # too short
        (10.0, 11.0, "speed_rpm", 99.0),  # too small
        (0.0, 1.4, "speed_rpm", 150.0),  # only .4 s of it after the first second
        (10.0, 10.49, "i_q_ref_A", 15.0),  # less than half a second
        (0.0, 1.4, "i_q_ref_A", 15.0),  # the step itself
    ],
)
def test_what_is_not_yet_unstable(change):
    assert not holds(8, f8=during(step_signals(), *change))


def test_unstable_at_the_edge_does_not_survive_tightening():
    for change in [
        (10.0, 10.505, "speed_rpm", 150.0),
        (10.0, 11.0, "speed_rpm", 101.0),
        (10.0, 10.505, "i_q_ref_A", 15.0),
    ]:
        signals = during(step_signals(), *change)
        assert holds(8, f8=signals)
        assert not holds(8, p.TIGHT, f8=signals)


@pytest.mark.parametrize("figure", [8, 9, 13, 14, 15])
def test_a_drive_that_never_starts_matches_nothing(figure):
    signals = during(step_signals(), -11.0, 31.0, "speed_rpm", 0.0)
    signals = dataclasses.replace(signals, trip=1, trip_s=1.0)
    assert not holds(figure, **{f"f{figure}": signals})


def rippled(w: float, w_hat: float, i_q: float) -> Signals:
    signals = during(step_signals(), 3.0, 31.0, "speed_rpm", sine(w * np.sqrt(2.0)))
    signals = during(signals, 3.0, 31.0, "speed_hat_rpm", sine(w_hat * np.sqrt(2.0)))
    return during(signals, 3.0, 31.0, "i_q_A", sine(i_q * np.sqrt(2.0), 4.0))


def test_figure_6_wants_sustained_ripple_of_all_three():
    assert holds(6, p.TIGHT, f6=rippled(3.2, 3.2, 0.27))
    assert not holds(6, f6=rippled(2.9, 3.2, 0.27))
    assert not holds(6, f6=rippled(3.2, 2.9, 0.27))
    assert not holds(6, f6=rippled(3.2, 3.2, 0.24))
    assert not holds(6, f6=rippled(80.0, 3.2, 0.27))  # not STABLE


def test_figure_7_wants_quiet_and_half_of_figure_6():
    six = rippled(3.2, 3.2, 0.27)
    assert holds(7, p.TIGHT, f6=six, f7=rippled(1.4, 2.3, 0.12))
    assert not holds(7, f6=rippled(9.0, 9.0, 9.0), f7=rippled(1.6, 2.3, 0.12))
    assert not holds(7, f6=rippled(9.0, 9.0, 9.0), f7=rippled(1.4, 2.6, 0.12))
    assert not holds(7, f6=rippled(2.7, 3.2, 0.27), f7=rippled(1.4, 2.3, 0.12))
    assert not holds(7, f6=rippled(3.2, 3.2, 0.23), f7=rippled(1.4, 2.3, 0.12))


def biased(signals: Signals, bias_rpm: float) -> Signals:
    return during(signals, -2.0, 0.0, "speed_hat_rpm", 300.0 + bias_rpm)


def test_figure_11_wants_less_ripple_than_10_and_a_biased_estimate():
    ten = rippled(1.0, 1.0, 1.0)
    assert holds(11, p.TIGHT, f10=ten, f11=biased(rippled(1.0, 1.0, 0.87), 8.3))
    assert not holds(11, f10=ten, f11=biased(rippled(1.0, 1.0, 0.91), 8.3))
    assert not holds(11, f10=ten, f11=biased(rippled(1.0, 1.0, 0.87), 7.9))
    assert holds(11, f10=ten, f11=biased(rippled(1.0, 1.0, 0.87), -8.3))


def test_figure_12_wants_a_small_bias_and_half_of_figure_11():
    eleven = biased(step_signals(), 10.5)
    assert holds(12, p.TIGHT, f11=eleven, f12=biased(step_signals(), 4.8))
    assert not holds(12, f11=biased(step_signals(), 20.0), f12=biased(step_signals(), 5.1))
    assert not holds(12, f11=biased(step_signals(), 9.0), f12=biased(step_signals(), 4.8))


# ---- protocol R -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("lost_s", "nominal", "tight"),
    [
        (9.9, False, False),
        (10.1, True, False),
        (10.5, True, True),
        (38.3, True, True),
        (38.8, True, False),
        (39.5, False, False),
        (60.0, False, False),
        (1e9, False, False),
    ],
)
def test_figure_17_is_lost_inside_the_ramp(lost_s, nominal, tight):
    assert holds(17, 0.0, f17=ramp_signals(lost_s)) is nominal
    assert holds(17, p.TIGHT, f17=ramp_signals(lost_s)) is tight


def test_figure_18_reaches_the_dwell_and_is_lost_in_it():
    assert holds(18, p.TIGHT, f17=ramp_signals(30.0), f18=ramp_signals(60.0))
    assert not holds(18, f17=ramp_signals(30.0), f18=ramp_signals(38.0))
    assert not holds(18, f17=ramp_signals(30.0), f18=ramp_signals(39.6))  # before the dwell
    assert not holds(18, f17=ramp_signals(30.0), f18=ramp_signals(1e9))  # never lost
    assert holds(18, f17=ramp_signals(30.0), f18=ramp_signals(79.5))
    assert not holds(18, p.TIGHT, f17=ramp_signals(30.0), f18=ramp_signals(79.5))


def test_figure_18_ends_the_ramp_near_zero_frequency():
    assert not holds(18, f17=ramp_signals(30.0), f18=ramp_signals(60.0, f_s_Hz=-0.51))
    near = ramp_signals(60.0, f_s_Hz=-0.495)
    assert holds(18, f17=ramp_signals(30.0), f18=near)
    assert not holds(18, p.TIGHT, f17=ramp_signals(30.0), f18=near)


def test_a_frequency_that_swings_about_zero_is_not_near_zero():
    swings = during(ramp_signals(60.0), 38.0, 41.0, "f_s_Hz", sine(2.0, 0.0, 4.0))
    assert abs(p.measure_ramp(swings).f_s_end_Hz) < 0.05
    assert p.measure_ramp(swings).f_s_abs_end_Hz == pytest.approx(4.0 / np.pi, rel=0.02)
    assert not holds(18, f17=ramp_signals(30.0), f18=swings)


def test_figure_18_is_later_than_17_by_time_or_by_torque():
    late = ramp_signals(40.5)
    assert holds(18, p.TIGHT, f17=ramp_signals(37.9), f18=late)  # 5.25 % of T_N, 2.6 s
    assert not holds(18, f17=ramp_signals(38.4), f18=late)
    assert holds(18, p.TIGHT, f17=ramp_signals(45.0), f18=ramp_signals(48.2))  # 3.2 s
    assert not holds(18, f17=ramp_signals(45.0), f18=ramp_signals(47.9))
    assert not holds(18, f17=ramp_signals(1e9), f18=ramp_signals(60.0))


def test_a_judgement_is_the_tightened_verdict_and_names_the_reason():
    measures = {10: p.measure(10, during(step_signals(), 20.0, 20.1, "speed_rpm", 59.0))}
    judgement = p.judge(10, measures)
    assert not judgement.match
    assert [c.text for c in judgement.failing] == ["|w - w*| in hold"]
    assert judgement.margin == pytest.approx((58.8 - 59.0) / 58.8)
    assert judgement.measured["hold_error_rpm"] == pytest.approx(59.0)


def test_tightening_never_turns_a_failure_into_a_match():
    rng = np.random.default_rng(7)
    for _ in range(60):
        six = rippled(*rng.uniform(0.1, 7.0, 2), rng.uniform(0.05, 0.6))
        kind = ("speed_rpm", "i_q_ref_A")[rng.integers(2)]
        start_s = rng.uniform(0.0, 20.0)
        end_s = start_s + rng.uniform(0.3, 1.5)
        level = rng.uniform(50.0, 130.0) if kind == "speed_rpm" else 15.0
        run = biased(during(six, start_s, end_s, kind, level), rng.uniform(0.0, 12.0))
        measures = {n: p.measure(n, run if n % 2 else six) for n in p.STEP_FIGURES}
        measures |= {n: p.measure(n, ramp_signals(rng.uniform(5.0, 90.0))) for n in (17, 18)}
        for figure in p.FIGURES:
            if all(c.holds for c in p.clauses(figure, measures, p.TIGHT)):
                assert all(c.holds for c in p.clauses(figure, measures, 0.0)), figure
