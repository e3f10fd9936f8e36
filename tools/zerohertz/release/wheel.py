"""Wheel and source distribution of the checkout, by scikit-build-core.

It wants pyproject.toml on top of the sources. Ours stands beside this file, so both are made from a
copy of the checkout in build/package.
"""

from __future__ import annotations

import filecmp
import re
import shutil
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

from zerohertz.errors import UserError
from zerohertz.paths import BUILD, ROOT, need_checkout
from zerohertz.studio.bundle import ensure_bundle

MAX_BYTES = 3_000_000
PROJECT = Path(__file__).with_name("pyproject.toml")
PAGE = Path("build", "web", "dist")  # of `zh studio`
LIBRARY = Path("build", "wheel", "host_sim", "libzerohertz_sil.so")
# Platform tag by what the library asks of the C and the C++ library (PEP 600): the newest that the
# distributions behind the tag have.
_TAGS = (
    ("manylinux_2_28_x86_64", (2, 28), (3, 4, 24)),
    ("manylinux_2_31_x86_64", (2, 31), (3, 4, 28)),
    ("manylinux_2_34_x86_64", (2, 34), (3, 4, 29)),
    ("manylinux_2_35_x86_64", (2, 35), (3, 4, 30)),
)
_NEEDED = re.compile(r"\b(GLIBC|GLIBCXX)_([\d.]+)")


def build_wheel(into: Path, source: Path | None = None) -> Path:
    """zerohertz-VERSION-py3-none-PLATFORM.whl, of the checkout or of an unpacked sdist.

    The build is kept in build/wheel of the source.
    """
    need_checkout("a wheel")
    if source is None:
        if shutil.which("npm"):  # else without the page of `zh studio`
            ensure_bundle()
        source = _copied()
    made = _build("build_wheel", into, source)
    tag = platform_tag(_run(source, "objdump", "-T", LIBRARY))
    if tag is None:  # a newer machine than any in the table: good for machines like this one
        return _small_enough(made)
    words = ("-m", "wheel", "tags", "--remove", "--platform-tag", tag, made)
    return _small_enough(made.parent / _run(source, sys.executable, *words).split()[-1])


def build_sdist(into: Path) -> Path:
    """zerohertz-VERSION.tar.gz: sources enough to build the wheel."""
    need_checkout("a source distribution")
    return _build("build_sdist", into, _copied())


def platform_tag(symbols: str) -> str | None:
    """The oldest tag that has all versions in this text of objdump; None: none has."""
    asked = {"GLIBC": (0,), "GLIBCXX": (0,)}
    for library, version in _NEEDED.findall(symbols):
        asked[library] = max(asked[library], tuple(int(part) for part in version.split(".")))
    for tag, c_library, cxx_library in _TAGS:
        if asked["GLIBC"] <= c_library and asked["GLIBCXX"] <= cxx_library:
            return tag
    return None


def _small_enough(made: Path) -> Path:
    size = made.stat().st_size
    if size > MAX_BYTES:
        raise UserError(f"{made}: has {size} bytes, more than {MAX_BYTES}; pack less")
    return made


def _copied() -> Path:
    """The checkout with pyproject.toml on top; what has not changed keeps its build."""
    sources = {name: ROOT / name for name in _packed()}
    return mirror(BUILD / "package", sources | {Path(PROJECT.name): PROJECT})


def mirror(folder: Path, sources: Mapping[Path, Path]) -> Path:
    """The folder has these files, by their places in it, and its build: nothing else."""
    wanted = {folder / name: source for name, source in sources.items()}
    for old in (path for path in folder.rglob("*") if path.is_file()):
        if old not in wanted and folder / "build" / "wheel" not in old.parents:
            old.unlink()
    for target, source in wanted.items():
        if not target.is_file() or not filecmp.cmp(source, target, shallow=False):
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(source, target)
    return folder


def _packed() -> set[Path]:
    """Files that git knows or could know, and the built page, relative to the checkout."""
    listed = _run(ROOT, "git", "ls-files", "-z", "--cached", "--others", "--exclude-standard")
    files = {Path(name) for name in listed.split("\0") if name}
    files |= {path.relative_to(ROOT) for path in (ROOT / PAGE).rglob("*")}
    return {name for name in files if (ROOT / name).is_file()}


def _build(function: str, into: Path, source: Path) -> Path:
    into = into.absolute()
    into.mkdir(parents=True, exist_ok=True)
    code = f"import sys; from scikit_build_core.build import {function} as f; print(f(sys.argv[1]))"
    return into / _run(source, sys.executable, "-c", code, into).split()[-1]


def _run(folder: Path, *command: object) -> str:
    words = [str(word) for word in command]
    done = subprocess.run(words, cwd=folder, capture_output=True, text=True, errors="replace")
    if done.returncode != 0:
        print(done.stdout + done.stderr, file=sys.stderr)
        raise UserError(f"'{words[0]}' failed making the package; its output is above")
    return done.stdout
