"""Pictures of runs: simulate one seed, draw it. Charts are made in worker processes."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterable
from pathlib import Path

from zerohertz import sim
from zerohertz.report import chart, figure_plot, style
from zerohertz.report.chart import Chart
from zerohertz.scenario.evaluate import Run, job, signals
from zerohertz.scenario.setup import event_s, figure_scenario, scenario_file
from zerohertz.scenario.signals import Signals

SHOWN_SEED = 1


def simulate(run: Run) -> Signals:
    """The signals of one experiment."""
    begin_s = event_s(scenario_file(figure_scenario(run.figure)))
    return signals(sim.run(job(run)), begin_s, run.setup)


def source(run: Run) -> str:
    """What a picture shows, for its corner."""
    return f"configuration {run.setup.name}, {run.setup.rig_name}, seed {run.seed}"


def chart_of(run: Run) -> Chart:
    """The plot for the report."""
    return chart.experiment(simulate(run), source(run))


def write_png(run: Run, file: Path, title: str, width_px: int) -> int:
    """The plot as a PNG file, for a README; its size in bytes."""
    with figure_plot.draw(simulate(run), source(run), title=title) as drawn:
        data = style.png(drawn, width_px)
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_bytes(data)
    return len(data)


def draw_all(runs: Iterable[Run], workers: int, progress: Callable[[int], None]) -> list[Chart]:
    """The chart of every run, in order."""
    found = []
    with multiprocessing.get_context("spawn").Pool(max(1, workers)) as pool:
        for picture in pool.imap(chart_of, list(runs), chunksize=1):
            found.append(picture)
            progress(len(found))
    return found
