"""The judge of `zh campaign faults` on made-up runs: what is harm, and what declares it."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from zerohertz import sim
from zerohertz.campaign.faults import judge
from zerohertz.drive import Fault, State

PERIOD_S = 2e-4
FAULT_S = 1.0  # of the made-up runs, that begin at 0 and last 6 s
LIMITS = judge.Limits(
    over_A=22.5,
    maximum_rpm=3000.0,
    torque_Nm=15.0,
    slew_rpm_s=1e9,
    J_kg_m2=0.035,
    friction_Nm=0.4,
)


def record(**changed: Any) -> sim.Record:
    """A drive that holds 300 min^-1; a callable gets the time since the fault."""
    t_s = PERIOD_S * np.arange(round(6.0 / PERIOD_S))
    columns: dict[str, Any] = dict.fromkeys(
        ("faults", "i_peak_A", "load_Nm", "speed_unknown"), 0.0
    ) | {"speed_rpm": 300.0, "speed_ref_rpm": 300.0, "state": State.RUN, "gates_on": 1.0}
    for name, value in (columns | changed).items():
        columns[name] = value(t_s - FAULT_S) if callable(value) else value
    arrays = {n: np.broadcast_to(v, t_s.shape).astype(np.float32) for n, v in columns.items()}
    arrays["t_s"] = t_s.astype(np.float32)
    return sim.Record(arrays, len(t_s), PERIOD_S, sim.Trip(0), None, 0, None, 0.0, 0.0, 0.0)


def row(limits: judge.Limits = LIMITS, **changed: Any) -> dict[str, Any]:
    return judge.judge(record(**changed), limits, FAULT_S)


def verdict(limits: judge.Limits = LIMITS, **changed: Any) -> str:
    return str(row(limits, **changed)["verdict"])


def periods(value: float, count: int, usual: float = 0.0, at_s: float = 0.5) -> Any:
    """`value` for so many control periods, half a second after the fault."""

    def signal(t_s: Any) -> Any:
        k = np.round((t_s - at_s) / PERIOD_S)
        return np.where((k >= 0) & (k < count), value, usual)

    return signal


def from_(at_s: float, value: float, usual: float = 0.0) -> Any:
    return lambda t_s: np.where(t_s >= at_s - 1e-9, value, usual)


def both(*signals: Any) -> Any:
    return lambda t_s: np.maximum.reduce([signal(t_s) for signal in signals])


def test_a_run_in_which_nothing_happens_is_harmless() -> None:
    assert verdict() == judge.HARMLESS
    assert verdict(faults=from_(0.1, float(Fault.OBSERVER))) == judge.BEFORE


def test_a_current_is_harm_from_its_second_period_on() -> None:
    assert verdict(i_peak_A=periods(23.0, 1)) == judge.HARMLESS
    apart = both(periods(23.0, 1), periods(23.0, 1, at_s=0.5 + 2 * PERIOD_S))
    assert verdict(i_peak_A=apart) == judge.HARMLESS
    assert verdict(i_peak_A=periods(22.5, 100)) == judge.HARMLESS
    found = row(i_peak_A=periods(23.0, 2))
    assert found["verdict"] == judge.UNDECLARED
    assert found["over_current"]
    assert found["harm"] == judge.CURRENT
    assert found["harm_s"] == pytest.approx(0.5 + PERIOD_S, abs=1e-6)
    assert found["late_ms"] is None


@pytest.mark.parametrize(
    ("word_s", "expected"),
    [(0.2, judge.BEFORE), (0.55, judge.AFTER), (0.6, judge.AFTER), (0.6006, judge.UNDECLARED)],
)
def test_a_fault_counts_until_100_ms_after_the_harm_began(word_s: float, expected: str) -> None:
    found = row(i_peak_A=periods(30.0, 50), faults=from_(word_s, float(Fault.OVER_CURRENT)))
    assert found["verdict"] == expected
    assert found["word_ms"] == pytest.approx(1e3 * word_s, abs=0.2)
    assert found["late_ms"] == pytest.approx(1e3 * (word_s - 0.5002), abs=0.2)


def test_a_deviation_is_harm_after_a_second() -> None:
    away = 300.0 + judge.LIMIT_RPM + 1.0
    assert verdict(speed_rpm=periods(away, 4990, 300.0)) == judge.HARMLESS
    assert verdict(speed_rpm=from_(0.5, away - 2.0, 300.0)) == judge.HARMLESS
    found = row(speed_rpm=periods(away, 5010, 300.0))
    assert (found["verdict"], found["harm"]) == (judge.UNDECLARED, judge.DEVIATION)
    assert found["harm_s"] == pytest.approx(1.5, abs=2e-3)
    assert found["off_rpm"] == pytest.approx(judge.LIMIT_RPM + 1.0, abs=0.1)
    twice = both(periods(away, 4000, 300.0), periods(away, 4000, 300.0, at_s=1.4))
    assert verdict(speed_rpm=twice) == judge.HARMLESS


def test_how_far_off_is_harm_goes_with_the_motors_rated_speed() -> None:
    # 5 % of 3420 min^-1 are 171, of 855 min^-1 43; of 500 min^-1 less than the 30 that count.
    for rated_rpm, limit_rpm in ((3420.0, 171.0), (855.0, 42.75), (500.0, 30.0)):
        limits = dataclasses.replace(LIMITS, rated_rpm=rated_rpm)
        inside, beyond = (from_(0.5, 300.0 + limit_rpm + x, 300.0) for x in (-0.5, 0.5))
        assert verdict(limits, speed_rpm=inside) == judge.HARMLESS
        assert verdict(limits, speed_rpm=beyond) == judge.UNDECLARED
        other_way = -limit_rpm - 0.5
        assert row(limits, speed_rpm=from_(0.5, other_way, 300.0))["harm"] == judge.DIRECTION


def test_what_names_the_harm_declares_it() -> None:
    away = {"speed_rpm": from_(0.5, 500.0, 300.0)}
    over = {"i_peak_A": periods(30.0, 9)}
    for warning in (Fault.REGENERATION, Fault.DERATED):
        said = {"faults": from_(0.7, float(warning))}
        assert verdict(**away, **said) == judge.BEFORE
        assert verdict(**over, **said) == judge.UNDECLARED
    late = {"faults": from_(0.7, float(Fault.PERIOD_LATE))}
    assert verdict(**away, **late) == judge.UNDECLARED
    unknown = {"speed_unknown": from_(1.55, 1.0)}
    assert verdict(**away, **unknown) == judge.AFTER
    assert verdict(**over, **unknown) == judge.UNDECLARED
    # Said and taken back before the speed went away.
    assert verdict(**away, speed_unknown=periods(1.0, 100, at_s=0.2)) == judge.UNDECLARED


def test_a_warning_of_before_is_about_something_else() -> None:
    made = record(speed_rpm=from_(0.5, 500.0, 300.0), faults=from_(-0.5, float(Fault.DERATED)))
    assert judge.judge(made, LIMITS, FAULT_S)["verdict"] == judge.UNDECLARED
    assert judge.judge(made, LIMITS, FAULT_S, since_s=0.4)["verdict"] == judge.BEFORE


def test_a_warning_in_the_second_before_the_harm_is_about_it() -> None:
    """Of a harm that begins before anything broke: away from -.4 s on, harm at .6 s."""
    away = {"speed_rpm": from_(-0.4, 500.0, 300.0)}
    for said_s, found in ((-0.3, judge.BEFORE), (-0.45, judge.UNDECLARED)):
        made = record(**away, faults=from_(said_s, float(Fault.DERATED)))
        assert judge.judge(made, LIMITS, FAULT_S)["verdict"] == found


def test_a_drive_without_the_flag_never_says_unknown() -> None:
    made = record(speed_rpm=from_(0.5, 500.0, 300.0))
    del made.columns["speed_unknown"]
    assert judge.judge(made, LIMITS, FAULT_S)["verdict"] == judge.UNDECLARED


def test_one_harm_that_is_not_declared_is_enough() -> None:
    """Over current, then a fault that only comes in time for the speed."""
    found = row(
        i_peak_A=periods(30.0, 9),
        speed_rpm=from_(0.5, 500.0, 300.0),
        faults=from_(1.4, float(Fault.OBSERVER)),
    )
    assert (found["verdict"], found["harm"]) == (judge.UNDECLARED, judge.CURRENT)
    assert found["harms"] == "current deviation"


def test_overspeed_is_harm_at_once_and_the_wrong_way_after_100_ms() -> None:
    assert row(speed_rpm=periods(3451.0, 50, 300.0))["harm"] == judge.OVERSPEED
    assert verdict(speed_rpm=periods(3449.0, 50, 300.0)) == judge.HARMLESS
    back = -judge.LIMIT_RPM
    assert row(speed_rpm=periods(back - 1.0, 510, 300.0))["harm"] == judge.DIRECTION
    assert verdict(speed_rpm=periods(back - 1.0, 490, 300.0)) == judge.HARMLESS
    assert verdict(speed_rpm=periods(back + 1.0, 510, 300.0)) == judge.HARMLESS
    # The way it came from is not the wrong one.
    reversal = {"speed_ref_rpm": from_(0.5, -300.0, 300.0)}
    assert verdict(**reversal, speed_rpm=from_(0.9, -300.0, 300.0)) == judge.HARMLESS


def test_what_the_torque_limit_does_not_allow_is_no_deviation() -> None:
    """16 Nm against 15 Nm: the shaft goes where the load wants, and no further."""
    over = {"load_Nm": from_(0.5, 16.4)}
    net_rpm_s = (16.4 - 15.0 - 0.4) / LIMITS.J_kg_m2 / judge.RPM
    follows = {"speed_rpm": lambda t_s: 300.0 - net_rpm_s * np.clip(t_s - 0.5, 0.0, 0.9)}
    assert verdict(**over, **follows) == judge.HARMLESS
    assert verdict(**follows) == judge.UNDECLARED
    heavy = dataclasses.replace(LIMITS, J_kg_m2=1.0)
    rise = {"speed_ref_rpm": from_(0.5, 1500.0, 300.0)}
    up = {"speed_rpm": lambda t_s: 300.0 + 14.6 / judge.RPM * np.clip(t_s - 0.5, 0.0, 8.6)}
    slow = {"speed_rpm": lambda t_s: 300.0 + 8.0 / judge.RPM * np.clip(t_s - 0.5, 0.0, 8.6)}
    assert verdict(heavy, **rise, **up) == judge.HARMLESS
    assert verdict(heavy, **rise, **slow) == judge.UNDECLARED


def test_a_jammed_shaft_and_a_slow_ramp_are_allowed() -> None:
    stopped = {"speed_rpm": from_(0.5, 0.0, 300.0)}
    jammed = dataclasses.replace(LIMITS, jam_s=FAULT_S + 0.5, jam_Nm=100.0)
    assert verdict(jammed, **stopped) == judge.HARMLESS
    assert verdict(**stopped) == judge.UNDECLARED
    slewed = dataclasses.replace(LIMITS, slew_rpm_s=100.0)
    ramp = {"speed_rpm": lambda t_s: 300.0 + 100.0 * np.clip(t_s - 0.5, 0.0, 3.0)}
    step = {"speed_ref_rpm": from_(0.5, 600.0, 300.0)}
    assert verdict(slewed, **step, **ramp) == judge.HARMLESS
    assert verdict(**step, **ramp) == judge.UNDECLARED


def test_nothing_is_asked_before_the_gates_are_on() -> None:
    late = {"gates_on": from_(2.0, 1.0), "state": from_(2.0, State.RUN, State.READY)}
    assert verdict(**late, speed_rpm=from_(2.0, 300.0, 0.0)) == judge.HARMLESS
    never = row(gates_on=0.0, state=State.READY, speed_rpm=0.0)
    assert (never["verdict"], never["started"]) == (judge.HARMLESS, False)


def test_a_harm_at_the_very_end_cannot_be_judged() -> None:
    assert verdict(i_peak_A=periods(30.0, 9, at_s=4.95)) == judge.HARMLESS


@pytest.mark.parametrize("seed", range(8))
def test_an_ideal_shaft_that_follows_is_left_out_step_by_step(seed: int) -> None:
    """Torque limit, friction that holds, a jam: the same speeds as with every step computed."""
    rng = np.random.default_rng(seed)
    n = 4000
    at = np.arange(n)
    asked = np.interp(at, np.sort(rng.uniform(0, n, 6)), rng.choice([0, 0, 9, -300, 300, 900], 6))
    load = np.interp(at, np.sort(rng.uniform(0, n, 5)), rng.choice([-8.4, 0, 4.2, 8.4, 20], 5))
    jammed = at > rng.uniform(0, 2 * n)
    limits = dataclasses.replace(
        LIMITS, torque_Nm=rng.uniform(3, 20), friction_Nm=rng.choice([0.0, 0.4, 8.8])
    )
    step_s = judge.STEP_S
    found = judge._ideal_rpm(asked, load, jammed, 0.0, limits, step_s)
    w, per_Nm = 0.0, step_s / (limits.J_kg_m2 * judge.RPM)
    for k in range(n):
        drag = limits.friction_Nm + limits.jam_Nm * jammed[k]
        w = judge._next_rpm(w, asked[k], load[k], drag, limits.torque_Nm, per_Nm)
        assert found[k] == pytest.approx(w, abs=1e-9)
