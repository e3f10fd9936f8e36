"""The SIL library around the chosen estimator: built, with what is wrong with it said in one line,
and run once in a process of its own before a campaign meets it."""

from __future__ import annotations

import difflib
import hashlib
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

from zerohertz.build import (
    ESTIMATOR,
    HOST_TARGETS,
    IN_TREE,
    PYTHON,
    BuildError,
    build_estimator,
    ensure_built,
    estimator_folder,
)
from zerohertz.console import short_paths
from zerohertz.errors import UserError
from zerohertz.estimators import probe
from zerohertz.estimators.chosen import chosen_name, python_digest

CONTRACT = IN_TREE / "estimator.h"
LOG = "compiler.log"
PROBED = "probed.stamp"
PROBE_S = 120.0  # by the clock, for what waits; what computes has probe.CPU_S
VERBS = ("init", "table", "step", "hold", "off", "seed")
_FUNCTION = rf"['‘`]?(?P<name>estimator_(?:{'|'.join(VERBS)}|sum))\b"
# What gcc and clang say of a function that is another than the header's, and of a missing one.
_OTHER = re.compile(
    r"(?:conflicting types for|no previous prototype for(?: function)?|static declaration of|"
    rf"too (?:few|many) arguments to function|argument \d+ of) {_FUNCTION}"
)
_MISSING = re.compile(
    r"(?:undefined reference to|undefined symbol:|implicit declaration of function|"
    rf"undeclared function) {_FUNCTION}"
)
_NO_TYPE = re.compile(r"unknown type name ['‘`]?(?P<name>estimator_(?:config|state)_t)\b")
_ERROR = re.compile(r"^.*: (?:fatal )?error: .*$|^.*undefined reference to.*$", re.MULTILINE)
# gcc names a function that nobody declared; clang likewise, when its name begins as the others do.
_UNKNOWN = re.compile(r"no previous prototype for(?: function)? ['‘`]?(?P<name>estimator_\w+)")
_NO_MEMBER = re.compile(r"no member named ['‘`]?(?P<name>estimate)\b")
_CMAKE_ERROR = re.compile(r"CMake Error.*\n+((?:  .*\n)+)")


def checked_library() -> Path:
    """Of the chosen estimator; UserError when it cannot be built or does not run at all."""
    estimator = os.environ.get(ESTIMATOR)
    if not estimator:
        return ensure_built().sil_library
    folder = Path(estimator)
    ensure_built(*HOST_TARGETS)  # what fails here is none of the estimator's
    try:
        built = build_estimator(folder, quiet=True)
    except BuildError as error:
        log = estimator_folder(folder) / LOG
        log.write_text(error.output, encoding="utf-8")
        said = f"{refusal(error.output)} (all the compiler said: {short_paths(log)})"
        raise UserError(f"estimator {folder.name}: {said}") from None
    _probe(built.sil_library, built.folder / PROBED, folder)
    return built.sil_library


def refusal(output: str) -> str:
    """One line: the function that is missing or another than expected, or the first error."""
    if found := _OTHER.search(output):
        expected = f"{prototype(found['name'])}{_line(output, found)}"
        return f"{found['name']} is not what the drive calls; expected: {expected}"
    if found := _UNKNOWN.search(output):
        verbs = [f"estimator_{verb}" for verb in (*VERBS, "sum")]
        meant = difflib.get_close_matches(found["name"], verbs, n=1, cutoff=0.0)[0]
        expected = f"{prototype(meant)} or make it static{_line(output, found)}"
        return f"the drive calls no {found['name']}; expected: {expected}"
    if found := _MISSING.search(output):
        return f"{found['name']} is missing; expected: {prototype(found['name'])}"
    if found := _NO_TYPE.search(output):
        return f"{found['name']} is missing; define it in estimator_types.h"
    if _NO_MEMBER.search(output):
        return "estimator_state_t has no estimate; expected: estimate_t estimate;"
    if found := _CMAKE_ERROR.search(output):
        return " ".join(found[1].split())
    first = _ERROR.search(output)
    return f"does not compile: {first[0].strip() if first else output.strip()[-300:]}"


def _line(output: str, found: re.Match[str]) -> str:
    """Where the compiler saw it, if it said so."""
    begin = output.rfind("\n", 0, found.start()) + 1
    at = re.match(r"\S+\.[ch]:\d+", output[begin : found.start()])
    return f" at {at[0]}" if at else ""


def prototype(name: str) -> str:
    """As the contract has it, without what is there for the compiler alone."""
    text = re.sub(r"\n \* ?", "\n", CONTRACT.read_text(encoding="utf-8"))
    found = re.search(rf"^[^\n;*]*?[\w*]+ \*?{name}\([^;]*\);", text, re.MULTILINE)
    assert found is not None, name
    words = " ".join(found[0].split())
    return re.sub(r"\b(?:CHECKED|COLD) ", "", words)


def _probe(library: Path, stamp: Path, folder: Path) -> None:
    """A first second and a half, in a process of its own: what crashes or hangs ends here."""
    mark = hashlib.sha256(library.read_bytes() + python_digest()).hexdigest()
    if stamp.is_file() and stamp.read_text() == mark:
        return
    name = chosen_name()
    command = (sys.executable, "-m", probe.__name__, str(library))
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=PROBE_S)
    except subprocess.TimeoutExpired:
        raise UserError(
            f"estimator {name}: {probe.SECONDS} s of the drive took more than {PROBE_S:.0f} s; "
            "nothing in it may wait"
        ) from None
    if done.returncode < 0:
        at = probe.where(done.stderr, library, folder, os.environ.get(PYTHON))
        raise UserError(f"estimator {name}: {_ended(-done.returncode, at)}")
    if done.returncode != 0:
        raise UserError(f"estimator {name}: does not run: {done.stderr.strip().splitlines()[-1]}")
    stamp.write_text(mark)


def _ended(number: int, at: str) -> str:
    """Why its first 1.5 s ended by a signal, where and what to do."""
    place = f" at {at}" if at else ""
    if number in (signal.SIGXCPU, signal.SIGKILL):
        return (
            f"too slow{place}: {probe.SECONDS} s of the drive took more than {probe.CPU_S} s of "
            "CPU time; give every loop a constant bound"
        )
    return (
        f"crashed with {signal.Signals(number).name}{place} within the first {probe.SECONDS} s; "
        "`zh estimator test` runs it under the address sanitizer"
    )
