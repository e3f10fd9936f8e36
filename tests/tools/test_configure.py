"""Configuring a machine that lacks something: what is missing, the remedy, no lasting harm."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from zerohertz import build
from zerohertz.paths import ROOT

CMAKE = shutil.which("cmake") or "cmake"
# What a later `zh demo` builds takes a minute; this goes the same way in a second.
TARGET = "zh_gain_tables"


@pytest.fixture
def bare(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A checkout in which tools/zh has not run yet; `build` works there."""
    for entry in ROOT.iterdir():
        if entry.name not in (".cache", ".venv", "build"):
            (tmp_path / entry.name).symlink_to(entry)
    monkeypatch.setattr(build, "ROOT", tmp_path)
    monkeypatch.setattr(build, "BUILD", tmp_path / "build")
    monkeypatch.delenv("UNITY_DIR", raising=False)
    return tmp_path


def refused(checkout: Path, *arguments: str, path: str = os.environ["PATH"]) -> str:
    """The message of a configuration that has to fail, as one line."""
    done = subprocess.run(
        (CMAKE, "--preset", "host", *arguments),
        cwd=checkout,
        env=os.environ | {"PATH": path},
        capture_output=True,
        text=True,
    )
    assert done.returncode != 0, done.stdout
    return " ".join(done.stderr.split())


def test_each_refusal_names_the_remedy_and_spoils_no_later_build(bare: Path) -> None:
    said = refused(bare, path="/nowhere")
    assert "missing: ninja, gcc, g++ Run tools/zh setup" in said
    assert "install from Debian: ninja-build gcc g++" in said

    said = refused(bare, "-DCMAKE_IGNORE_PATH=/usr/include;/usr/share/eigen3/cmake")
    assert "missing: Eigen 3.4, toml++, nlohmann/json, Unity" in said
    assert "Debian: libeigen3-dev libtomlplusplus-dev nlohmann-json3-dev" in said

    said = refused(bare, "-UCMAKE_IGNORE_PATH")
    assert f"missing: Unity (no unity.c in {bare}/.cache/unity)" in said
    assert "Run tools/zh setup" in said
    assert "-DUNITY_DIR=" in said

    steps: list[tuple[int, int]] = []
    build.ensure_built(TARGET, progress=lambda done, total: steps.append((done, total)))
    assert steps
    assert steps[-1][0] == steps[-1][1]
    assert "no unity.c in /nowhere" in refused(bare, "-DUNITY_DIR=/nowhere")
    build.ensure_built(TARGET)


def test_nothing_is_downloaded() -> None:
    for path in (*ROOT.glob("tools/cmake/*"), ROOT / "CMakeLists.txt"):
        text = path.read_text(encoding="utf-8")
        assert "FetchContent" not in text
        assert "ExternalProject" not in text


def test_the_first_image_of_a_plug_in_is_configured(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    said: list[tuple[str, ...]] = []
    monkeypatch.setattr(build, "BUILD", tmp_path)
    monkeypatch.setattr(build, "_run", lambda *command, **_: said.append(command))
    monkeypatch.setenv(build.ESTIMATOR, str(tmp_path / "mine"))
    build.build_image("qemu-mps2")
    assert f"-DZH_ESTIMATOR={tmp_path / 'mine'}" in said[0]
