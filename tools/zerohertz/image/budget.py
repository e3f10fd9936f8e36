"""Budgets of the flash images: instructions of a control period, flash, RAM, stack; against the
committed figures (tools/docs/image_budget.json). All of them repeat exactly with one compiler."""

from __future__ import annotations

import dataclasses
import json
import subprocess
from collections.abc import Callable, Iterable
from typing import Any

from zerohertz.build import build_image
from zerohertz.errors import UserError
from zerohertz.image import cycles, sizes
from zerohertz.image.command import PRESETS as CONFIGS
from zerohertz.image.command import Experiment, experiments, measure
from zerohertz.image.interrupt import STEADY, Interrupt, load_of, measure_interrupt
from zerohertz.image.loop import PilRun
from zerohertz.image.ports import ports
from zerohertz.paths import ROOT

COMMITTED = ROOT / "tools" / "docs" / "image_budget.json"
# Instructions, mean and worst with a live change.
GOALS = {"paper": (650, 850), "recommended": (800, 1000), "all_options": ("", 1000)}

ALL_OPTIONS = (Experiment("smoke", "all_options"), Experiment("fig07", "all_options"))

Progress = Callable[[str], None]


def every_experiment() -> list[Experiment]:
    """All figures and situations, and two runs with every option on."""
    return [*experiments("all", None), *ALL_OPTIONS]


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


def measure_interrupts(progress: Progress | None = None) -> list[Interrupt]:
    """Every configuration in steady running."""
    found = []
    for experiment in STEADY:
        found.append(measure_interrupt(experiment))
        if progress is not None:
            progress(experiment.name)
    return found


def added_figures(interrupts: Iterable[Interrupt]) -> dict[str, dict[str, int]]:
    """Configuration -> the most that a live change, and that a trace, adds to a period."""
    return {i.config: {"live_change": i.live_change, "trace": i.trace} for i in interrupts}


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


def rows() -> dict[str, Any]:
    """Compiler -> its committed figures."""
    return json.loads(COMMITTED.read_text(encoding="utf-8"))


def committed() -> dict[str, Any]:
    """This compiler's figures. UserError without: they are not another one's."""
    known = rows()
    if compiler() not in known:
        raise UserError(
            f"{COMMITTED.name}: has nothing of {compiler()}, only of {', '.join(known)}; measure "
            "with tools/zh bench --image --write and commit the file"
        )
    return known[compiler()]


def write(images: dict[str, Any], periods: dict[str, Any], added: dict[str, Any]) -> None:
    """Keeps this compiler's figures for a commit; those of others stay."""
    row = {"images": images, "periods": periods, "added": added}
    content = dict(sorted((rows() | {compiler(): row}).items()))
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


def overall(periods: dict[str, Any], added: dict[str, Any]) -> dict[str, Any]:
    """Per configuration: mean of the experiments' means, and the worst of all with a live change in
    that very period; and the worst latency."""
    result: dict[str, Any] = {}
    for config in CONFIGS:
        found = [f for name, f in periods.items() if name.endswith(f" {config}")]
        if found and config in added:
            steady = max(f["worst"] for f in found)
            result[config] = {
                "mean": round(sum(f["mean"] for f in found) / len(found), 1),
                "worst": steady + added[config]["live_change"],
                "worst_without_live_change": steady,
                "live_change": added[config]["live_change"],
                "trace": added[config]["trace"],
            }
    result["latency"] = max(f["latency"] for f in periods.values())
    return result


def load(instructions: dict[str, Any], interrupts: Iterable[Interrupt]) -> dict[str, Any]:
    """Per configuration, an estimate: the cycles per instruction of steady running."""
    result: dict[str, Any] = {"model": cycles.MODEL_NAME}
    for each in interrupts:
        counted = instructions[each.config]
        found = load_of(counted["mean"], counted["worst"], each.cycles_per_instruction)
        result[each.config] = dataclasses.asdict(found)
    return result
