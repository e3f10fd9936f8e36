"""`zh bringup`: the first power-up, on simulated benches, healthy and with one wiring fault.

All faults on two boards: `zh campaign bringup`. The drive's time passes only while it is asked.
"""

from __future__ import annotations

import cmath
import contextlib
import io
import json
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from zerohertz.bringup import campaign, command, judge, wiring
from zerohertz.bringup.bench import phases, vector
from zerohertz.bringup.person import Answers, Keyboard, Reading
from zerohertz.bringup.rig import bench_of
from zerohertz.bringup.seeds import Place, Seed, faulty_places, healthy_places, seeds_of
from zerohertz.bringup.steps import NAMES, STEPS
from zerohertz.bringup.wiring import AXES, CROSSINGS, Finding, Linear, Turn
from zerohertz.cli import make_app
from zerohertz.drive import Fault
from zerohertz.errors import UserError
from zerohertz.flight.file import Flight
from zerohertz.paths import ROOT

F405, G431 = faulty_places()
RIG = "im_1kw5_200v"
Y = cmath.rect(0.25, -0.1)  # A/V of the motor; the prediction says nothing of the lag
HOLD_V = cmath.rect(7.0, cmath.pi / 6.0)


def seed_named(name: str, place: Place = F405) -> Seed:
    return next(seed for seed in seeds_of(place) if seed.name == name)


def run(*words: str) -> tuple[int, str, str]:
    result = CliRunner().invoke(make_app(), ["bringup", *words])
    if isinstance(result.exception, UserError):
        raise result.exception
    return result.exit_code, result.stdout, result.stderr


# --- the drive's part, sensors and legs as the plant has them ------------------------------------


@pytest.mark.parametrize(
    "name",
    [
        "current sensors v and w exchanged",
        "current sensor w inverted",
        "current sensor u reads 1.2 times",
        "current sensor v offset by 5 % of full scale",
        "all current sensors read 0.5 times",
        "upper switch of leg u does not turn on",
        "gates of legs w and u exchanged",
        "motor cables v and w exchanged",
        "line-voltage sensor u_vw reads 0.5 times",
        "dc link reads 1.2 times",
        "dead time 2.5 times what the drive is told",
        "delta instead of star",
    ],
)
def test_a_seeded_fault_is_named(name: str) -> None:
    row = campaign.bring_up(F405, seed_named(name), 3)
    assert row.good, row


def test_a_healthy_low_voltage_board_without_voltage_sensors_passes() -> None:
    assert campaign.bring_up(G431, None, 2).good


def test_a_large_inertia_follows_the_first_turn() -> None:
    place = next(place for place in healthy_places() if place.name == "im_45kw_400v")
    assert campaign.bring_up(place, None, 2).good


def test_a_model_that_does_not_run_fails_its_bench_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise UserError("the model trips")

    monkeypatch.setattr(campaign.procedure, "go_on", refuse)
    row = campaign.bring_up(G431, None, 2)
    assert (row.step, row.named, row.good) == (1, "the model trips", False)


def test_every_seed_has_a_name_of_its_own_and_fits_its_bench() -> None:
    names = [seed.name for seed in seeds_of(F405)]
    assert len(names) == len(set(names)) >= 55
    assert not any(seed.lines for seed in seeds_of(G431))
    assert len(healthy_places()) == 11
    scaled = F405.changes(seed_named("star instead of delta"))
    assert scaled["motor.Rs_ohm"] == pytest.approx(3.0 * 0.93)


# --- the command ---------------------------------------------------------------------------------


def test_a_person_stops_goes_on_and_gets_a_report_with_flights(tmp_path: Path) -> None:
    out = ("--rig", RIG, "--out", str(tmp_path))
    code, _, notes = run(*out, "--until", "still")
    assert code == 0
    assert "passed before" not in notes
    code, said, notes = run(*out, "--until", "turn", "--json")
    assert code == 0
    assert notes.count("passed before") == 2
    told = json.loads(said)
    assert [step["name"] for step in told["steps"]] == list(NAMES[:4])
    assert not told["passed"]
    page = (tmp_path / "report.md").read_text()
    assert "4 of 7 steps fit" in page
    assert "Not done yet." in page
    flight = Flight.read(tmp_path / "turn.flight")
    assert flight.head.parameters["control_mode"] != 1.0  # recorded before the step borrows
    # Another parameter: nothing that was passed counts any more.
    report = json.loads((tmp_path / "report.json").read_text())
    report["stamp"] = "of another drive"
    (tmp_path / "report.json").write_text(json.dumps(report))
    code, _, notes = run(*out, "--until", "supply", "--no-record")
    assert code == 0
    assert "from the first step on" in notes
    (tmp_path / "report.json").write_text("{}")
    with pytest.raises(UserError, match="no report"):
        run(*out, "--until", "supply")


def test_what_does_not_fit_is_refused_with_exit_code_1(tmp_path: Path) -> None:
    out = ("--rig", RIG, "--out", str(tmp_path), "--no-record")
    code, said, notes = run(*out, "--fault", 'gates="vw"')
    assert code == 1
    assert said.strip() == "Does not fit: gates of legs v and w exchanged"
    assert "exchange the gate signals" in notes
    assert "Resistance" not in notes
    page = (tmp_path / "report.md").read_text()
    assert "**gates of legs v and w exchanged**" in page


def test_answers_of_a_file_are_judged_like_a_persons(tmp_path: Path) -> None:
    answers = tmp_path / "answers.json"
    out = ("--rig", RIG, "--out", str(tmp_path), "--answers", str(answers))
    answers.write_text('{"supply.u_dc_V": 240}')
    code, said, _ = run(*out)
    assert code == 1
    assert "dc link scaled by 1.18" in said
    answers.write_text('{"clamp_u_A": 1.0}')
    with pytest.raises(UserError, match=r"supply\.u_dc_V: is missing"):
        run(*out)
    answers.write_text("[]")
    with pytest.raises(UserError, match="is not a JSON object"):
        run(*out)


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (("--until", "nothing"), "there is no such step"),
        (("--rig", RIG, "--sil"), "only one of them"),
        (("--rig", RIG, "--fault", "gates"), "is not KEY=VALUE"),
        (("--rig", RIG, "--board", "/nowhere.toml"), "cannot be read"),
        (("--sil", "--board", "b.toml"), "--board: only with --rig"),
        (("--sil", "--fault", "gates=1"), "--fault: only with --rig"),
        (("--sil", "--seed", "2"), "--seed: only with --rig"),
        ((), "which drive"),
        (("--rig", RIG, "--unlock"), "--unlock: --rig brings a drive along"),
        (("--rig", RIG, "--baud", "9600"), "--baud: --rig brings a drive along"),
    ],
)
def test_wrong_use_is_told(words: tuple[str, ...], why: str, tmp_path: Path) -> None:
    with pytest.raises(UserError, match=why):
        run("--out", str(tmp_path), *words)


def test_a_person_types_numbers_and_stops_with_q(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdin", io.StringIO("\nmuch\n1,5\nq\n"))
    person, reading = Keyboard(), Reading("u_dc_V", "Multimeter", "V")
    person.ready("step 1")
    assert person.read("supply", reading, lambda: None) == 1.5
    with pytest.raises(KeyboardInterrupt):
        person.read("supply", reading, lambda: None)
    with pytest.raises(UserError, match="the input has ended, and 'step 2' is missing"):
        person.ready("step 2")


def test_the_end_of_the_input_keeps_the_report(tmp_path: Path) -> None:
    rig = (ROOT / "host_sim" / "rigs" / "motors" / f"{RIG}.toml").read_text()
    with bench_of(rig, None, 1) as (drive, _):
        keyed = contextlib.nullcontext((drive, Keyboard()))
        stdin, sys.stdin = sys.stdin, io.StringIO("\n")
        try:
            with pytest.raises(UserError) as caught:
                command._go_on(keyed, tmp_path, None, None, (False, False, False))
        finally:
            sys.stdin = stdin
    said = str(caught.value)
    assert "the input has ended, and 'Multimeter at the dc link, V' is missing" in said
    assert "report.md keeps the steps before (0)" in said
    assert (tmp_path / "report.md").is_file()
    assert json.loads((tmp_path / "report.json").read_text())["steps"] == []


def test_a_files_answer_for_a_step_comes_before_one_for_all(tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    path.write_text('{"speed_rpm": 1, "first_turn.speed_rpm": 2}')
    answers, reading = Answers(path), Reading("speed_rpm", "Tachometer", "min^-1")
    assert answers.read("first_turn", reading, lambda: None) == 2.0
    assert answers.read("closed_loop", reading, lambda: None) == 1.0


# --- naming, without a drive ---------------------------------------------------------------------


def turn_of(sensors: Linear, legs: Linear = CROSSINGS[""], scale: float = 1.0) -> Turn:
    """What such sensors and legs show: i = S(Y T(u)), with all sensors off by `scale`."""
    a, b = sensors.a * Y * scale, sensors.b * Y.conjugate() * scale
    turning = a * legs.a + b * legs.b.conjugate()
    mirrored = a * legs.b + b * legs.a.conjugate()
    true_A = Y * legs(HOLD_V)
    lag = cmath.phase(Y) + 0.1  # the prediction is 6 degrees off
    hold_A = scale * sensors(true_A)
    return Turn(turning, mirrored, 0.0, 7.0, hold_A, HOLD_V, true_A, lag)


def one_channel(phase: str, gain: float) -> Linear:
    third = (gain - 1.0) / 3.0
    return Linear(1.0 + third, third * cmath.rect(1.0, 2.0 * AXES[phase]))


def named(turn: Turn) -> str:
    if broken := wiring.broken_power(turn):
        return broken.name
    pair, legs = wiring.crossed_gates(turn)
    if pair:
        return wiring.gates_finding(pair).name
    found = wiring.current_sensors(wiring.sensor_matrix(turn, legs))
    return found.name if found else ""


def test_right_sensors_have_no_fault() -> None:
    assert named(turn_of(Linear(1.0, 0.0))) == ""
    assert named(turn_of(Linear(1.0, 0.0), scale=1.04)) == ""
    assert named(turn_of(one_channel("v", 1.05))) == ""


@pytest.mark.parametrize("phase", "uvw")
def test_one_channel_is_named_with_its_gain(phase: str) -> None:
    for gain in (0.5, 0.8, 1.2, 2.0, 3.0):
        want = Seed("", f"current sensor {phase} scaled", gain=gain)
        name = named(turn_of(one_channel(phase, gain)))
        assert want.named([Finding(name, "", "")]), name
    assert named(turn_of(one_channel(phase, 0.0))) == f"current sensor {phase} dead"
    assert named(turn_of(one_channel(phase, -1.0))) == f"current sensor {phase} inverted"


def test_crossed_sensors_and_gates_are_told_apart() -> None:
    for pair, crossing in CROSSINGS.items():
        if pair:
            assert named(turn_of(crossing)) == f"current sensors {pair} exchanged"
            legs = turn_of(Linear(1.0, 0.0), crossing)
            assert named(legs) == f"gates of legs {pair} exchanged"
            # Sensors that are wrong as well do not hide the gates.
            S = wiring.sensor_matrix(turn_of(one_channel("u", 2.0), crossing), crossing)
            assert abs(S.a - 4.0 / 3.0) + abs(S.b - 1.0 / 3.0) < 0.3


def test_two_and_all_channels() -> None:
    minus_two = Linear(-1.0 / 3.0, 2.0 / 3.0 * cmath.rect(1.0, 2.0 * AXES["w"]))
    assert named(turn_of(minus_two)) == "current sensors u and v inverted"
    assert named(turn_of(Linear(-1.0, 0.0))) == "all current sensors inverted"
    assert named(turn_of(Linear(1.0, 0.0), scale=1.5)) == "all current sensors scaled by 1.50"
    # u x .5 and v x 2
    e = cmath.rect(1.0, 2.0 * AXES["v"])
    two = Linear(1.0 - 1.0 / 6.0 + 1.0 / 3.0, -1.0 / 6.0 + e / 3.0)
    assert named(turn_of(two)) == "current sensors: more than one fault"


@pytest.mark.parametrize("phase", "uvw")
def test_broken_power_parts(phase: str) -> None:
    axis = cmath.rect(1.0, AXES[phase])
    lag = cmath.phase(Y)
    whole = Turn(Y, 0.1 * Y, -0.6 * axis, 7.0, 0.0, HOLD_V, 0.0, lag)
    assert named(whole) == f"upper switch of leg {phase} does not turn on"
    half = Turn(0.5 * Y, -0.5 * Y.conjugate() * axis**2, 0.0, 7.0, 0.0, HOLD_V, 0.0, lag)
    assert named(half) == f"motor phase {phase} open"


def lines(uv: tuple[float, float], vw: tuple[float, float]) -> str:
    """Rows: what u_uv and u_vw read of both line voltages."""

    def sensed(u: complex) -> complex:
        u_uv, u_vw = 1.5**0.5 * u.real - u.imag / 2.0**0.5, 2.0**0.5 * u.imag
        return wiring._of_lines(uv[0] * u_uv + uv[1] * u_vw, vw[0] * u_uv + vw[1] * u_vw)

    one, j = sensed(1.0), sensed(1j)
    found = wiring.line_sensors(Linear(0.5 * (one - 1j * j), 0.5 * (one + 1j * j)), 1.0)
    return found.name if found else ""


def test_line_voltage_sensors() -> None:
    assert lines((1.0, 0.0), (0.0, 1.0)) == ""
    assert lines((0.0, 1.0), (1.0, 0.0)) == "line-voltage sensors exchanged"
    assert lines((-1.0, 0.0), (0.0, 1.0)) == "line-voltage sensor u_uv inverted"
    assert lines((1.0, 0.0), (0.0, 0.0)) == "line-voltage sensor u_vw dead"
    assert lines((1.2, 0.0), (0.0, 1.2)) == "line-voltage sensors scaled by 1.20"
    assert lines((1.0, 1.0), (0.0, 1.0)) == "line-voltage sensors wired to other lines"


def test_phases_and_vector_are_inverse() -> None:
    assert phases(complex(vector(2.0, -0.5, -1.5))) == pytest.approx((2.0, -0.5, -1.5))


# --- judgements ----------------------------------------------------------------------------------

P = {
    "dc_link_full_scale_V": 400.0,
    "current_full_scale_A": 25.0,
    "line_voltage_full_scale_V": 400.0,
    "voltage_source": 0.0,
    "pole_pairs": 2.0,
    "speed_max_rad_s": 500.0,
    "swap_vw": 0.0,
    "u_dc_V": 283.0,
    "period_s": 200e-6,
    "device_drop_V": 1.0,
    "dead_time_s": 2e-6,
}
REST = {f"left_{x}_A": 0.0 for x in "uvw"} | {"noise_A": 0.0, "line_V": 0.0, "faults": 0.0}


def test_supply_is_judged() -> None:
    assert not judge.supply({"u_dc_drive_V": 283.0, "u_dc_V": 285.0}, {}, P)
    dead = judge.supply({"u_dc_drive_V": 0.0, "u_dc_V": 285.0}, {}, P)
    assert dead[0].name == "dc-link sensor dead"
    assert judge.supply({"u_dc_drive_V": 0.0, "u_dc_V": 0.0}, {}, P)[0].name == "no dc link"


def test_rest_is_judged() -> None:
    assert not judge.still(REST, {}, P)
    noisy = judge.still(REST | {"noise_A": 1.0}, {}, P)
    assert noisy[0].name == "current sensors noisy"
    seen = judge.still(REST | {"line_V": 40.0}, {}, P)
    assert seen[0].name == "line-voltage sensors see a voltage"
    fault = judge.still(REST | {"faults": float(Fault.STORE)}, {}, P)
    assert fault[0].name == "not READY: STORE"


def test_trips_that_do_not_act_are_judged() -> None:
    acted = {"over_voltage_faults": 2.0, "under_voltage_faults": 4.0}
    assert not judge.trips(acted, {}, P)
    found = judge.trips(acted | {"over_voltage_faults": 0.0}, {}, P)
    assert found[0].name == "over-voltage trip does not act"


def test_resistance_and_ratio_are_judged() -> None:
    good = {"Rs_ohm": 0.93, "leg_loss_V": 3.8, "u_high_A": 2.0, "faults": 0.0}
    good |= {"v_high_A": -1.0, "w_high_A": -1.0, "i_high_A": 2.4, "u_high_V": 9.0}
    told = {"Rs_ohm": 0.93, "leg_loss_V": 3.8}
    assert not judge.direct(good, told, P)
    other = judge.direct(good | {"Rs_ohm": 1.7}, told, P)
    assert other[0].name == "stator resistance of another motor"
    ratio = judge.direct(good | {"v_high_A": -1.6, "w_high_A": -0.4}, told, P)
    assert "1 : -.5 : -.5" in ratio[0].name
    tripped = judge.direct(good | {"faults": float(Fault.OVER_CURRENT)}, told, P)
    assert tripped[0].name == "tripped: OVER_CURRENT"
    del good["Rs_ohm"]
    assert judge.direct(good, told, P)[0].name == "too little direct current"


def test_the_first_turn_is_judged() -> None:
    seen = {"faults": 0.0, "asked_rpm": 240.0, "speed_rpm": 239.0, "i_voltage": 30.0}
    deaf = P | {"voltage_source": 1.0}
    assert not judge.first_turn(seen, seen, deaf)
    stuck = judge.first_turn(seen | {"speed_rpm": 0.0}, seen, deaf)
    assert stuck[0].name == "shaft does not turn"
    back = judge.first_turn(seen | {"speed_rpm": -239.0}, seen, deaf | {"swap_vw": 1.0})
    assert back[0].remedy.startswith("swap_vw is on")
    slow = judge.first_turn(seen | {"speed_rpm": 200.0}, seen, deaf)
    assert slow[0].name == "wrong speed"
    other = judge.first_turn(seen | {"i_voltage": 60.0}, seen, deaf)
    assert other[0].name == "voltage of another motor"


def test_the_estimate_is_judged() -> None:
    seen = {"faults": 0.0, "estimate_rpm": 240.0, "speed_rpm": 243.0}
    assert not judge.closed_loop(seen, {}, P)
    off = judge.closed_loop(seen | {"estimate_rpm": 300.0}, {}, P)
    assert off[0].name == "estimate off the tachometer"


def test_the_page_has_every_step_and_the_campaigns_tables() -> None:
    page = (ROOT / "tools" / "docs" / "bringup.md").read_text(encoding="utf-8")
    for number, step in enumerate(STEPS, 1):
        assert f"| {number} `{step.name}` |" in page
    for seed in seeds_of(F405):
        assert f"| {seed.name} |" in page
    assert "**NO**" not in page
