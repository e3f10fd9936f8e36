"""What `zh atlas` shows and leaves behind."""

from __future__ import annotations

import dataclasses
import importlib.util
import json
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from zerohertz.atlas import picture
from zerohertz.atlas.simulate import RIG_NAME, Bench
from zerohertz.atlas.summary import causes, causes_text, counts, percent, shares
from zerohertz.console import tell
from zerohertz.scenario.setup import Setup

Results = dict[str, list[dict[str, Any]]]


def test_R(setup: Setup, bench: Bench, workers: int) -> dict[str, Any] | None:
    """The long hold at 60 min^-1, of the same firmware as the maps; None without the module."""
    if importlib.util.find_spec("zerohertz.atlas.special") is None:
        tell("test R: zerohertz.atlas.special is not there; left out")
        return None
    from zerohertz.atlas import special

    told = dataclasses.replace(setup, params={**bench.params, **bench.firmware})
    (result,) = special.run_tests(told, ["test_R"], workers)
    return result.as_json()


def store(
    folder: Path, config: str, results: Results, test_R: dict[str, Any] | None, run_s: float
) -> dict[str, Any]:
    """Maps beside their rows, summary.json above them; returns what --json prints."""
    content: dict[str, Any] = {
        name: counts(rows) | {"causes": causes(rows)} for name, rows in results.items()
    }
    if "map_i" in results and "drift" in results:
        content["test_R"] = test_R
    content["run_s"] = round(run_s, 1)
    for name, rows in results.items():
        picture.write_png(folder / name / "atlas.png", config, rows)
        picture.write_html(folder / name / "atlas.html", config, rows)
    whole = content | {"shares": {name: shares(rows) for name, rows in results.items()}}
    (folder / "summary.json").write_text(json.dumps(whole, indent=1) + "\n")
    return content


def print_table(config: str, results: Results) -> None:
    """Classes in points and percent; what the supervisor said, in percent of the time."""
    table = Table(title=f"configuration {config}, {RIG_NAME}", title_justify="left")
    for text in "map points oriented% held% takeover safe_stop unsafe silent".split():
        table.add_column(text, justify="left" if text == "map" else "right", no_wrap=True)
    for text in ("closed%", "degraded%", "impressed%", "closed% >1Hz", "no start"):
        table.add_column(text, justify="right", no_wrap=True)
    for name, rows in results.items():
        count, share = counts(rows), shares(rows)
        cells = [f"{percent(count[key], len(rows)):.1f}" for key in ("oriented", "held")]
        cells += [str(count[key]) for key in ("takeover", "safe_stop", "unsafe", "silent")]
        for key in ("closed_share", "degraded_share", "impressed_share"):
            cells.append(f"{100.0 * (share[key] or 0.0):.1f}")
        fast = share["closed_share_held_above_1Hz"]
        cells.append("" if fast is None else f"{100.0 * fast:.1f}")
        table.add_row(name, str(count["points"]), *cells, str(share["failed_starts"]))
    # Wide enough for the numbers where nobody looks: a pipe has 80 columns.
    Console(width=max(Console().width, 150)).print(table)
    for name, rows in results.items():
        if stopped := causes(rows):
            print(f"{name}: points that stopped: {causes_text(stopped)}")


def print_throughput(bench: Bench, workers: int, as_json: bool) -> None:
    """Beside independent processes, measured now."""
    from zerohertz.atlas.throughput import measure

    found = measure(bench, workers)
    if as_json:
        print(json.dumps(dataclasses.asdict(found)))
        return
    print(
        f"{found.points} points of two seconds after the start, {found.workers} processes\n"
        f"atlas            {found.atlas_points_per_s:8.0f} points/s\n"
        f"independent      {found.independent_points_per_s:8.0f} points/s\n"
        f"ratio            {100.0 * found.ratio:8.1f} % of the time, "
        f"{100.0 * found.cpu_ratio:.1f} % of the CPU time\n"
        f"100 000 points   {found.projected_100k_s / 60.0:8.1f} min"
    )
