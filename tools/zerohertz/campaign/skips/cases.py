"""The cases: an executed instruction, a mode, a plain fault or none. A case is what its name says.

0x4010ac@run          the instruction at that address, in RUN
0x4010ac@run+fault    in the period in which i_u goes to its end
"""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import json
import random
from collections.abc import Mapping

import numpy as np

from zerohertz import sim
from zerohertz.campaign.flips import modes as flips
from zerohertz.campaign.flips.run import PERIOD_S, faults_of
from zerohertz.campaign.skips import core
from zerohertz.errors import UserError
from zerohertz.paths import BUILD

FAULT = "+fault"
PLAIN = "i_u_at_its_end"
BEGIN_S = 0.1
AFTER_S = 1.5  # a wrong speed has to last for 1 s
ANSWER_S = 0.15
# Name here -> a mode of `zh campaign flips`; of those of the vector control that with the shortest
# way to its period.
BASES: Mapping[str, str] = {
    "run": "run_60",
    "i_f": "i_f",
    "commissioning": "commissioning",
    "ready": "ready",
}
_COST_S = 25.0  # for the sharing out of work only: four cases at once


@dataclasses.dataclass(frozen=True)
class Skip:
    """One mode, with or without a fault: the run and the period."""

    name: str

    @property
    def faulty(self) -> bool:
        return self.name.endswith(FAULT)

    @property
    def mode(self) -> flips.Mode:
        return flips.MODES[BASES[self.name.removesuffix(FAULT)]]

    @property
    def period(self) -> int:
        """One of the mode, well inside; with the fault that in which the drive trips."""
        return _trip_period(self) if self.faulty else self.begin

    @property
    def begin(self) -> int:
        return round((self.mode.when(flips.bench()).first_s + BEGIN_S) / PERIOD_S)

    def job(self) -> sim.Job:
        made = self.mode.job(flips.bench())
        overrides = dict(made.scenario_overrides)
        end_s = self.begin * PERIOD_S + AFTER_S
        if self.faulty:
            overrides |= flips.PLAIN[PLAIN](self.begin * PERIOD_S)
            end_s = self.begin * PERIOD_S + ANSWER_S
        elif self.mode.scenario:
            end_s += flips.bench().run_s  # of a drive that has yet to start
        steps = round(end_s / PERIOD_S)
        return dataclasses.replace(made, scenario_overrides=overrides, max_steps=steps)


@functools.cache
def _trip_period(skip: Skip) -> int:
    record = sim.run(skip.job())
    tripped = np.flatnonzero(faults_of(record))
    if not len(tripped):
        raise UserError(f"{skip.name}: the plain fault does not trip the drive; take another one")
    return int(tripped[0])


SKIPS: Mapping[str, Skip] = {
    name: Skip(name) for base in BASES for name in (base, f"{base}{FAULT}")
}


@dataclasses.dataclass(frozen=True)
class Case:
    """One run. map (its mode) and index place it in the store."""

    map: str
    index: int
    name: str
    address: int
    function: str
    speed_rpm: float = 0.0
    loaded_s: float = _COST_S


def executed(skip: Skip) -> list[core.Instruction]:
    """Of its period; kept beside the build, for the image that it was measured on."""
    image = hashlib.sha256(core.image().read_bytes()).hexdigest()[:16]
    kept = BUILD / "skips" / f"executed-{image}-{skip.name}-{skip.period}.json"
    if kept.is_file():
        return [core.Instruction(*row) for row in json.loads(kept.read_text(encoding="utf-8"))]
    found = core.executed(skip.job(), skip.period)
    kept.parent.mkdir(parents=True, exist_ok=True)
    rows = [dataclasses.astuple(instruction) for instruction in found]
    kept.write_text(json.dumps(rows), encoding="utf-8")
    return found


def cases(name: str, count: int, seed: int) -> list[Case]:
    """A seeded sample of a mode; 0: every executed instruction."""
    every = [
        Case(name, index, f"{found.address:#x}@{name}", found.address, found.function)
        for index, found in enumerate(executed(skip_of(name)))
    ]
    if 0 < count < len(every):
        chosen = sorted(random.Random(f"{seed}/{name}").sample(range(len(every)), count))
        every = [every[k] for k in chosen]
    return every


def case_of(name: str) -> Case:
    """A case by its name alone."""
    address, _, mode = name.partition("@")
    for case in cases(skip_of(mode).name, 0, 0):
        if f"{case.address:#x}" == address:
            return case
    raise UserError(f"--case: {name}: that period executes no such instruction; --list names all")


def skip_of(name: str) -> Skip:
    if name not in SKIPS:
        raise UserError(f"--case: {name}: no such mode; there are {', '.join(SKIPS)}")
    return SKIPS[name]
