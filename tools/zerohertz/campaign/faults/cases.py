"""The cases: which faults meet which condition. A case is what its name says, and nothing else.

    i_u.frozen+open_v@running,300,+1,la2,averaged,sensors

Noise and the moments at which the faults begin are drawn from the name as well.
"""

from __future__ import annotations

import dataclasses
import itertools
import zlib
from collections.abc import Iterator
from typing import Any

from zerohertz.campaign.faults.conditions import (
    COMMISSIONING,
    STARTING,
    Condition,
    condition_of,
    covering,
    every_condition,
)
from zerohertz.campaign.faults.kinds import NOTHING, Kind, compatible, every_kind
from zerohertz.errors import UserError

SINGLE, PAIRS, TRIPLES, ALL = "single", "pairs", "triples", "all"
GROUPS = (SINGLE, PAIRS, TRIPLES)
TRIPLE_COUNT = 20_000
LATEST_S = 0.5  # between the first and the last fault of a case


@dataclasses.dataclass(frozen=True)
class Case:
    """One run. map and index place it in the store."""

    map: str
    index: int
    name: str
    speed_rpm: float

    @property
    def kinds(self) -> tuple[Kind, ...]:
        return tuple(every_kind()[name] for name in self.name.split("@")[0].split("+"))

    @property
    def condition(self) -> Condition:
        return condition_of_name(self.name.split("@")[1])

    @property
    def shares(self) -> bool:
        """Up to its first fault it is the same run as others."""
        return self.condition.mode not in (STARTING, COMMISSIONING)

    @property
    def stem(self) -> str:
        """Names what happens up to the first fault: one run for all cases of a stem."""
        kinds, at, condition = self.name.partition("@")
        if not self.shares:
            return self.name
        start = (name for name in kinds.split("+") if every_kind()[name].from_start)
        return "+".join(start) + at + condition

    @property
    def seed(self) -> int:
        """Of the noise."""
        return zlib.crc32(self.stem.encode()) + 1

    @property
    def sim_s(self) -> float:
        """About what it takes to simulate: what is shared is simulated once."""
        return 2.0 if self.shares else 8.0

    def delays_s(self) -> list[float]:
        """From the moment of the case to each fault: any phase of the current, the first within a
        period of 20 ms."""
        draws = [zlib.crc32(f"{self.name}/{k}".encode()) / 2.0**32 for k in range(len(self.kinds))]
        return [0.02 * draws[0], *(LATEST_S * draw for draw in draws[1:])]


_CONDITIONS: dict[str, Condition] = {}


def condition_of_name(name: str) -> Condition:
    """Looked up: a campaign asks a million times."""
    if not _CONDITIONS:
        _CONDITIONS.update((c.name, c) for c in every_condition())
    return _CONDITIONS.get(name) or condition_of(name)


def case_of(name: str) -> Case:
    """A case by its name alone."""
    kinds, at, condition = name.partition("@")
    names = kinds.split("+")
    unknown = [kind for kind in names if kind not in every_kind()]
    if not at or unknown or len(names) > len(GROUPS):
        raise UserError(
            f"--case: {name}: write up to three faults and a condition as the page does, "
            f"i_u.frozen+open_v@{every_condition()[0].name}; --list shows both"
        )
    found = condition_of_name(condition)
    if not compatible(tuple(every_kind()[kind] for kind in names), found):
        raise UserError(f"--case: {name}: these faults do not go together there; leave one out")
    return Case(GROUPS[len(names) - 1], 0, name, found.speed_rpm)


def cases(group: str, count: int, seed: int) -> list[Case]:
    """A seeded sample of a group in the order of the whole; 0: all of it."""
    names = list(_names(group, seed))
    if 0 < count < len(names):
        import numpy as np

        chosen = np.random.default_rng(seed).choice(len(names), count, replace=False)
        names = [names[k] for k in sorted(chosen.tolist())]
    return [
        Case(group, k, _name(kinds, condition), condition.speed_rpm)
        for k, (kinds, condition) in enumerate(names)
    ]


def split(which: str, runs: int) -> dict[str, int]:
    """How many runs of each group; 0: all."""
    groups = GROUPS if which == ALL else (which,)
    if runs == 0:
        return dict.fromkeys(groups, 0)
    shares = {group: runs // len(groups) for group in groups}
    shares[groups[0]] += runs - sum(shares.values())
    return {group: share for group, share in shares.items() if share}


def _name(kinds: tuple[Kind, ...], condition: Condition) -> str:
    return "+".join(kind.name for kind in kinds) + "@" + condition.name


def _names(group: str, seed: int) -> Iterator[tuple[tuple[Kind, ...], Condition]]:
    kinds = list(every_kind().values())
    broken = [kind for kind in kinds if kind.name != NOTHING]
    if group == TRIPLES:
        yield from _triples(broken, seed)
        return
    single = group == SINGLE
    sets: Any = ((kind,) for kind in kinds) if single else itertools.combinations(broken, 2)
    conditions = every_condition() if single else covering()[0]
    for together in sets:
        for condition in conditions:
            if compatible(together, condition):
                yield together, condition


def _triples(broken: list[Kind], seed: int) -> Iterator[tuple[tuple[Kind, ...], Condition]]:
    import numpy as np

    rng = np.random.default_rng((seed, 3))
    conditions, made = every_condition(), 0
    while made < TRIPLE_COUNT:
        chosen = sorted(rng.choice(len(broken), 3, replace=False).tolist())
        together = tuple(broken[k] for k in chosen)
        condition = conditions[int(rng.integers(len(conditions)))]
        if compatible(together, condition):
            made += 1
            yield together, condition
