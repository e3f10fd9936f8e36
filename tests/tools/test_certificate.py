"""The certificate proves what holds, and rejects every seeded defect."""

from __future__ import annotations

import ast
import dataclasses
import json
import math
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from zerohertz.check.certificate import INTERVAL_ROOM, NO_BOUND, certify, check_entry
from zerohertz.check.exact import is_positive_definite, solve
from zerohertz.check.inequalities import failing, hermitian, mirrored
from zerohertz.check.plots import figure_4, figure_gamma
from zerohertz.check.stored_table import StoredTable, read_stored_table
from zerohertz.errors import UserError
from zerohertz.paths import ROOT

FOLDERS = [ROOT / "gain_tables" / name for name in ("hasegawa2005", "im_4kw_400v")]
BOTH = pytest.mark.parametrize("folder", FOLDERS, ids=lambda f: f.name)
COLUMNS = ("gain", "gamma", "X", "poles")
SAMPLE = (0, 1, 5, 29, 30, 31, 60, 150, 450, 900, 1500, 1800)


def floor_of(table: StoredTable, k: int) -> float:
    m, omega = table.machine, float(k * table.step_rad_s)
    nearest = abs(omega - float(m.dw0_rad_s) / 2.0)
    return float(m.dw0_rad_s) / (2.0 * math.hypot(float(m.Rr_ohm / m.Lr_H), nearest))


def with_gain(table: StoredTable, k: int, change: Callable[[list], None]) -> StoredTable:
    gains = list(table.gain)
    gain = list(gains[k])
    change(gain)
    gains[k] = tuple(gain)
    return dataclasses.replace(table, gain=tuple(gains))


def with_entry(table: StoredTable, k: int, **values: object) -> StoredTable:
    changed = {}
    for key, value in values.items():
        column = list(getattr(table, key))
        column[k] = value
        changed[key] = tuple(column)
    return dataclasses.replace(table, **changed)


@BOTH
def test_every_entry_is_proven(folder: Path) -> None:
    report = certify(read_stored_table(folder))
    assert report.passed
    assert report.proven == report.entries == 1801
    assert set(report.holds.values()) == {1801}
    assert report.intervals == 1801
    assert report.without_bound == 0
    assert 0.3 < report.max_gamma < 0.35
    assert report.max_angle_deg == pytest.approx(math.degrees(2 * math.atan(report.max_gamma)))
    assert 0.99 < report.max_euler_radius < 1.0
    # Up to 3060 elec. min^-1 the gain is the exactly positive real one; beyond, nearly.
    assert report.max_negative_gain_band_rad_s < 5.0


@BOTH
def test_gamma_below_the_floor_is_rejected_at_every_speed(folder: Path) -> None:
    table = read_stored_table(folder)
    for k in SAMPLE:
        assert not check_entry(table, k).failing
        below = Fraction(0.99 * floor_of(table, k))
        rejected = check_entry(with_entry(table, k, gamma=below), k).failing
        assert any(name.startswith("gamma (14)") for name in rejected)


@BOTH
def test_three_times_l1_is_rejected_at_every_speed(folder: Path) -> None:
    table = read_stored_table(folder)
    for k in SAMPLE:

        def triple(gain: list) -> None:
            gain[0], gain[1] = 3 * gain[0], 3 * gain[1]

        assert check_entry(with_gain(table, k, triple), k).failing


@BOTH
def test_wrong_sign_of_im_l2_is_rejected(folder: Path) -> None:
    table = read_stored_table(folder)

    def flip(gain: list) -> None:
        gain[3] = -gain[3]

    # From 60 elec. min^-1 up; near 2000 Im l2 passes through zero, where nothing can be told.
    for k in [*range(30, 600, 19), 1500, 1800]:
        assert check_entry(with_gain(table, k, flip), k).failing
    whole = dataclasses.replace(
        table,
        gain=tuple((*g[:3], -g[3]) if k >= 30 else g for k, g in enumerate(table.gain)),
    )
    report = certify(whole)
    assert not report.passed
    assert report.proven < 0.5 * report.entries


@BOTH
def test_each_inequality_is_checked_on_its_own(folder: Path) -> None:
    """Each requirement made impossible in turn: exactly its inequality fails."""
    table, k = read_stored_table(folder), 150
    cases = {
        "disc (15)": {"radius_per_s": Fraction(999)},
        "decay (16)": {"decay_per_s": Fraction(100)},
        "Euler disc": {"period_s": Fraction(1, 499)},
    }
    for name, change in cases.items():
        machine = dataclasses.replace(table.machine, **change)
        assert check_entry(dataclasses.replace(table, machine=machine), k).failing == (name,)
    X = table.X[k]
    assert "X > 0" in check_entry(with_entry(table, k, X=tuple(-x for x in X)), k).failing
    doubled = dataclasses.replace(table.machine, dw0_rad_s=2 * table.machine.dw0_rad_s)
    assert any(
        name.startswith("gamma (14)")
        for name in check_entry(dataclasses.replace(table, machine=doubled), k).failing
    )


@BOTH
def test_an_entry_holds_between_the_grid_speeds(folder: Path) -> None:
    """Inside the interval as at its ends, with the gamma that is claimed; far outside not."""
    table = read_stored_table(folder)
    for k in SAMPLE:
        assert check_entry(table, k).interval
        gamma, X = table.gamma[k], hermitian(*table.X[k])

        def unproven(steps: Fraction, k: int = k, gamma=gamma, X=X) -> list[str]:
            omega_rad_s = (k + steps) * table.step_rad_s
            A = table.machine.error_matrix(omega_rad_s, table.gain[k][:2], table.gain[k][2:])
            return failing(table.machine, A, INTERVAL_ROOM * gamma, X)

        assert not any(unproven(Fraction(n, 8)) for n in range(-4, 5))
        # At high speed 1 % of gamma goes a long way; near the largest gamma it does not.
        assert k not in (29, 30, 31) or unproven(Fraction(-10))


def test_an_interval_needs_more_than_its_middle() -> None:
    """Steps ten times as long: the entry is proven, the speeds between it and the next not."""
    table, k = read_stored_table(FOLDERS[0]), 2
    coarse = dataclasses.replace(
        with_entry(table, k, **{name: getattr(table, name)[10 * k] for name in COLUMNS}),
        step_rad_s=10 * table.step_rad_s,
    )
    report = check_entry(coarse, k)
    assert not report.failing
    assert not report.interval


def test_a_gamma_of_one_bounds_nothing() -> None:
    table = read_stored_table(FOLDERS[0])
    useless = with_entry(table, 900, gamma=Fraction(1))
    assert check_entry(useless, 900).failing == (NO_BOUND,)
    report = certify(
        dataclasses.replace(useless, **{n: getattr(useless, n)[900:903] for n in COLUMNS})
    )
    # Moved to other speeds, but gamma is what it is.
    assert report.without_bound == 1
    assert report.max_angle_deg is None
    assert not report.passed
    other = dataclasses.replace(useless, method="pole_shift")
    assert NO_BOUND not in check_entry(other, 900).failing


@BOTH
def test_both_signs_of_the_speed_error_are_checked(folder: Path) -> None:
    """The vertices have different floors, and change places with the direction of rotation."""
    table, k = read_stored_table(folder), 30
    m, omega = table.machine, float(30 * table.step_rad_s)
    dw0, tau = float(m.dw0_rad_s), float(m.Rr_ohm / m.Lr_H)
    floor_of_other_vertex = dw0 / (2.0 * math.hypot(tau, omega + dw0 / 2.0))
    between = Fraction((floor_of(table, k) + floor_of_other_vertex) / 2.0)
    l1, l2 = table.gain[k][:2], table.gain[k][2:]
    A = m.error_matrix(k * table.step_rad_s, l1, l2)
    proven = hermitian(*table.X[k])
    at_plus = failing(m, A, between, proven)
    at_minus = failing(m, mirrored(A), between, mirrored(proven))
    assert "gamma (14) at +dw0" in at_plus
    assert "gamma (14) at -dw0" in at_minus
    assert failing(m, mirrored(A), table.gamma[k], mirrored(proven)) == []


def test_definiteness_is_exact_where_floating_point_is_not() -> None:
    def matrix(corner: Fraction) -> list:
        half = (Fraction(1, 3), Fraction(1, 7))
        return [
            [(Fraction(1), Fraction(0)), half],
            [(half[0], -half[1]), (corner, Fraction(0))],
        ]

    boundary = Fraction(1, 9) + Fraction(1, 49)
    tiny = Fraction(1, 10**40)
    assert is_positive_definite(matrix(boundary + tiny))
    assert not is_positive_definite(matrix(boundary))
    assert not is_positive_definite(matrix(boundary - tiny))
    not_hermitian = matrix(Fraction(1))
    not_hermitian[0][1] = (Fraction(1, 3), Fraction(-1, 7))
    assert not is_positive_definite(not_hermitian)


def test_definiteness_agrees_with_eigenvalues_of_random_matrices() -> None:
    rng, verdicts = np.random.default_rng(7), []
    for _ in range(200):
        root = rng.integers(-4, 5, (4, 4)) + 1j * rng.integers(-4, 5, (4, 4))
        hermitian = root @ root.conj().T - rng.integers(0, 12) * np.eye(4)
        least = np.linalg.eigvalsh(hermitian).min()
        if abs(least) < 1e-6:
            continue
        exact = [[(Fraction(int(x.real)), Fraction(int(x.imag))) for x in row] for row in hermitian]
        verdicts.append(is_positive_definite(exact))
        assert verdicts[-1] == (least > 0)
    assert 20 < sum(verdicts) < len(verdicts) - 20


def test_solve_returns_the_solution_or_none() -> None:
    rows = [[Fraction(0), Fraction(2)], [Fraction(3), Fraction(1)]]
    assert solve(rows, [Fraction(4), Fraction(5)]) == [Fraction(1), Fraction(2)]
    assert solve([[Fraction(1), Fraction(2)]] * 2, [Fraction(1), Fraction(1)]) is None


@BOTH
def test_table_without_multiplier_is_solved_for(folder: Path) -> None:
    """L = 0 and the table's own L, brought without gamma and X."""
    table = read_stored_table(folder)
    zero = (Fraction(0),) * 4
    for k in (0, 30, 900):
        bare = with_entry(table, k, gamma=None, X=None)
        found = check_entry(bare, k)
        assert not found.failing
        assert found.gamma == pytest.approx(float(table.gamma[k]), rel=1e-3)
        of_zero = check_entry(with_entry(bare, k, gain=zero), k)
        assert all(of_zero.holds.values())
        assert of_zero.gamma >= floor_of(table, k)
    # L = 0 has the whole regenerating wedge: .633 of the speed on Table 1's motor.
    if table.name == "hasegawa2005":
        assert of_zero.band_rad_s == pytest.approx(0.633 * float(900 * table.step_rad_s), rel=1e-3)


def test_what_holds_alone_is_told_apart() -> None:
    """The fast pole outside the disc: (15) fails, the others hold."""
    table, k = read_stored_table(FOLDERS[0]), 30
    machine = dataclasses.replace(table.machine, radius_per_s=Fraction(900))
    bare = with_entry(dataclasses.replace(table, machine=machine), k, gamma=None, X=None)
    report = check_entry(bare, k)
    assert report.holds == {
        "gamma (14)": True,
        "disc (15)": False,
        "decay (16)": True,
        "Euler disc": True,
    }
    assert "disc (15)" in report.failing

    def unstable(gain: list) -> None:
        gain[0] = -gain[0]

    report = check_entry(with_gain(bare, k, unstable), k)
    assert not any((report.holds["Euler disc"], report.holds["decay (16)"]))
    assert report.gamma == math.inf
    assert report.band_rad_s == math.inf


@pytest.fixture
def copied(tmp_path) -> Path:
    for name in ("motor.toml", "l_gain.json"):
        (tmp_path / name).write_bytes((FOLDERS[0] / name).read_bytes())
    return tmp_path


def edit(path: Path, old: str, new: str) -> None:
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")


def content_of(folder: Path) -> dict:
    return json.loads((folder / "l_gain.json").read_text(encoding="utf-8"))


def test_one_changed_digit_breaks_the_crc(copied: Path) -> None:
    l1_re_per_s = content_of(copied)["entries"][700]["L"][0]
    edit(copied / "l_gain.json", f"[{l1_re_per_s},", f"[{l1_re_per_s + 1e-4:.9g},")
    faults = read_stored_table(copied).faults
    assert len(faults) == 1
    assert faults[0].startswith("crc32c: ")


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ('"method": "gamma_pr"', '"method": "zero"', "method"),
        ('"step_rad_s": 0.209439516', '"step_rad_s": 0.209439546', "step_rad_s"),
        ('"motor_id": "', '"motor_id": "0', "motor_id"),
        ('"Rs_ohm": 0.93', '"Rs_ohm": 0.94', "inputs.circuit.Rs_ohm"),
        ('"inputs_sha256": "', '"inputs_sha256": "0', "inputs_sha256"),
        ('"motor": "hasegawa2005"', '"motor": "other"', "motor"),
    ],
)
def test_contradiction_in_the_json_is_named(copied: Path, old: str, new: str, fault: str) -> None:
    assert read_stored_table(copied).faults == ()
    edit(copied / "l_gain.json", old, new)
    assert any(text.startswith(f"{fault}: ") for text in read_stored_table(copied).faults)


def test_a_missing_entry_is_named(copied: Path) -> None:
    lines = (copied / "l_gain.json").read_text(encoding="utf-8").splitlines(keepends=True)
    (copied / "l_gain.json").write_text("".join(lines[:900] + lines[901:]), encoding="utf-8")
    assert "entries: 1800 are stored, 1801 is right" in read_stored_table(copied).faults


def test_changed_motor_data_make_the_table_stale(copied: Path) -> None:
    edit(copied / "motor.toml", "Rr_ohm = 0.500", "Rr_ohm = 0.501")
    faults = read_stored_table(copied).faults
    assert faults == ("inputs.circuit.Rr_ohm: 0.5 in l_gain.json, 0.501 in motor.toml",)


def test_gain_at_standstill_has_to_be_real(copied: Path) -> None:
    edit(copied / "l_gain.json", "[-821.25,0.0,", "[-821.25,0.001,")
    assert any("L(0) is not real" in text for text in read_stored_table(copied).faults)


def test_pole_that_is_none_is_a_fault(copied: Path) -> None:
    edit(copied / "l_gain.json", "[-1000.0,0.0,-4.902,0.0]", "[-1000.0,0.0,-4.912,0.0]")
    assert "is no pole" in check_entry(read_stored_table(copied), 0).fault


@pytest.mark.parametrize(
    ("name", "old", "new", "message"),
    [
        ("motor.toml", "Rs_ohm = 0.930", "Rs_ohm = nan", r"circuit\.Rs_ohm: is 'nan'"),
        ("motor.toml", "Rs_ohm = 0.930", "Rs_ohm = -0.930", r"circuit\.Rs_ohm: .* positive"),
        ("motor.toml", "Rs_ohm = 0.930", "", r"circuit\.Rs_ohm: is missing"),
        ("motor.toml", "M_H = 0.102", "M_H = 0.110", r"circuit\.M_H: leaves no leakage"),
        ("motor.toml", "Ls_H = 0.110", "Ls_H = 110", r"toml:18: circuit\.Ls_H: .*; 0\.11 H if mH"),
        ("motor.toml", "[circuit]", "[circuit", r"not valid TOML"),
        ("l_gain.json", '"gamma"', '"gama"', r"gamma: key is missing"),
        ("l_gain.json", "-821.25,", "-821.25e99,", r"cannot be read as a gain table"),
        ("l_gain.json", "-821.25,", "Infinity,", r"Infinity is not a number"),
        ("l_gain.json", "-821.25,", "", r"cannot be read as a gain table"),
        ("l_gain.json", "-821.25,", '"-821.25x",', r"cannot be read as a gain table"),
        ("l_gain.json", "{", "[", r"not valid JSON"),
    ],
)
def test_unusable_file_is_one_clear_error(
    copied: Path, name: str, old: str, new: str, message: str
) -> None:
    edit(copied / name, old, new)
    with pytest.raises(UserError, match=rf"{name.replace('.', '[.]')}: .*{message}|{message}") as e:
        read_stored_table(copied)
    assert name in str(e.value)
    assert "\n" not in str(e.value)


def zh_certify(*arguments: object) -> subprocess.CompletedProcess:
    environment = os.environ | {"PYTHONPATH": str(ROOT / "tools")}
    command = [sys.executable, "-m", "zerohertz", "certify", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, env=environment, check=False)


def test_command_exits_1_for_a_defect_and_prints_one_json_object(copied: Path) -> None:
    good = zh_certify(copied, "--json")
    assert good.returncode == 0, good.stderr
    motor = json.loads(good.stdout)["motors"]["hasegawa2005"]
    assert motor["proven"] == motor["entries"] == 1801
    assert {
        "max_gamma",
        "max_angle_deg",
        "max_euler_radius",
        "max_negative_gain_band_rad_s",
    } <= set(motor)
    gamma = content_of(copied)["entries"][300]["gamma"]
    edit(copied / "l_gain.json", f'"gamma":{gamma},', f'"gamma":{0.9 * gamma:.6g},')
    bad = zh_certify(copied, "--json")
    assert bad.returncode == 1
    assert json.loads(bad.stdout)["motors"]["hasegawa2005"]["proven"] == 1800
    assert "600 elec. min^-1: not proven: gamma (14)" in bad.stdout
    (copied / "l_gain.json").unlink()
    missing = zh_certify(copied)
    assert missing.returncode == 2
    assert missing.stderr.startswith("error: ")


@pytest.mark.parametrize("method", ["gamma_pr", "closed_form", "pole_shift", "zero"])
def test_one_entry_less_than_all_fails_for_every_method(method: str) -> None:
    table = dataclasses.replace(read_stored_table(FOLDERS[0]), method=method)
    few = dataclasses.replace(table, **{name: getattr(table, name)[:4] for name in COLUMNS})
    assert certify(few).passed
    # Too small by a tenth: the pair of gamma and X of this entry proves nothing any more.
    report = certify(with_entry(few, 2, gamma=few.gamma[2] * Fraction(9, 10)))
    assert report.holds["Euler disc"] == report.entries == 4
    assert report.proven == 3
    assert not report.passed


@pytest.mark.parametrize("name", ["hasegawa2005_paper", "hasegawa2005_recommended"])
def test_command_fails_for_one_entry_of_the_tables_in_use(name: str, tmp_path: Path) -> None:
    folder = Path(shutil.copytree(ROOT / "gain_tables" / name, tmp_path / name))
    gamma = content_of(folder)["entries"][300]["gamma"]
    edit(folder / "l_gain.json", f'"gamma":{gamma},', f'"gamma":{0.9 * gamma:.6g},')
    done = zh_certify(folder)
    assert done.returncode == 1
    assert f"error: {name}: only 1800 of 1801 entries are proven" in done.stderr


def test_check_shares_no_code_with_the_design() -> None:
    allowed = tuple(
        f"zerohertz.{name}" for name in ("check", "console", "errors", "options", "paths")
    )
    for path in (ROOT / "tools" / "zerohertz" / "check").glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            names += [node.module] if isinstance(node, ast.ImportFrom) else []
            for name in names:
                assert not name.startswith("zerohertz") or name.startswith(allowed), path


@BOTH
def test_pictures_are_drawn_and_repeatable(folder: Path, tmp_path) -> None:
    for draw in (figure_4, figure_gamma):
        first, second = tmp_path / "1.png", tmp_path / "2.png"
        draw(folder / "l_gain.json", first)
        draw(folder / "l_gain.json", second)
        assert first.read_bytes() == second.read_bytes()
        assert first.stat().st_size > 20_000
