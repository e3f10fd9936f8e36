"""The parameters that the build puts into an image: those of the SIL firmware, float for float."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest

from zerohertz.board import BOARDS, board_file, read_board
from zerohertz.drive import Drive, parameters
from zerohertz.errors import UserError
from zerohertz.gain_design.command import default_motor_dirs
from zerohertz.image.param_header import header
from zerohertz.image.param_values import image_values
from zerohertz.motor import load_motor
from zerohertz.param_list import FIELDBUS, entries, float32
from zerohertz.paths import ROOT
from zerohertz.scenario.setup import CONFIGS, load_setup

SCRIPT = ROOT / "tools" / "generate_params.py"


def generate(*options: object) -> subprocess.CompletedProcess:
    """Without the packages of a venv, as a build runs it."""
    command = ["python3", "-S", "-B", str(SCRIPT), *map(str, options)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_the_list_is_the_firmwares() -> None:
    listed = entries()
    assert list(listed) == [p.name for p in parameters()]
    for p in parameters():
        mine = listed[p.name]
        assert (mine.lowest, mine.highest) == (p.minimum, p.maximum)
        assert float32(mine.initial) == p.initial
        assert mine.whole == p.whole


@pytest.mark.parametrize("board", sorted(file.stem for file in BOARDS.glob("*.toml")))
@pytest.mark.parametrize("folder", default_motor_dirs(), ids=lambda folder: folder.name)
def test_motor_and_board_scale_the_defaults_as_the_sil_does(folder: Path, board: str) -> None:
    file = board_file(board)
    with Drive(folder, file) as drive:
        wanted = {name: drive[name] for name in drive}
    assert image_values(load_motor(folder), read_board(file), {}, file) == wanted


@pytest.mark.parametrize("config", sorted(file.stem for file in CONFIGS.glob("*.toml")))
def test_a_configuration_gives_the_parameters_of_the_sil(config: str) -> None:
    setup = load_setup(config)
    with Drive(setup.motor_dir, setup.board, setup.params) as drive:
        wanted = {name: drive[name] for name in drive}
    found = dict(re.findall(r"\.(\w+) = ([^,]+),", header(config, fieldbus=True).text))
    assert {name: float32(float(text.rstrip("fu"))) for name, text in found.items()} == wanted


def test_an_image_without_a_fieldbus_lacks_its_parameters_alone() -> None:
    with_bus, without = (header("recommended", fieldbus=given).text for given in (True, False))
    lines = [line for line in with_bus.splitlines() if line not in without.splitlines()]
    names = re.findall(r"\.(\w+) =", "\n".join(lines))
    assert names == [name for name in entries() if name not in entries(fieldbus=False)]
    assert len(names) == 3
    assert all(entries()[name].group == FIELDBUS for name in names)


def test_the_script_names_what_the_header_was_made_from(tmp_path: Path) -> None:
    out = tmp_path / "new folder" / "image_params.h"
    made = generate("--config", "recommended", "--out", out, "--depfile", tmp_path / "d")
    assert made.returncode == 0, made.stderr
    assert out.read_text() == header("recommended").text
    rule = (tmp_path / "d").read_text()
    assert "new\\ folder/image_params.h:" in rule
    for name in ("recommended.toml", "paper.toml", "motor.toml", "l_gain.json", "param_list.def"):
        assert f"/{name}" in rule
    assert "/param_values.py" in rule


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("eps1_on_Hz = 3.0", "eps1_off_Hz: 2.5 has to be at least 3 with eps1_on_Hz = 3"),
        ("i_d_A = 9.0", "i_d_A: 9 has to be at most 8 with i_d_max_A = 8"),
        ("u_dc_min_V = 390.0", "u_dc_min_V: 390 has to be below 390 with u_dc_max_V = 390"),
        ("M_H = 0.1059", "period_s: 0.0002 has to be below .* with Ls_H = "),
        (
            "current_bandwidth_rad_s = 5000.0",
            "current_bandwidth_rad_s: 5000 has to be below 5000 with period_s",
        ),
        ("M_H = 0.106", "M_H: 0.106 has to be below 0.105925 with Ls_H = 0.11"),
        ("period_s = 3e-4", r"design\.period_s: the table is for 200 us at most, .* 300 us"),
        ("adc_bits = 8.5", "adc_bits: 8.5 is not a whole number"),
        ("adc_bits = 17", r"adc_bits: 17 is out of range; give 8 \.\. 16"),
        ("i_d_A = 1e60", "i_d_A: 1e[+]60 is out of range"),
        ("no_such = 1", "params.no_such: no such parameter"),
        ("i_d_A = nan", "params.i_d_A: is nan; a finite number"),
        ("i_d_A =", r"not valid TOML: .* \(at line 7, column 8\)"),
    ],
)
def test_bad_parameters_fail_the_build_by_file_and_name(
    tmp_path: Path, line: str, message: str
) -> None:
    head = '[config]\nname = "mine"\nmotor = "hasegawa2005"\nboard = "paper"\nrig = "ideal"\n'
    config = tmp_path / "mine.toml"
    config.write_text(f"{head}[params]\n{line}\n")
    failed = generate("--config", config, "--out", tmp_path / "h")
    assert failed.returncode == 2
    assert failed.stdout == ""
    assert re.fullmatch(rf"error: .*(mine\.toml|l_gain\.json): .*{message}.*\n", failed.stderr)
    assert not (tmp_path / "h").exists()


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("bits = 12", "bits = 40", r"adc\.bits: is 40; give a whole number of 8 \.\. 16"),
        ("bits = 12", "bits = 12.5", r"adc\.bits: is 12\.5; give a whole number"),
        ("[adc]", "[abc]", r"abc\.bits: unknown key; known are adc\.bits, "),
        ("current_A = 25.0", "", r"full_scale\.current_A: is missing; give a number"),
        ("current_A = 25.0", "current_A = -25.0", r"full_scale\.current_A: is -25\.0"),
        ("period_s = 200e-6", "period_s = inf", r"control\.period_s: is inf"),
        ("u_dc_V = 283.0", "u_dc_V = 500.0", r"inverter\.u_dc_V: is above full_scale\.dc_link_V"),
        ("[adc]", "[adc", r"cannot be read: .*line 6"),
    ],
)
def test_a_bad_board_fails_the_build_by_file_and_key(
    tmp_path: Path, old: str, new: str, message: str
) -> None:
    text = (BOARDS / "stm32f405.toml").read_text()
    assert old in text
    board = tmp_path / "myboard.toml"
    board.write_text(text.replace(old, new, 1))
    failed = generate("--config", "paper", "--board", board, "--out", tmp_path / "h")
    assert failed.returncode == 2
    assert re.match(rf"error: .*myboard\.toml: {message}", failed.stderr), failed.stderr


def test_unknown_names_are_refused_with_the_choices(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="--config: no 'best'; there are no_gain, paper, recomm"):
        header("best")
    with pytest.raises(UserError, match="--board: no board 'x'; there are board_540V, paper, stm"):
        header("paper", "x")
    with pytest.raises(UserError, match=r"motor\.toml: no such file"):
        header("paper", None, tmp_path)
