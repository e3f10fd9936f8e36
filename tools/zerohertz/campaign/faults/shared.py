"""Cases that are one run up to their first fault: that run once, each case from there in a process
of its own.
"""

from __future__ import annotations

import dataclasses
import functools
import json
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from zerohertz import sim
from zerohertz.campaign.fork import answer_of
from zerohertz.sil_types import WARNINGS
from zerohertz.sim_steps import Steps

# A fault that was latched and leaves the gates open for so long has said its word, and nothing that
# the drive does begins any more.
OVER_S = 0.5
LOOK_S = 0.1
PERIOD_S = 200e-6  # of the campaign's board; a test compares
# What the judge reads.
COLUMNS = (
    "t_s", "state", "gates_on", "faults", "speed_unknown", "speed_ref_rpm", "speed_rpm", "load_Nm",
    "i_peak_A",
)  # fmt: skip

Row = dict[str, Any]


@dataclasses.dataclass(frozen=True)
class Rest:
    """A case from where it leaves the others."""

    job: sim.Job
    end_s: float
    judge: Callable[[sim.Record], Row]


def rows_of(cases: Sequence[Rest], parting_s: float) -> Iterator[Row]:
    """Of cases with the same job up to parting_s, where each gets its own scenario.

    0: their scenarios act from the start.
    """
    last = max(cases, key=lambda case: case.end_s)
    common = dataclasses.replace(last.job, columns=COLUMNS)
    if parting_s > 0.0:
        common = dataclasses.replace(common, scenario_overrides={})
    with Steps(common) as run:
        run.advance(_steps(parting_s))
        for case in cases:
            answer = answer_of(functools.partial(_rest, run, case, parting_s))
            if isinstance(answer, str):
                raise RuntimeError(f"a run of the firmware ended by {answer}")
            yield answer


def _rest(run: Steps, case: Rest, parting_s: float) -> Row:
    """In the child."""
    if parting_s > 0.0:
        run.change(text_of(case.job))
    now_s, open_s = parting_s, 0.0
    while now_s < case.end_s and open_s < OVER_S:
        now_s = min(now_s + LOOK_S, case.end_s)
        run.advance(_steps(now_s))
        over = run.faults() & ~WARNINGS != 0 and not run.gates_on()
        open_s = open_s + LOOK_S if over else 0.0
    return case.judge(run.take())


def _steps(t_s: float) -> int:
    return round(t_s / PERIOD_S)


def text_of(job: sim.Job) -> str:
    """The scenario of a job, whose last section is [profiles], with what overrides it."""
    top, profiles = "", ""
    for name, value in job.scenario_overrides.items():
        section, _, key = name.partition(".")
        if section == "profiles":
            profiles += f"{key} = {json.dumps(value)}\n"
        else:
            top += f"{name} = {json.dumps(value)}\n"
    return f"{top}{job.scenario}{profiles}"
