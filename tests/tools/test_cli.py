"""The command line: help, errors on one line, exit codes; the launcher."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys

import pytest
import typer

from zerohertz import __version__, build, cli
from zerohertz.console import short_paths
from zerohertz.errors import UserError
from zerohertz.paths import ROOT

LAUNCHER = ROOT / "tools" / "zh"


def zh(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "zerohertz", *words],
        cwd=ROOT / "tools",
        capture_output=True,
        text=True,
        timeout=600,
    )


def test_help_names_the_commands():
    done = zh("--help")
    assert done.returncode == 0
    commands = "demo figures identify design certify replay bench test campaign".split()
    for command in commands:
        assert f" {command} " in done.stdout


def test_no_command_shows_the_help():
    assert "Usage" in zh().stdout


def test_version_is_the_package_version():
    assert zh("--version").stdout == f"zerohertz {__version__}\n"


@pytest.mark.parametrize("words", [("nonsense",), ("--nonsense",), ("test", "--only", "nonsense")])
def test_bad_usage_is_one_line_and_exit_code_2(words):
    done = zh(*words)
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.startswith("error: ")
    assert done.stderr.count("\n") == 1
    assert "nonsense" in done.stderr


def test_a_path_below_the_current_folder_is_shown_from_there(tmp_path, monkeypatch):
    here = tmp_path / "here"
    here.mkdir()
    monkeypatch.chdir(here)
    text = f"{here}/a.toml: is not {here}/b/c.toml; see {tmp_path}/d.toml, {here}"
    assert short_paths(text) == f"a.toml: is not b/c.toml; see {tmp_path}/d.toml, {here}"
    assert short_paths(f"/other{here}/a.toml") == f"/other{here}/a.toml"


def test_an_error_names_the_file_from_the_current_folder():
    done = zh("certify", "docs/nosuch")
    assert done.stderr.startswith("error: docs/nosuch")
    done = zh("design", str(ROOT / "tools" / "nosuch"))
    assert done.stderr.startswith("error: nosuch: no such file")


def test_an_error_of_the_user_shows_no_traceback(monkeypatch, capsys):
    def failing_app():
        def run(**_):
            raise UserError("motor.toml: circuit.Rs_ohm: is\nnegative; give a resistance")

        return run

    monkeypatch.setattr(cli, "make_app", failing_app)
    monkeypatch.setattr(sys, "argv", ["zh", "design"])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert ended.value.code == 2
    expected = "error: motor.toml: circuit.Rs_ohm: is negative; give a resistance\n"
    assert capsys.readouterr().err == expected


def test_ctrl_c_says_so_and_ends_with_130(monkeypatch, capsys):
    def interrupted():
        raise KeyboardInterrupt

    app = typer.Typer()
    app.command("wait")(interrupted)
    app.command("other")(lambda: None)  # one command alone would lose its name
    monkeypatch.setattr(cli, "make_app", lambda: app)
    monkeypatch.setattr(sys, "argv", ["zh", "wait"])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert ended.value.code == 130
    assert capsys.readouterr().err.strip() == "error: interrupted"


def test_a_foreign_library_is_taken_and_must_exist(monkeypatch, tmp_path):
    library = tmp_path / "libother.so"
    monkeypatch.setenv("ZEROHERTZ_SIL", str(library))
    with pytest.raises(UserError, match="ZEROHERTZ_SIL"):
        build.ensure_built()
    library.write_bytes(b"")
    assert build.ensure_built().sil_library == library


@pytest.mark.parametrize("tests", ["ON", "OFF"])
def test_configuring_anew_leaves_the_tests_as_they_are(monkeypatch, tmp_path, tests):
    folder = tmp_path / "host"
    folder.mkdir()
    (folder / "build.ninja").touch()  # of plain cmake: without our stamp
    (folder / "CMakeCache.txt").write_text(f"ZH_BUILD_TESTS:BOOL={tests}\n")
    commands = []
    monkeypatch.setattr(build, "BUILD", tmp_path)
    monkeypatch.setattr(build, "_run", lambda *words, **_: commands.append(words))
    monkeypatch.delenv("ZEROHERTZ_SIL", raising=False)
    build.ensure_built()
    assert commands[0] == ("cmake", "--preset", "host", f"-DZH_BUILD_TESTS={tests}")
    assert [words[1] for words in commands] == ["--preset", "--build"]
    build.ensure_built()
    assert [words[1] for words in commands] == ["--preset", "--build", "--build"]


def test_the_launcher_is_plain_shell():
    for script in (LAUNCHER, ROOT / "tools" / "fetch_unity.sh"):
        assert script.read_text().startswith("#!/bin/sh\n")
        subprocess.run(["sh", "-n", script], check=True)


def test_the_launcher_refuses_an_unknown_stage_before_it_sets_anything_up(tmp_path):
    tools = tmp_path / "tools"
    tools.mkdir()
    (tools / "zh").write_text(LAUNCHER.read_text())
    (tools / "zerohertz").symlink_to(ROOT / "tools" / "zerohertz")
    done = subprocess.run(
        ["sh", str(tools / "zh"), "test", "--only", "unit,nosuch"],
        capture_output=True,
        text=True,
        timeout=600,
    )
    assert done.returncode == 2
    assert done.stderr.startswith("error: --only: no stage 'nosuch'; there are build, images, ")
    assert done.stderr.count("\n") == 1
    assert sorted(path.name for path in tmp_path.iterdir()) == ["tools"]


def pins(file: str) -> dict[str, str]:
    """Package and version, by the name as pip compares it."""
    text = (ROOT / "tools" / file).read_text(encoding="utf-8")
    found = re.findall(r"^([\w.-]+)==([\w.]+)", text, re.MULTILINE)
    return {name.lower().replace("_", "-"): version for name, version in found}


LISTS = ("-design", "-draw", "-campaign", "-mdf", "-test", "-site")


def test_the_locks_are_those_of_the_requirements():
    wanted, locked = pins("requirements.txt"), pins("requirements.lock")
    assert set(locked) - set(wanted) == {"colorama"}  # of Windows alone
    assert wanted.items() <= locked.items()
    every = wanted | {"colorama": locked["colorama"]}
    for name in LISTS:
        every |= pins(f"requirements{name}.txt")
    for name in LISTS:
        listed, beside = pins(f"requirements{name}.txt"), pins(f"requirements{name}.lock")
        assert listed.items() <= beside.items() <= every.items()


@pytest.mark.parametrize("file", [f"requirements{part}.lock" for part in ("", *LISTS)])
def test_every_package_of_a_lock_has_its_hashes(file):
    text = (ROOT / "tools" / file).read_text(encoding="utf-8")
    blocks = re.split(r"^(?=[\w.-]+==)", text, flags=re.MULTILINE)[1:]
    assert len(blocks) == len(pins(file))
    assert all(re.search(r"--hash=sha256:[0-9a-f]{64}\b", block) for block in blocks)


def test_a_build_keeps_unity_when_the_cache_is_gone(tmp_path):
    cache = tmp_path / ".cache" / "unity"
    cache.mkdir(parents=True)
    (cache / "unity.c").write_text('#include "unity.h"\nint unity = UNITY;\n')
    (cache / "unity.h").write_text("#define UNITY 1\n")
    include = f'include("{ROOT}/tools/cmake/ZhUnity.cmake")'
    lists = tmp_path / "CMakeLists.txt"
    lists.write_text(f"cmake_minimum_required(VERSION 3.22)\nproject(some C)\n{include}\n")

    def run(*words: str) -> None:
        done = subprocess.run(["cmake", *words], cwd=tmp_path, capture_output=True, text=True)
        assert done.returncode == 0, done.stdout + done.stderr

    run("-B", "build")
    shutil.rmtree(cache)
    run("-B", "build")
    run("--build", "build")


def test_the_launcher_asks_for_packages_where_it_cannot_install(tmp_path):
    (tmp_path / "tools").mkdir()
    copy = tmp_path / "tools" / "zh"
    copy.write_text(LAUNCHER.read_text())
    # A machine with the programs of every Unix, but neither dpkg nor apt.
    programs = tmp_path / "bin"
    programs.mkdir()
    for name in ("sh", "readlink", "dirname", "mkdir", "flock", "sha256sum", "cat", "id"):
        found = subprocess.run(["which", name], capture_output=True, text=True).stdout.strip()
        (programs / name).symlink_to(found)
    done = subprocess.run(
        ["sh", str(copy), "demo"],
        env={"PATH": str(programs)},
        capture_output=True,
        text=True,
        timeout=600,
    )
    assert done.returncode == 2
    assert "error: this is not a Debian system" in done.stderr
    assert "libeigen3-dev" in done.stderr
    assert "ZH_NO_APT=1" in done.stderr
