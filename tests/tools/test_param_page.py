"""The parameter list as data, and the page that is made of it."""

from __future__ import annotations

import pytest

from zerohertz import param_list
from zerohertz.drive import parameters
from zerohertz.errors import UserError
from zerohertz.image import param_page

LIST = """\
/* About the list. */

PARAM_F(MOTOR, Rs_ohm, "ohm", 1e-4f, 1e3f, 0.930f, PROTECTED, "stator resistance")
PARAM_E(SPEED, mode, WAYS, 1u, RUN,
        "|x|, "
        "or the rest")
PARAM_U(BOARD, bits, "", 8u, 16u, 14u, READY, "of the ADC")
"""
CHOICES = {"WAYS": ("off", "length", "rest")}


def test_an_entry_becomes_a_row_under_its_group():
    lines = param_page.page_text(param_list.parse(LIST, CHOICES)).splitlines()
    row = "| `Rs_ohm` | ohm | 1e-4 .. 1e3 | 0.930 | PROTECTED | stator resistance |"
    assert lines.index("## Motor") < lines.index(row) < lines.index("## Board")
    assert "| `bits` |  | 8 .. 16, whole | 14 | READY | of the ADC |" in lines
    choices = "0 `off`, 1 `length`, 2 `rest` | `length`"
    row = f"| `mode` |  | {choices} | RUN | \\|x\\|, or the rest |"
    assert lines.index("## Speed") < lines.index(row)
    assert not any(line.startswith("## Flux") for line in lines)


def test_an_entry_that_is_not_understood_is_refused():
    with pytest.raises(UserError, match="4 parameters, 3 understood"):
        param_list.parse(LIST + 'PARAM_F(MOTOR, broken, "ohm", 1e-4f)\n', CHOICES)


def test_the_list_as_text_is_the_list_as_built():
    listed, built = list(param_list.entries().values()), parameters()
    for of_text, of_library in zip(listed, built, strict=True):
        assert of_text.name == of_library.name
        assert of_text.whole == of_library.whole
        assert of_text.choices == of_library.choices
        assert param_list.groups()[of_text.group][0] == of_library.group
        assert of_text.initial == pytest.approx(of_library.initial, rel=1e-6)
        assert (of_text.unit, of_text.text) == (of_library.unit, of_library.text)


def test_a_former_name_is_no_name_of_today_and_a_renamed_one_is():
    former, today = param_list.former(), param_list.entries()
    assert not set(former) & set(today)
    renamed = {name: now.now for name, now in former.items() if now.now}
    assert renamed["impressed_A"] == "i_f_A"
    assert set(renamed.values()) <= set(today)
    assert param_list.no_such("impressed_A") == "is called i_f_A now"
    assert param_list.no_such("rs_track_low") == "is a constant now, 0.98"
    assert param_list.no_such("rs_low_A") == "is derived now: 0.625 rs_high_A"
    assert "no such parameter" in param_list.no_such("rs_lowest_A")


def test_a_choice_is_given_by_name_or_number():
    choices = param_list.entries()["lost_action"].choices
    assert param_list.number_of("fault", choices, "here") == 1.0
    assert param_list.number_of("2", choices, "here") == 2.0
    with pytest.raises(UserError, match="here: 'trip': give one of warn, fault, i_f"):
        param_list.number_of("trip", choices, "here")
    with pytest.raises(UserError, match="'much': is not a number"):
        param_list.number_of("much", (), "here")


def test_a_page_that_is_not_the_lists_is_stale(tmp_path, monkeypatch):
    page = tmp_path / "parameters.md"
    monkeypatch.setattr(param_page, "PAGE", page)
    assert param_page.stale()
    param_page.write()
    assert not param_page.stale()
    page.write_text(page.read_text() + " ")
    assert param_page.stale()
