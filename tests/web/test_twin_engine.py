"""Firmware and plant as WebAssembly, in node: the native bits, and the speed."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import pytest

from zerohertz.paths import ROOT

# 440 were measured on one core of a machine at rest; a loaded one has to pass as well.
LEAST_TIMES_REAL_TIME = 50.0


@pytest.fixture(scope="module")
def found(twin_js: Path, data_file: Path) -> dict[str, Any]:
    script = ROOT / "tests" / "web" / "hashes.mjs"
    # Else emscripten's loader takes node for a browser.
    command = ("node", "--no-experimental-fetch", script, twin_js, data_file)
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_every_signal_of_every_figure_has_the_native_bits(
    found: dict[str, Any], data: dict[str, Any]
) -> None:
    assert len(data["figures"]) == 13
    for figure, native in data["hashes"].items():
        web = found["hashes"][figure]
        differing = [
            name for name, a, b in zip(data["signals"], native, web, strict=True) if a != b
        ]
        assert not differing, f"{figure}: {differing}"


def test_many_times_faster_than_real_time(found: dict[str, Any]) -> None:
    assert found["simulated_s"] / found["seconds"] > LEAST_TIMES_REAL_TIME
