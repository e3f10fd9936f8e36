"""A release image refuses the development key, and carries the one it was given."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from zerohertz.build import build_image
from zerohertz.link.siphash import DEVELOPMENT_KEY
from zerohertz.paths import ROOT

KEY = bytes(range(100, 116))


def configure(build: Path, *options: str) -> subprocess.CompletedProcess[str]:
    command = ("cmake", "-S", ROOT, "--preset", "stm32f405", "-B", build, *options)
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)


def key_file(folder: Path, text: str) -> str:
    path = folder / "key.txt"
    path.write_text(text, encoding="ascii")
    return f"-DZH_ACCESS_KEY={path}"


def test_a_release_without_a_key_of_its_own_is_refused(tmp_path: Path) -> None:
    for options in ((), (key_file(tmp_path, DEVELOPMENT_KEY.hex()),)):
        done = configure(tmp_path / "build", "-DZH_RELEASE=ON", *options)
        assert done.returncode != 0
        said = " ".join(done.stderr.split())
        assert "everybody knows the development key; give -DZH_ACCESS_KEY=" in said


@pytest.mark.parametrize("text", ["", "00112233", "g" * 32, "0" * 33])
def test_a_key_that_is_none_is_refused(tmp_path: Path, text: str) -> None:
    done = configure(tmp_path / "build", key_file(tmp_path, text))
    assert done.returncode != 0
    assert "holds no key" in " ".join(done.stderr.split())


def test_a_release_carries_its_own_key_and_a_bench_the_known_one(tmp_path: Path) -> None:
    release = tmp_path / "release"
    done = configure(release, "-DZH_RELEASE=ON", key_file(tmp_path, KEY.hex() + "\n"))
    assert done.returncode == 0, done.stderr
    built = ("cmake", "--build", release, "--parallel", "2")
    subprocess.run(built, check=True, capture_output=True)
    image = (release / "firmware.bin").read_bytes()
    assert KEY in image
    assert DEVELOPMENT_KEY not in image
    assert DEVELOPMENT_KEY in build_image("stm32f405").with_suffix(".bin").read_bytes()


def test_a_port_that_includes_the_development_key_does_not_compile_as_release() -> None:
    source = '#include "hal_development_key.h"\nint main(void) { return 0; }\n'
    for options, good in (((), True), (("-DZH_RELEASE",), False)):
        done = subprocess.run(
            ("gcc", *options, f"-I{ROOT}/hal/include", "-fsyntax-only", "-x", "c", "-"),
            input=source,
            capture_output=True,
            text=True,
            check=False,
        )
        assert (done.returncode == 0) is good
        assert good or "everybody knows the development key" in done.stderr
