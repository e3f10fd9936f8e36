"""The rules of the pages find what they are for."""

import subprocess
from pathlib import Path

import pytest

from zerohertz.paths import ROOT
from zerohertz.testing import page_rules
from zerohertz.testing.stages import CODESPELL

LONG = "word " * 25


def breaches(folder: Path, text: str) -> list[str]:
    page = folder / "page.md"
    page.write_text(text)
    return [what for _, what in page_rules.check_page(page)]


@pytest.mark.parametrize(
    ("text", "what"),
    [
        (LONG, "125 characters, at most 120"),
        (f"- {LONG}", "127 characters, at most 120"),
        ("see [there](nowhere.md)", "nothing at nowhere.md"),
        ("see [there](#no-such-heading)", "nothing at #no-such-heading"),
        ("see [there](other.md#missing)", "nothing at other.md#missing"),
    ],
)
def test_a_breach_is_found(tmp_path: Path, text: str, what: str) -> None:
    (tmp_path / "other.md").write_text("# Here\n")
    assert breaches(tmp_path, text) == [what]


@pytest.mark.parametrize(
    "text",
    [
        f"| {LONG} | in a table |",
        f"```sh\n{LONG}\n[x](nowhere.md)\n```",
        "[there](other.md#a-heading-with-code-2)",
        "# Two words\n\n[up](#two-words), [out](https://example.org)",
        "[the simulator](../twin.html)",
    ],
)
def test_what_is_allowed_is_no_breach(tmp_path: Path, text: str) -> None:
    (tmp_path / "other.md").write_text("## A heading, with `code` 2\n")
    assert breaches(tmp_path, text) == []


def test_every_page_is_looked_at() -> None:
    names = {page.relative_to(ROOT).as_posix() for page in page_rules.pages(ROOT)}
    assert {"README.md", "tools/docs/claims.md", "firmware/law/README.md"} <= names


def test_a_slip_of_spelling_is_found(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("The drive recieves a command.\n")
    found = subprocess.run((*CODESPELL, str(page)), capture_output=True, text=True, check=False)
    assert found.returncode != 0
    assert "recieves ==> receives" in found.stdout
