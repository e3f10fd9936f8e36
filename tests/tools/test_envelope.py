"""`zh envelope`: the draw, the missions, what is possible, the measures, and a short sample."""

from __future__ import annotations

import dataclasses
import json
import math
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from zerohertz import sim
from zerohertz.check.certificate import check_entry
from zerohertz.check.stored_table import read_stored_table
from zerohertz.cli import make_app
from zerohertz.drive import Fault, State
from zerohertz.envelope import (
    axes,
    campaign,
    feasible,
    measure,
    mission,
    page,
    plans,
    run,
    why,
)
from zerohertz.envelope.axes import AXES
from zerohertz.envelope.case import Case
from zerohertz.envelope.mission import Change, Hold, Mission, TorqueWindow
from zerohertz.envelope.motors import drive_of
from zerohertz.envelope.plant import TrueMotor, true_motor
from zerohertz.errors import UserError
from zerohertz.gain_design.table import design_table, table_json
from zerohertz.motor import Circuit, load_motor

PERIOD_S = 2e-4
SEED = 2005
SEED_2005 = run.Sample(SEED)
SCALE = measure.Scale(1.0, 8.4)
# One run of each mission, quick to simulate.
SAMPLE = [
    (k, (("inverter", "averaged"), ("motor", "table1"), ("mission", name)))
    for k, name in enumerate(axes.BY_NAME["mission"].choices)
]


def test_a_run_is_the_same_alone_and_among_many() -> None:
    some, many = run.cases_of(SEED_2005, 3, 200)[0], run.cases_of(SEED_2005, 400, 200)
    assert [case.values for case in some] == [case.values for case in many[0][:3]]
    assert many[1][0].index == 200
    assert Case("", 2, SEED).values == some[2].values
    assert Case("", 2, SEED + 1).values != some[2].values
    assert Case("", 2, SEED).noise_seed == some[2].noise_seed


def test_fixing_an_axis_leaves_the_others() -> None:
    free = Case("", 7, SEED)
    fixed = Case("", 7, SEED, (("voltage", "duty"), ("J_ratio", 3.0)))
    others = [axis.name for axis in AXES if axis.name not in ("voltage", "J_ratio")]
    assert fixed.word("voltage") == "duty"
    assert fixed.number("J_ratio") == 3.0
    assert all(free.values[name] == fixed.values[name] for name in others)


def test_a_parameter_that_is_set_has_the_last_word() -> None:
    sample = run.Sample(SEED, {"voltage": "duty"}, {"voltage_source": 0.0, "rs_bias": 1.0})
    told = run.planned(sample.case(5)).job.firmware
    assert (told["voltage_source"], told["rs_bias"]) == (0.0, 1.0)
    assert sample.options == "--seed 2005 --fix voltage=duty --set voltage_source=0 --set rs_bias=1"


def test_every_value_lies_on_its_axis_and_every_choice_comes() -> None:
    drawn = [Case("", k, SEED).values for k in range(400)]
    for axis in AXES:
        values = [row[axis.name] for row in drawn]
        if axis.choices:
            assert set(values) == set(axis.choices), axis.name
        else:
            assert axis.low <= min(values) < max(values) <= axis.high, axis.name
            quarter = 0.25 * (axis.high - axis.low) if not axis.log else 0.0
            assert max(values) - min(values) > quarter, axis.name


@pytest.mark.parametrize(
    ("line", "words"),
    [
        (
            "inverter=ideal",
            "--fix: inverter: 'ideal' is not one of its values: averaged, switched",
        ),
        ("J_ratio=200", "--fix: J_ratio: '200' is not one of its values: 0.4 to 100"),
        ("J_ratio=many", "--fix: J_ratio: 'many' is not one of its values: 0.4 to 100"),
        ("inertia=2", "--fix: no axis 'inertia'; there are motor, "),
        ("inverter", "--fix: 'inverter': write axis=value"),
    ],
)
def test_a_bad_fix_names_axis_and_values(line: str, words: str) -> None:
    with pytest.raises(UserError) as caught:
        axes.fixed([line])
    assert words in str(caught.value)


def limits(Rs_ohm: float = 0.93, Rr_ohm: float = 0.5, **other: Any) -> feasible.Limits:
    motor = TrueMotor(Circuit(Rs_ohm, Rr_ohm, 0.110, 0.102, 0.102), 2, 0.0, 4)
    return feasible.Limits(**({"motor": motor, "i_max_A": 15.8, "flux_Wb": 0.5202} | other))


def test_torque_at_standstill_is_what_the_current_leaves() -> None:
    # i_d = .5202 / .102 = 5.1 A; i_q = sqrt(15.8^2 - 5.1^2) = 14.954 A; 2 x .5202 x 14.954.
    low, high = feasible.torque_range_Nm(limits(), 0.0, 283.0)
    assert high == pytest.approx(15.558, rel=0.02)
    assert low == pytest.approx(-high, rel=1e-9)


def test_torque_far_above_base_speed_is_the_pull_out_torque() -> None:
    # Without resistances: p/2 M^2/(Ls Lr) psi_s^2/(sigma Ls), psi_s = u_dc / sqrt(2) / w.
    ideal = limits(Rs_ohm=1e-6, Rr_ohm=1e-6, i_max_A=50.0, flux_Wb=0.6)
    for u_dc in (283.0, 200.0):
        omega = 2.0 * 400.0
        psi = u_dc / math.sqrt(2.0) / omega
        pull_out = 0.5 * 2.0 * 0.102 / 0.110 * psi**2 / 0.008
        high = feasible.torque_range_Nm(ideal, 400.0, u_dc)[1]
        assert high == pytest.approx(pull_out, rel=0.03)


def test_saturation_iron_and_lost_voltage_take_torque() -> None:
    free = feasible.torque_range_Nm(limits(), 300.0, 283.0)[1]
    iron = feasible.torque_range_Nm(limits(iron_ohm=500.0), 300.0, 283.0)[1]
    lost = feasible.torque_range_Nm(limits(lost_V=10.0), 300.0, 283.0)[1]
    assert iron < free
    assert lost < free
    hard = TrueMotor(Circuit(0.93, 0.5, 0.110, 0.102, 0.102), 2, 0.3, 8)
    assert float(hard.M_H(0.3)) == pytest.approx(0.051)
    soft = dataclasses.replace(hard, soft=True)
    assert float(soft.M_H(0.3)) == pytest.approx(0.051)
    saturated = feasible.torque_range_Nm(limits(motor=hard), 0.0, 283.0)[1]
    assert saturated < feasible.torque_range_Nm(limits(), 0.0, 283.0)[1]


def test_a_brake_resistor_bounds_what_comes_back_and_nothing_else() -> None:
    # 150 rad/s and 1000 W in the resistor: T = -(1000 W + losses) / 150 rad/s. Without resistances
    # nothing is lost, and the current would leave 15.6 Nm.
    ideal = limits(Rs_ohm=1e-6, Rr_ohm=1e-6)
    low, high = feasible.torque_range_Nm(dataclasses.replace(ideal, brake_W=1000.0), 150.0, 283.0)
    assert low == pytest.approx(-1000.0 / 150.0, rel=0.02)
    assert high == feasible.torque_range_Nm(ideal, 150.0, 283.0)[1]
    # Rs takes .93 ohm of (5.1 A)^2 and of i_q^2: less comes back. The legs take voltage alone.
    assert feasible.torque_range_Nm(limits(brake_W=1000.0), 150.0, 283.0)[0] < low - 0.3
    legs = dataclasses.replace(ideal, brake_W=1000.0, lost_V=10.0)
    assert feasible.torque_range_Nm(legs, 150.0, 283.0)[0] == pytest.approx(low, rel=1e-9)


def test_the_impossible_is_told_from_the_possible() -> None:
    def asked(torque_Nm: float, rpm: float, u_dc_V: float = 283.0) -> str:
        one = [np.array([x]) for x in (rpm * math.pi / 30.0, torque_Nm, u_dc_V)]
        return feasible.impossible(limits(), feasible.Demand(*one))

    assert asked(12.0, 300.0) == ""
    assert "20.0 Nm at 300 min^-1" in asked(20.0, 300.0)
    assert asked(-12.0, 300.0) == ""
    assert asked(-20.0, 300.0) != ""
    assert asked(8.4, 1710.0) == ""
    assert asked(8.4, 3420.0) != ""
    assert asked(8.4, 1710.0, 150.0) != ""


@pytest.mark.parametrize(("index", "fixed"), SAMPLE)
def test_a_planned_mission_asks_for_what_there_is(index: int, fixed: Any) -> None:
    case = Case("", index, SEED, fixed)
    plan = plans.plan(case, 4.0)
    assert all(hold.end_s <= plan.end_s + 1e-9 for hold in plan.holds)
    assert plan.holds
    for points in (plan.speed, plan.load, plan.u_dc):
        times = [t for t, _ in points]
        assert times == sorted(times)
    demand = mission.demand(case, plan, drive_of("table1"))
    assert feasible.impossible(mission.limits_of(case), demand) == ""
    # The same with three times the load is not.
    plan.load = [[t, 3.0 * torque + 30.0] for t, torque in plan.load]
    if not plan.torque:
        assert feasible.impossible(
            mission.limits_of(case), mission.demand(case, plan, drive_of("table1"))
        )


def record(**changed: Any) -> sim.Record:
    """Ten seconds in which 300 min^-1 are held with 4 Nm; a callable gets the time."""
    t_s = PERIOD_S * np.arange(round(10.0 / PERIOD_S))
    columns: dict[str, Any] = {
        **dict.fromkeys(("faults", "speed_unknown", "confidence", "flux_angle_err_deg"), 0.0),
        "speed_rpm": 300.0,
        "speed_ref_rpm": 300.0,
        "state": State.RUN,
        "gates_on": 1.0,
        "torque_Nm": 4.0,
        "load_Nm": 4.0,
        "i_peak_A": 8.0,
        "f_s_Hz": 10.0,
        "lambda_Wb": 0.5,
        "lambda_hat_Wb": 0.5,
    }
    for name, value in (columns | changed).items():
        columns[name] = value(t_s) if callable(value) else value
    arrays = {n: np.broadcast_to(v, t_s.shape).astype(np.float32) for n, v in columns.items()}
    arrays["t_s"] = t_s.astype(np.float32)
    return sim.Record(arrays, len(t_s), PERIOD_S, sim.Trip(0), None, 0, None, 0.0, 0.0, 0.0)


MADE_UP = Mission(
    end_s=10.0,
    speed=[[0.0, 300.0]],
    load=[[0.0, 4.0]],
    u_dc=[[0.0, 283.0]],
    holds=[Hold(1.0, 4.0, 300.0), Hold(6.0, 9.0, 300.0)],
    load_steps=[Change(4.0, 6.0, 300.0)],
    ramps=[Change(4.0, 6.0, 300.0, 200.0)],
    torques=[TorqueWindow(6.0, 9.0, 4.2)],
)


def numbers(**changed: Any) -> dict[str, Any]:
    return measure.numbers(record(**changed), MADE_UP, SCALE)


def after(at_s: float, value: float, usual: float) -> Any:
    return lambda t: np.where(t >= at_s, value, usual)


def test_held_is_held_and_each_way_of_losing_it_counts() -> None:
    assert numbers()["held"] is True
    assert numbers(speed_rpm=340.0)["held"] is False  # mean
    assert numbers(speed_rpm=lambda t: 300.0 + 30.0 * np.sin(40.0 * t))["held"] is False
    assert numbers(gates_on=after(9.5, 0.0, 1.0))["held"] is False
    assert numbers(speed_rpm=lambda t: np.where(abs(t - 2.0) < 1e-3, 500.0, 300.0))["held"] is False
    # A swing between the holds is the dip's affair.
    assert numbers(speed_rpm=lambda t: np.where(abs(t - 5.0) < 0.2, 200.0, 300.0))["held"] is True


def test_ripple_counts_between_1_Hz_and_1_kHz() -> None:
    def ripple(f_Hz: float) -> float:
        swing = numbers(torque_Nm=lambda t: 4.0 + 0.84 * np.sin(2.0 * np.pi * f_Hz * t))
        return float(swing["torque_ripple_pu"])

    assert numbers()["torque_ripple_pu"] < 1e-6
    assert ripple(20.0) == pytest.approx(0.1 / math.sqrt(2.0), rel=0.01)
    assert ripple(900.0) == pytest.approx(0.1 / math.sqrt(2.0), rel=0.01)
    assert ripple(0.2) < 0.01
    assert ripple(1500.0) < 0.005


def test_accuracy_dip_recovery_and_overshoot() -> None:
    assert numbers()["torque_error_pu"] == pytest.approx(0.2 / 8.4, rel=1e-3)
    assert numbers(speed_rpm=304.0)["speed_error_rpm"] == pytest.approx(4.0)
    dipped = numbers(speed_rpm=lambda t: np.where((t >= 4.0) & (t < 4.5), 240.0, 300.0))
    assert dipped["dip_rpm"] == pytest.approx(60.0)
    assert dipped["recovery_s"] == pytest.approx(0.5, abs=0.01)
    beyond = numbers(speed_rpm=lambda t: np.where((t >= 4.0) & (t < 4.2), 320.0, 300.0))
    assert beyond["overshoot"] == pytest.approx(0.1)


def test_oriented_time_is_that_above_1_Hz_with_the_flux_right() -> None:
    assert numbers()["above_1Hz_s"] == pytest.approx(9.0, abs=0.01)
    assert numbers()["oriented_above_1Hz_s"] == pytest.approx(9.0, abs=0.01)
    assert numbers(f_s_Hz=0.5)["above_1Hz_s"] == 0.0
    assert numbers(flux_angle_err_deg=30.0)["oriented_above_1Hz_s"] == 0.0
    assert numbers(lambda_hat_Wb=0.7)["oriented_above_1Hz_s"] == 0.0


def row(impossible: str = "", **changed: Any) -> dict[str, Any]:
    """The row of a made-up record in place of the simulated one."""
    fixed = (
        ("motor", "table1"),
        ("load", "active"),
        ("pulse", "steady"),
        ("J_ratio", 2.3),
    )
    case = Case("", 0, SEED, fixed)
    drive = drive_of("table1")
    plan = run.Planned(case, drive, MADE_UP, impossible, sim.Job())
    return run.row_of(plan, record(**changed))


def test_every_verdict_can_be_provoked() -> None:
    runs_away = {"speed_rpm": after(5.0, 600.0, 300.0)}
    fault = int(Fault.SPEED_DEVIATION)
    off = {"gates_on": after(3.0, 0.0, 1.0)}
    assert row()["verdict"] == "harmless"
    assert row(**runs_away)["undeclared_harm"]
    assert row(**runs_away)["harm"] == "deviation"
    assert row(i_peak_A=after(5.0, 30.0, 8.0))["harm"] == "current"
    assert row(**runs_away, faults=after(3.0, fault, 0.0), **off)["verdict"] == "declared_before"
    assert row(**runs_away, faults=after(6.05, fault, 0.0))["verdict"] == "declared_after"
    tripped = row(faults=after(3.0, fault, 0.0), **off)
    assert tripped["false_trip"]
    assert tripped["fault"] == "SPEED_DEVIATION"
    assert not tripped["held"]
    assert not row("too much", faults=after(3.0, fault, 0.0), **off)["false_trip"]


def test_a_torque_may_turn_the_shaft_faster_than_the_speed_reference_ramps() -> None:
    """It was called a wrong direction: the judge took the ramp for what was asked."""

    def slew_rpm_s(mission: str) -> float:
        fixed = (*run.NOMINAL, ("motor", "im_1kw5_200v"), ("mission", mission))
        return run.limits_of(run.planned(Case("", 0, SEED, fixed))).slew_rpm_s

    assert slew_rpm_s("torque") == math.inf
    assert math.isfinite(slew_rpm_s("cycle"))


def test_counts_and_the_worst_leave_out_the_impossible() -> None:
    fault = {
        "faults": after(3.0, int(Fault.OVER_CURRENT), 0.0),
        "gates_on": after(3.0, 0.0, 1.0),
    }
    rows = [
        row(),
        row(**fault),
        row("too much", **fault),
        row(speed_rpm=after(5.0, 600.0, 300.0)),
    ]
    rows = [r | {"index": k} for k, r in enumerate(rows)]
    content = campaign.as_dict(campaign.Result(SEED_2005, rows))
    assert (content["runs"], content["impossible"]) == (3, 1)
    assert content["undeclared_harm"]["count"] == 1
    assert content["false_trips"] == {"count": 1, "share": round(1 / 3, 5)}
    assert content["held"]["count"] == 1
    assert [r["index"] for r in content["worst"]] == [3, 1, 0]


def test_an_axis_counts_only_the_runs_in_which_it_acts() -> None:
    rigid, elastic = row() | {"coupling": "rigid"}, row() | {"coupling": "elastic"}
    rows = [rigid, rigid, elastic]
    parts = dict.fromkeys(("resonance_Hz", "J_ratio"), 0)
    for name in parts:
        parts[name] = sum(len(part) for _, part in campaign.parts(axes.BY_NAME[name], rows))
    assert parts == {"resonance_Hz": 1, "J_ratio": 3}


def test_every_plain_value_lies_on_its_axis() -> None:
    for axis in AXES:
        if axis.plain is not None:
            assert axis.parse(str(axis.plain)) == axis.plain
    assert axes.BY_NAME["slope_rpm_s"].plain is None
    assert axes.BY_NAME["adc_bits"].plain == "14"


def test_the_axis_that_mends_a_run_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """A drive that only fails with a large inertia and 10 bits together."""

    def judged(case: Case) -> tuple[dict[str, Any], None, None]:
        bad = case.number("J_ratio") > 10.0 and case.word("adc_bits") == "10"
        return row() | {"held": not bad, "false_trip": bad}, None, None

    monkeypatch.setattr(why, "run_case", judged)
    sample = run.Sample(SEED, {"J_ratio": 50.0, "adc_bits": "10"})
    found = why.mending(sample, 0, lambda done: None)
    assert {one["axis"] for one in found} == {"J_ratio", "adc_bits"}


def test_the_true_motor_has_the_drawn_inductance_at_rated_flux() -> None:
    for law in axes.BY_NAME["saturation"].choices:
        case = Case("", 3, SEED, (("motor", "table1"), ("saturation", law), ("M_ratio", 0.9)))
        flux_Wb = drive_of("table1").flux_Wb
        assert float(true_motor(case).M_H(flux_Wb)) == pytest.approx(0.9 * 0.102, rel=1e-9)


def test_a_sample_runs_resumes_and_is_reproducible_alone(tmp_path: Path) -> None:
    def called(*words: str) -> Any:
        command = [
            "envelope",
            "--seed",
            str(SEED),
            "--out",
            str(tmp_path),
            "--json",
            *words,
        ]
        return CliRunner().invoke(make_app(), command)

    fixes = ["--fix", "inverter=averaged", "--fix", "mission=crossing"]
    first = called("--runs", "3", "-j", "1", *fixes)
    content = json.loads(first.stdout)
    keys = {"runs", "undeclared_harm", "false_trips", "held", "oriented_above_1Hz"}
    assert keys | {"torque_ripple_p95_pu"} <= set(content)
    assert content["runs"] + content["impossible"] == 3
    assert (tmp_path / "envelope.parquet").is_file()
    assert "<svg" in (tmp_path / "envelope.html").read_text(encoding="utf-8")
    assert list((tmp_path / "traces").glob("*.parquet"))
    assert json.loads(called("--runs", "3", "-j", "1", *fixes).stdout) == content
    alone = json.loads(called("--only", "1", *fixes).stdout)
    assert alone["index"] == 1
    import pyarrow.parquet as pq

    stored = pq.read_table(tmp_path / "envelope.parquet").to_pylist()[1]
    assert alone == stored


def test_the_page_shows_every_axis() -> None:
    rows = [row() | {"index": k} for k in range(4)]
    text = page.page_text(campaign.Result(SEED_2005, rows), "tools/zh envelope")
    assert all(f"| {axis.name} |" in text for axis in AXES)


@pytest.mark.parametrize("motor", ["table1", "im_1kw5_200v"])
@pytest.mark.parametrize("period_us", ["100", "62.5"])
def test_every_period_has_a_table_of_its_own_that_can_be_proven(motor, period_us, tmp_path):
    drive = drive_of(motor, period_us)
    designed = load_motor(drive.motor_dir)
    assert drive.period_s == designed.design.period_s == pytest.approx(1e-6 * float(period_us))
    shutil.copy(drive.motor_dir / "motor.toml", tmp_path)
    text = table_json(design_table(designed))
    (tmp_path / "l_gain.json").write_text(text)
    proven, used = read_stored_table(tmp_path), read_stored_table(drive.motor_dir)
    assert proven.gain == used.gain
    assert not any(check_entry(proven, k).failing for k in range(0, len(proven.gain), 150))


def test_the_voltage_check_leaves_room_for_an_inverter_that_switches_more_often():
    volts = [float(drive_of("table1", us).known["voltage_check_V"]) for us in ("200", "100")]
    assert volts[1] == 2.0 * volts[0] > 0.0
