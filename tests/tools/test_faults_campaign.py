"""`zh campaign faults`: its cases, the runner, and a sample of both."""

from __future__ import annotations

import contextlib
import dataclasses
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from zerohertz import sim
from zerohertz.atlas.run import RunOptions
from zerohertz.atlas.simulate import RATED_TORQUE_NM, Bench
from zerohertz.campaign.faults import (
    campaign,
    cases,
    conditions,
    excepted,
    judge,
    kinds,
    page,
    run,
    shared,
)
from zerohertz.cli import make_app
from zerohertz.drive import Fault
from zerohertz.errors import UserError

KNOWN = Path(__file__).parent / "data" / "faults_undeclared.txt"
SAMPLE = {"which": "all", "runs": 200, "seed": 2005}


def test_a_case_is_what_its_name_says() -> None:
    name = "i_u.frozen+open_v@running,300,+1,la2,averaged,sensors"
    case = cases.case_of(name)
    assert [kind.name for kind in case.kinds] == ["i_u.frozen", "open_v"]
    assert case.condition == conditions.Condition("running", 300.0, "+1", 2, "averaged", "sensors")
    assert case.seed == cases.case_of(name).seed
    first, second = case.delays_s()
    assert 0.0 <= first < 0.02
    assert 0.0 <= second < cases.LATEST_S
    for group in cases.GROUPS:
        for sampled in cases.cases(group, 50, 7):
            again = cases.case_of(sampled.name)
            assert dataclasses.replace(again, index=sampled.index) == sampled


@pytest.mark.parametrize(
    "name",
    [
        "i_u.frozen",
        "i_u.melted@running,300,+1,la2,averaged,sensors",
        "i_u.frozen@running,301,+1,la2,averaged,sensors",
        "open_u+open_v@running,300,+1,la2,averaged,sensors",
        "hoist@running,0,+1,la2,averaged,sensors",
    ],
)
def test_a_name_that_is_none_is_a_mistake_with_a_remedy(name: str) -> None:
    with pytest.raises(UserError, match="--case"):
        cases.case_of(name)


def test_the_groups_are_what_they_promise() -> None:
    single = cases.cases(cases.SINGLE, 0, 1)
    assert len({case.name for case in single}) == len(single)
    here = {(c.kinds[0].name, c.condition) for c in single if c.kinds[0].name != "hoist"}
    assert len(here) == (len(kinds.every_kind()) - 1) * len(conditions.every_condition())
    chosen, share = conditions.covering()
    assert len(set(chosen)) == conditions.COVERING
    assert share > 0.85
    assert {c.mode for c in chosen} == set(conditions.MODES)
    assert len(cases.cases(cases.TRIPLES, 0, 1)) == cases.TRIPLE_COUNT
    assert cases.split("all", 100) == {"single": 34, "pairs": 33, "triples": 33}
    assert cases.split("pairs", 0) == {"pairs": 0}
    assert cases.cases("pairs", 20, 3) == cases.cases("pairs", 20, 3)
    assert cases.cases("pairs", 20, 3) != cases.cases("pairs", 20, 4)


@pytest.fixture(scope="module")
def bench() -> Bench:
    return run.bench_of_campaign()


def test_every_kind_runs_and_reaches_the_plant(bench: Bench) -> None:
    here = "@running,300,+0.5,la1,averaged,sensors"
    base = run.job(bench, cases.case_of(kinds.NOTHING + here))
    for name in kinds.every_kind():
        made = run.job(bench, cases.case_of(name + here))
        assert (name == kinds.NOTHING) == (
            (base.scenario, base.scenario_overrides, base.rig_overrides)
            == (made.scenario, made.scenario_overrides, made.rig_overrides)
        )
        short = dataclasses.replace(made, max_steps=10)
        assert sim.run(short).steps == 10, name


@pytest.mark.parametrize(
    "name",
    [
        "currents.gain_0.5@i_f,60,+1,la0,averaged,sensors",
        "all.gain_0.5@i_f,0,passive,la0,switched,sensors",
        "all.gain_0.5@reversing,900,passive,la2,switched,sensors",
        "currents.gain_0.5@reversing,9,+0,la2,switched,duty",
        "all.gain_0.5+J_3@running,60,+1,la1,averaged,sensors",
        "i_v.drift_0.03+i_w.drift_0.03+currents.gain_0.5@running,300,+0,la2,averaged,duty",
    ],
)
def test_a_gain_that_changes_while_running_opens_the_gates(bench: Bench, name: str) -> None:
    row = run.run_case(bench, cases.case_of(name))
    assert row["verdict"] == judge.BEFORE
    assert (row["bits"], row["over_current"]) == (int(Fault.CURRENT_SENSOR), False)


@pytest.mark.parametrize(
    ("fault", "name"),
    [
        (Fault.CURRENT_SENSOR, "all.gain_0.5@running,1710,+0,la2,averaged,sensors"),
        (Fault.VOLTAGE_SENSOR, "u_dc.gain_0.5@running,1710,+0,la2,averaged,duty"),  # link_drop.h
        (
            Fault.STATOR_RESISTANCE,
            "currents.gain_0.5+all.gain_0.5@starting,300,+0.5,la0,averaged,duty",
        ),
        (
            Fault.STATOR_RESISTANCE,
            "currents.gain_0.5+voltages.noise_0.05+all.gain_0.5@starting,0,+1,la0,averaged,sensors",
        ),
        (  # 28.3 A without rs_measurement.c's lower limit
            Fault.STATOR_RESISTANCE,
            "u_uv.frozen+currents.gain_0.5+all.gain_0.5@starting,0,+0.5,la1,switched,sensors",
        ),
    ],
)
def test_words_that_all_read_too_little_are_told_before_the_harm(
    bench: Bench, fault: Fault, name: str
) -> None:
    row = run.run_case(bench, cases.case_of(name))
    assert row["verdict"] == judge.BEFORE
    assert (row["bits"], row["over_current"]) == (int(fault), False)


@pytest.mark.parametrize(
    "here",
    [
        "v_f,0,passive,la0,switched,duty",
        "i_f,0,+0,la0,averaged,sensors",
        "running,0,+0,la0,switched,duty",
    ],
)
def test_an_earth_fault_behind_a_frozen_word_is_told_by_the_word(bench: Bench, here: str) -> None:
    row = run.run_case(bench, cases.case_of(f"i_u.frozen+earth_u_1ohm@{here}"))
    assert row["verdict"] in (judge.BEFORE, judge.AFTER)  # the earth fault comes when it comes
    assert row["bits"] == int(Fault.ADC_FROZEN)


# The shaft turns the wrong way, and too much current flows. The word was "speed unknown" until the
# gain of the speed loop grew with its error; now a trip comes first (the word: test_drive_speed.c).
@pytest.mark.parametrize("here", ["averaged,sensors", "switched,duty"])
def test_a_lost_drive_that_only_warns_is_declared(bench: Bench, here: str) -> None:
    row = run.run_case(bench, cases.case_of(f"currents.late_10@running,9,+1,la0,{here}"))
    assert "direction" in row["harms"]
    assert row["verdict"] in (judge.BEFORE, judge.AFTER)


@pytest.mark.parametrize(
    "here",
    [
        "running,300,+0.5,la2,averaged,sensors",
        "reversing,60,+1,la1,switched,duty",
        "i_f,60,+0.5,la0,averaged,sensors",
    ],
)
def test_cases_that_share_their_start_have_the_rows_they_have_alone(
    bench: Bench, here: str
) -> None:
    names = ("nothing", "u_uv.gain_0.5", "i_u.late_10", "currents.frozen", "sag_0.7_1s", "J_3")
    several = [cases.case_of(f"{name}@{here}") for name in names]
    assert len({case.stem for case in several}) == 2
    rows = {row["name"]: row for row in run.run_cases(bench, several)}
    for case in several:
        found = rows[case.name]
        assert run.run_case(bench, case) == found, case.name
        made, times = run.job(bench, case), run.times_of(bench, case)
        whole = judge.judge(
            sim.run(made), run.limits_of(bench, case, made), times.fault_s, times.reverse_s
        )
        for key in ("verdict", "word_ms", "bits", "over_current", "started"):
            assert found[key] == whole[key], (case.name, key)


def test_a_period_is_the_boards(bench: Bench) -> None:
    made = run.job(bench, cases.case_of(EXACT))
    assert sim.run(dataclasses.replace(made, max_steps=1)).period_s == pytest.approx(
        shared.PERIOD_S
    )


def test_a_load_that_the_torque_accelerates_too_slowly_is_told(bench: Bench) -> None:
    name = "J_10@running,1710,passive,la0,switched,sensors"
    assert run.run_case(bench, cases.case_of(name))["verdict"] == judge.BEFORE


@pytest.mark.parametrize("mode", ["running", "starting", "reversing"])
def test_a_healthy_drive_does_no_harm(bench: Bench, mode: str) -> None:
    for load in ("-1", "+0", "+1", conditions.PASSIVE):
        name = f"{kinds.NOTHING}@{mode},300,{load},la2,switched,duty"
        found = run.run_case(bench, cases.case_of(name))
        assert (found["verdict"], found["started"]) == (judge.HARMLESS, True), name


def test_the_largest_speed_is_the_shafts() -> None:
    """The firmware bounds the reference in electrical rad/s (firmware/unit/period.c)."""
    known = {"speed_max_rad_s": 500.0, "pole_pairs": 2.0}
    assert run.maximum_rpm(known) == pytest.approx(250.0 * 30.0 / math.pi)


def test_without_its_detectors_the_same_drive_is_undeclared(bench: Bench) -> None:
    """The negative control: the judge sees what the firmware does not look for."""
    off = {"voltage_check_V": 0.0, "open_phase_A": 0.0, "current_sum_max_A": 6.0, "stall_s": 0.0}
    off |= {"speed_deviation_rad_s": 100.0, "speed_deviation_s": 10.0}
    off |= dict.fromkeys(("observer_e1_A", "observer_rate_rad_s2", "observer_power_W"), 0.0)
    blind = dataclasses.replace(bench, firmware={**bench.firmware, **off})
    case = cases.case_of("u_vw.gain_0.5@running,300,-1,la0,averaged,sensors")
    assert run.run_case(bench, case)["verdict"] == judge.BEFORE
    made, times = run.job(blind, case), run.times_of(blind, case)
    limits, record = run.limits_of(blind, case, made), sim.run(made)

    def verdict(words: sim.Record) -> str:
        return str(judge.judge(words, limits, times.fault_s, times.reverse_s)["verdict"])

    assert verdict(record) == judge.BEFORE  # lost, and so its speed is unknown
    silent = {name: column for name, column in record.columns.items() if name != "speed_unknown"}
    assert verdict(dataclasses.replace(record, columns=silent)) == judge.UNDECLARED


@contextlib.contextmanager
def no_bar(_text: str, _total: int) -> Any:
    yield lambda _done: None


@pytest.fixture(scope="module")
def sample(tmp_path_factory: pytest.TempPathFactory) -> campaign.Result:
    how = RunOptions(tmp_path_factory.mktemp("faults"), workers=2)
    return campaign.run_all(**SAMPLE, how=how, tell=lambda _text: None, bar=no_bar)


def test_no_case_of_the_sample_does_harm_that_was_declared_before(
    sample: campaign.Result,
) -> None:
    """The list is what is still open; it only ever gets shorter."""
    known = set(KNOWN.read_text(encoding="utf-8").split())
    undeclared = {row["name"] for row in sample.undeclared}
    assert undeclared <= known, "\n".join(sorted(undeclared - known))
    assert len(sample.every) == SAMPLE["runs"]
    assert all(row["started"] for row in sample.every if row["mode"] == "running")


def test_rows_are_stored_and_summed_up(sample: campaign.Result, tmp_path: Path) -> None:
    told: list[str] = []
    how = RunOptions(tmp_path, workers=1)
    first = campaign.run_all("single", 6, 1, how, told.append, no_bar)
    assert campaign.run_all("single", 6, 1, how, told.append, no_bar).rows == first.rows
    assert any("6 of 6 points are stored" in line for line in told)
    total = campaign.as_dict(sample)
    verdicts = ("undeclared_harm", "declared", "harmless", "excepted")
    assert total["runs"] == sum(total[name] for name in verdicts)
    assert sum(group["runs"] for group in total["groups"].values()) == total["runs"]
    json.dumps(total)
    text = page.page_text(sample, "a command")
    first = f"| {sample.rows['single'][0]['kinds']} | "
    for words in ("a command", first, "Undeclared, case by case", *page.TITLES.values()):
        assert words in text
    assert max(len(line) for line in page.how_to_read().splitlines()) <= 120


def test_a_link_that_freezes_with_the_brake_resistor_off_is_found(bench: Bench) -> None:
    """Frozen with the resistor on, as with voltage from the duty here, it is harmless."""
    row = run.run_case(bench, cases.case_of("u_dc.frozen@running,900,-1,la0,averaged,sensors"))
    assert (row["verdict"], row["bits"]) == (judge.BEFORE, int(Fault.VOLTAGE_SENSOR))
    assert 51.0 < row["word_ms"] < 100.0


def test_a_link_that_froze_before_the_start_is_found_by_the_flux(bench: Bench) -> None:
    row = run.run_case(bench, cases.case_of("u_dc.frozen@starting,900,-1,la0,switched,duty"))
    assert (row["verdict"], row["bits"]) == (judge.BEFORE, int(Fault.OBSERVER))


def test_words_that_all_read_low_still_reach_the_brake_resistor(bench: Bench) -> None:
    """The gain acts before the converter clips: .8 of a link that rises passes regen_start_V."""
    row = run.run_case(bench, cases.case_of("all.gain_0.8@starting,900,-1,la0,switched,duty"))
    assert row["verdict"] == judge.HARMLESS


@pytest.mark.parametrize("kind", ["u_dc.frozen", "nothing"])  # the resistor stays on
def test_a_link_that_the_brake_resistor_holds_is_left_alone(bench: Bench, kind: str) -> None:
    row = run.run_case(bench, cases.case_of(f"{kind}@running,1710,-1,la0,averaged,sensors"))
    assert row["verdict"] == judge.HARMLESS


EXACT = "currents.gain_0.5@starting,60,+0.5,la2,averaged,duty"
OTHER_MOTOR = "currents.gain_0.5+motor_0.4@starting,300,+0.5,la2,averaged,duty"


def harmful(**changed: Any) -> dict[str, Any]:
    return {"verdict": judge.UNDECLARED, "undeclared": judge.CURRENT, "peak_A": 24.6, **changed}


@pytest.mark.parametrize(
    ("name", "changed"),
    [
        (EXACT.replace("starting", "running"), {}),  # words that jump show it once
        (EXACT.replace("currents.gain_0.5", "i_u.gain_0.5"), {}),
        (EXACT.replace("currents.gain_0.5", "voltages.gain_0.5"), {}),
        (EXACT.replace("currents.gain_0.5", "all.gain_1.5"), {}),
        (EXACT.replace("@", "+u_dc.gain_0.5@"), {}),
        (EXACT.replace("@", "+all.gain_0.8@"), {}),
        (EXACT.replace("@", "+open_u@"), {}),
        (EXACT.replace("@", "+u_uv.frozen@").replace("duty", "sensors"), {}),
        (EXACT, {"undeclared": f"{judge.CURRENT} {judge.DEVIATION}"}),
        (EXACT, {"undeclared": judge.OVERSPEED}),
        (EXACT, {"peak_A": 45.1}),  # 22.5 A / .5
        (EXACT, {"verdict": judge.AFTER}),
        (EXACT, {"verdict": judge.HARMLESS}),
    ],
)
def test_an_exception_is_not_wider_than_its_proof(name: str, changed: dict[str, Any]) -> None:
    row = harmful(**changed)
    assert excepted.verdict(cases.case_of(EXACT), harmful(), 22.5) == judge.EXCEPTED
    assert excepted.verdict(cases.case_of(name), row, 22.5) == row["verdict"]


@pytest.mark.parametrize(
    "other",
    [
        "motor_0.4",
        "J_10",
        "load_reversal",
        "locked_rotor",
        "u_uv.frozen",
        "sag_0.5_0.2s",
        "mains_loss",
    ],
)
def test_what_tells_nothing_of_a_current_may_be_wrong_as_well(other: str) -> None:
    case = cases.case_of(EXACT.replace("@", f"+{other}@"))
    assert excepted.verdict(case, harmful(), 22.5) == judge.EXCEPTED
    late = cases.case_of(case.name.replace("starting", "running"))
    assert excepted.verdict(late, harmful(), 22.5) == judge.UNDECLARED


def test_half_of_every_current_is_found_by_the_resistance_at_the_start(bench: Bench) -> None:
    row = run.run_case(bench, cases.case_of(EXACT))
    assert row["verdict"] == judge.BEFORE
    assert row["bits"] == Fault.STATOR_RESISTANCE
    assert row["peak_A"] < 22.5


def test_a_quarter_of_every_current_is_found_before_the_largest_current(bench: Bench) -> None:
    """All words read half and the currents half of that: 28 A flowed where 7 were read."""
    name = "currents.gain_0.5+all.gain_0.5@starting,9,-1,la2,averaged,sensors"
    row = run.run_case(bench, cases.case_of(name))
    assert row["verdict"] == judge.BEFORE
    assert row["bits"] == Fault.STATOR_RESISTANCE
    assert row["peak_A"] < 22.5


def test_every_exception_has_a_proof_and_is_a_kind_with_its_gain() -> None:
    for name, proven in excepted.every_proven().items():
        assert name in kinds.every_kind()
        assert name.endswith(f".gain_{proven.gain:g}")
        assert len(proven.proof) > 10


def test_words_of_another_motor_are_excepted(bench: Bench) -> None:
    row = run.run_case(bench, cases.case_of(OTHER_MOTOR))
    assert row["verdict"] == judge.EXCEPTED
    assert 22.5 < row["peak_A"] < 45.0


def test_the_words_of_a_scaled_motor_are_the_scaled_words(bench: Bench) -> None:
    """The proof of currents.gain_0.5, by the plant: the motor with twice the impedances."""
    scaled = run.job(bench, cases.case_of(EXACT))
    told = dict(scaled.firmware)
    rig = dict(scaled.rig_overrides)
    twice = {f"motor.{name}" for name in ("Rs_ohm", "Rr_ohm", "Ls_H", "Lr_H", "M_H")}
    ideal = {
        "sensors.current_noise_A": 0.0,
        "sensors.current_offset_A": [0.0, 0.0, 0.0],
        "inverter.dead_time_s": 0.0,
        "mechanics.J_kg_m2": 1e4,  # half the current is half the torque: let nothing turn
    }
    other = {name: 2.0 * value if name in twice else value for name, value in rig.items()} | ideal
    rows = {
        "sensor": dataclasses.replace(scaled, rig_overrides=rig | ideal, max_steps=4000),
        "motor": dataclasses.replace(
            scaled, rig_overrides=other, scenario_overrides={}, max_steps=4000
        ),
    }
    records = {
        name: sim.run(dataclasses.replace(job, firmware=told, seed=1)) for name, job in rows.items()
    }
    seen_A = {name: record["i_d_A"] for name, record in records.items()}
    assert seen_A["motor"] == pytest.approx(seen_A["sensor"], abs=0.02)
    true_A = {name: record["i_abs_A"].max() for name, record in records.items()}
    assert true_A["sensor"] == pytest.approx(2.0 * true_A["motor"], rel=0.01)


def test_all_words_scaled_are_those_of_a_motor_on_a_scaled_link(bench: Bench) -> None:
    """The proof of all.gain_0.5, by the plant, from the start to load at speed: half the link gives
    half the flux and current, a quarter of the torque, and the same speeds and words."""
    case = cases.case_of("all.gain_0.5@starting,300,+0.5,la0,averaged,duty")
    scaled = run.job(bench, case)
    exact = {"sensors.current_gain": [1.0] * 3, "sensors.voltage_gain": [1.0] * 2} | dict.fromkeys(
        [f"sensors.{name}" for name in ("current_noise_A", "voltage_noise_V", "dc_noise_V")], 0.0
    )
    rig = {**scaled.rig_overrides, **exact, "sensors.current_offset_A": [0.0] * 3}
    quarter = {
        f"mechanics.{name}": 0.25 * rig[f"mechanics.{name}"] for name in ("J_kg_m2", "coulomb_Nm")
    }
    half = {"inverter.u_dc_V": 0.5 * 283.0, "inverter.i_threshold_A": 0.5 * 0.25}  # of atlas.toml
    load_Nm = case.condition.load_pu * RATED_TORQUE_NM
    sensor = sim.run(dataclasses.replace(scaled, rig_overrides=rig))
    motor = sim.run(
        dataclasses.replace(
            scaled,
            scenario=scaled.scenario.replace(f"{load_Nm}]]", f"{0.25 * load_Nm}]]"),
            scenario_overrides={},
            rig_overrides=rig | quarter | half,
        )
    )
    assert motor["load_Nm"].max() == pytest.approx(0.25 * sensor["load_Nm"].max())
    assert motor["i_peak_A"].max() == pytest.approx(0.5 * sensor["i_peak_A"].max(), rel=1e-3)
    assert (motor["faults"] == sensor["faults"]).all()
    for name, within in (("speed_hat_rpm", 0.3), ("i_q_ref_A", 0.1), ("Rs_hat_ohm", 1e-3)):
        assert np.abs(motor[name] - sensor[name]).max() < within


def test_quantiles_are_values_that_occurred() -> None:
    assert campaign.quantiles([]) is None
    assert campaign.quantiles([3.0, 1.0, 2.0]) == {
        "median_ms": 2.0,
        "p95_ms": 3.0,
        "worst_ms": 3.0,
    }


def test_one_case_on_the_command_line() -> None:
    app = CliRunner()
    name = "open_u@running,300,+0.5,la2,averaged,sensors"
    done = app.invoke(make_app(), ["campaign", "faults", "--case", name])
    assert done.exit_code == 0
    assert "declared_before" in done.stdout
    done = app.invoke(make_app(), ["campaign", "faults", "--case", name, "--json"])
    assert json.loads(done.stdout)["name"] == name
    listed = app.invoke(make_app(), ["campaign", "faults", "--list"]).stdout.split()
    assert {"i_u.frozen", "open_u", name.split("@")[1]} <= set(listed)
    refused = app.invoke(make_app(), ["campaign", "faults", "--kinds", "pairs", "--write"])
    assert isinstance(refused.exception, UserError)
