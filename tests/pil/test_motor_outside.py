"""A motor folder outside the tree: -DZH_MOTOR puts its table into library and image."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from zerohertz.gain_design.stored import read_table_json
from zerohertz.gain_design.table import design_table, gains_of, table_json
from zerohertz.image import sizes
from zerohertz.motor import load_motor, motor_from_dict, motor_toml
from zerohertz.paths import ROOT


@pytest.fixture(scope="module")
def motor(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A slightly other machine with a table of 31 entries."""
    inputs = load_motor(ROOT / "gain_tables" / "im_4kw_400v").inputs()
    inputs["motor"]["name"] = "my_motor"
    inputs["circuit"]["Rs_ohm"] *= 1.1
    inputs["design"] |= {"method": "closed_form", "table_end_elec_per_min": 60}
    mine = motor_from_dict(inputs)
    folder = tmp_path_factory.mktemp("outside") / "my_motor"
    folder.mkdir()
    (folder / "motor.toml").write_text(motor_toml(mine), encoding="utf-8")
    (folder / "l_gain.json").write_text(table_json(design_table(mine)), encoding="utf-8")
    return folder


def cmake(*arguments: object) -> subprocess.CompletedProcess:
    command = ["cmake", *map(str, arguments)]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)


def test_the_image_is_built_for_the_motor_outside(motor: Path, tmp_path: Path) -> None:
    configured = cmake("--preset", "template", "-B", tmp_path, f"-DZH_MOTOR={motor}/")
    assert configured.returncode == 0, configured.stderr
    built = cmake("--build", tmp_path)
    assert built.returncode == 0, built.stdout
    image = (tmp_path / "firmware.bin").read_bytes()
    table = read_table_json(motor / "l_gain.json")
    assert gains_of(table).astype("<f4").tobytes() in image
    assert b"my_motor" in image
    assert str(motor.parent).encode() not in (tmp_path / "firmware.elf").read_bytes()
    assert sizes._symbols(tmp_path / "firmware.elf")["gain_entry"][1] == 31 * 16
    # The build follows the folder: a table for other inputs stops it.
    toml = motor / "motor.toml"
    text = toml.read_text(encoding="utf-8")
    toml.write_text(text.replace("decay_per_s = 1.0", "decay_per_s = 2.0"), encoding="utf-8")
    stale = cmake("--build", tmp_path)
    toml.write_text(text, encoding="utf-8")
    assert stale.returncode != 0
    assert re.search(r"error: .*l_gain\.json: inputs_sha256: .* run zh design", stale.stdout)
    assert cmake("--build", tmp_path).returncode == 0


@pytest.mark.parametrize(
    ("spoil", "missing"),
    [
        (lambda folder: (folder / "l_gain.json").unlink(), "l_gain.json"),
        (lambda folder: (folder / "motor.toml").unlink(), "motor.toml"),
        (lambda folder: folder.rename(folder.with_name("moved")), "motor.toml"),
    ],
)
def test_a_folder_that_is_none_is_refused(motor: Path, tmp_path: Path, spoil, missing) -> None:
    copy = shutil.copytree(motor, tmp_path / "my_motor")
    spoil(copy)
    refused = cmake("--preset", "template", "-B", tmp_path / "b", f"-DZH_MOTOR={copy}")
    assert refused.returncode != 0
    said = " ".join(refused.stderr.split())
    assert re.search(f"missing: .*/my_motor/{missing}; .* tools/zh design /", said)


def test_the_folder_bears_the_name_of_the_motor(motor: Path, tmp_path: Path) -> None:
    other = shutil.copytree(motor, tmp_path / "other")
    script = ROOT / "tools" / "generate_gain_table.py"
    run = subprocess.run(
        ("python3", "-S", script, other, "--out", tmp_path),
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 2
    assert "motor.name: is 'my_motor', the folder is 'other'; give both one name" in run.stderr
