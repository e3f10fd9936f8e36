"""`zh estimator new` and `test`: a folder to begin with, and its unit tests."""

from __future__ import annotations

import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path

from zerohertz.build import IN_TREE
from zerohertz.errors import UserError
from zerohertz.estimators.chosen import check_name, in_tree
from zerohertz.param_list import own_list
from zerohertz.paths import ROOT, make_folder

SKELETON = Path(__file__).parent / "skeleton"
NAME = "my_observer"  # in the skeleton
PAGE = ROOT / "tools" / "docs" / "estimator.md"
_BASE = ROOT / "firmware" / "law" / "base"
_PARAMETERS = ROOT / "firmware" / "parameters"
_FLAGS = (
    *("-std=c11", "-O1", "-g", "-Wall", "-Wextra", "-Wconversion", "-Wfloat-equal", "-Werror"),
    *(
        "-ffp-contract=off",
        "-fno-math-errno",
        "-fsanitize=address,undefined",
        "-fno-sanitize-recover=all",
    ),
)
TEST_S = 120.0


def new(name: str, into: Path) -> Path:
    """The folder of a working estimator; UserError for a name or a place that cannot be."""
    check_name(name)
    if name in in_tree():
        raise UserError(f"estimator new: '{name}' is one of firmware/law/estimator; take another")
    folder = into.resolve() / name
    if folder.exists():
        raise UserError(f"estimator new: {folder}: exists; take another name or remove it")
    make_folder(folder, "--into")
    for file in sorted(path for path in SKELETON.iterdir() if path.is_file()):
        text = file.read_text(encoding="utf-8").replace(NAME, name)
        text = text.replace("@DIR@", str(folder)).replace("@PAGE@", str(PAGE))
        (folder / file.name).write_text(text, encoding="utf-8")
    return folder


def run_tests(folder: Path) -> Iterator[tuple[str, bool, str]]:
    """Every test_*.c of the folder: its name, whether it passed, what it said."""
    tests = sorted(folder.glob("test_*.c"))
    if not tests:
        raise UserError(f"estimator test: {folder}: has no test_*.c; `zh estimator new` shows one")
    with tempfile.TemporaryDirectory(prefix="zh-estimator-") as made:
        for test in tests:
            program = Path(made) / test.stem
            built = _compiled(folder, test, program)
            if built.returncode != 0:
                yield test.name, False, built.stderr
                continue
            yield test.name, *_ran(program)


def _compiled(folder: Path, test: Path, program: Path) -> subprocess.CompletedProcess[str]:
    own = (path for path in folder.glob("*.c") if not path.name.startswith("test_"))
    sources = (test, *own, *_BASE.glob("*.c"), _PARAMETERS / "params.c")
    includes = [f"-I{path}" for path in (folder, _BASE, IN_TREE, _PARAMETERS)]
    if own := own_list(str(folder.resolve())):
        includes.append(f'-DZH_ESTIMATOR_PARAMS="{own}"')
    command = ("gcc", *_FLAGS, *includes, *map(str, sources), "-lm", "-o", str(program))
    try:
        return subprocess.run(command, capture_output=True, text=True)
    except FileNotFoundError:
        raise UserError("gcc: not installed; run tools/zh setup") from None


def _ran(program: Path) -> tuple[bool, str]:
    try:
        done = subprocess.run((program,), capture_output=True, text=True, timeout=TEST_S)
    except subprocess.TimeoutExpired:
        return False, f"did not end within {TEST_S:.0f} s"
    return done.returncode == 0, done.stdout + done.stderr
