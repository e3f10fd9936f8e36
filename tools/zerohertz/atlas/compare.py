"""`zh atlas --compare`: the same map under several configurations, in one picture."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

from zerohertz.atlas import picture
from zerohertz.atlas.points import RS_RATIOS, standard_map
from zerohertz.atlas.run import Progress, RunOptions, Tell, run_map
from zerohertz.atlas.simulate import make_bench
from zerohertz.report import style
from zerohertz.scenario.setup import load_setup

# What a reader has, what the paper gives, what the firmware reaches.
CONFIGS = ("no_gain", "paper", "recommended")
WIDTH_PX = 1600

Rows = Sequence[Mapping[str, Any]]


def run(
    configs: Sequence[str],
    map_name: str,
    options: RunOptions,
    tell: Tell,
    bar: Callable[[str, int], AbstractContextManager[Progress]],
) -> dict[str, Rows]:
    """The rows of the map by configuration, stored where `zh atlas --config` stores them."""
    points = standard_map(map_name)
    found = {}
    for config in configs:
        setup = load_setup(config)
        where = dataclasses.replace(options, out=options.out / setup.name)
        with bar(f"{setup.name} {points[0].map}", len(points)) as progress:
            found[setup.name] = run_map(make_bench(setup), points, where, tell, progress)
    return found


def write_png(path: Path, rows: Mapping[str, Rows]) -> None:
    """A row of panels per configuration, a panel per Rs ratio; percentages above each row."""
    with style.figure(10.0, 2.25 * len(rows) + 0.3) as drawn:
        *parts, foot = drawn.subfigures(len(rows) + 1, 1, height_ratios=[2.25] * len(rows) + [0.3])
        for part, (config, of_config) in zip(parts, rows.items(), strict=True):
            _row(part, of_config, last=part is parts[-1])
            part.suptitle(
                picture.title(config, of_config), x=0.01, ha="left", fontsize=10, weight="bold"
            )
        handles, labels = picture.legend()
        foot.legend(handles, labels, loc="center", ncols=len(labels))
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(style.png(drawn, WIDTH_PX))


def _row(part: Any, rows: Rows, last: bool) -> None:
    all_axes = part.subplots(1, len(RS_RATIOS), sharey=True)
    for axes, ratio in zip(all_axes, RS_RATIOS, strict=True):
        picture.panel(axes, [r for r in rows if picture.nearest_ratio(r) == ratio], size=70)
        style.panel_title(axes, f"Rs {ratio:g} of nameplate")
        if last:
            axes.set_xlabel("speed, min⁻¹")
    all_axes[0].set_ylabel("load, % of rated")
