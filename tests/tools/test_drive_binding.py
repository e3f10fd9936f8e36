"""zerohertz.Drive: the SIL library from Python, and what it says about bad files."""

import dataclasses
import json
import math
import os
import re
import runpy
import shutil
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import zerohertz
from zerohertz.drive import Access, Drive, Fault, State, parameters
from zerohertz.errors import UserError
from zerohertz.paths import ROOT

MOTOR = ROOT / "gain_tables" / "hasegawa2005"
BOARD = ROOT / "host_sim" / "boards" / "paper.toml"
QUIET = (8192, 8192, 8192, 8192, 8192, 11592)


@pytest.fixture
def drive():
    with Drive(MOTOR, BOARD) as d:
        yield d


@pytest.fixture
def motor_dir(tmp_path: Path) -> Path:
    """A copy of the motor's folder, to be spoilt."""
    folder = tmp_path / "motor"
    folder.mkdir()
    for name in ("motor.toml", "l_gain.json"):
        shutil.copy(MOTOR / name, folder / name)
    return folder


def edit_table(folder: Path, change) -> None:
    path = folder / "l_gain.json"
    content = json.loads(path.read_text())
    change(content)
    path.write_text(json.dumps(content))


def steps(drive: Drive, n: int, **command):
    for _ in range(n):
        out = drive.step(*QUIET, **{"speed_ref_rpm": 0.0, **command})
    return out


def test_drive_is_exported():
    assert zerohertz.Drive is Drive


def test_drive_reaches_ready_and_turns_the_gates_on(drive):
    assert steps(drive, 600).state == State.READY
    out = steps(drive, 2, run=True)
    assert out.state == State.PREMAGNETISE
    assert out.gates_on is True
    assert out.faults == 0
    with pytest.raises(dataclasses.FrozenInstanceError):
        out.duty_u = 0.0


def test_drive_pushes_against_the_missing_flux_current(drive):
    steps(drive, 600)
    out = steps(drive, 5, run=True)
    # i_d asked along phase u, none flows: u_u up, v and w down alike.
    assert out.duty_u > 0.51
    assert out.duty_v == out.duty_w < 0.5


def test_parameters_are_listed_read_and_set(drive):
    listed = {p.name: p for p in parameters()}
    assert listed["adapt_kp"].unit == "rad/(s Wb A)"
    assert listed["Rs_ohm"].access is Access.AT_OPEN
    assert listed["eps1_mode"].whole
    assert set(drive) == set(listed)
    drive["adapt_kp"] = 7.5
    assert drive["adapt_kp"] == 7.5
    for name, value, text in [
        ("adapt_kp", 1e9, "out of range"),
        ("adapt_kp", math.nan, "finite"),
        ("Rs_ohm", 1.0, "overrides"),
        ("nothing", 1.0, "no such parameter"),
    ]:
        with pytest.raises(UserError, match=text):
            drive[name] = value
    assert drive["adapt_kp"] == 7.5
    with pytest.raises(UserError, match="no such parameter"):
        drive["nothing"]


def test_a_reference_that_is_no_number_is_an_error_and_trips(drive):
    steps(drive, 600)
    steps(drive, 10, run=True)
    with pytest.raises(UserError, match="speed_ref_rpm"):
        drive.step(*QUIET, speed_ref_rpm=math.nan, run=True)
    out = steps(drive, 1, run=True)
    assert out.state == State.FAULT
    assert out.gates_on is False
    assert Fault.NON_FINITE in Fault(out.faults)  # words that stand still are one as well


def test_words_beyond_sixteen_bit_are_refused(drive):
    for word in (-1, 65536):
        with pytest.raises(UserError, match=r"0 \.\. 65535"):
            drive.step(word, *QUIET[1:], speed_ref_rpm=0.0)


def test_a_closed_drive_says_so():
    d = Drive(MOTOR, BOARD)
    d.close()
    d.close()
    with pytest.raises(UserError, match="closed"):
        d.step(*QUIET, speed_ref_rpm=0.0)


def test_two_drives_with_their_own_overrides():
    with Drive(MOTOR, BOARD, {"i_d_A": 3.0}) as a, Drive(MOTOR, BOARD) as b:
        outs = []
        for d in (a, b):
            steps(d, 600)
            outs.append(steps(d, 3, run=True).duty_u)
        assert a["i_d_A"] == 3.0
        assert b["i_d_A"] == 4.5
        assert outs[0] < outs[1]


def random_run(seed: int):
    rng = np.random.default_rng(seed)
    words = rng.integers(7900, 8500, size=(3000, 5))
    with Drive(MOTOR, BOARD) as d:
        return [d.step(*map(int, row), 11592, speed_ref_rpm=50.0, run=k > 600)
                for k, row in enumerate(words)]  # fmt: skip


def test_threads_give_what_one_after_another_gives():
    serial = [random_run(seed) for seed in range(4)]
    with ThreadPoolExecutor(2) as pool:
        assert list(pool.map(random_run, range(4))) == serial


def test_opening_again_is_cheap():
    Drive(MOTOR, BOARD).close()
    start = time.process_time()
    for _ in range(100):
        Drive(MOTOR, BOARD).close()
    # Parsing the table's json takes some 10 ms each time; the cached one must not.
    assert (time.process_time() - start) / 100 < 3e-3


@pytest.mark.parametrize(
    ("overrides", "text"),
    [
        ({"no_such": 1.0}, "overrides: no_such: no such parameter"),
        ({"adapt_kp": -1.0}, "overrides: adapt_kp: -1 is out of range; give 0 .. 160"),
        ({"adapt_kp": math.inf}, "not a finite number"),
        ({"adapt_kp": "x; rm"}, "not a number"),
        ({"eps1_mode": 0.5}, "not a whole number"),
        ({"M_H": 0.12}, "M_H: is 0.12 H; it must be below 0.1059245 H with Ls_H = 0.11 H"),
    ],
)
def test_bad_override_is_named(overrides, text):
    with pytest.raises(UserError, match=text):
        Drive(MOTOR, BOARD, overrides)


def test_missing_files_are_named(tmp_path):
    with pytest.raises(UserError, match=r"nowhere/motor\.toml: cannot be read"):
        Drive(tmp_path / "nowhere", BOARD)
    with pytest.raises(UserError, match=r"nowhere\.toml: cannot be read"):
        Drive(MOTOR, tmp_path / "nowhere.toml")


def test_missing_table_is_named(motor_dir):
    (motor_dir / "l_gain.json").unlink()
    with pytest.raises(UserError, match=r"l_gain\.json: cannot be read; .*tools/zh design"):
        Drive(motor_dir, BOARD)


def change_the_last_digit(table):
    gain = table["entries"][2]["L"]
    gain[2] = float(np.nextafter(np.float32(gain[2]), np.float32(0.0)))


def flip_the_crc(table):
    table["crc32c"] = f"{int(table['crc32c'], 16) ^ 0x80000000:08x}"


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (change_the_last_digit, "crc32c: does not match"),
        (flip_the_crc, "crc32c: does not match"),
        (lambda t: t["entries"].pop(), "crc32c: does not match"),
        (lambda t: t["entries"].extend(t["entries"][:300]), "entries: 2101 is outside"),
        (lambda t: t["entries"].clear(), "entries: 0 is outside"),
        (lambda t: t.update(entries="many"), "entries: is missing or no list"),
        (lambda t: t.update(schema=1), "schema: is not 2"),
        (lambda t: t.pop("crc32c"), "crc32c: missing"),
        (lambda t: t.pop("entries"), "entries: is missing or no list"),
        (lambda t: t.update(entries=[1, 2]), r"entries\[0\].L: is not four float32"),
        (lambda t: t["entries"][7].pop("L"), r"entries\[7\].L: is not four float32"),
        (lambda t: t["entries"][7]["L"].pop(), r"entries\[7\].L: is not four float32"),
        (
            lambda t: t["entries"][7].update(L=[0, 0, "0", 0]),
            r"entries\[7\].L: is not four",
        ),
        (
            lambda t: t["entries"][7].update(L=[0, 0, 1e39, 0]),
            r"entries\[7\].L: is not four",
        ),
        (lambda t: t.update(step_rad_s=-2), "step_rad_s: is outside"),
        (lambda t: t.pop("step_rad_s"), "step_rad_s: missing"),
        (lambda t: t.update(motor="other"), "motor: .*other.* is not"),
        (lambda t: t["inputs"]["circuit"].update(Rr_ohm=0.51), "differs from motor.toml"),
        (lambda t: t["inputs"].pop("circuit"), "circuit: missing"),
    ],
)
def test_spoilt_table_is_refused(motor_dir, change, text):
    Drive(motor_dir, BOARD).close()  # the copy itself is fine, and now cached
    edit_table(motor_dir, change)
    with pytest.raises(UserError, match=text) as caught:
        Drive(motor_dir, BOARD)
    assert "l_gain.json" in str(caught.value)


@pytest.mark.parametrize("text", ["", "{", "[]", "null", "\x00\x01", '{"schema": 1'])
def test_table_that_is_no_json_object_is_refused(motor_dir, text):
    (motor_dir / "l_gain.json").write_text(text)
    with pytest.raises(UserError, match=r"l_gain\.json"):
        Drive(motor_dir, BOARD)


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ("Rs_ohm = 0.930", "Rs_ohm = -1", "circuit.Rs_ohm"),
        ("Rs_ohm = 0.930", "Rs_ohm = nan", "circuit.Rs_ohm"),
        ("Rs_ohm = 0.930", 'Rs_ohm = "big"', "circuit.Rs_ohm"),
        ("Rs_ohm = 0.930", "", "circuit.Rs_ohm: missing"),
        ("Rs_ohm = 0.930", "Rs_ohm = 0.930\nRx_ohm = 1", "circuit.Rx_ohm: unknown key"),
        ("M_H = 0.102", "M_H = 0.2", "circuit.M_H"),
        ("pole_pairs = 2", "pole_pairs = 1.5", "nameplate.pole_pairs"),
        ("[circuit]", "[circuit", "motor.toml:"),
        ("Rr_ohm = 0.500", "Rr_ohm = 0.600", "differs from motor.toml"),
    ],
)
def test_spoilt_motor_file_is_refused(motor_dir, old, new, text):
    path = motor_dir / "motor.toml"
    content = path.read_text()
    assert old in content
    path.write_text(content.replace(old, new))
    with pytest.raises(UserError, match=text):
        Drive(motor_dir, BOARD)


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ("bits = 14", "bits = 40", "adc.bits"),
        ("current_A = 25.0", "current_A = -25.0", "full_scale.current_A"),
        ("period_s = 200e-6", "period_s = inf", "control.period_s"),
        ("period_s = 200e-6", "period_s = 5e-6", "period_s: 5e-06 is out of range"),
        ("[adc]", "[abc]", "adc.bits: missing"),
        ("[adc]", "\x00", ":"),
    ],
)
def test_spoilt_board_is_refused(tmp_path, old, new, text):
    content = BOARD.read_text()
    assert old in content
    board = tmp_path / "board.toml"
    board.write_text(content.replace(old, new))
    with pytest.raises(UserError, match=text):
        Drive(MOTOR, board)


def test_a_table_proven_for_a_shorter_period_is_refused(motor_dir):
    def for_100_us(table):
        table["inputs"]["design"]["period_s"] = 100e-6

    edit_table(motor_dir, for_100_us)
    with pytest.raises(UserError, match=r"design\.period_s: .*design it for that period"):
        Drive(motor_dir, BOARD)
    # At that period, and without the table, there is nothing to object to.
    Drive(motor_dir, BOARD, {"period_s": 100e-6}).close()
    Drive(motor_dir, BOARD, {"observer_gain_enable": 0}).close()


def test_a_table_written_anew_is_read_anew(motor_dir):
    """The words, not the cache, decide: l1 at standstill doubled, CRC kept up to date."""
    from zerohertz.gain_design.crc32c import crc32c
    from zerohertz.gain_design.table import gains_of

    def double(table):
        table["entries"][0]["L"][0] *= 2.0
        table["crc32c"] = f"{crc32c(gains_of(table).astype('<f4').tobytes()):08x}"

    def l1_at_standstill() -> float:
        with Drive(motor_dir, BOARD) as d:
            steps(d, 600)
            return steps(d, 2, run=True).l1_re

    os.utime(motor_dir / "l_gain.json", (1e9, 1e9))  # old enough to be cached
    before = l1_at_standstill()
    assert before == pytest.approx(-820.0, rel=0.5)
    edit_table(motor_dir, double)
    assert l1_at_standstill() == pytest.approx(2.0 * before)


def test_the_example_reaches_its_speed(capsys):
    runpy.run_path(str(ROOT / "tools" / "zerohertz" / "examples" / "python_plant.py"))
    last = capsys.readouterr().out.splitlines()[-1]
    true, estimated = (float(x) for x in re.findall(r"(-?[\d.]+)(?: min|$)", last))
    assert true == pytest.approx(300.0, abs=5.0)
    assert estimated == pytest.approx(true, abs=5.0)
