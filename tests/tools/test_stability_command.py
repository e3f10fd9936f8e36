"""`zh stability`: maps, files, comparison with an atlas, complaints."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from typer.testing import CliRunner

from zerohertz.cli import make_app
from zerohertz.errors import UserError
from zerohertz.paths import ROOT
from zerohertz.scenario.setup import load_setup
from zerohertz.stability import compare, plane
from zerohertz.stability.firmware import GainTable

TABLE = ROOT / "gain_tables" / "hasegawa2005_recommended"


def run(*arguments):
    return CliRunner().invoke(make_app(), ["stability", *arguments])


def small_map(tmp_path, *more):
    files = ("--png", str(tmp_path / "map.png"), "--html", str(tmp_path / "map.html"))
    return run("--json", "--cells", "9x5", "--rs-ratio", "1", *files, *more)


def test_map_is_written_and_printed(tmp_path):
    result = small_map(tmp_path, "--set", "rs_measure=0")
    assert result.exit_code == 0
    found = json.loads(result.stdout)
    (panel,) = found["panels"]
    assert panel["points"] == 45
    assert panel["oriented"] == 45  # no error, positive-real gains
    assert np.shape(panel["verdict"]) == np.shape(panel["growth_per_s"]) == (5, 9)
    assert found["x"][0] == -6.0
    assert found["y_pct"][-1] == pytest.approx(150.0)
    assert (tmp_path / "map.png").read_bytes().startswith(b"\x89PNG")
    page = (tmp_path / "map.html").read_text(encoding="utf-8")
    assert "dominant mode" in page
    assert 'src="http' not in page  # needs no network


def test_table_none_and_firmware_rs_change_the_map(tmp_path):
    without = ("--table", "none", "--set", "phi_factor=0", "--set", "rs_measure=0")
    (panel,) = json.loads(small_map(tmp_path, *without).stdout)["panels"]
    assert panel["unstable"] > 0
    nearly = json.loads(small_map(tmp_path, "--firmware-rs", "1.02").stdout)["panels"][0]
    far = json.loads(small_map(tmp_path, "--firmware-rs", "0.7").stdout)["panels"][0]
    assert nearly["oriented"] > far["oriented"]


def test_speed_plane_is_the_atlas_grid(tmp_path):
    result = small_map(tmp_path, "--plane", "speed")
    found = json.loads(result.stdout)
    assert found["x"] == [0.0, 15.0, 30.0, 60.0, 120.0, 300.0, 900.0]
    assert len(found["y_pct"]) == 7
    assert found["panels"][0]["points"] == 49


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (("--table", "nowhere"), "--table: nowhere: no such gain table"),
        (("--cells", "3"), "--cells: '3' is not NxM"),
        (("--plane", "x"), "--plane: 'x'; known are frequency, speed"),
        (("--rs-ratio", "-1"), "--rs-ratio: is -1; give 0.1 .. 10"),
        (("--torque", "nan"), "--torque: is nan"),
        (("--set", "adapt_kp"), "--set: 'adapt_kp' is not NAME=VALUE"),
        (("--set", "adapt=1"), "--set: adapt: no such parameter"),
        (("--compare", "none.parquet"), "--compare: none.parquet"),
        (("--config", "none"), "no 'none'; there are no_gain"),
    ],
)
def test_complaints_name_the_option(arguments, complaint):
    result = run(*arguments)
    assert isinstance(result.exception, UserError)
    assert complaint in str(result.exception)


def atlas(path, outcomes, **changes):
    """An atlas of points whose verdict is known: 300 min^-1, motoring, no error: oriented."""
    n = len(outcomes)
    row = dict.fromkeys(("rs_ratio", "rr_ratio", "m_ratio", "leakage_ratio"), 1.0)
    row |= dict.fromkeys(("gain_u", "gain_v", "gain_w", "gain_uv", "gain_vw"), 1.0)
    row |= {"speed_rpm": 300.0, "load_pu": 0.5, "knee_Wb": 0.0, "drift_pu": 0.0}
    row |= {"J_kg_m2": 0.035, "coulomb_Nm": 0.4, "started": True} | changes
    columns = {k: v if isinstance(v, list) else [v] * n for k, v in row.items()}
    pq.write_table(pa.table(columns | {"outcome": outcomes}), path)


def test_comparison_counts_agreement_on_what_both_judge(tmp_path):
    path = tmp_path / "atlas.parquet"
    outcomes = ["oriented", "unsafe", "oriented", "oriented"]
    atlas(path, outcomes, started=[True, True, False, True], drift_pu=[0.0, 0.0, 0.0, 0.2])
    result = run("--compare", str(path), "--json")
    found = json.loads(result.stdout)
    assert (found["points"], found["judged"], found["agree"]) == (4, 2, 1)
    assert (found["not_started"], found["not_linear"]) == (1, 1)
    assert found["rows"][0]["atlas"] == "unsafe"
    assert found["rows"][0]["linear"] == "oriented"
    assert result.exit_code == 1
    atlas(path, ["oriented"] * 3)
    assert run("--compare", str(path)).exit_code == 0


def test_comparison_refuses_another_table(tmp_path):
    path = tmp_path / "other.parquet"
    pq.write_table(pa.table({"speed_rpm": [1.0]}), path)
    with pytest.raises(UserError, match=r"column load_pu is missing"):
        compare.read(path)


def test_sensor_gains_become_one_vector_gain():
    """Positive sequence of what unequal line gains make of a rotating voltage, by averaging it."""
    angle = np.linspace(0.0, 2.0 * np.pi, 4000, endpoint=False)
    u = np.exp(1j * angle)
    phase = [np.sqrt(2.0 / 3.0) * np.real(u * np.exp(-2j * np.pi * k / 3.0)) for k in range(3)]
    uv, vw = 1.02 * (phase[0] - phase[1]), 0.97 * (phase[1] - phase[2])
    seen = np.sqrt(2.0 / 3.0) * (uv + 0.5 * vw) + 1j * np.sqrt(0.5) * vw
    np.testing.assert_allclose(np.mean(seen * u.conj()), plane.voltage_gain(1.02, 0.97), rtol=1e-9)
    g = (1.03, 0.98, 1.01)
    currents = [a * b for a, b in zip(g, phase, strict=True)]
    seen = np.sqrt(2.0 / 3.0) * (currents[0] - 0.5 * (currents[1] + currents[2]))
    seen = seen + 1j * np.sqrt(0.5) * (currents[1] - currents[2])
    np.testing.assert_allclose(np.mean(seen * u.conj()), plane.current_gain(*g), rtol=1e-9)
    # Direct current along phase u: what a measurement of Rs sees.
    i = (1.0, -0.5, -0.5)
    i_alpha = g[0] * i[0] - 0.5 * (g[1] * i[1] + g[2] * i[2])
    assert plane.sensed_rs(*g, 1.02) == pytest.approx(1.02 * 1.5 / i_alpha)


def test_gain_table_is_the_stored_one_and_conjugate_backwards():
    table = GainTable.load(TABLE)
    assert len(table.l1_per_s) == 1801
    k = 300
    l1, l2 = table.at(np.array([k * table.step_rad_s, -k * table.step_rad_s, 1e4]))
    assert l1[0] == pytest.approx(table.l1_per_s[k], rel=1e-6)
    assert l2[1] == pytest.approx(np.conj(table.l2_ohm[k]), rel=1e-6)
    assert l1[2] == table.l1_per_s[-1]
    assert table.l1_per_s[0].imag == 0.0


def test_steering_keeps_away_from_zero_frequency_and_has_hysteresis():
    changes = {"steer_min_Hz": 0.67, "i_d_A": 5.0}
    fw = plane.firmware_of(load_setup("recommended"), None, changes)
    omega, torque = np.full(5, 12.0), np.array([-0.5, -5.0, -8.4, -3.0, 8.4])
    on = fw.steering.steers(omega, torque)
    # Too little torque; on the way; at zero; not yet; motoring needs none.
    np.testing.assert_array_equal(on, [False, False, True, False, False])
    flux = fw.lambda_nominal_Wb - fw.steering.below_Wb(omega, torque, on)
    slip = fw.circuit.Rr_ohm * torque / (fw.pole_pairs * flux**2)
    # Braking, it asks for 1.25 times the slip that would do.
    assert (omega + slip)[2] == pytest.approx(-2.0 * np.pi * 0.67 - 0.25 * 12.0, rel=1e-6)
    assert (flux[~on] == fw.lambda_nominal_Wb).all()
    # At nominal flux the field would turn with so much of w_min, in the sense of the torque: on up
    # to w_min, then only what was on before.
    w_min = 2.0 * np.pi * 0.67
    slip_per_Nm = fw.circuit.Rr_ohm / (fw.pole_pairs * fw.lambda_nominal_Wb**2)
    share = np.array([0.9, 1.1, 1.38, 1.42])
    torque = -(4.0 + share * w_min) / slip_per_Nm
    np.testing.assert_array_equal(fw.steering.steers(np.full(4, 4.0), torque), share < 1.4)
    at_once = dataclasses.replace(fw.steering, leave_rad_s=fw.steering.min_rad_s)
    np.testing.assert_array_equal(at_once.steers(np.full(4, 4.0), torque), share < 1.0)
