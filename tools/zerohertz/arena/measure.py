"""One part of what one entrant is measured by, in a process of its own.

    python -m zerohertz.arena.measure FILE    FILE: the task as JSON; the answer on stdout

The process has the entrant's library (chosen.py), so whatever it does ends here and not the arena.
"""

from __future__ import annotations

import dataclasses
import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from zerohertz import param_list
from zerohertz.arena.entrant import Entrant
from zerohertz.arena.runs import columns_of
from zerohertz.console import progress_bar
from zerohertz.param_list import Value

MAPS = ("map_i", "map_ii", "drift")
PARTS = ("maps", "envelope", "figures", "instructions")
INSTRUCTION_PERIODS = 30_000  # 6 s: the start and the steady run behind it
SCENARIO = "fig07"
PERIOD_US = "200"  # of the tables that entrants bring
MOTOR = "table1"  # of the envelope: the one whose numbers an entrant's own parameters are for
# What the envelope's plan says itself.
_PLANNED = ("dead_time_s", "speed_J_kg_m2", "device_drop_V", "dead_time_i_threshold_A")


@dataclasses.dataclass(frozen=True)
class Task:
    """What to measure of whom."""

    entrant: Entrant
    part: str
    bare: bool
    points: int  # of each map; 0: all
    runs: int  # of the envelope
    seed: int
    workers: int
    folder: str  # for rows on their way

    def as_json(self) -> dict[str, Any]:
        return dataclasses.asdict(self) | {"entrant": self.entrant.as_json()}


def task_of(content: Mapping[str, Any]) -> Task:
    return Task(**(dict(content) | {"entrant": Entrant(**content["entrant"])}))


def measure(task: Task) -> dict[str, Any]:
    """The part's numbers."""
    return {"maps": maps, "envelope": envelope, "figures": figures, "instructions": instructions}[
        task.part
    ](task)


def spread(points: Sequence[Any], count: int) -> list[Any]:
    """So many of them, evenly over their order; all for 0."""
    if count == 0 or count >= len(points):
        return list(points)
    return [points[k * len(points) // count] for k in range(count)]


def maps(task: Task) -> dict[str, Any]:
    """The classes of each map, and of each point for the picture."""
    from zerohertz.atlas.points import standard_map
    from zerohertz.atlas.run import RunOptions, run_map
    from zerohertz.atlas.simulate import make_bench
    from zerohertz.atlas.summary import causes, counts

    bench = make_bench(task.entrant.setup(task.bare))
    how = RunOptions(Path(task.folder) / _drive(task), task.workers)
    found = {}
    for name in MAPS:
        points = spread(standard_map(name), task.points)
        with progress_bar(name, len(points)) as progress:
            rows = run_map(bench, points, how, _say, progress)
        # By the number of the point: which class, and silent or not.
        classes = {row["index"]: row["outcome"] for row in rows}
        found[name] = counts(rows) | {"classes": classes, "causes": causes(rows)}
    return found


def envelope(task: Task) -> dict[str, Any]:
    """Counts of the random missions, the same for every entrant."""
    from zerohertz.atlas.run import RunOptions
    from zerohertz.atlas.summary import causes
    from zerohertz.envelope import campaign
    from zerohertz.envelope.run import Sample

    setup = task.entrant.setup(task.bare)
    sample = Sample(
        task.seed,
        {"motor": MOTOR, "period_us": PERIOD_US},
        _changes(setup.params),
        str(setup.motor_dir),
    )
    how = RunOptions(Path(task.folder) / _drive(task) / "envelope", task.workers)
    result = campaign.run_all(sample, task.runs, how, _say, progress_bar)
    rows = result.possible
    return campaign.summary(rows) | {"rows": columns_of(rows), "causes": causes(rows)}


def figures(task: Task) -> dict[str, Any]:
    """The paper's protocols, judged as a good drive: how many of its four situations are held."""
    from zerohertz.scenario import evaluate

    setup = task.entrant.setup(task.bare)
    with progress_bar("figures", 0) as progress:
        results = evaluate.evaluate_situations(setup, 2, task.workers, progress, guard_acts=True)
    return {"score": evaluate.score(results)} | {r.key: r.match for r in results}


def instructions(task: Task) -> dict[str, Any]:
    """Of a control period on the emulated Cortex-M4F, whose signals have to equal the SIL's."""
    from zerohertz.build import build_image
    from zerohertz.errors import UserError
    from zerohertz.image import loop
    from zerohertz.image.command import MACHINES, PRESETS, Experiment, job_of

    base = task.entrant.base if task.entrant.base in PRESETS else "recommended"
    job = job_of(Experiment(SCENARIO, base), INSTRUCTION_PERIODS)
    job = dataclasses.replace(job, firmware=task.entrant.parameters)
    ran = loop.run(job, build_image(PRESETS[base]), machine=MACHINES["an386"])
    if ran.end is not loop.End.EQUAL:
        raise UserError(f"image and SIL differ: {ran.difference or ran.text}")
    # 0: it did not come to RUN in this time.
    mean = round(ran.mean_instructions, 1) or None
    return {"mean": mean, "worst": ran.worst_instructions}


def _drive(task: Task) -> str:
    return f"{task.entrant.name}{'-bare' if task.bare else ''}"


def _changes(params: Mapping[str, Value]) -> dict[str, float]:
    """What the entrant's drive has otherwise than the envelope's."""
    from zerohertz.envelope.motors import CONFIG
    from zerohertz.scenario.setup import load_setup

    usual = load_setup(CONFIG).parameters()
    wanted = param_list.defaults() | dict(params)
    return {
        name: float(value)
        for name, value in wanted.items()
        if value != usual[name] and name not in _PLANNED
    }


def _say(_: str) -> None:
    """What is kept and what is not, campaign.py tells."""


def main() -> None:
    from zerohertz.errors import UserError

    task = task_of(json.loads(Path(sys.argv[1]).read_text(encoding="utf-8")))
    try:
        answer = measure(task)
    except UserError as error:
        answer = {"error": " ".join(str(error).split())}
    print(json.dumps(answer))


if __name__ == "__main__":
    main()
