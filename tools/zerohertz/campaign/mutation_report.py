"""One mutation run as a person sees it: progress, survivors, score, JSON."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

from zerohertz.campaign.mutation import Result, all_mutants, draw, run


@dataclass(frozen=True)
class Request:
    """What to mutate; sample 0 means all."""

    folder: str = "firmware"
    files: Sequence[str] = ()
    sample: int = 0
    seed: int = 2005
    jobs: int = 2
    minimum: float = 0.95


def run_and_show(request: Request, json_file: Path | None, out: TextIO) -> tuple[Result, bool]:
    """Judge, print, write; the answer also says whether the run is good.

    Good means: the score is reached and every accepted survivor still is one.
    """
    started = time.monotonic()
    population = all_mutants(request.folder, request.files)
    chosen = draw(population, request.sample, request.seed)
    progress = _Progress(len(chosen))
    result = run(chosen, request.jobs, progress.step, whole=len(chosen) == len(population))
    _show(result, time.monotonic() - started, len(population), out)
    if json_file:
        json_file.write_text(json.dumps(as_dict(request, result), indent=2) + "\n")
    return result, result.score >= request.minimum and not result.stale


def as_dict(request: Request, result: Result) -> dict:
    """For JSON: what was asked and what came out."""
    head = {"folder": request.folder, "sample": request.sample, "seed": request.seed}
    return {**head, **result.as_dict()}


class _Progress:
    """A counter on a terminal, silence elsewhere."""

    def __init__(self, total: int) -> None:
        self.total = total
        self.count = 0

    def step(self, verdict: str) -> None:
        """One more mutant is judged."""
        self.count += 1
        if sys.stderr.isatty():
            end = "\n" if self.count == self.total else ""
            print(f"\r{self.count}/{self.total} {verdict:<10}", end=end, file=sys.stderr)


def _show(result: Result, seconds: float, population: int, out: TextIO) -> None:
    for survivor in result.survivors:
        print(f"{survivor['file']}:{survivor['number']}: {survivor['kind']} survived", file=out)
        print(f"  - {survivor['line']}\n  + {survivor['becomes']}", file=out)
    for entry in result.stale:
        print(f"mutation_survivors.toml: {entry['file']}: no such survivor any more:", file=out)
        print(f"  + {entry['becomes']}", file=out)
    verdicts = result.verdicts
    print(
        f"{result.total} of {population} mutants in {seconds:.0f} s: {verdicts['killed']} killed, "
        f"{verdicts['survived']} survived ({result.accepted} accepted), "
        f"{verdicts['equivalent']} equivalent, {verdicts['invalid']} do not compile",
        file=out,
    )
    print(
        f"score {result.score:.4f} without the accepted ones, {result.raw_score:.4f} with them",
        file=out,
    )
