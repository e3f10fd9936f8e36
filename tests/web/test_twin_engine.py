"""Firmware and plant as WebAssembly, in node: the native bits, and the speed."""

from __future__ import annotations

import json
import struct
import subprocess
from pathlib import Path
from typing import Any

import pytest

from zerohertz.link.client import Op
from zerohertz.link.frame import Frame, encode
from zerohertz.link.server import LinkedDrive
from zerohertz.paths import ROOT
from zerohertz.site import twin_data

# 440 were measured on one core of a machine at rest; a loaded one has to pass as well.
LEAST_TIMES_REAL_TIME = 50.0


LINK_PERIODS = 50


def node(script: str, *files: Path) -> Any:
    # Without the option emscripten's loader takes node for a browser.
    command = ("node", "--no-experimental-fetch", ROOT / "tests" / "web" / script, *files)
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.fixture(scope="module")
def found(twin_js: Path, data_file: Path) -> dict[str, Any]:
    return node("hashes.mjs", twin_js, data_file)


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


def test_the_link_says_what_the_native_one_says(
    twin_js: Path, data_file: Path, tmp_path: Path
) -> None:
    job = twin_data.figure_job(16, "recommended")
    frames = [Frame(1, Op.HELLO, b""), Frame(2, Op.STATUS, b"")]
    frames += [Frame(3 + k, Op.PARAM_INFO, struct.pack("<H", k)) for k in range(100)]
    frames += [Frame(103 + k, Op.SIGNAL_INFO, bytes((k,))) for k in range(100)]
    frames.append(Frame(203, Op.SAMPLE, bytes(range(8))))
    requests = [encode(frame) for frame in frames]
    with LinkedDrive(job) as drive:
        native = [drive.run(LINK_PERIODS, request) for request in requests]
    assert all(answer for _, answer in native)
    files = twin_data.Files()
    content = {
        "job": files.job(job),
        "requests": [request.hex() for request in requests],
        "periods": LINK_PERIODS,
    }
    path = tmp_path / "job.json"
    path.write_text(json.dumps(content), encoding="utf-8")
    assert node("link.mjs", twin_js, data_file, path) == [answer.hex() for _, answer in native]
