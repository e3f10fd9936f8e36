"""Budgets of the flash images: instructions of a control period, flash, RAM, stack; against the
committed figures (tools/docs/image_budget.json). All of them repeat exactly with one compiler."""

from __future__ import annotations

import dataclasses
import json
import subprocess
from collections.abc import Callable, Iterable
from typing import Any

from zerohertz.build import build_image
from zerohertz.image import sizes
from zerohertz.image.command import PRESETS as CONFIGS
from zerohertz.image.command import Experiment, experiments, measure
from zerohertz.image.loop import PilRun
from zerohertz.image.ports import ports
from zerohertz.paths import ROOT

COMMITTED = ROOT / "tools" / "docs" / "image_budget.json"
MEAN_GOAL, WORST_GOAL = 600, 1000

ALL_OPTIONS = Experiment("smoke", "all_options")

Progress = Callable[[str], None]


def every_experiment() -> list[Experiment]:
    """All figures and situations, and one run with every option on."""
    return [*experiments("all", None), ALL_OPTIONS]


def measure_images(chosen: Iterable[str] | None = None) -> dict[str, dict[str, int]]:
    """Port (default: all) -> bytes of flash, table, RAM and stack, configuration `recommended`."""
    return {
        port: dataclasses.asdict(sizes.measure(build_image(port), port))
        for port in (ports() if chosen is None else chosen)
    }


def measure_periods(
    chosen: Iterable[Experiment], max_periods: int | None = None, progress: Progress | None = None
) -> dict[str, dict[str, float]]:
    """Experiment -> instructions of its control periods."""
    found = {}
    for experiment in chosen:
        found[experiment.name] = period_figures(measure(experiment, "mps2-an386", max_periods))
        if progress is not None:
            progress(experiment.name)
    return found


def period_figures(run: PilRun) -> dict[str, float]:
    """Mean in state RUN, worst of all states, entry latency of the interrupt."""
    return {
        "mean": round(run.mean_instructions, 1),
        "worst": run.worst_instructions,
        "latency": run.worst_latency_instructions,
    }


def compiler() -> str:
    """What the figures are bound to."""
    command = ("arm-none-eabi-gcc", "--version")
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout.split("\n")[0]


def committed() -> dict[str, Any]:
    return json.loads(COMMITTED.read_text(encoding="utf-8"))


def write(images: dict[str, Any], periods: dict[str, Any]) -> None:
    """Keeps the figures for a commit."""
    content = {"compiler": compiler(), "images": images, "periods": periods}
    COMMITTED.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")


def grown(measured: dict[str, Any], known: dict[str, Any]) -> list[str]:
    """What is larger than committed, and what was never committed."""
    found = []
    for name, figures in measured.items():
        for key, value in figures.items():
            before = known.get(name, {}).get(key)
            if before is None or value > before:
                found.append(f"{name}: {key}: {value}, committed {before}")
    return found


def overall(periods: dict[str, dict[str, float]]) -> dict[str, Any]:
    """Per configuration: mean of the experiments' means, worst of all; and the worst latency."""
    result: dict[str, Any] = {}
    for config in CONFIGS:
        found = [f for name, f in periods.items() if name.endswith(f" {config}")]
        if found:
            mean = round(sum(f["mean"] for f in found) / len(found), 1)
            result[config] = {"mean": mean, "worst": max(f["worst"] for f in found)}
    result["latency"] = max(f["latency"] for f in periods.values())
    return result
