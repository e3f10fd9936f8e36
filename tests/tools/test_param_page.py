"""The parameter page says what param_list.def says, all of it."""

from __future__ import annotations

import pytest

from zerohertz.drive import parameters
from zerohertz.errors import UserError
from zerohertz.image import param_page

LIST = """\
/* About the list. */

/* Motor: of the plate. */
PARAM_F(Rs_ohm, "ohm", 1e-4f, 1e3f, 0.930f, PROTECTED, "stator resistance")
PARAM_U(mode, "", 0u, 2u, 1u, RUN,
        "0: off, 1: |x|, "
        "2: rest")
"""


def test_an_entry_becomes_a_row_under_its_section():
    text = param_page.page_text(LIST)
    assert "## Motor\n\nMotor: of the plate.\n" in text
    row = "| `Rs_ohm` | ohm | 1e-4 | 1e3 | 0.930 | PROTECTED | stator resistance |"
    assert row in text.splitlines()
    row = "| `mode` | whole | 0 | 2 | 1 | RUN | 0: off, 1: \\|x\\|, 2: rest |"
    assert row in text.splitlines()


def test_an_entry_that_is_not_understood_is_refused():
    with pytest.raises(UserError, match="3 parameters, 2 understood"):
        param_page.page_text(LIST + 'PARAM_F(broken, "ohm", 1e-4f)\n')


def test_the_page_has_every_parameter_of_the_firmware():
    listed = [
        entry
        for group in param_page.entries(param_page.LIST.read_text()).values()
        for entry in group
    ]
    built = parameters()
    assert [entry.name for entry in listed] == [parameter.name for parameter in built]
    assert [entry.whole for entry in listed] == [parameter.whole for parameter in built]


def test_a_page_that_is_not_the_lists_is_stale(tmp_path, monkeypatch):
    page = tmp_path / "parameters.md"
    monkeypatch.setattr(param_page, "PAGE", page)
    assert param_page.stale()
    param_page.write()
    assert not param_page.stale()
    page.write_text(page.read_text() + " ")
    assert param_page.stale()
