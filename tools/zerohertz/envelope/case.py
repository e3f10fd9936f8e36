"""One run of the envelope: what it draws.

Every axis draws from a generator of its own, seeded with (seed, run, axis): fixing one axis leaves
all others as they were, and run k of a seed is the same alone as among a thousand.
"""

from __future__ import annotations

import dataclasses
import functools
import zlib
from collections.abc import Mapping
from typing import Any

import numpy as np

from zerohertz.envelope.axes import AXES, Value


@dataclasses.dataclass(frozen=True)
class Case:
    """Run `index` of a seed. map places it in the store; speed and length share out the work."""

    map: str
    index: int
    seed: int
    fixed: tuple[tuple[str, Value], ...] = ()
    firmware: tuple[tuple[str, float], ...] = ()  # parameters, last word
    motor_dir: str = ""  # with another gain table for Table 1's motor; empty: the drive's own
    speed_rpm: float = 0.0
    loaded_s: float = 6.7  # so that run.AT_ONCE of them are given to a worker at once

    def rng(self, what: str) -> np.random.Generator:
        return np.random.default_rng((self.seed, self.index, zlib.crc32(what.encode())))

    @property
    def noise_seed(self) -> int:
        return int(self.rng("noise").integers(1, 2**32))

    @property
    def values(self) -> Mapping[str, Value]:
        return _values(self)

    def number(self, name: str) -> float:
        return float(self.values[name])

    def word(self, name: str) -> str:
        return str(self.values[name])

    def vector(self, name: str, count: int) -> list[float]:
        """So many numbers of either sign, none larger than the axis' value."""
        shares = self.rng(f"{name}/shares").uniform(-1.0, 1.0, count)
        return [float(x) for x in self.number(name) * shares]


@functools.lru_cache(maxsize=64)
def _values(case: Case) -> Mapping[str, Any]:
    drawn = {axis.name: axis.draw(case.rng(axis.name)) for axis in AXES}
    return drawn | dict(case.fixed)
