"""The port to copy links all that a finished port calls; its stubs say what they must do."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from zerohertz.build import build_image
from zerohertz.image import sizes
from zerohertz.paths import ROOT

SOURCE = ROOT / "hal" / "template" / "main.c"


@pytest.fixture(scope="module")
def symbols() -> dict[str, int]:
    """Sizes, by name without what the compiler appends to a clone."""
    elf: Path = build_image("template")
    return {name.split(".")[0]: size for name, (_, size) in sizes._symbols(elf).items()}


@pytest.mark.parametrize(
    ("what", "needs"),
    [
        ("start", {"unit_start", "cm_reset", "start_devices"}),
        ("link", {"link_read", "link_write", "carry_out", "identity"}),
        ("parameter store", {"flash_erase", "flash_program", "flash_read", "unit_background"}),
        ("access key", {"access_key", "entropy"}),
        ("fault record", {"fault_memory", "clock_us"}),
        ("trace", {"trace_memory"}),
    ],
)
def test_it_links(what: str, needs: set[str], symbols: dict[str, int]) -> None:
    assert needs - set(symbols) == set(), what


def test_memories_of_the_records_are_lent(symbols: dict[str, int]) -> None:
    assert symbols["trace_memory"] == 4096
    assert symbols["fault_memory"] > 2000


def test_every_stub_says_what_it_must_do() -> None:
    """The comment above it begins with FILL IN and is a sentence or more."""
    text = SOURCE.read_text()
    stubs = re.findall(r"/\* (.*?) \*/\n(?:STUB static [\w ]+?(\w+)|void (port_\w+))\(", text, re.S)
    told = {local or port: comment.rsplit("/*", 1)[-1] for comment, local, port in stubs}
    names = set(re.findall(r"STUB static [\w ]+?(\w+)\(", text))
    names |= set(re.findall(r"^void (port_\w+)\(", text, re.M))
    assert len(names) == 17
    assert set(told) == names
    assert [
        name for name, comment in told.items() if not comment.strip().startswith("FILL IN")
    ] == []
    assert [name for name, comment in told.items() if len(comment.split()) < 8] == []
