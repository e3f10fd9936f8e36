"""Gain design: against the equations, a dense frequency scan, and the committed files."""

from __future__ import annotations

import ctypes
import json
import math
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from zerohertz.errors import UserError
from zerohertz.gain_design import command, cones
from zerohertz.gain_design.closed_form import closed_form_gain, gain_for_poles
from zerohertz.gain_design.command import default_motor_dirs
from zerohertz.gain_design.crc32c import crc32c
from zerohertz.gain_design.gamma_positive_real import GammaPositiveReal
from zerohertz.gain_design.machine import gamma_floor, observer_poles, state_matrix
from zerohertz.gain_design.pole_shift import pole_shift_gain
from zerohertz.gain_design.stored import float32_text, read_table_json
from zerohertz.gain_design.table import design_table, gains_of, speed_of_entry_rad_s, table_json
from zerohertz.motor import (
    Circuit,
    MotorError,
    load_motor,
    motor_toml,
    with_design,
)
from zerohertz.paths import ROOT

FOLDERS = [ROOT / "gain_tables" / name for name in ("hasegawa2005", "im_4kw_400v")]
MOTORS = [load_motor(folder) for folder in FOLDERS]
BOTH = pytest.mark.parametrize("motor", MOTORS, ids=lambda m: m.name)
BOTH_FOLDERS = pytest.mark.parametrize("folder", FOLDERS, ids=lambda f: f.name)
SPEEDS_ELEC_PER_MIN = (0, 2, 20, 60, 300, 1800, 3600)


def rad_s(elec_per_min: float) -> float:
    return elec_per_min * 2.0 * math.pi / 60.0


def zh(*arguments: object) -> subprocess.CompletedProcess:
    environment = os.environ | {"PYTHONPATH": str(ROOT / "tools")}
    command = [sys.executable, "-m", "zerohertz", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, env=environment, check=False)


def stored_gains(folder: Path) -> np.ndarray:
    gains = gains_of(read_table_json(folder / "l_gain.json"))
    return gains.astype(float).reshape(-1, 2, 2) @ np.array([1.0, 1.0j])


def gamma_by_frequency_scan(c: Circuit, omega: float, gain: np.ndarray, dw: float) -> float:
    """max |(I - G)(I + G)^-1| over stator frequency, G = I - G2 dw j, from eq. (11) in SI."""
    fine = np.concatenate([np.linspace(-20, 20, 4001), np.linspace(-3000, 3000, 6001)])
    A = state_matrix(c, omega)
    A[:, 0] += gain
    s = 1j * np.concatenate([fine, omega + fine])
    determinant = (s - A[0, 0]) * (s - A[1, 1]) - A[0, 1] * A[1, 0]
    G2 = (A[1, 0] / c.eps_H - (s - A[0, 0])) / determinant  # C2 (sI - A)^-1 [1/eps; -1]
    deviation = G2 * dw * 1j  # I - G
    return float(np.max(np.abs(deviation / (2.0 - deviation))))


@BOTH
def test_state_matrix_is_equation_1(motor) -> None:
    c, omega = motor.circuit, 40.0
    identity, J = np.eye(2), np.array([[0.0, -1.0], [1.0, 0.0]])
    sigma = 1.0 - c.M_H**2 / (c.Ls_H * c.Lr_H)
    eps = sigma * c.Ls_H * c.Lr_H / c.M_H
    real = np.block(
        [
            [
                -(c.Rs_ohm + c.M_H**2 * c.Rr_ohm / c.Lr_H**2) / (sigma * c.Ls_H) * identity,
                c.Rr_ohm / (eps * c.Lr_H) * identity - omega / eps * J,
            ],
            [c.M_H * c.Rr_ohm / c.Lr_H * identity, -c.Rr_ohm / c.Lr_H * identity + omega * J],
        ]
    )
    x = np.array([1.0 + 2.0j, -0.3 + 0.7j])
    expected = real @ np.array([1.0, 2.0, -0.3, 0.7])
    image = state_matrix(c, omega) @ x
    np.testing.assert_allclose(
        [image[0].real, image[0].imag, image[1].real, image[1].imag], expected, rtol=1e-12
    )


@BOTH
@pytest.mark.parametrize("elec_per_min", SPEEDS_ELEC_PER_MIN)
def test_gain_for_poles_places_them(motor, elec_per_min: float) -> None:
    omega, wanted = rad_s(elec_per_min), np.array([-700.0 + 30.0j, -20.0 - 5.0j])
    gain = gain_for_poles(motor.circuit, omega, *wanted)
    np.testing.assert_allclose(observer_poles(motor.circuit, omega, gain), wanted, rtol=1e-9)


@BOTH
def test_closed_form_makes_g1_exactly_positive_real(motor) -> None:
    c, omega = motor.circuit, rad_s(300)
    gain = closed_form_gain(c, omega, p1_per_s=-1000.0, a=1.0, b=0.2)
    A = state_matrix(c, omega)
    A[:, 0] += gain
    s = 1j * np.linspace(-2000.0, 2000.0, 8001)
    determinant = (s - A[0, 0]) * (s - A[1, 1]) - A[0, 1] * A[1, 0]
    # C1 (sI - A)^-1 Bw of eq. (8), without using that its numerator is s/eps.
    G1 = ((s - A[1, 1]) / c.eps_H - A[0, 1]) / determinant
    assert G1.real.min() >= -1e-9 * np.abs(G1).max()
    plain = state_matrix(c, omega)
    determinant = (s - plain[0, 0]) * (s - plain[1, 1]) - plain[0, 1] * plain[1, 0]
    G1 = ((s - plain[1, 1]) / c.eps_H - plain[0, 1]) / determinant
    assert G1.real.min() < -1e-2 * np.abs(G1).max()  # L = 0 is not


@BOTH
def test_pole_shift_scales_the_motor_poles(motor) -> None:
    omega = rad_s(900)
    gain = pole_shift_gain(motor.circuit, omega, real_factor=0.85, imag_factor=0.3)
    machine = np.linalg.eigvals(state_matrix(motor.circuit, omega))
    wanted = 0.85 * machine.real + 0.3j * machine.imag
    shifted = observer_poles(motor.circuit, omega, gain)
    np.testing.assert_allclose(shifted, wanted[np.argsort(wanted.real)], rtol=1e-9)


@BOTH
def test_gains_mirror_at_negative_speed(motor) -> None:
    c, omega = motor.circuit, rad_s(500)
    forms = {"p1_per_s": -1000.0, "a": 1.0, "b": 0.2}
    np.testing.assert_allclose(
        closed_form_gain(c, -omega, **forms), np.conj(closed_form_gain(c, omega, **forms))
    )


@pytest.mark.parametrize(
    ("elec_per_min", "gamma"),
    [(0, 0.3060), (60, 0.2190), (300, 0.0495), (1800, 0.00802), (3600, 0.00399)],
)
def test_least_gamma_of_table_1_is_the_known_one(elec_per_min: float, gamma: float) -> None:
    assert GammaPositiveReal(MOTORS[0]).least_gamma(rad_s(elec_per_min)) == pytest.approx(
        gamma, rel=2e-3
    )


@BOTH
def test_no_gain_beats_the_floor_nor_least_gamma(motor) -> None:
    rng, dw0 = np.random.default_rng(1), motor.design.dw0_rad_s
    lmi = GammaPositiveReal(motor)
    for elec_per_min in (0, 60, 600):
        omega = rad_s(elec_per_min)
        floor = gamma_floor(motor.circuit, dw0, omega)
        assert floor <= lmi.least_gamma(omega) * (1.0 + 1e-5)
        for _ in range(20):
            p1, p2 = -rng.uniform(1.5, 1400.0, 2) + 1j * rng.uniform(-200.0, 200.0, 2)
            gain = gain_for_poles(motor.circuit, omega, p1, p2)
            scans = [gamma_by_frequency_scan(motor.circuit, omega, gain, dw) for dw in (dw0, -dw0)]
            assert max(scans) >= floor * (1.0 - 1e-3)


@BOTH_FOLDERS
def test_stored_gamma_bounds_the_frequency_scan(folder: Path) -> None:
    motor, gains = load_motor(folder), stored_gains(folder)
    entries = read_table_json(folder / "l_gain.json")["entries"]
    gamma = [entry["gamma"] for entry in entries]
    tightest = 0.0
    for k in range(0, len(gains), 30):
        for dw in (motor.design.dw0_rad_s, -motor.design.dw0_rad_s):
            scan = gamma_by_frequency_scan(motor.circuit, speed_of_entry_rad_s(k), gains[k], dw)
            assert scan <= gamma[k]
            tightest = max(tightest, scan / gamma[k])
    assert tightest > 0.98  # 1.01 margin: the bound is no looser than it says


@BOTH
def test_stage_two_keeps_gamma_within_relax_where_the_reference_does_not(motor) -> None:
    omega, lmi, design = rad_s(3600), GammaPositiveReal(motor), motor.design
    least = lmi.least_gamma(omega)
    reference = closed_form_gain(
        motor.circuit, omega, p1_per_s=design.p1_per_s, a=design.a, b=design.b
    )
    assert lmi.multiplier(omega, reference).gamma > design.relax * least
    gain, multiplier = lmi.gain(omega)
    assert multiplier.gamma <= design.relax * least * (1.0 + 1e-4)
    assert np.linalg.norm((gain - reference) / reference) < 0.1
    wide = GammaPositiveReal(with_design(motor, relax=1.2)).gain(omega)[0]
    np.testing.assert_allclose(wide, reference, rtol=1e-6)  # enough room: the reference itself


@BOTH
def test_stage_two_does_not_depend_on_the_solver_settings(motor, monkeypatch) -> None:
    """1e-3 is what a redesign elsewhere has to keep: its own freedom must be far below."""
    omega, settings = rad_s(3600), cones._settings
    gain = GammaPositiveReal(motor).gain(omega)[0]
    monkeypatch.setattr(cones, "_settings", lambda careful: settings(not careful))
    monkeypatch.setattr(cones, "TOLERANCE", 1e-9)
    np.testing.assert_allclose(GammaPositiveReal(motor).gain(omega)[0], gain, rtol=2e-5)


@BOTH_FOLDERS
def test_stored_table_is_smooth_and_real_at_standstill(folder: Path) -> None:
    gains = stored_gains(folder)
    assert len(gains) == 1801
    assert np.all(gains[0].imag == 0.0)
    jumps = np.abs(np.diff(gains, axis=0))
    assert jumps[:, 0].max() < 5e-4 * np.abs(gains[:, 0]).max()
    assert jumps[:, 1].max() < 0.05 * np.abs(gains[:, 1]).max()


def test_impossible_requirements_name_the_keys() -> None:
    motor = with_design(MOTORS[0], radius_per_s=5.0, decay_per_s=4.9)
    with pytest.raises(MotorError, match=r"motor\.toml: design\.radius_per_s, .* no gain meets"):
        design_table(motor)


def test_circuit_whose_gain_no_float_holds_is_an_error() -> None:
    motor = with_design(MOTORS[0], method="closed_form", p1_per_s=-1e29, a=1e15)
    with pytest.raises(MotorError, match=r"circuit: L is beyond float32"):
        design_table(motor)


@BOTH
def test_tables_without_lmi_have_gamma_only_where_the_lmis_hold(motor) -> None:
    short = with_design(motor, method="closed_form", table_end_elec_per_min=20)
    assert all(gamma is not None for gamma in design_table(short).gamma)
    # p1 outside the disc: (15) cannot hold with any X.
    outside = with_design(short, p1_per_s=-1.1 * motor.design.radius_per_s)
    assert design_table(outside).gamma == (None,) * 11
    assert design_table(short, certificate=False).X == (None,) * 11


def test_crc32c_gives_the_standard_check_value() -> None:
    assert crc32c(b"123456789") == 0xE3069283
    assert crc32c(b"") == 0


class GainTable(ctypes.Structure):
    _fields_ = (
        *((name, ctypes.c_uint32) for name in ("magic", "version", "motor_id", "count", "crc")),
        ("step_rad_s", ctypes.c_float),
        ("entry", ctypes.POINTER(ctypes.c_float * 4)),
    )


@pytest.mark.parametrize("folder", default_motor_dirs(), ids=lambda folder: folder.name)
def test_the_c_array_is_the_json_bit_for_bit(folder, tmp_path) -> None:
    generated = (ROOT / "tools" / "generate_gain_table.py", folder, "--out", tmp_path)
    # Without the packages of a venv, as a build may run it.
    subprocess.run(["python3", "-S", *generated], check=True)
    library = tmp_path / "table.so"
    base = ROOT / "firmware" / "law" / "base"
    subprocess.run(
        [
            *("gcc", "-std=c11", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Werror"),
            *("-Wdouble-promotion", "-shared", "-fPIC", "-O1", "-I", base),
            *("-o", library, tmp_path / "l_gain.c", base / "gain_table.c", base / "num.c"),
        ],
        check=True,
    )
    content = read_table_json(folder / "l_gain.json")
    firmware = ctypes.CDLL(str(library))
    table = GainTable.in_dll(firmware, f"l_gain_{content['motor']}")
    data = b"".join(bytes(table.entry[k]) for k in range(table.count))
    assert data == gains_of(content).astype("<f4").tobytes()
    assert table.magic == 0x5A48474C
    assert table.crc == crc32c(data) == int(content["crc32c"], 16)
    assert f"{table.motor_id:08x}" == content["motor_id"]
    assert table.step_rad_s == np.float32(content["step_rad_s"]) == np.float32(math.pi / 15.0)
    firmware.gain_table_valid.restype = ctypes.c_bool
    assert firmware.gain_table_valid(ctypes.byref(table))


def test_committed_tables_are_what_a_fresh_design_gives() -> None:
    run = zh("design", "--check", "--json")
    assert run.returncode == 0, run.stderr
    motors = json.loads(run.stdout)["motors"]
    assert {"hasegawa2005", "im_4kw_400v"} <= set(motors)
    assert all(motor["largest_difference"] <= 1e-3 for motor in motors.values())
    assert all(motor["solves"] <= motor["entries"] for motor in motors.values())


@pytest.fixture
def short_motor(tmp_path) -> Path:
    """A folder with a designed table of eleven entries."""
    motor = with_design(MOTORS[1], table_end_elec_per_min=20)
    (tmp_path / "motor.toml").write_text(motor_toml(motor), encoding="utf-8")
    run = zh("design", tmp_path)
    assert run.returncode == 0, run.stderr
    return tmp_path


def read_gains(path: Path) -> np.ndarray:
    return gains_of(read_table_json(path))


def with_gain(path: Path, k: int, l1_re_per_s: np.float32) -> str:
    """Writes the table with another l1 of entry k and the CRC that goes with it; its text."""
    gains = read_gains(path)
    text = path.read_text(encoding="utf-8")
    crc = read_table_json(path)["crc32c"]
    old = float32_text(gains[k, 0])
    gains[k, 0] = l1_re_per_s
    text = text.replace(old, float32_text(gains[k, 0]), 1)
    text = text.replace(crc, f"{crc32c(gains.astype('<f4').tobytes()):08x}", 1)
    path.write_text(text, encoding="utf-8")
    return text


def test_design_writes_reproducible_files_and_keeps_what_holds(short_motor: Path) -> None:
    path = short_motor / "l_gain.json"
    assert path.read_text(encoding="utf-8") == table_json(design_table(load_motor(short_motor)))
    nudged = with_gain(path, 1, np.nextafter(read_gains(path)[1, 0], np.float32(0.0)))
    assert zh("design", short_motor).returncode == 0
    assert path.read_text(encoding="utf-8") == nudged  # within 1e-3: left as it is


def test_check_rejects_a_table_that_a_fresh_design_does_not_give(short_motor: Path) -> None:
    path = short_motor / "l_gain.json"
    with_gain(path, 5, read_gains(path)[5, 0] * np.float32(1.002))
    run = zh("design", "--check", short_motor)
    assert run.returncode == 1
    assert "off a fresh design" in run.stdout


def test_check_rejects_a_table_of_other_inputs(short_motor: Path) -> None:
    motor = with_design(load_motor(short_motor), decay_per_s=1.5)
    (short_motor / "motor.toml").write_text(motor_toml(motor), encoding="utf-8")
    run = zh("design", "--check", short_motor)
    assert run.returncode == 1
    assert "was designed for other inputs" in run.stdout


def test_other_method_goes_to_another_folder(short_motor: Path, tmp_path) -> None:
    refused = zh("design", short_motor, "--method", "zero")
    assert refused.returncode == 2
    assert refused.stderr.startswith("error: --method: ")
    out = tmp_path / "out"
    assert zh("design", short_motor, "--method", "zero", "--out", out).returncode == 0
    assert not np.any(read_gains(out / "im_4kw_400v" / "l_gain.json"))
    assert load_motor(out / "im_4kw_400v").design.method == "zero"


def test_a_motor_of_gain_tables_bears_the_name_of_its_folder(tmp_path, monkeypatch) -> None:
    """Two tables of one name could not be linked into one image."""
    monkeypatch.setattr(command, "ROOT", tmp_path)
    folder = tmp_path / "gain_tables" / "im_4kw_400v"
    folder.mkdir(parents=True)
    command._require_own_name(MOTORS[1], folder)
    with pytest.raises(UserError, match=r"motor\.name: is 'hasegawa2005', the folder is 'im_4kw"):
        command._require_own_name(MOTORS[0], folder)
    command._require_own_name(MOTORS[0], tmp_path)  # elsewhere a folder is called as one likes


def test_two_folders_of_one_motor_name_are_refused(short_motor: Path, tmp_path) -> None:
    other = shutil.copytree(short_motor, tmp_path / "other")
    run = zh("design", short_motor, other, "--out", tmp_path / "out")
    assert run.returncode == 2
    assert "motor.name: 'im_4kw_400v' is also that of" in run.stderr


def test_a_motor_may_be_named_by_its_file(short_motor: Path) -> None:
    run = zh("design", "--check", short_motor / "motor.toml", "--json")
    assert run.returncode == 0
    assert json.loads(run.stdout)["motors"]["im_4kw_400v"]["faults"] == []


def test_bad_motor_data_ends_with_one_line_and_exit_code_2(short_motor: Path) -> None:
    path = short_motor / "motor.toml"
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("M_H = 0.1722", "M_H = 0.2"), encoding="utf-8")
    run = zh("design", short_motor)
    assert run.returncode == 2
    assert re.match(rf"error: {path}:\d+: circuit\.M_H: ", run.stderr)
    assert run.stderr.count("\n") == 1
    shutil.rmtree(short_motor)
    assert zh("design", short_motor).returncode == 2
