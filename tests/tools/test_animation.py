"""`zh animate`: the passage through zero frequency as a moving picture."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

from zerohertz.atlas import bench_run, special
from zerohertz.cli import make_app
from zerohertz.paths import ROOT
from zerohertz.report import animation
from zerohertz.scenario.setup import load_setup

MOST_BYTES = 1_500_000


def test_every_frame_moves_and_the_file_is_small(tmp_path: Path) -> None:
    path = tmp_path / "crossing.gif"
    made = animation.write_gif(load_setup("recommended"), path, load_pu=1.0, rs_ratio=1.0)
    assert made.bytes == path.stat().st_size < MOST_BYTES
    assert made.worst_rpm < 30.0  # the limit of `zh special slow_crossing`
    with Image.open(path) as picture:
        assert picture.n_frames == made.frames > 100
        shown = []
        for frame in (0, 40, 100, made.frames - 1):
            picture.seek(frame)
            shown.append(np.asarray(picture.convert("RGB")))
    assert all((a != b).any() for a, b in itertools.pairwise(shown))


def test_the_wedge_stands_where_the_simulated_stator_frequency_is() -> None:
    what = special.crossing(1.0)
    record = bench_run.run(load_setup("recommended"), what)
    steady = bench_run.window(record, 10.0, 20.0)  # a slow ramp: no transient of the flux
    flux_Wb = float(record["lambda_Wb"][steady].mean())
    for row in np.flatnonzero(steady)[::2000]:
        drawn_rpm = animation._speed_rpm(
            record["torque_Nm"][row], float(record["f_s_Hz"][row]), flux_Wb
        )
        assert drawn_rpm == pytest.approx(record["speed_rpm"][row], abs=5.0)


def test_the_committed_picture_is_small() -> None:
    assert (ROOT / "tools" / "docs" / "zero_crossing.gif").stat().st_size < MOST_BYTES


def test_another_format_is_refused(tmp_path: Path) -> None:
    done = CliRunner().invoke(make_app(), ["animate", "--gif", str(tmp_path / "a.png")])
    assert done.exit_code != 0
    assert "ends in .gif" in str(done.exception)
