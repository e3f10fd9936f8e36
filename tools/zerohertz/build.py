"""Builds the SIL library when a command needs it: quietly, and only what is out of date."""

from __future__ import annotations

import fcntl
import json
import os
import re
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from zerohertz.errors import UserError
from zerohertz.paths import BUILD, ROOT

PRESETS = ROOT / "CMakePresets.json"
PRESET = "host"
STAMP = "configured.stamp"
SIL_TARGET = "zerohertz_sil"
_NINJA_STEP = re.compile(r"\[(\d+)/(\d+)\]")
Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class Built:
    """What a build leaves behind."""

    folder: Path
    sil_library: Path


def ensure_built(*targets: str, progress: Progress | None = None) -> Built:
    """Configure and build preset `host` (by default the SIL library alone); do nothing when fresh.

    ZEROHERTZ_SIL names a library built elsewhere: then nothing is built. A failing build raises
    UserError after the compiler's output went to stderr. progress: build steps, done and in all.
    """
    folder = BUILD / PRESET
    foreign = os.environ.get("ZEROHERTZ_SIL")
    if foreign and not targets:
        library = Path(foreign)
        if not library.is_file():
            raise UserError(f"ZEROHERTZ_SIL: '{foreign}' is no file; unset it to build the library")
        return Built(folder, library)

    folder.mkdir(parents=True, exist_ok=True)
    # Two commands at once must not run ninja twice in one folder.
    with open(BUILD / f"{PRESET}.lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not _configured(folder):
            print("zh: configuring the build", file=sys.stderr)
            _configure(folder, "--preset", PRESET, f"-DZH_BUILD_TESTS={_tests(folder)}")
        wanted = targets or (SIL_TARGET,)
        _run("cmake", "--build", "--preset", PRESET, "--target", *wanted, progress=progress)
    return Built(folder, folder / "host_sim" / f"lib{SIL_TARGET}.so")


def build_image(preset: str) -> Path:
    """firmware.elf of a preset, or of a port of hal/; built when out of date."""
    folder = BUILD / preset
    folder.mkdir(parents=True, exist_ok=True)
    with open(BUILD / f"{preset}.lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not _configured(folder):
            print(f"zh: configuring the image {preset}", file=sys.stderr)
            _configure(folder, *_preset_arguments(preset))
        _run("cmake", "--build", str(folder))
    return folder / "firmware.elf"


def build_twin() -> tuple[Path, Path]:
    """twin.js and twin.wasm of the preset `wasm`; built when out of date."""
    folder = BUILD / "wasm"
    folder.mkdir(parents=True, exist_ok=True)
    with open(BUILD / "wasm.lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not _configured(folder):
            print("zh: configuring the WebAssembly build", file=sys.stderr)
            _configure(folder, "--preset", "wasm")
        _run("cmake", "--build", "--preset", "wasm", "--parallel", "2")
    return folder / "twin.js", folder / "twin.wasm"


def _configured(folder: Path) -> bool:
    """By the presets of today: ninja looks after the CMakeLists, but not after these."""
    stamp = folder / STAMP
    return (
        (folder / "build.ninja").is_file()
        and stamp.is_file()
        and stamp.stat().st_mtime >= PRESETS.stat().st_mtime
    )


def _tests(folder: Path) -> str:
    """Off in a first build: a demo needs no test framework. Once `zh test` has them on they stay:
    its stages run beside each other, and one that builds must not take the others' tests away."""
    cache = folder / "CMakeCache.txt"
    on = cache.is_file() and "ZH_BUILD_TESTS:BOOL=ON" in cache.read_text(encoding="utf-8")
    return "ON" if on else "OFF"


def _configure(folder: Path, *arguments: str) -> None:
    _run("cmake", *arguments)
    (folder / STAMP).touch()


def _preset_arguments(preset: str) -> tuple[str, ...]:
    """A port without a preset of its own is built like the template."""
    known = json.loads(PRESETS.read_text())["configurePresets"]
    if any(preset == entry["name"] for entry in known):
        return ("--preset", preset)
    return ("--preset", "template", "-B", str(BUILD / preset), f"-DZH_PORT={preset}")


def configure_tests() -> None:
    """Configure preset `host` with its tests, for who needs their compile commands."""
    _run("cmake", "--preset", PRESET, "-DZH_BUILD_TESTS=ON")


def _run(*command: str, progress: Progress | None = None) -> None:
    said: list[str] = []
    try:
        with subprocess.Popen(
            command,
            cwd=ROOT,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
        ) as process:
            assert process.stdout is not None
            for line in process.stdout:
                said.append(line)
                if progress and (step := _NINJA_STEP.match(line)):
                    progress(int(step[1]), int(step[2]))
    except FileNotFoundError:
        raise UserError(f"{command[0]}: not installed; run tools/zh setup") from None
    if process.returncode != 0:
        print("".join(said), file=sys.stderr)
        raise UserError(f"'{' '.join(command)}' failed; the compiler's output is above")
