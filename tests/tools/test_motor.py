"""motor.toml: what is accepted, and that every mistake names file, key and remedy in one line."""

from __future__ import annotations

import copy
import re
import tomllib
from pathlib import Path

import pytest

from zerohertz.motor import MotorError, load_motor, motor_from_dict, motor_toml, with_design
from zerohertz.paths import ROOT

FOLDERS = [ROOT / "gain_tables" / name for name in ("hasegawa2005", "im_4kw_400v")]


@pytest.fixture
def content() -> dict:
    return tomllib.loads((FOLDERS[0] / "motor.toml").read_text(encoding="utf-8"))


def test_table_1_gives_the_derived_numbers_of_the_paper() -> None:
    circuit = load_motor(FOLDERS[0]).circuit
    assert circuit.eps_H == pytest.approx(8.0e-3, rel=1e-12)
    assert circuit.sigma_Ls_H == pytest.approx(8.0e-3, rel=1e-12)
    assert circuit.tau_per_s == pytest.approx(0.5 / 0.102, rel=1e-12)
    assert circuit.a11_per_s == pytest.approx((0.93 + 0.5) / 8.0e-3, rel=1e-12)


def test_second_machine_has_the_factor_m_over_lr_that_table_1_hides() -> None:
    motor = load_motor(FOLDERS[1])
    c = motor.circuit
    assert c.M_H / c.Lr_H <= 0.98
    assert motor.nameplate.power_W >= 2200.0
    assert motor.nameplate.voltage_V == 400.0
    sigma = 1.0 - c.M_H**2 / (c.Ls_H * c.Lr_H)
    assert c.sigma_Ls_H == pytest.approx(sigma * c.Ls_H, rel=1e-12)
    assert c.eps_H == pytest.approx(sigma * c.Ls_H * c.Lr_H / c.M_H, rel=1e-12)
    expected = (c.Rs_ohm + c.M_H**2 * c.Rr_ohm / c.Lr_H**2) / (sigma * c.Ls_H)
    assert c.a11_per_s == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(
    ("section", "key", "value", "why"),
    [
        ("circuit", "Rs_ohm", -0.93, "greater than zero"),
        ("circuit", "Rr_ohm", 0.0, "greater than zero"),
        ("circuit", "Lr_H", float("nan"), "finite"),
        ("circuit", "Ls_H", float("inf"), "finite"),
        ("circuit", "Ls_H", 10**400, "finite"),
        ("circuit", "M_H", 0.2, "no leakage"),
        ("circuit", "M_H", "0.1", "a number is needed"),
        ("circuit", "M_H", True, "a number is needed"),
        ("circuit", "L_H", 0.1, "unknown key"),
        ("nameplate", "pole_pairs", 1.5, "whole number"),
        ("mechanics", "J_kg_m2", [1.0], "a number is needed"),
        ("motor", "name", "Motor 1", "C identifier"),
        ("motor", "source", "", "a text is needed"),
        ("design", "method", "lqr", "known are gamma_pr"),
        ("design", "relax", 0.9, "1 or more"),
        ("design", "p1_per_s", 1000.0, "less than zero"),
        ("design", "table_end_elec_per_min", 3601, "even number"),
        ("design", "table_end_elec_per_min", 5000, "32 KiB"),
    ],
)
def test_bad_value_names_file_key_and_reason(
    content: dict, section: str, key: str, value: object, why: str
) -> None:
    content[section][key] = value
    with pytest.raises(MotorError) as caught:
        motor_from_dict(content, "some/motor.toml")
    message = str(caught.value)
    assert message.startswith(f"some/motor.toml: {section}.{key}: ")
    assert why in message
    assert "\n" not in message


def test_leakage_is_needed_right_up_to_the_limit(content: dict) -> None:
    limit = (content["circuit"]["Ls_H"] * content["circuit"]["Lr_H"]) ** 0.5
    content["circuit"]["M_H"] = limit * (1.0 - 1e-6)
    assert motor_from_dict(content).circuit.eps_H > 0.0
    content["circuit"]["M_H"] = limit * (1.0 + 1e-6)
    with pytest.raises(MotorError, match="no leakage"):
        motor_from_dict(content)


@pytest.mark.parametrize(
    ("section", "key", "value", "text"),
    [
        ("circuit", "Ls_H", 110.0, "circuit.Ls_H: is 110 H, 2.23e+03 times the rated impedance"),
        ("circuit", "M_H", 102.0, "0.102 H if mH was meant"),
        ("circuit", "Lr_H", 1.02e-4, "circuit.Lr_H: is 0.000102 H, 0.00206 times"),
        ("circuit", "Rs_ohm", 930.0, "0.93 ohm if mohm was meant"),
        ("circuit", "Rr_ohm", 5e-5, "circuit.Rr_ohm: is 5e-05 ohm, 2.68e-06 times"),
        ("nameplate", "current_A", 8700.0, "look at its unit, and at voltage_V and current_A"),
        ("nameplate", "speed_rpm", 1800.0, "nameplate.speed_rpm: is 1800; rated speed lies"),
        ("nameplate", "speed_rpm", 900.0, "the synchronous 1800 min"),
        ("nameplate", "pole_pairs", 4, "the synchronous 900 min"),
    ],
)
def test_what_no_motor_has_is_a_slip_of_the_unit(
    content: dict, section: str, key: str, value: float, text: str
) -> None:
    content[section][key] = value
    with pytest.raises(MotorError, match=re.escape(text)):
        motor_from_dict(content)


@pytest.mark.parametrize(
    ("section", "key", "value", "text"),
    [
        (
            "nameplate",
            "power_W",
            1.5,
            "is 1.5 W, and voltage_V = 200 with current_A = 6.2",
        ),
        ("nameplate", "voltage_V", 115.0, "draw 1235 VA; look at its unit, and at the connection"),
        ("nameplate", "torque_Nm", 0.84, "is 0.84 Nm, and power_W = 1500 at speed_rpm = 1710 is"),
        ("mechanics", "J_kg_m2", 150.0, "is 150 kg m2; a motor of 8.4 Nm has about 0.0086"),
        ("mechanics", "J_kg_m2", 1.5e-5, "a motor of 8.4 Nm has about 0.0086"),
        ("design", "period_s", 200.0, "is 200 s; the firmware takes 2e-05 .. 0.002"),
    ],
)
def test_values_that_contradict_one_another_are_refused_with_both(
    content: dict, section: str, key: str, value: float, text: str
) -> None:
    content[section][key] = value
    with pytest.raises(MotorError, match=re.escape(text)):
        motor_from_dict(content)


def test_ten_henry_are_the_firmware_s_end_even_where_the_nameplate_agrees(content: dict) -> None:
    content["nameplate"] |= {"voltage_V": 28300.0}
    content["circuit"] |= {"Rs_ohm": 93.0, "Rr_ohm": 50.0, "Ls_H": 11.0, "Lr_H": 10.2, "M_H": 10.2}
    with pytest.raises(MotorError, match=r"Ls_H: is 11 H; the firmware takes 1e-06 \.\. 10"):
        motor_from_dict(content)


def test_a_mistake_in_a_file_is_shown_with_its_line(tmp_path: Path) -> None:
    lines = (FOLDERS[1] / "motor.toml").read_text(encoding="utf-8").splitlines()
    number = next(k for k, line in enumerate(lines, start=1) if line.startswith("Ls_H"))
    lines[number - 1] = "Ls_H = 178.039"
    file = tmp_path / "motor.toml"
    file.write_text("\n".join(lines), encoding="utf-8")
    with pytest.raises(MotorError, match=rf"motor\.toml:{number}: circuit\.Ls_H: is 178\.039 H"):
        load_motor(tmp_path)


def test_every_missing_key_is_named(content: dict) -> None:
    for section, values in content.items():
        for key in values:
            broken = copy.deepcopy(content)
            del broken[section][key]
            with pytest.raises(MotorError, match=rf"motor\.toml: {section}\.{key}: key is missing"):
                motor_from_dict(broken)


def test_missing_and_unknown_sections_are_named(content: dict) -> None:
    with pytest.raises(MotorError, match=r"\[rotor\]: unknown section"):
        motor_from_dict(content | {"rotor": {}})
    del content["circuit"]
    with pytest.raises(MotorError, match=r"\[circuit\]: section is missing"):
        motor_from_dict(content)


def test_keys_of_a_method_are_needed_only_by_that_method(content: dict) -> None:
    for key in ("p1_per_s", "a", "b"):
        del content["design"][key]
    content["design"]["method"] = "zero"
    assert motor_from_dict(content).design.p1_per_s is None
    content["design"]["method"] = "pole_shift"
    with pytest.raises(MotorError, match=r"design\.real_factor: .* method pole_shift needs it"):
        motor_from_dict(content)


def test_unreadable_files_are_named(tmp_path) -> None:
    with pytest.raises(MotorError, match=r"motor\.toml: no such file"):
        load_motor(tmp_path)
    (tmp_path / "motor.toml").write_bytes(b"[motor\n\xff")
    with pytest.raises(MotorError, match=r"motor\.toml: not valid TOML"):
        load_motor(tmp_path)


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda f: f.name)
def test_written_motor_toml_reads_back_the_same(folder, tmp_path) -> None:
    motor = load_motor(folder)
    (tmp_path / "motor.toml").write_text(motor_toml(motor), encoding="utf-8")
    again = load_motor(tmp_path)
    assert again.inputs() == motor.inputs()
    assert again.inputs_sha256() == motor.inputs_sha256()


def test_hash_ignores_how_a_number_is_written_and_sees_what_it_is(content: dict) -> None:
    motor = motor_from_dict(content)
    content["nameplate"]["voltage_V"] = 200  # written as an integer
    assert motor_from_dict(content).inputs_sha256() == motor.inputs_sha256()
    content["nameplate"]["voltage_V"] = 201
    assert motor_from_dict(content).inputs_sha256() != motor.inputs_sha256()


def test_motor_id_follows_the_machine_and_not_the_design(content: dict) -> None:
    motor = motor_from_dict(content)
    assert with_design(motor, decay_per_s=2.0).machine_bytes() == motor.machine_bytes()
    content["circuit"]["Rs_ohm"] = 0.94
    assert motor_from_dict(content).machine_bytes() != motor.machine_bytes()
