"""An estimator is a folder: swapped for the drive's own, and several side by side as libraries."""

from __future__ import annotations

import json
import math
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from zerohertz.build import HOST_TARGETS, ensure_built
from zerohertz.errors import UserError
from zerohertz.estimator import ESTIMATE, Estimator, Verb, built_library, events
from zerohertz.paths import BUILD, ROOT

MOTOR = ROOT / "gain_tables" / "hasegawa2005"
OTHER = ROOT / "tests" / "estimator" / "voltage_model"
FILES = ("CMakeLists.txt", "estimator_types.h", "estimator_signals.def")

SMOKE = """
import json, sys
from zerohertz import sim
record = sim.run(sim.Job(decimate=500))
columns = ("speed_rpm", "speed_hat_rpm", "lambda_Wb", "lambda_hat_Wb", "faults", "x_rad_s")
json.dump({**{name: float(record[name][-1]) for name in columns},
           "trip": int(record.trip), "signals": sim.signal_names()}, sys.stdout)
"""


def configured(folder: Path, estimator: Path | str) -> subprocess.CompletedProcess[str]:
    """The host's build with another estimator for the drive, hasegawa beside it, and the plant of
    the host's own build: it does not know the estimator, and takes half a minute to build."""
    built = ensure_built(*HOST_TARGETS).folder / "host_sim"
    options = (f"-DZH_ESTIMATOR={estimator}", "-DZH_ESTIMATORS=hasegawa", "-DZH_BUILD_TESTS=OFF")
    options += (f"-DZH_BUILT={built}",)
    command = ("cmake", "-S", ROOT, "--preset", "host", "-B", folder)
    return subprocess.run((*command, *options), cwd=ROOT, capture_output=True, text=True)


@pytest.fixture(scope="module")
def swapped() -> Path:
    """host_sim of a build whose drive has the other estimator; kept, as it takes a minute."""
    folder = BUILD / "voltage_model"
    made = configured(folder, OTHER)
    assert made.returncode == 0, made.stderr
    targets = ("zerohertz_sil", "zh_estimator_voltage_model", "zh_estimator_hasegawa")
    command = ("cmake", "--build", folder, "--parallel", "2", "--target", *targets)
    built = subprocess.run(command, capture_output=True, text=True)
    assert built.returncode == 0, built.stdout
    return folder / "host_sim"


def library(folder: Path, name: str) -> Path:
    return folder / f"lib{name}.so"


def turning_field(count: int = 10000, w: float = 60.0):
    """A motor at w el., no load: no slip, rotor current 0, flux M i."""
    Rs, Ls = 0.93, 0.110
    t = np.arange(count) * 200e-6
    i = 4.0 * np.exp(1j * w * t)
    u = (Rs + 1j * w * Ls) * 4.0 * np.exp(1j * w * (t - 100e-6))  # mean over the ended interval
    return events(count, u_alpha_V=u.real, u_beta_V=u.imag, i_alpha_A=i.real, i_beta_A=i.imag)


def from_speed(rows: np.ndarray, omega_e_rad_s: float) -> np.ndarray:
    return np.concatenate((events(1, verb=Verb.SEED, omega_e_rad_s=omega_e_rad_s), rows))


def test_the_drive_turns_with_another_estimator(swapped):
    environment = {**os.environ, "ZEROHERTZ_SIL": str(library(swapped, "zerohertz_sil"))}
    ran = subprocess.run(
        (sys.executable, "-c", SMOKE), env=environment, capture_output=True, text=True
    )
    assert ran.returncode == 0, ran.stderr
    end = json.loads(ran.stdout)
    assert (end["trip"], end["faults"]) == (0, 0)
    assert end["speed_rpm"] == pytest.approx(300.0, abs=3.0)
    assert end["speed_hat_rpm"] == pytest.approx(end["speed_rpm"], abs=3.0)
    assert end["lambda_hat_Wb"] == pytest.approx(end["lambda_Wb"], rel=0.02)
    # It has signals of its own, at the end of the list, and none of hasegawa's.
    assert end["signals"][-6] == "psi_s_alpha_Wb"
    assert "x_rad_s" not in end["signals"]
    assert end["x_rad_s"] == 0.0


@pytest.mark.parametrize("file", FILES)
def test_a_missing_file_is_named(tmp_path, file):
    folder = Path(shutil.copytree(OTHER, tmp_path / "voltage_model"))
    (folder / file).unlink()
    made = configured(tmp_path / "build", folder)
    assert made.returncode != 0
    said = " ".join(made.stderr.split())
    assert f"ZH_ESTIMATOR: no {folder}/{file}; a folder has what" in said


def test_a_target_of_another_name_is_named(tmp_path):
    folder = Path(shutil.copytree(OTHER, tmp_path / "renamed"))
    made = configured(tmp_path / "build", folder)
    assert made.returncode != 0
    said = " ".join(made.stderr.split())
    assert f"{folder}/CMakeLists.txt makes no law_estimator_renamed" in said


def test_two_estimators_in_one_process(swapped):
    rows = from_speed(turning_field(), 40.0)
    libraries = {
        "drive": None,
        "hasegawa": library(swapped, "zh_estimator_hasegawa"),
        "voltage_model": library(swapped, "zh_estimator_voltage_model"),
    }
    handles = {
        name: Estimator(MOTOR, period_s=200e-6, library=path) for name, path in libraries.items()
    }
    out = {name: np.empty(len(rows), dtype=ESTIMATE) for name in handles}
    for first in range(0, len(rows), 500):  # by turns
        for name, estimator in handles.items():
            out[name][first : first + 500] = estimator.run(rows[first : first + 500])
    assert out["hasegawa"].tobytes() == out["drive"].tobytes()
    assert out["voltage_model"].tobytes() != out["hasegawa"].tobytes()
    for name in ("hasegawa", "voltage_model"):
        late = out[name][-1000:]
        assert late["omega_e_rad_s"].mean() == pytest.approx(60.0, abs=0.3), name
        flux = np.hypot(late["lambda_alpha_Wb"], late["lambda_beta_Wb"])
        assert flux.mean() == pytest.approx(4.0 * 0.102, rel=0.02), name
    assert set(handles["hasegawa"].signals()) & set(handles["voltage_model"].signals()) == set()
    assert handles["hasegawa"].signals()["x_rad_s"] == pytest.approx(60.0, abs=1.0)


def test_the_drives_estimator_has_a_library_of_its_own():
    rows = from_speed(turning_field(1000), 55.0)
    with (
        Estimator(MOTOR, period_s=200e-6) as drive,
        Estimator(MOTOR, period_s=200e-6, library=built_library("hasegawa")) as alone,
    ):
        assert drive.run(rows).tobytes() == alone.run(rows).tobytes()


def test_verbs_do_what_the_contract_says():
    still = {"i_alpha_A": 4.0, "u_alpha_V": 0.93 * 4.0}
    with Estimator(MOTOR, period_s=200e-6) as estimator:
        held = estimator.run(events(20000, verb=Verb.HOLD, **still))[-1]
        assert held["omega_e_rad_s"] == 0.0
        assert held["lambda_alpha_Wb"] == pytest.approx(0.102 * 4.0, abs=1e-4)
        off = estimator.run(events(1, verb=Verb.OFF, omega_e_rad_s=7.0))[0]
        assert off["omega_e_rad_s"] == off["omega_s_rad_s"] == 7.0
        assert off["lambda_alpha_Wb"] == 0.0
        seed = events(1, verb=Verb.SEED, omega_e_rad_s=20.0, lambda_beta_Wb=0.3)
        seeded = estimator.run(seed)[0]
        assert (seeded["lambda_beta_Wb"], seeded["omega_s_rad_s"]) == (np.float32(0.3), 20.0)
        imposed = events(1, frame_imposed=1, omega_frame_rad_s=11.0, **still)
        assert estimator.run(imposed)[0]["omega_s_rad_s"] == 11.0
        reset = estimator.run(events(1, verb=Verb.RESET))[0]
        assert reset == np.zeros((), dtype=ESTIMATE)


def test_bad_input_is_refused():
    with pytest.raises(UserError, match="period_s"):
        Estimator(MOTOR, period_s=math.nan)
    with pytest.raises(UserError, match="no_such"):
        Estimator(MOTOR, {"no_such": 1.0}, period_s=200e-6)
    with Estimator(MOTOR, period_s=200e-6) as estimator:
        with pytest.raises(UserError, match="row 1: is not finite"):
            estimator.run(events(3, u_alpha_V=[0.0, math.nan, 0.0]))
        with pytest.raises(UserError, match="row 0: verb"):
            estimator.run(events(1, verb=9))
    with pytest.raises(UserError, match="is closed"):
        estimator.run(events(1))
