"""zerohertz.configuration: one folder from nameplate to image, and what it refuses.

The tutorial's commands are executed as they are printed: of one motor here, of all five by
`zh campaign configurations`.
"""

from __future__ import annotations

import re
import shutil
import tomllib
from pathlib import Path

import pytest
from typer.testing import CliRunner

from zerohertz.cli import make_app
from zerohertz.configuration import campaign, checks, command, new
from zerohertz.configuration.derive import derive, firmware_file, nameplate_asked, rig_of
from zerohertz.configuration.files import FILES, read_configuration
from zerohertz.errors import UserError
from zerohertz.gain_design.command import motor_folder
from zerohertz.image.param_header import header
from zerohertz.link.client import Client
from zerohertz.link.command import sil_job
from zerohertz.link.server import DirectLine, LinkedDrive
from zerohertz.scenario.setup import config_file, load_setup
from zerohertz.toml_file import with_section

PLATE = "4 kW, 400 V, 7.88 A, star, 50 Hz, 1435 rpm, cos phi .82, .0131 kg m2"
LOW = "1.066 kW, 27.7 V, 34 A, star, 50 Hz, 1388 rpm, cos phi .854"
CIRCUIT = {"Rs_ohm": 1.405, "Rr_ohm": 1.395, "Ls_H": 0.178, "Lr_H": 0.178, "M_H": 0.172}


def zh(*words: object) -> str:
    """What the command says; UserError as the command line would tell it."""
    done = CliRunner().invoke(make_app(), [str(word) for word in words])
    if done.exception is not None and not isinstance(done.exception, SystemExit):
        raise done.exception
    assert done.exit_code == 0, done.output
    return done.output


def make(folder: Path, *options: object, plate: str = PLATE, board: str = "stm32f405") -> Path:
    scale = () if "--link-V" in options or board != "stm32f405" else _SCALE
    words = ("--nameplate", plate, "--board", board, "--application", "general")
    zh("new", folder, *words, *scale, *options)
    return folder


_SCALE = ("--full-scale-A", 28, "--link-V", 566)


@pytest.fixture(scope="module")
def designed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A 4 kW motor whose circuit is known, with its table."""
    folder = make(tmp_path_factory.mktemp("drives") / "my_motor")
    file = folder / "motor.toml"
    file.write_text(with_section(file.read_text(), "circuit", CIRCUIT))
    derive(folder)
    return folder


@pytest.fixture
def folder(designed: Path, tmp_path: Path) -> Path:
    """A copy to spoil."""
    return Path(shutil.copytree(designed, tmp_path / "my_motor"))


def change(folder: Path, file: str, old: str, fresh: str) -> int:
    """Replaces a line that begins so; its number."""
    path = folder / file
    lines = path.read_text().splitlines()
    at = next(k for k, line in enumerate(lines) if line.startswith(old))
    lines[at] = fresh
    path.write_text("\n".join(lines) + "\n")
    return at + 1


def test_the_page_goes_from_an_empty_folder_to_an_image(tmp_path: Path) -> None:
    """The low-voltage machine on its board; `zh campaign configurations` runs every motor."""
    page = campaign.blocks(campaign.PAGE.read_text())
    assert len(page) == 5
    first = page[0]
    assert [line.split()[1] for line in first] == [
        *("new", "commission", "design", "trial", "build", "flash"),
    ]
    for other in page[1:]:
        assert [line.split()[1] for line in other] == [line.split()[1] for line in first[:-1]]
    said = []
    for ran in campaign.run_block(first, tmp_path):
        assert ran.code == 0, f"{ran.command}\n{ran.output}"
        said.append(ran.output)
    assert "my_fan: held" in said[3]
    image = tmp_path / "drives" / "my_fan" / "build" / "image" / "firmware.bin"
    assert 90_000 < image.stat().st_size <= 120 * 1024  # the pages below the parameters
    header = next(image.parent.rglob("image_params.h")).read_text()
    assert '#define PARAMS_MOTOR  "my_fan"' in header
    assert ".current_full_scale_A = 60.15f" in header
    assert ".voltage_source = 1u" in header
    assert "stm32g4x.cfg" in said[5]


def test_a_configuration_is_named_once() -> None:
    with pytest.raises(UserError, match="--config paper: NAME is recommended; leave one"):
        zh("serve", "recommended", "--config", "paper")


@pytest.mark.parametrize("command", ["trial", "serve", "studio", "build", "commission", "flash"])
def test_a_wrong_path_is_called_one(command: str, tmp_path: Path) -> None:
    more = {"commission": ["--rig", "im_4kw_400v"], "studio": ["--no-browser"]}
    with pytest.raises(UserError, match=r"nothing: no such (folder|configuration); "):
        zh(command, tmp_path / "nothing", *more.get(command, []))


def test_the_files_are_read_as_they_were_written(designed: Path) -> None:
    c = read_configuration(designed)
    assert c.motor.plate.power_kW == 4.0
    assert c.motor.plate.connection == "star"
    assert c.board.port == "stm32f405"
    assert c.board.scaling.u_dc_V == 566.0
    assert c.application.speed_rpm == 1435.0
    assert c.motor.circuit is not None
    assert c.motor.circuit.M_H == 0.172


def test_what_is_derived_is_what_commissioning_derives(designed: Path) -> None:
    """One derivation: parameters_of of zerohertz.commission, then the application's."""
    from zerohertz.commission.folder import parameters_of, stored_parameters
    from zerohertz.commission.solve import identified
    from zerohertz.configuration.derive import board_of

    c = read_configuration(designed)
    plate = checks.total_plate(c)
    expected = parameters_of(identified(c.motor.circuit, plate), plate, board_of(c))
    told = stored_parameters(c.derived)
    changed = {name for name, value in expected.items() if told[name] != pytest.approx(value)}
    assert changed == {"speed_max_rad_s", "over_speed_rad_s"}
    assert told["speed_max_rad_s"] == pytest.approx(1435 * 2 * 3.14159265 / 30)
    assert load_setup(designed).params == told
    assert motor_folder(designed) == c.derived


def test_only_what_changed_is_made_again_and_the_reason_is_said(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    derive(folder)
    capsys.readouterr()
    derive(folder)
    assert capsys.readouterr().err == ""
    change(folder, "application.toml", "speed_rpm", "speed_rpm = 1000")
    c = derive(folder)
    said = capsys.readouterr().err
    assert "my_motor: application.toml changed; derived again: firmware.toml" in said
    assert "l_gain" not in said
    assert nameplate_asked(c).speed_rpm == 1000.0
    change(folder, "motor.toml", "Rr_ohm", "Rr_ohm = 1.5")
    derive(folder)
    said = capsys.readouterr().err
    assert "motor.toml changed; derived again" in said
    assert "l_gain.json" in said
    shutil.rmtree(folder / "build")
    derive(folder)
    assert "my_motor: derived: motor.toml, board.toml, rig.toml" in capsys.readouterr().err


def test_a_configuration_has_its_own_simulated_motor(folder: Path) -> None:
    assert rig_of(read_configuration(folder)).name == "rig.toml"
    text = (folder / "motor.toml").read_text()
    (folder / "motor.toml").write_text(with_section(text, "motor", {"rig": "im_4kw_400v"}))
    assert rig_of(read_configuration(folder)).stem == "im_4kw_400v"
    setup = load_setup(folder)
    assert setup.rig.is_file()
    assert setup.name == "my_motor"


# File, line to replace, its replacement, what the message says.
SLIPS = [
    ("motor.toml", "power_kW", "power_kW = 0.004", "efficiency"),
    ("motor.toml", "voltage_V", "voltage_V = 230.0", "star and delta differ"),
    ("motor.toml", "voltage_V", "voltage_V = { star = 400, delta = 300 }", "differ by 1.73"),
    ("motor.toml", "voltage_V", "voltage_V = { star = 400 }", "write { star = 400, delta = 230 }"),
    ("motor.toml", "connection", 'connection = "triangle"', "star, delta"),
    ("motor.toml", "J_kg_m2", "J_kg_m2 = 131", "a motor of 26.6 Nm has about"),
    ("motor.toml", "J_kg_m2", "torque_Nm = 2.66", "is 26.62 Nm; correct the one that is wrong"),
    ("motor.toml", "speed_rpm", "speed_rpm = 1500", "below a synchronous speed"),
    ("motor.toml", "cos_phi", "cos_fi = 0.82", "unknown key"),
    ("motor.toml", "Rs_ohm", "Rs_ohm = -1", "a positive number is needed"),
    ("motor.toml", "Rs_ohm", "Rs_ohm = 1405", "mohm was meant"),
    ("motor.toml", "M_H", "M_H = 0.2", "no leakage"),
    ("motor.toml", "current_A", "current_A = 20 A", "not valid TOML"),
    ("board.toml", "port", "port = 5", "name a preset"),
    ("board.toml", "bits", "bits = 99", "give a whole number of 8 .. 16"),
    ("board.toml", "u_dc_V", "u_dc_V = 24.0", "are possible, or raise the link"),
    ("board.toml", "u_dc_V", "u_dc_V = 900.0", "raise the full scale"),
    ("board.toml", "line_voltages", "line_voltages = 1", "write true or false"),
    ("board.toml", "i_trip_A", "i_trip_A = 30.0", "the sensors end at full_scale.current_A = 28"),
    ("board.toml", "i_trip_A", "i_trip_A = 9.0", "4.8 in"),
    ("board.toml", "i_trip_A", "u_dc_max_V = 900.0", "the sensor ends at"),
    ("board.toml", "i_trip_A", "u_dc_max_V = 500.0", "trip at once; raise"),
    ("board.toml", "i_trip_A", "u_dc_min_V = 600.0", "trip at once; lower"),
    ("board.toml", "period_s", "period_s = 0.2", "control.period_s"),
    ("board.toml", "period_s", "period_s = 0.009", "the firmware takes 2e-05 .. 0.002"),
    ("application.toml", "[params]", "[params]\nperiod_s = 1e-4", "is the board's"),
    ("application.toml", "speed_rpm", "speed_rpm = 0", "a positive number"),
    ("application.toml", "speed_rpm", "speed_rpm = 4000", "more than twice"),
    ("application.toml", "speed_rpm", "rpm = 1000", "unknown key; known are speed_rpm, current_A"),
    ("application.toml", "torque_Nm", "torque_Nm = 80", "lower it, or raise limits.current_A"),
    ("application.toml", "slowest_rpm", "slowest_rpm = 1500", "limits.speed_rpm = 1435; lower it"),
    ("application.toml", "[ramps]", "[ramps]\nup_rpm_per_s = 1e5", "for the inertia alone"),
    ("application.toml", "speed_rpm", "current_A = 30", "are possible"),
    ("application.toml", "speed_rpm", "current_A = 3", "lower it, or raise"),
    ("application.toml", "direction", 'direction = "up"', "give one of both, positive, negative"),
    ("application.toml", "restarts", "restarts = -1", "whole number of 0 .. 100"),
    ("application.toml", "[params]", "[params]\nspeed_loop = 1", "no such parameter"),
    ("application.toml", "[params]", "[params]\ni_max_A = 40.0", "with i_trip_A = "),
    ("application.toml", "[params]", "[params]\ni_d_A = 1e6", "out of range"),
    ("application.toml", "[modes]", "[mode]", "unknown section; known are limits, load"),
]


@pytest.mark.parametrize(("file", "old", "fresh", "why"), SLIPS, ids=lambda text: text[:24])
def test_a_slip_is_refused_with_file_key_and_remedy(
    folder: Path, file: str, old: str, fresh: str, why: str
) -> None:
    change(folder, file, old, fresh)
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    with pytest.raises(UserError) as caught:
        derive(folder)
    message = str(caught.value)
    assert why in message
    assert re.search(r"/(motor|board|application)\.toml[: ]", message)
    assert "\n" not in message
    assert before == {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_a_contradiction_is_shown_with_its_line(folder: Path) -> None:
    number = change(folder, "application.toml", "torque_Nm", "torque_Nm = 80")
    with pytest.raises(UserError, match=rf"application\.toml:{number}: load\.torque_Nm: is 80 Nm"):
        derive(folder)
    change(folder, "application.toml", "torque_Nm", "torque_Nm = 20")
    number = change(folder, "motor.toml", "Ls_H", "Ls_H = 178")
    with pytest.raises(UserError, match=rf"motor\.toml:{number}: circuit\.Ls_H: is 178 H"):
        derive(folder)


def test_a_period_that_the_motor_outruns_is_refused(folder: Path) -> None:
    for key in ("Ls_H", "Lr_H"):
        change(folder, "motor.toml", key, f"{key} = 0.1724")
    change(folder, "board.toml", "period_s", "period_s = 0.0005")
    with pytest.raises(
        UserError, match=r"board\.toml:\d+: control\.period_s: is 500 us, and .*286"
    ):
        derive(folder)


@pytest.mark.parametrize("name", FILES)
def test_a_file_that_is_missing_or_no_text_is_named(folder: Path, name: str) -> None:
    (folder / name).write_bytes(b"\xff\xfe")
    with pytest.raises(UserError, match=rf"{name}: is not UTF-8"):
        read_configuration(folder)
    (folder / name).unlink()
    with pytest.raises(UserError, match=rf"{name}: no such file; tools/zh new"):
        read_configuration(folder)


def test_without_a_circuit_the_next_command_is_said(tmp_path: Path) -> None:
    folder = make(tmp_path / "my_motor")
    with pytest.raises(UserError, match=r"\[circuit\]: section is missing; find it with tools/zh"):
        derive(folder)


def test_without_a_circuit_an_image_is_good_for_commissioning(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Of the real plate on the real board: it must be flashed before the motor can be found."""
    limits = ("--current-A", 23, "--speed-rpm", 700, "--torque-Nm", 3)
    folder = make(tmp_path / "my_fan", *limits, plate=LOW, board="stm32g431_esc")
    config = config_file(folder)
    assert "good for zh commission alone" in capsys.readouterr().err
    c = read_configuration(folder)
    text = header(str(config), str(c.derived / "board.toml"), c.derived).text
    assert ".observer_gain_enable = 0u" in text
    assert ".i_trip_A = 42.28499f" in text
    assert c.motor.circuit is None


def test_a_simulated_drive_is_one_of_the_folder(designed: Path) -> None:
    with LinkedDrive(sil_job(str(designed), "0", [])) as drive:
        line = DirectLine(drive, 10)
        line.pause(0.1)
        told = Client(line, timeout_s=10.0).get(["i_max_A", "dc_link_full_scale_V", "M_H"])
    assert told["dc_link_full_scale_V"] == 849.0
    assert told["M_H"] == pytest.approx(0.172)
    assert sil_job(str(designed), "0", [], "im_4kw_400v").board == load_setup(designed).board


def test_new_refuses_and_writes_nothing(tmp_path: Path) -> None:
    folder = tmp_path / "my_motor"
    for options, why in (
        ({"plate": "4 kW, 400 V"}, "current_A is missing"),
        ({"plate": "four kW"}, "is not understood"),
        ({"plate": f"{PLATE}, 5 kW"}, "power_kW is there twice"),
        ({"board": "arduino"}, "there are qemu_mps2, stm32f405, stm32g431_esc"),
        ({"plate": LOW, "board": "stm32g431_esc"}, "limits.current_A = 23.3"),
    ):
        with pytest.raises(UserError, match=re.escape(why)):
            make(folder, **options)
    with pytest.raises(UserError, match="--application"):
        zh("new", folder, "--nameplate", PLATE, "--board", "stm32f405", *_SCALE)
    with pytest.raises(UserError, match="a-z, 0-9 and _"):
        make(tmp_path / "My Motor")
    assert not folder.exists()
    assert not (tmp_path / "My Motor").exists()


def test_what_is_missing_is_asked_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(command, "somebody_answers", lambda: True)
    answers = "4\n400\n7.88\nstar\n50\n1435\n0.82\nstm32f405\nhoist\n"
    words = ["new", str(tmp_path / "my_hoist"), *(str(word) for word in _SCALE)]
    done = CliRunner().invoke(make_app(), words, input=answers)
    assert done.exit_code == 0, done.output
    assert "rated power, kW" in done.output
    c = read_configuration(tmp_path / "my_hoist")
    assert (c.motor.plate.current_A, c.board.port) == (7.88, "stm32f405")
    assert c.application.slowest_rpm == 0.0


def test_a_refusal_of_new_names_the_option(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"or raise the link; nothing was written: .*--link-V"):
        zh("new", tmp_path / "my_motor", "--nameplate", PLATE, "--board", "stm32f405",
           "--application", "general")  # fmt: skip


def test_a_small_motor_on_a_board_for_a_larger_one_has_an_image(tmp_path: Path) -> None:
    """The sum of the currents that is a fault is below its trip (current_sum_max_A)."""
    plate = "1,5 kW, 400 V, 3,4 A, Y, 50 Hz, 1425 rpm, cos phi ,79"
    folder = make(tmp_path / "my_saw", "--link-V", 566, plate=plate)
    c = derive(folder, guessed=True)
    text = header(str(firmware_file(c)), str(c.derived / "board.toml"), c.derived).text
    trip, most = (float(re.search(rf"\.{name} = ([\d.]+)f", text)[1])
                  for name in ("i_trip_A", "current_sum_max_A"))  # fmt: skip
    assert c.board.scaling.current_full_scale_A == 25.0
    assert most == pytest.approx(0.29 * trip)


def test_a_simulated_motor_with_another_plate_is_refused(tmp_path: Path) -> None:
    folder = make(tmp_path / "my_motor")
    with pytest.raises(UserError, match=r"another motor: its power_kW is 1.5, the nameplate's 4;"):
        zh("commission", folder, "--rig", "im_1kw5_200v")


def test_new_overwrites_nothing(folder: Path) -> None:
    before = (folder / "motor.toml").read_text()
    with pytest.raises(UserError, match="is there already and is left as it is"):
        make(folder)
    assert (folder / "motor.toml").read_text() == before


def test_star_and_delta_of_a_plate_follow_the_connection(folder: Path) -> None:
    change(folder, "motor.toml", "voltage_V", "voltage_V = { star = 400, delta = 230 }")
    change(folder, "motor.toml", "current_A", "current_A = { star = 7.88, delta = 13.7 }")
    assert read_configuration(folder).motor.plate.voltage_V == 400
    change(folder, "motor.toml", "connection", 'connection = "delta"')
    plate = read_configuration(folder).motor.plate
    assert (plate.voltage_V, plate.current_A) == (230, 13.7)


@pytest.mark.parametrize("kind", new.APPLICATIONS)
def test_every_application_gives_files_that_are_read_back(kind: str, tmp_path: Path) -> None:
    zh("new", tmp_path / kind, "--nameplate", PLATE, "--board", "stm32f405", "--application", kind,
       *_SCALE)  # fmt: skip
    c = read_configuration(tmp_path / kind)
    assert c.application.slowest_rpm == pytest.approx(new.APPLICATIONS[kind].slowest * 1435, 1e-3)


def test_what_is_found_is_added_and_the_rest_stays() -> None:
    text = "# mine\n[nameplate]\npower_kW = 4 # as printed\n\n[circuit]\nRs_ohm = 1\n\n[motor]\n"
    fresh = with_section(text, "circuit", {"Rs_ohm": 2.0})
    assert fresh == text.replace("Rs_ohm = 1", "Rs_ohm = 2.0")
    assert tomllib.loads(with_section(text, "mechanics", {"J_kg_m2": 0.5}))["mechanics"]
    assert with_section(text, "mechanics", {"J_kg_m2": 0.5}).startswith("# mine\n")
