"""The campaign: the executed instructions of each mode on the atlas' runner."""

from __future__ import annotations

from zerohertz.atlas.run import RunOptions, Tell, run_map
from zerohertz.campaign.flips.campaign import Asked, Bar, Result
from zerohertz.campaign.flips.cases import split
from zerohertz.campaign.flips.modes import bench
from zerohertz.campaign.skips.cases import cases
from zerohertz.campaign.skips.run import run_cases


def run_all(asked: Asked, how: RunOptions, tell: Tell, bar: Bar) -> Result:
    """All of it, mode by mode."""
    rows = {}
    for mode, count in split(list(asked.modes), asked.runs).items():
        chosen = cases(mode, count, asked.seed)
        with bar(mode, len(chosen)) as progress:
            rows[mode] = run_map(bench(), chosen, how, tell, progress, run_cases)
    return Result(asked, rows)
