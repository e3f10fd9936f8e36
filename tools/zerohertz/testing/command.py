"""`zh test`: everything that has to hold before a commit, as CI runs it."""

from __future__ import annotations

import json
import os
import sys
import time
from dataclasses import asdict
from typing import Annotated

import typer

from zerohertz.console import short_paths
from zerohertz.testing.counts import TimedTest, slowest_tests
from zerohertz.testing.runner import run_stages
from zerohertz.testing.selection import select
from zerohertz.testing.stage import Report, Stage, Stopwatch
from zerohertz.testing.stages import LOGS, all_stages

LOG_LINES_SHOWN = 60


def register(app: typer.Typer) -> None:
    """Add `zh test`."""

    @app.command("test")
    def test(
        quick: Annotated[
            bool,
            typer.Option(
                "--quick", help="Only build, unit tests, layout and rules; takes a minute."
            ),
        ] = False,
        only: Annotated[
            str, typer.Option(help="Only these stages and what they need, e.g. unit,tidy-c.")
        ] = "",
        as_json: Annotated[
            bool,
            typer.Option(
                "--json", help="Print one JSON object on stdout, everything else on stderr."
            ),
        ] = False,
    ) -> None:
        """Build with gcc and clang, run all tests and checks. Exit 1 if one fails."""
        out = sys.stderr if as_json else sys.stdout
        stages = select(all_stages(), quick, only)
        watch, since = Stopwatch(), time.time()
        live = _Live(out, len(stages))
        reports = run_stages(stages, LOGS, _cores(), live.started, live.ended)
        passed = sum(report.outcome.passed for report in reports)
        failed = sum(report.outcome.failed for report in reports)
        for report in reports:
            if not report.ok:
                _show_log(report, out)
        slowest = slowest_tests(LOGS, since)
        if as_json:
            print(json.dumps(_as_dict(reports, slowest, watch.read()), indent=2))
        _show_slowest(slowest, out)
        logs = short_paths(LOGS)
        print(f"\n{len(reports)} stages in {watch.read():.0f} s; logs in {logs}", file=out)
        # The closing line that CI reads: alone on its line, and the last.
        print(f"{passed} passed, {failed} failed", file=out, flush=True)
        raise typer.Exit(0 if all(report.ok for report in reports) else 1)


def _cores() -> int:
    return max(1, min(2, os.cpu_count() or 1))


class _Live:
    """One line per stage that ended; on a terminal also a line saying which are running."""

    def __init__(self, out, total: int) -> None:
        self.out = out
        self.total = total
        self.done = 0
        self.running: list[str] = []
        self.terminal = out.isatty()

    def started(self, stage: Stage) -> None:
        """A stage begins."""
        self.running.append(stage.name)
        self._status()

    def ended(self, report: Report) -> None:
        """A stage ends."""
        self.done += 1
        if report.stage.name in self.running:
            self.running.remove(report.stage.name)
        if self.terminal:
            self.out.write("\r\033[K")
        word = "ok  " if report.ok else "FAIL"
        text = report.outcome.note or report.stage.what
        print(
            f"{word} {report.stage.name:<10} {report.seconds:6.1f} s  {text}",
            file=self.out,
            flush=True,
        )
        self._status()

    def _status(self) -> None:
        if self.terminal and self.running:
            self.out.write(f"\r\033[K[{self.done}/{self.total}] {', '.join(self.running)} ...")
            self.out.flush()


def _show_log(report: Report, out) -> None:
    if report.skipped or not report.log.is_file():
        return
    lines = report.log.read_text(errors="replace").splitlines()
    print(f"\n--- {report.stage.name}: end of {short_paths(report.log)}", file=out)
    print("\n".join(lines[-LOG_LINES_SHOWN:]), file=out)


def _show_slowest(slowest: list[TimedTest], out) -> None:
    if slowest:
        print("\nslowest tests:", file=out)
    for test in slowest:
        print(f"{test.seconds:8.1f} s  {test.run}: {test.name}", file=out)


def _as_dict(reports: list[Report], slowest: list[TimedTest], seconds: float) -> dict:
    return {
        "passed": sum(report.outcome.passed for report in reports),
        "failed": sum(report.outcome.failed for report in reports),
        "seconds": round(seconds, 1),
        "slowest": [asdict(test) for test in slowest],
        "stages": {
            report.stage.name: {
                "ok": report.ok,
                "passed": report.outcome.passed,
                "failed": report.outcome.failed,
                "seconds": round(report.seconds, 1),
                "note": report.outcome.note,
            }
            for report in reports
        },
    }
