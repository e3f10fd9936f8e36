"""Modified condition/decision coverage of what opens the gates: does each condition of a decision,
alone, decide in some unit test?

clang 19 counts while the unit tests run; gcc 12 and clang 14 cannot. A decision with one condition
is a branch, and the coverage stage of `zh test` looks at those.
"""

from __future__ import annotations

import json
import operator
import os
import shutil
import subprocess
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from zerohertz.errors import UserError
from zerohertz.paths import BUILD, ROOT

PRESET = "mcdc"
FOLDERS = ("firmware/guard", "firmware/sequence")


@dataclass(frozen=True)
class Decision:
    """One decision of the source and its conditions, in order."""

    file: str
    line: int
    conditions: tuple[bool, ...]  # decided alone in some test

    @property
    def gaps(self) -> tuple[int, ...]:
        """Conditions, from 1, that never decided alone."""
        return tuple(k for k, seen in enumerate(self.conditions, 1) if not seen)


def run(jobs: int) -> list[Decision]:
    """Build, run the unit tests, and read what they decided. UserError when a test fails."""
    folder = BUILD / PRESET
    profiles = folder / "profiles"
    shutil.rmtree(profiles, ignore_errors=True)
    _run("cmake", "--preset", PRESET)
    _run("cmake", "--build", str(folder), "--parallel", str(jobs))
    _run(
        *("ctest", "--test-dir", str(folder), "-L", "unit", "-j", str(jobs)),
        env={"LLVM_PROFILE_FILE": str(profiles / "%p.profraw")},
    )
    merged = folder / "all.profdata"
    raw = sorted(map(str, profiles.glob("*.profraw")))
    _run("llvm-profdata-19", "merge", "-sparse", "-o", str(merged), *raw)
    return decisions(_export(folder, merged))


def _export(folder: Path, merged: Path) -> Mapping[str, Any]:
    tests = [
        path for path in (folder / "tests" / "unit").glob("test_*") if os.access(path, os.X_OK)
    ]
    programs = sorted(str(path) for path in tests if path.is_file())
    objects = [word for program in programs[1:] for word in ("-object", program)]
    sources = [str(ROOT / name) for name in FOLDERS]
    command = ("llvm-cov-19", "export", "-instr-profile", str(merged))
    found: Mapping[str, Any] = json.loads(_run(*command, programs[0], *objects, *sources))
    return found


def decisions(exported: Mapping[str, Any]) -> list[Decision]:
    """What `llvm-cov export` says of functions; a record is line, column, end, end, expanded file,
    kind, conditions. An inline function is there once for each file that uses it: a condition
    counts when it decided in any of them."""
    found: dict[tuple[str, int, int], tuple[bool, ...]] = {}
    for function in exported["data"][0]["functions"]:
        path = Path(function["filenames"][0])
        if not any(path.is_relative_to(ROOT / folder) for folder in FOLDERS):
            continue
        for record in function["mcdc_records"]:
            place = (str(path.relative_to(ROOT)), record[0], record[1])
            seen = tuple(record[-1])
            before = found.get(place, (False,) * len(seen))
            found[place] = tuple(map(operator.or_, before, seen))
    return [Decision(place[0], place[1], seen) for place, seen in sorted(found.items())]


def as_dict(found: list[Decision]) -> dict[str, Any]:
    """One JSON object; `gaps` names what is missing."""
    return {
        "decisions": len(found),
        "conditions": sum(len(decision.conditions) for decision in found),
        "covered": sum(sum(decision.conditions) for decision in found),
        "gaps": [
            {"file": one.file, "line": one.line, "conditions": one.gaps}
            for one in found
            if one.gaps
        ],
    }


def _run(*command: str, env: Mapping[str, str] | None = None) -> str:
    try:
        ended = subprocess.run(
            command, cwd=ROOT, env={**os.environ, **(env or {})}, capture_output=True, text=True
        )
    except FileNotFoundError:
        message = f"missing: {command[0]}; install clang-19, llvm-19 and libclang-rt-19-dev"
        raise UserError(message) from None
    if ended.returncode != 0:
        said = (ended.stdout + ended.stderr)[-2000:]
        raise UserError(f"{' '.join(command[:3])}: ended with {ended.returncode}:\n{said}")
    return ended.stdout
