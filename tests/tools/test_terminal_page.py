"""The page of the terminals says what the firmware's lists say, all of it."""

from __future__ import annotations

import re

from zerohertz.image import terminal_page
from zerohertz.paths import ROOT
from zerohertz.terminal_list import FOLDER, terminal_faults, terminal_parameters
from zerohertz.terminals import Fault


def listed(name: str, macro: str) -> list[str]:
    text = (FOLDER / name).read_text(encoding="utf-8")
    return re.findall(rf"^{macro}\((\w+),", text, re.MULTILINE)


def test_every_entry_is_understood():
    names = listed("terminal_params.def", "TERMINAL_[FE]")
    assert list(terminal_parameters()) == names
    assert [fault.name for fault in terminal_faults()] == listed(
        "terminal_faults.def", "TERMINAL_FAULT"
    )
    assert [fault.bit for fault in terminal_faults()] == list(range(len(terminal_faults())))
    assert {fault.reaction for fault in terminal_faults()} == {"WARN", "STOP", "OFF"}


def test_the_names_of_the_tools_are_those_of_the_list():
    assert {e.name: 1 << e.bit for e in terminal_faults()} == {f.name: f.value for f in Fault}


def test_a_choice_has_its_highest_number():
    text = (FOLDER / "terminal_params.def").read_text(encoding="utf-8")
    highest = dict(re.findall(r"^TERMINAL_E\((\w+), (\d+),", text, re.MULTILINE))
    for name, number in highest.items():
        assert len(terminal_parameters()[name].choices) == int(number) + 1


def test_the_page_names_every_parameter_fault_and_terminal():
    text = terminal_page.page_text()
    for name in (*terminal_parameters(), *(fault.name for fault in terminal_faults())):
        assert f"`{name}`" in text
    header = (ROOT / "hal" / "include" / "hal_terminals.h").read_text(encoding="utf-8")
    for name in re.findall(r"HAL_TERMINAL_([A-Z_]+) +\(1u << \d+\)", header):
        said = {"ANALOG": "0-10 V", "SINK_SENSOR": "heat-sink", "MOTOR_SENSOR": "winding"}
        said |= {"BRAKE_RELEASE": "coil of", "CONTACTOR": "contactor past"}
        said |= {"CHOPPER": "brake transistor's driver"}
        assert said.get(name, name) in text


def test_the_committed_page_is_that_of_the_lists():
    assert not terminal_page.stale()


def test_a_page_that_is_not_the_lists_is_stale(tmp_path, monkeypatch):
    monkeypatch.setattr(terminal_page, "PAGE", tmp_path / "terminals.md")
    assert terminal_page.stale()
    terminal_page.write()
    assert not terminal_page.stale()
