"""From a built library to the report: the steps of `zh demo`."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

from zerohertz.build import ensure_built
from zerohertz.check import loci
from zerohertz.report import chart
from zerohertz.report.chart import Chart
from zerohertz.report.page import Report, build_page
from zerohertz.report.pictures import draw_all
from zerohertz.report.tables import TableOutcome, check_tables, motor_folders
from zerohertz.report.versions import versions
from zerohertz.scenario.evaluate import (
    SITUATIONS,
    Result,
    Run,
    evaluate_figures,
    evaluate_situations,
)
from zerohertz.scenario.figures import committed_sensitivity, result_json
from zerohertz.scenario.predicates import FIGURES
from zerohertz.scenario.setup import Setup

SHOWN_SEED = 1
STEPS = 6


class Steps:
    """One line per step: what, how far, how long."""

    def __init__(self, console: Console) -> None:
        self.console = console
        self.number = 0

    @contextmanager
    def step(self, text: str, total: int | None = None) -> Iterator[Callable[..., None]]:
        """A bar while it runs on a terminal; a line with the seconds when it is done."""
        self.number += 1
        label = f"[{self.number}/{STEPS}] {text}"
        start_s = time.monotonic()
        live = self.console.is_terminal
        if not live:
            self.console.print(f"{label} ...", markup=False, highlight=False)
        text_column = TextColumn("{task.description}", markup=False)
        columns = (text_column, BarColumn(), MofNCompleteColumn())
        with Progress(*columns, console=self.console, transient=True, disable=not live) as bar:
            task = bar.add_task(label, total=total)
            yield lambda done, total=None: bar.update(task, completed=done, total=total)
        seconds = time.monotonic() - start_s
        self.console.print(f"{label}: {seconds:.1f} s", markup=False, highlight=False)


def make_report(
    paper: Setup,
    recommended: Setup | None,
    out: Path,
    *,
    seeds: int,
    workers: int,
    console: Console,
    design: bool = False,
) -> Report:
    """Runs everything and writes out/index.html and out/figures.json."""
    steps = Steps(console)
    out.mkdir(parents=True, exist_ok=True)
    with steps.step("building the firmware and the simulated rig") as progress:
        ensure_built(progress=progress)
    folders = motor_folders()
    what = "designing and proving" if design else "proving"
    with steps.step(f"{what} the gain tables", len(folders)) as progress:
        fresh = out / "gain_tables" if design else None
        tables = check_tables(folders, fresh, workers, progress)
    runs = seeds * len(FIGURES)
    with steps.step(f"thirteen experiments, {seeds} noise seeds", runs) as progress:
        results = evaluate_figures(paper, seeds, workers, progress)
    situations: list[Result] = []
    with steps.step("the recommended configuration", seeds * len(SITUATIONS)) as progress:
        if recommended is not None:
            situations = evaluate_situations(recommended, seeds, workers, progress)
    wanted = _runs_to_draw(paper, recommended)
    with steps.step("drawing", len(wanted)) as progress:
        pictures = dict(zip(wanted, draw_all(wanted.values(), workers, progress), strict=True))
        pictures |= _design_pictures(tables, paper)
    with steps.step("writing the report"):
        sensitivity, source = committed_sensitivity(paper)
        report = Report(
            paper=paper,
            results=results,
            pictures=pictures,
            recommended=recommended,
            situations=situations,
            tables=tables,
            sensitivity=sensitivity,
            sensitivity_source=source,
            versions=versions(),
        )
        content = result_json(paper, results, sensitivity, source)
        (out / "figures.json").write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
        (out / "index.html").write_text(build_page(report), encoding="utf-8")
    return report


def _runs_to_draw(paper: Setup, recommended: Setup | None) -> dict[str, Run]:
    runs = {str(figure): Run(paper, figure, SHOWN_SEED) for figure in FIGURES}
    if recommended is not None:
        runs |= {name: Run(recommended, figure, SHOWN_SEED) for name, figure in SITUATIONS.items()}
    return runs


def _design_pictures(tables: list[TableOutcome], paper: Setup) -> dict[str, Chart]:
    """Fig. 4 and gamma of the paper's motor, as the LMIs give it."""
    by_lmi = [table for table in tables if table.method == "gamma_pr"]
    first = min(by_lmi, key=lambda t: t.folder != paper.motor_dir, default=None)
    if first is None:
        return {}
    table = loci.read(first.folder / "l_gain.json")
    return {"fig04": chart.root_loci(table), "gamma": chart.orientation(table)}
