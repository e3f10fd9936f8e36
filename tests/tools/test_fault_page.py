"""The fault page says what fault_list.def says, all of it, and Python's names are those."""

from __future__ import annotations

import pytest

from zerohertz.drive import Fault
from zerohertz.errors import UserError
from zerohertz.image import fault_page

LIST = """\
FAULT(HOT, 0, WARN, "it is "
      "hot", "no air", "open a|b")
"""


def test_an_entry_becomes_a_row():
    assert "| 0 | `HOT` | WARN | it is hot | no air | open a\\|b |" in fault_page.page_text(LIST)


def test_an_entry_that_is_not_understood_is_refused():
    with pytest.raises(UserError, match="2 faults, 1 understood"):
        fault_page.entries(LIST + 'FAULT(COLD, 1, WARN, "it is cold")\n')


def test_the_names_of_the_tools_are_those_of_the_list():
    assert {e.name: 1 << e.bit for e in fault_page.entries()} == {f.name: f.value for f in Fault}


def test_the_committed_page_is_that_of_the_list():
    assert not fault_page.stale()


def test_a_page_that_is_not_the_lists_is_stale(tmp_path, monkeypatch):
    monkeypatch.setattr(fault_page, "PAGE", tmp_path / "faults.md")
    assert fault_page.stale()
    fault_page.write()
    assert not fault_page.stale()
    fault_page.PAGE.write_text(fault_page.page_text() + " ")
    assert fault_page.stale()
