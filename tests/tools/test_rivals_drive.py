"""The rivals in the drive: each takes the motor from rest to 1500 min^-1 and carries rated load.

The drive around them is `recommended` with what arena's entrant says, on the rig of its figures.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest

from zerohertz.build import IN_TREE, build_estimator, ensure_built
from zerohertz.estimators.chosen import DEFAULT
from zerohertz.paths import ROOT

ENTRANTS = ROOT / "tools" / "zerohertz" / "arena" / "entrants"
RUN = """
import json, sys
import numpy as np
from zerohertz import sim
from zerohertz.scenario.setup import load_setup

base, given, scenario = json.loads(sys.argv[1])
setup = load_setup(base)
record = sim.run(sim.Job(
    scenario=scenario, rig=setup.rig, board=setup.board, motor_dir=setup.motor_dir,
    firmware_config={**setup.params, **given}, decimate=50))
columns = ("t_s state speed_rpm speed_hat_rpm speed_ref_rpm torque_Nm flux_angle_err_deg "
           "lambda_Wb faults")
json.dump({"trip": int(record.trip),
           **{name: np.asarray(record[name], float).tolist() for name in columns.split()}},
          sys.stdout)
"""
# Magnetised and measured after 4.1 s.
SCENARIO = """
[scenario]
name = "rival"
duration_s = 9.5
run_on_s = 0.12
[profiles]
speed_ref_rpm = [[0.0, 0.0], [2.5, 0.0], [4.5, 1500.0]]
load_torque_Nm = [[0.0, 0.0], [6.0, 0.0], [6.01, 8.4], [7.8, 8.4], [7.81, -8.4]]
"""


def library(estimator: str) -> Path:
    """Of a drive around this estimator, as `zh arena` builds and keeps it."""
    if estimator == DEFAULT:
        return ensure_built().sil_library
    return build_estimator(IN_TREE / estimator).sil_library


# Measured: speed 9, 9, 10, 39, 9, 9, 8 min^-1 off, its estimate 1.1, .6, 1.1, 76, .8, 1.0, 1.7,
# the angle of the flux 9, 11.9, 8, 19, 13, 9, 12 degrees. The rig's Rr is 16 % and its M 15 %
# beyond the parameters: 1 % of the speed.
@pytest.mark.parametrize(
    ("name", "speed_rpm", "estimate_rpm", "angle_deg"),
    [
        ("compensated_voltage_model", 18.0, 6.0, 12.0),
        ("reduced_order", 18.0, 6.0, 12.0),
        ("ekf", 18.0, 6.0, 12.0),
        ("schauder_mras", 60.0, 110.0, 30.0),
        ("hybrid_crossover", 18.0, 6.0, 20.0),
        ("hinkkanen_full_order", 18.0, 6.0, 15.0),
        ("kubota_1993", 18.0, 6.0, 18.0),
    ],
)
def test_it_runs_to_1500_rpm_and_carries_rated_load(name, speed_rpm, estimate_rpm, angle_deg):
    entrant = tomllib.loads((ENTRANTS / f"{name}.toml").read_text())
    told = json.dumps((entrant["base"], entrant.get("parameters", {}), SCENARIO))
    environment = {**os.environ, "ZEROHERTZ_SIL": str(library(entrant["estimator"]))}
    command = (sys.executable, "-c", RUN, told)
    done = subprocess.run(command, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    record = {key: np.array(column) for key, column in json.loads(done.stdout).items()}
    assert record["trip"] == 0
    assert record["faults"].max() == 0.0
    t_s = record["t_s"]
    settled = ((t_s > 5.8) & (t_s < 6.0)) | ((t_s > 7.4) & (t_s < 7.8)) | (t_s > 9.2)
    assert np.abs(record["speed_rpm"][settled] - 1500.0).max() < speed_rpm
    assert np.abs(record["speed_hat_rpm"][settled] - 1500.0).max() < estimate_rpm
    # While the start reverses its small current, 2 to 4 % of the flux are left, and no angle is.
    magnetised = record["lambda_Wb"] > 0.05 * np.median(record["lambda_Wb"][settled])
    assert np.abs(record["flux_angle_err_deg"][magnetised]).max() < angle_deg
