"""Builds the SIL library when a command needs it: quietly, and only what is out of date.

ZEROHERTZ_SIL names a library built elsewhere: then nothing is built. ZEROHERTZ_ESTIMATOR names the
folder of another estimator (zerohertz.estimators.chosen): library and images are built around it.
The installed package brings its library; there nothing can be built.
"""

from __future__ import annotations

import fcntl
import hashlib
import json
import os
import re
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from zerohertz.errors import UserError
from zerohertz.paths import BUILD, INSTALLED, LIBRARIES, ROOT, need_checkout

PRESETS = ROOT / "CMakePresets.json"
PRESET = "host"
STAMP = "configured.stamp"
SIL_TARGET = "zerohertz_sil"
HOST_TARGETS = ("zh_plant", "zh_gain_file")  # what knows no estimator
ESTIMATOR = "ZEROHERTZ_ESTIMATOR"
PYTHON = "ZEROHERTZ_PYTHON_ESTIMATOR"  # FILE.py:CLASS, behind the bridge
OWN_LIST = "estimator_params.def"  # in an estimator's folder: its own parameters
IN_TREE = ROOT / "firmware" / "law" / "estimator"
_NINJA_STEP = re.compile(r"\[(\d+)/(\d+)\]")
Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class Built:
    """What a build leaves behind."""

    folder: Path
    sil_library: Path

    def library(self, target: str) -> Path:
        """The shared library of a target of host_sim."""
        return self.sil_library.with_name(f"lib{target}.so")


class BuildError(UserError):
    """A build that failed, with all that was said."""

    def __init__(self, text: str, output: str) -> None:
        super().__init__(text)
        self.output = output


def ensure_built(*targets: str, progress: Progress | None = None) -> Built:
    """Configure and build preset `host` (by default the SIL library alone); do nothing when fresh.

    A failing build raises UserError after the compiler's output went to stderr. progress: build
    steps, done and in all.
    """
    folder = BUILD / PRESET
    foreign = os.environ.get("ZEROHERTZ_SIL")
    if foreign and not targets:
        library = Path(foreign)
        if not library.is_file():
            raise UserError(f"ZEROHERTZ_SIL: '{foreign}' is no file; unset it to build the library")
        return Built(folder, library)
    if INSTALLED:
        return _packed(folder, targets)
    if (estimator := os.environ.get(ESTIMATOR)) and not targets:
        return build_estimator(Path(estimator), progress)

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


def _packed(folder: Path, targets: tuple[str, ...]) -> Built:
    built = Built(folder, LIBRARIES / f"lib{SIL_TARGET}.so")
    for target in targets:
        if not built.library(target).is_file():
            need_checkout(target)
    return built


def build_estimator(
    estimator: Path, progress: Progress | None = None, quiet: bool = False
) -> Built:
    """The SIL library around another estimator's folder. quiet: a BuildError tells, not stderr."""
    built = ensure_built(*HOST_TARGETS).folder / "host_sim"
    folder = estimator_folder(estimator)
    folder.mkdir(parents=True, exist_ok=True)
    with open(folder.with_suffix(".lock"), "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not _configured(folder) or _list_came_or_went(folder, estimator):
            print(f"zh: building the drive around {estimator.name}", file=sys.stderr)
            options = (f"-DZH_ESTIMATOR={estimator}", f"-DZH_BUILT={built}", "-DZH_BUILD_TESTS=OFF")
            arguments = ("-S", str(ROOT), "--preset", PRESET, "-B", str(folder), *options)
            _configure(folder, *arguments, quiet=quiet)
        command = ("cmake", "--build", str(folder), "--parallel", "2", "--target", SIL_TARGET)
        _run(*command, progress=progress, quiet=quiet)
    return Built(folder, folder / "host_sim" / f"lib{SIL_TARGET}.so")


def estimator_folder(estimator: Path) -> Path:
    """Where the builds around an estimator go; two of one name in two places have two."""
    mark = "" if estimator.parent == IN_TREE else f"-{_digest(str(estimator))}"
    return BUILD / "estimators" / f"{estimator.name}{mark}"


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:8]


# Targets of a flash image's build, and what they make.
IMAGE_OF = {
    "all": "firmware.elf",
    "zh_mps2": "mps2/firmware.elf",
    "zh_boot": "loader/loader.elf",
    "zh_above": "above/firmware.elf",
}


def build_image(preset: str, target: str = "all") -> Path:
    """firmware.elf of a preset, or of a port of hal/; built when out of date. Target zh_mps2: the
    objects of a board under the start-up of the emulated one (zh_image_on_mps2). Targets zh_boot,
    zh_above: the boot loader, and the application above it (ZhLoader.cmake)."""
    need_checkout(f"image {preset}")
    folder, options = BUILD / preset, list(_preset_arguments(preset, BUILD / preset))
    if estimator := os.environ.get(ESTIMATOR):
        folder = estimator_folder(Path(estimator)).with_suffix(f".{preset}")
        options += ["-S", str(ROOT), "-B", str(folder), f"-DZH_ESTIMATOR={estimator}"]
    folder.mkdir(parents=True, exist_ok=True)
    with open(folder.with_suffix(f"{folder.suffix}.lock"), "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        known = _configured(folder)
        # A list of parameters may have come or gone, and Monocypher may have come.
        if known and estimator:
            known = not _list_came_or_went(folder, Path(estimator))
        if not known or target == "zh_boot":
            print(f"zh: configuring the image {preset}", file=sys.stderr)
            _configure(folder, *options)
        _run("cmake", "--build", str(folder), "--target", target)
    return folder / IMAGE_OF[target]


def build_own_image(folder: Path, port: str, options: tuple[str, ...]) -> Path:
    """firmware.elf in a folder of its own: a preset, or a port by its path, with cmake's options.
    Another port or other options begin anew."""
    need_checkout("an image")
    arguments = ("-S", str(ROOT), *_preset_arguments(port, folder), *options)
    folder.mkdir(parents=True, exist_ok=True)
    with open(folder.with_suffix(".lock"), "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        stamp = folder / STAMP
        if not _configured(folder) or stamp.read_text(encoding="utf-8") != "\n".join(arguments):
            print(f"zh: configuring the image for {port}", file=sys.stderr)
            (folder / "CMakeCache.txt").unlink(missing_ok=True)
            _configure(folder, *arguments)
            stamp.write_text("\n".join(arguments), encoding="utf-8")
        _run("cmake", "--build", str(folder))
    return folder / "firmware.elf"


def build_twin() -> tuple[Path, Path]:
    """twin.js and twin.wasm of the preset `wasm`; built when out of date."""
    need_checkout("the WebAssembly build")
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


def _list_came_or_went(folder: Path, estimator: Path) -> bool:
    """Ninja does not see a list of parameters that was not there (firmware/parameters)."""
    cache = (folder / "CMakeCache.txt").read_text(encoding="utf-8")
    has = re.search(r"^ZH_ESTIMATOR_PARAMS:INTERNAL=.", cache, re.MULTILINE) is not None
    return has != (estimator / OWN_LIST).is_file()


def _tests(folder: Path) -> str:
    """Off in a first build: a demo needs no test framework. Once `zh test` has them on they stay:
    its stages run beside each other, and one that builds must not take the others' tests away."""
    cache = folder / "CMakeCache.txt"
    on = cache.is_file() and "ZH_BUILD_TESTS:BOOL=ON" in cache.read_text(encoding="utf-8")
    return "ON" if on else "OFF"


def _configure(folder: Path, *arguments: str, quiet: bool = False) -> None:
    _run("cmake", *arguments, quiet=quiet)
    (folder / STAMP).touch()


def _preset_arguments(preset: str, folder: Path) -> tuple[str, ...]:
    """A port without a preset of its own is built like the template."""
    known = json.loads(PRESETS.read_text())["configurePresets"]
    if any(preset == entry["name"] for entry in known):
        return ("--preset", preset, "-B", str(folder))
    return ("--preset", "template", "-B", str(folder), f"-DZH_PORT={preset}")


def configure_tests() -> None:
    """Configure preset `host` with its tests, for who needs their compile commands."""
    need_checkout("configuring the tests")
    _run("cmake", "--preset", PRESET, "-DZH_BUILD_TESTS=ON")


def _run(*command: str, progress: Progress | None = None, quiet: bool = False) -> None:
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
        if not quiet:
            print("".join(said), file=sys.stderr)
        text = f"'{' '.join(command)}' failed; the compiler's output is above"
        raise BuildError(text, "".join(said))
