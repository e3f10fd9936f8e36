"""The help of every command shows its docstring and the help of its options, word for word."""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from typing import Any

import pytest
import typer
from typer.testing import CliRunner

from zerohertz.cli import make_app

APP = make_app()


def commands(command: Any, words: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    yield words, command
    for name, below in getattr(command, "commands", {}).items():
        yield from commands(below, (*words, name))


ALL = dict(commands(typer.main.get_command(APP)))


def joined(text: str | None) -> str:
    """Without blanks: lines are broken anew, at hyphens too."""
    return "".join((text or "").split())


def shown(*words: str) -> str:
    result = CliRunner().invoke(APP, [*words, "--help"])
    assert result.exit_code == 0, result.output
    return joined(result.stdout)


@pytest.mark.parametrize("words", ALL, ids=lambda words: " ".join(("zh", *words)))
def test_help_is_what_the_source_says(words: tuple[str, ...]) -> None:
    page, command = shown(*words), ALL[words]
    assert joined(command.help) in page
    if words and command.callback:
        assert joined(inspect.getdoc(command.callback)) in page
    for parameter in command.params:
        assert joined(parameter.help) in page
        assert (parameter.metavar or max(parameter.opts, key=len)) in page


@pytest.mark.parametrize("words", [(), ("campaign",)], ids=["zh", "zh campaign"])
def test_the_list_of_commands_shows_whole_summaries(words: tuple[str, ...]) -> None:
    page = shown(*words)
    for name, command in ALL[words].commands.items():
        summary = command.help.split("\n\n")[0]
        assert f"{name}{joined(summary)}" in page


def test_what_stands_in_square_brackets_is_shown() -> None:
    assert "section[nameplate]istheonlyinput" in shown("commission")
    assert "afilewith[nameplate],orarig" in shown("commission")
    assert "[[s,Nm],...]" in shown("serve")
    assert "[OPTIONS][MOTOR_DIR]..." in shown("design")
