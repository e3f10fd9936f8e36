"""All entrants through all parts: each part in a process of its own, its answer kept.

The answer of a part belongs to a key: the entrant's library and numbers, the arguments, and the
sources that judge. With the same key it is not measured again.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from zerohertz.arena.entrant import Entrant
from zerohertz.arena.measure import PARTS, Task
from zerohertz.errors import UserError
from zerohertz.estimators.chosen import choose, python_digest
from zerohertz.estimators.library import checked_library
from zerohertz.paths import BUILD, ROOT

FOLDER = BUILD / "arena"
LONGEST_S = 3600.0  # of one part, and for each run of the envelope; what takes longer hangs
LONGEST_RUN_S = 20.0
BARE_PARTS = ("maps", "envelope")  # what the drive finds out changes no instruction count
# What makes or judges an answer, by folder: a change of one makes kept answers old, as does the
# library. No page, picture or command: those are made anew from the answers.
_JUDGES = {
    "arena": "measure entrant runs",
    "atlas": "classes points simulate summary",
    "envelope": "axes campaign case feasible measure mission motors plans plant run",
    "scenario": "by_eye evaluate filters predicates setup signals",
    "campaign/faults": "judge run",
    "campaign": "rig",
    "": "sim",
}
_PACKAGE = ROOT / "tools" / "zerohertz"
SOURCES = tuple(
    _PACKAGE / folder / f"{name}.py" for folder, names in _JUDGES.items() for name in names.split()
)

Found = dict[str, Any]


@dataclasses.dataclass(frozen=True)
class Options:
    """The same for every entrant."""

    parts: tuple[str, ...] = PARTS
    points: int = 0
    runs: int = 40
    bare_runs: int = 0  # without helpers; 0: as many
    seed: int = 2005
    workers: int = 2
    fresh: bool = False
    folder: Path = FOLDER


def run(
    entrants: Iterable[Entrant], options: Options, tell: Callable[[str], None]
) -> dict[str, Found]:
    """What was found, by the entrants' names: parts, the same below `bare`, errors in words."""
    entrants = list(entrants)
    found: dict[str, Found] = {}
    for number, entrant in enumerate(entrants, 1):
        tell(f"{number} of {len(entrants)}: {entrant.title}")
        found[entrant.name] = _one(entrant, options, tell)
    return found


def _one(entrant: Entrant, options: Options, tell: Callable[[str], None]) -> Found:
    about = {name: getattr(entrant, name) for name in ("title", "reference", "base", "checked")}
    try:
        choose(entrant.estimator)
        library = checked_library()
    except UserError as error:
        tell(f"  {error}")
        return about | {"errors": [str(error)], "bare": {}}
    mark = library.read_bytes() + python_digest()
    found: Found = about | {"errors": [], "bare": {}}
    for part, bare in _plan(entrant, options):
        task = Task(
            entrant=entrant,
            part=part,
            bare=bare,
            points=options.points,
            runs=(bare and options.bare_runs) or options.runs,
            seed=options.seed,
            workers=options.workers,
            folder=str(options.folder / "rows"),
        )
        answer = _answer(task, mark, options, tell)
        if "error" in answer:
            found["errors"].append(f"{part}{' (bare)' if bare else ''}: {answer['error']}")
        else:
            (found["bare"] if bare else found)[part] = answer
    return found


def _plan(entrant: Entrant, options: Options) -> list[tuple[str, bool]]:
    """Parts, with the drive's helpers and without."""
    every = [(part, False) for part in PARTS] + [(part, True) for part in BARE_PARTS]
    python = ".py:" in entrant.estimator  # no image has one
    return [
        (part, bare)
        for part, bare in every
        if part in options.parts and not (python and part == "instructions")
    ]


def _answer(task: Task, mark: bytes, options: Options, tell: Callable[[str], None]) -> Found:
    name = f"{task.part}{'-bare' if task.bare else ''}"
    kept = options.folder / task.entrant.name / f"{name}-{_key(task, mark)}.json"
    if kept.is_file() and not options.fresh:
        tell(f"  {name}: kept")
        return json.loads(kept.read_text(encoding="utf-8"))
    tell(f"  {name}")
    began = time.monotonic()
    kept.parent.mkdir(parents=True, exist_ok=True)
    answer = _measured(task, kept.with_suffix(".task"))
    if "error" in answer:
        tell(f"  {name}: {answer['error']}")
    else:
        tell(f"  {name}: {time.monotonic() - began:.0f} s")
        scratch = kept.with_suffix(".tmp")
        scratch.write_text(json.dumps(answer), encoding="utf-8")
        scratch.replace(kept)
    return answer


def _measured(task: Task, file: Path) -> Found:
    file.write_text(json.dumps(task.as_json()), encoding="utf-8")
    longest_s = LONGEST_S + LONGEST_RUN_S * task.runs
    command = (sys.executable, "-m", "zerohertz.arena.measure", str(file))
    try:
        done = subprocess.run(
            command, cwd=ROOT, stdout=subprocess.PIPE, text=True, timeout=longest_s
        )
    except subprocess.TimeoutExpired:
        return {"error": f"too slow: not done in {longest_s:.0f} s; the same command goes on"}
    finally:
        file.unlink()
    if done.returncode < 0:
        return {"error": f"crashed with {signal.Signals(-done.returncode).name}"}
    if done.returncode != 0:
        return {"error": f"crashed, exit code {done.returncode}"}
    return json.loads(done.stdout.splitlines()[-1])


def _key(task: Task, mark: bytes) -> str:
    digest = hashlib.sha256(mark)
    content = task.as_json()
    for name in ("folder", "workers"):
        del content[name]
    for name in ("title", "reference", "checked"):
        del content["entrant"][name]
    base = task.entrant.setup(task.bare)
    digest.update(json.dumps([content, dict(base.params)], sort_keys=True).encode())
    for path in SOURCES:
        digest.update(path.read_bytes())
    for path in (base.motor_dir / "l_gain.json", base.motor_dir / "motor.toml", base.board):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]
