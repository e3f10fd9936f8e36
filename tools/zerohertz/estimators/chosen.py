"""Which estimator the drive of this process has, and of every process that it starts.

    choose("my_observer")              a folder of firmware/law/estimator
    choose("../my_observer")           a folder anywhere
    choose("sketch.py:MyObserver")     a class in Python

The choice is two variables of the environment, so that workers and emulators have the same drive.
"""

from __future__ import annotations

import hashlib
import os
import re
from pathlib import Path

from zerohertz.build import ESTIMATOR, IN_TREE, PYTHON
from zerohertz.errors import UserError
from zerohertz.paths import ROOT

BRIDGE = ROOT / "host_sim" / "python_bridge"
DEFAULT = "hasegawa"
FILES = ("CMakeLists.txt", "estimator_types.h", "estimator_signals.def")
_NAME = re.compile(r"[a-z][a-z0-9_]*")
_CLASS = re.compile(r"(?P<file>.+\.py):(?P<name>\w+)")


def use(estimator: str | None, write: bool = False) -> None:
    """For a command: choose, build, and see that it runs at all. None: the drive's own.

    write: it will write a page to be committed, which only the drive's own has.
    """
    if estimator is not None:
        if write:
            raise UserError("--write: the page shows the drive's own; leave out --estimator")
        from zerohertz.estimators.library import checked_library

        choose(estimator)
        checked_library()


def refuse_python(estimator: str | None) -> None:
    """For a command that runs an image: UserError for a class."""
    if estimator is not None and _CLASS.fullmatch(estimator):
        raise UserError(
            f"--estimator: {estimator}: an image has no Python; write the estimator in C: "
            "`zh estimator new NAME` makes a folder that runs already"
        )


def choose(estimator: str) -> None:
    """For this process and its children, before the first run of a drive."""
    found = _CLASS.fullmatch(estimator)
    os.environ.pop("ZEROHERTZ_SIL", None)
    os.environ.pop(PYTHON, None)
    if found:
        file = Path(found["file"]).resolve()
        if not file.is_file():
            raise UserError(f"--estimator: {file}: no such file; name FILE.py:CLASS")
        os.environ[ESTIMATOR] = str(BRIDGE)
        os.environ[PYTHON] = f"{file}:{found['name']}"
        return
    folder = folder_of(estimator)
    if folder == IN_TREE / DEFAULT:
        os.environ.pop(ESTIMATOR, None)
    else:
        os.environ[ESTIMATOR] = str(folder)


def folder_of(estimator: str) -> Path:
    """The folder of a name or a path; UserError with the remedy if it is none."""
    if re.fullmatch(r"[\w-]+", estimator) and (IN_TREE / estimator).is_dir():
        folder = IN_TREE / estimator
    else:
        folder = Path(estimator).resolve()
    if _CLASS.fullmatch(estimator):
        raise UserError(
            f"estimator: {estimator}: is a class in Python; write its tests in Python, this "
            "command takes a folder with C"
        )
    if not folder.is_dir():
        known = ", ".join(in_tree())
        raise UserError(
            f"--estimator: no '{estimator}'; there are {known}; or name a folder that "
            "`zh estimator new` made, or FILE.py:CLASS"
        )
    for file in FILES:
        if not (folder / file).is_file():
            raise UserError(
                f"--estimator: {folder}: has no {file}; firmware/law/estimator/README.md lists "
                "the files, and `zh estimator new` writes them all"
            )
    check_name(folder.name)
    return folder


def check_name(name: str) -> None:
    """It becomes part of a library's name."""
    if not _NAME.fullmatch(name):
        raise UserError(
            f"estimator: '{name}': a name has small letters, digits and _, a letter first; "
            "for example my_observer"
        )


def in_tree() -> list[str]:
    """The estimators of firmware/law/estimator."""
    return sorted(path.parent.name for path in IN_TREE.glob(f"*/{FILES[1]}"))


def chosen_name() -> str:
    """For folders and tables; empty: the drive's own."""
    if python := os.environ.get(PYTHON):
        return Path(python).name  # file.py:Class, as it was written
    return Path(os.environ.get(ESTIMATOR, "")).name


def is_foreign() -> bool:
    """It is none of the tree's: it may take any time and do anything."""
    folder = os.environ.get(ESTIMATOR)
    return PYTHON in os.environ or (folder is not None and Path(folder).parent != IN_TREE)


def python_digest() -> bytes:
    """Of the class behind the bridge: its library alone does not tell one from another."""
    python = os.environ.get(PYTHON)
    if not python:
        return b""
    file, _, name = python.rpartition(":")
    return hashlib.sha256(Path(file).read_bytes() + name.encode()).digest()
