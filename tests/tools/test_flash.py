"""zh flash: the command it prints and runs, with a programmer that is none."""

from __future__ import annotations

from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from zerohertz import build
from zerohertz.errors import UserError
from zerohertz.flash import command

ELF = Path("/images/firmware.elf")
LOADER = Path("/images/loader/loader.elf")


@pytest.fixture
def app(monkeypatch: pytest.MonkeyPatch) -> typer.Typer:
    made = {"all": ELF, "zh_boot": LOADER}
    monkeypatch.setattr(build, "build_image", lambda preset, target: made[target])
    app = typer.Typer()
    command.register(app)
    app.command("other")(lambda: None)
    return app


def programmer(folder: Path, name: str, exit_code: int) -> Path:
    """A program that writes down how it was called."""
    script = folder / name
    script.write_text(f'#!/bin/sh\necho "$@" > {folder}/called\nexit {exit_code}\n')
    script.chmod(0o755)
    return script


def test_the_loader_goes_where_the_part_starts(app: typer.Typer) -> None:
    command = ["flash", "--dry-run", "--tool", "st-flash", "--loader"]
    result = CliRunner().invoke(app, command)
    assert result.exit_code == 0
    assert result.stdout == "st-flash --reset write /images/loader/loader.bin 0x08000000\n"


def test_dry_run_prints_the_command_and_runs_nothing(app: typer.Typer) -> None:
    result = CliRunner().invoke(app, ["flash", "--dry-run", "--tool", "openocd"])
    assert result.exit_code == 0
    assert result.stdout == (
        "openocd -f interface/stlink.cfg -f target/stm32f4x.cfg "
        "-c 'program {/images/firmware.elf} verify reset exit'\n"
    )


@pytest.mark.parametrize("board", ["stm32g431_esc", "stm32g431_ihm08m1"])
def test_boards_of_one_folder_have_names_of_their_own(app: typer.Typer, board: str) -> None:
    result = CliRunner().invoke(app, ["flash", "--dry-run", "--tool", "openocd", "--board", board])
    assert result.exit_code == 0
    assert "-f target/stm32g4x.cfg" in result.stdout


def test_st_flash_gets_the_binary_and_its_address(
    app: typer.Typer, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    programmer(tmp_path, "st-flash", 0)
    monkeypatch.setenv("PATH", f"{tmp_path}:/usr/bin:/bin")
    result = CliRunner().invoke(app, ["flash", "--tool", "st-flash"])
    assert result.exit_code == 0, result.exception
    called = (tmp_path / "called").read_text()
    assert called == "--reset write /images/firmware.bin 0x08000000\n"


def test_a_programmer_that_fails_is_an_error(
    app: typer.Typer, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    programmer(tmp_path, "openocd", 1)
    monkeypatch.setenv("PATH", f"{tmp_path}:/usr/bin:/bin")
    result = CliRunner().invoke(app, ["flash"])
    assert isinstance(result.exception, UserError)
    assert "openocd: ended with 1; is the probe plugged in" in str(result.exception)


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (("--board", "abacus"), "--board: no 'abacus'; there are stm32f405"),
        (("--tool", "hammer"), "--tool: no 'hammer'; there are openocd, st-flash"),
        ((), "not installed; apt-get install openocd or apt-get install stlink-tools"),
    ],
)
def test_what_cannot_be_is_refused(
    app: typer.Typer, monkeypatch: pytest.MonkeyPatch, arguments: tuple[str, ...], text: str
) -> None:
    monkeypatch.setenv("PATH", "/nowhere")
    result = CliRunner().invoke(app, ["flash", *arguments])
    assert isinstance(result.exception, UserError)
    assert text in str(result.exception)
