"""zerohertz.configuration.plate_text: a nameplate in one line, and what it may not mean."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest
from typer.testing import CliRunner

from zerohertz.cli import make_app
from zerohertz.configuration import new, plate_text
from zerohertz.configuration.files import read_configuration
from zerohertz.configuration.plate_text import answer, missing, plate_of_text
from zerohertz.errors import UserError
from zerohertz.toml_file import toml_value

FOUR_KW = {
    "power_kW": 4.0,
    "voltage_V": 400.0,
    "current_A": 7.88,
    "connection": "star",
    "frequency_Hz": 50.0,
    "speed_rpm": 1435.0,
    "cos_phi": 0.82,
}
BOTH = "4 kW, 230/400 V, 13,7/7,88 A, 50 Hz, 1435 rpm, cos phi .82"


@pytest.mark.parametrize(
    "text",
    [
        "4 kW, 400 V, 7.88 A, star, 50 Hz, 1435 rpm, cos phi .82",
        "4 kW, 400 V, 7,88 A, Y, 50 Hz, 1435 min^-1, cos phi 0,82",
        "4kW,400V,7.88A,Y,50Hz,1435rpm,cos phi .82",
        "4 kW; 400 V; 7,88 A; wye; 50 Hz; 1435 1/min; cosφ ,82",
        "4000 W, 400 v, 7.88 a, STAR, 50 hz, 1435 r/min, PF .82,",
        "cos phi ,82, 1435 min⁻¹, 50 Hz, y, 7,88 A, 400 V, 4,0 kW",
    ],
)
def test_a_plate_is_read_as_it_is_printed(text: str) -> None:
    assert plate_of_text(text) == FOUR_KW
    assert missing(plate_of_text(text)) == []


def test_a_decimal_comma_is_one() -> None:
    said = plate_of_text("1,066 kW, 27,7 V, 0,0131 kg m2, 7,5 Nm, D")
    assert said["power_kW"] == 1.066
    assert said["voltage_V"] == 27.7
    assert said["J_kg_m2"] == 0.0131
    assert said["torque_Nm"] == 7.5
    assert said["connection"] == "delta"


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("5.5 HP", "give the power in kW: 4.101 kW"),
        ("5,5 hp", "give the power in kW: 4.101 kW"),
        ("10 PS", "give the power in kW: 7.355 kW"),
        ("1,435 rpm", "is it 1435 or 1.435"),
        ("1.435 min^-1", "is it 1435 or 1.435"),
        ("1,066 W", "is it 1066 or 1.066"),
        ("four kW", "'four kW': is not understood; write it like '4 kW"),
        ("50", "is not understood"),
        ("1,4,5 A", "is not understood"),
        ("400 V,7", "'7': is not understood"),
        ("4 kW 400 V", "is not understood"),
        ("4 kW, 5 kW", "power_kW is there twice"),
        ("Y, star", "connection is there twice"),
        ("Y/Y", "'star' is there twice"),
        ("D/Y, star", "leave out the one that is not wired"),
        ("50/60 Hz", "has two values"),
    ],
)
def test_what_can_be_read_in_two_ways_is_refused(text: str, why: str) -> None:
    with pytest.raises(UserError) as caught:
        plate_of_text(text)
    assert why in str(caught.value)


def test_a_plate_with_two_voltages_asks_which_connection_is_wired() -> None:
    said = plate_of_text(f"D/Y, {BOTH}")
    assert said["voltage_V"] == {"star": 400.0, "delta": 230.0}
    assert said["current_A"] == {"star": 7.88, "delta": 13.7}
    assert missing(said) == ["connection"]
    for wired, volts in (("Y", 400.0), ("delta", 230.0)):
        plate = new.require_plate(plate_of_text(BOTH, wired))
        assert plate.voltage_V == volts


def test_the_connection_may_be_an_option_but_no_second_opinion() -> None:
    assert plate_of_text("4 kW", "D")["connection"] == "delta"
    assert plate_of_text("4 kW, star", "Y")["connection"] == "star"
    with pytest.raises(UserError, match="--connection delta: the nameplate says star"):
        plate_of_text("4 kW, star", "delta")
    with pytest.raises(UserError, match="give star or delta"):
        plate_of_text("4 kW", "triangle")


def test_what_is_typed_may_have_a_comma() -> None:
    assert answer("current_A", " 7,88 ") == 7.88
    assert answer("connection", "D") == "delta"
    with pytest.raises(UserError, match="current_A: 'x' is not a number"):
        answer("current_A", "x")
    assert set(plate_text.HOW_TO_ASK) == set(FOUR_KW)


def test_both_voltages_are_kept_in_the_file(tmp_path: Path) -> None:
    folder = tmp_path / "my_motor"
    words = ["new", str(folder), "--nameplate", BOTH, "--connection", "Y", "--board", "stm32f405"]
    words += ["--application", "general", "--full-scale-A", "28", "--link-V", "566"]
    done = CliRunner().invoke(make_app(), words)
    assert done.exit_code == 0, done.exception
    assert "voltage_V = { star = 400.0, delta = 230.0 }" in (folder / "motor.toml").read_text()
    plate = read_configuration(folder).motor.plate
    assert (plate.voltage_V, plate.current_A, plate.connection) == (400.0, 7.88, "star")
    refused = CliRunner().invoke(make_app(), [*words[:4], *words[6:]])
    assert "connection is missing (star or delta)" in str(refused.exception)


def test_a_table_in_one_line_is_toml() -> None:
    assert tomllib.loads(f"x = {toml_value({'star': 400.0, 'delta': 'a'})}")["x"]["delta"] == "a"


@pytest.mark.parametrize(
    ("make", "why"),
    [
        (lambda path: None, "no such folder; correct the path"),
        (lambda path: path.mkdir(), "has no port.toml; a port is made from hal/template"),
        (lambda path: _port(path), r"\[boards\]: section is missing"),
    ],
)
def test_a_wrong_path_to_a_port_is_told(make, why: str, tmp_path: Path) -> None:
    make(tmp_path / "port")
    with pytest.raises(UserError, match=why):
        new.port_of(str(tmp_path / "port"))


def _port(path: Path) -> None:
    path.mkdir()
    (path / "port.toml").write_text('[image]\ninterrupts = ["x"]\n')


def test_a_file_is_no_folder(tmp_path: Path) -> None:
    (tmp_path / "my_motor").write_text("")
    with pytest.raises(UserError, match="is a file; take another name"):
        new.write_new(tmp_path / "my_motor", {})
