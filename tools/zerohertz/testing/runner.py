"""Runs stages on as many cores as there are, in the order of the list, each after its needs."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from pathlib import Path

from zerohertz.testing.stage import Log, Outcome, Report, Stage, Stopwatch


def run_stages(
    stages: Sequence[Stage],
    log_folder: Path,
    cores: int,
    started: Callable[[Stage], None],
    ended: Callable[[Report], None],
) -> list[Report]:
    """All stages, also after one has failed; one whose need failed counts as failed, unrun."""
    waiting = list(stages)
    running: dict[Future[Report], Stage] = {}
    reports: dict[str, Report] = {}

    def finish(report: Report) -> None:
        reports[report.stage.name] = report
        ended(report)

    with ThreadPoolExecutor(max_workers=cores) as pool:
        while waiting or running:
            for stage in _blocked(waiting, reports):
                waiting.remove(stage)
                note = "not run: a stage it needs failed"
                log = log_folder / f"{stage.name}.log"
                finish(Report(stage, Outcome(0, 1, note), 0.0, log, skipped=True))
            free = cores - sum(min(stage.cores, cores) for stage in running.values())
            for stage in _startable(waiting, reports, free, cores):
                waiting.remove(stage)
                started(stage)
                running[pool.submit(_run, stage, log_folder)] = stage
            if running:
                done, _ = wait(running, return_when=FIRST_COMPLETED)
                for future in done:
                    del running[future]
                    finish(future.result())
    return [reports[stage.name] for stage in stages]


def _blocked(waiting: Sequence[Stage], reports: dict[str, Report]) -> list[Stage]:
    return [s for s in waiting if any(n in reports and not reports[n].ok for n in s.needs)]


def _startable(
    waiting: Sequence[Stage], reports: dict[str, Report], free: int, cores: int
) -> list[Stage]:
    chosen = []
    for stage in waiting:
        ready = all(need in reports and reports[need].ok for need in stage.needs)
        wanted = min(stage.cores, cores)
        if ready and wanted <= free:
            chosen.append(stage)
            free -= wanted
    return chosen


def _run(stage: Stage, log_folder: Path) -> Report:
    watch = Stopwatch()
    log = Log(log_folder / f"{stage.name}.log")
    try:
        outcome = stage.run(log)
    except Exception:
        log.write(traceback.format_exc())
        outcome = Outcome(0, 1, "the check itself broke")
    return Report(stage, outcome, watch.read(), log.path)
