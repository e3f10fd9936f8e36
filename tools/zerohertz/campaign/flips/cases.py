"""The cases: a bit of a member of unit_t, and a mode. A case is what its name says.

    drive.modes.vector.speed.omega_ref_rad_s/30@run_900

The moment of the flip is drawn from the name as well.
"""

from __future__ import annotations

import dataclasses
import zlib
from collections.abc import Iterator

from zerohertz.campaign.flips.layout import Leaf, leaf_of, leaves
from zerohertz.campaign.flips.modes import MODES, Span, mode_of
from zerohertz.errors import UserError

# For the sharing out of work only: a worker runs the way to the moment of the flip once per share.
_COST_S = -3.0


@dataclasses.dataclass(frozen=True)
class Case:
    """One run. map (its mode) and index place it in the store."""

    map: str
    index: int
    name: str
    byte: int
    bit: int  # of that byte
    speed_rpm: float = 0.0
    loaded_s: float = _COST_S

    @property
    def path(self) -> str:
        return self.name.partition("/")[0]

    def at_s(self, span: Span) -> float:
        share = zlib.crc32(self.name.encode()) / 2.0**32
        return span.first_s + share * (span.last_s - span.first_s)


def _case(leaf: Leaf, bit: int, mode: str, index: int) -> Case:
    name = f"{leaf.path}/{bit}@{mode}"
    return Case(mode, index, name, leaf.offset + bit // 8, bit % 8)


def case_of(name: str) -> Case:
    """A case by its name alone."""
    path, _, rest = name.partition("/")
    bit, _, mode = rest.partition("@")
    leaf = leaf_of(path)
    if not bit.isdigit() or int(bit) >= 8 * leaf.size:
        raise UserError(f"--case: {name}: write member/bit@mode, {path}/0@{next(iter(MODES))}")
    return _case(leaf, int(bit), mode_of(mode).name, 0)


def _every(mode: str, member: str) -> Iterator[Case]:
    bits = ((leaf, bit) for leaf in leaves() for bit in range(8 * leaf.size))
    for index, (leaf, bit) in enumerate(bits):
        if leaf.path.startswith(member):
            yield _case(leaf, bit, mode, index)


def cases(mode: str, count: int, seed: int, member: str = "") -> list[Case]:
    """A seeded sample of a mode in the order of the whole; 0: every bit.

    member: of those whose path begins like this. Chosen by name: a member that comes or goes
    changes no other choice.
    """
    every = list(_every(mode, member))
    if not every:
        raise UserError(f"--member: {member}: no member of unit_t begins like this; see --list")
    if 0 < count < len(every):
        drawn = sorted(every, key=lambda case: zlib.crc32(f"{seed}/{case.name}".encode()))
        every = sorted(drawn[:count], key=lambda case: case.index)
    return every


def split(modes: list[str], runs: int) -> dict[str, int]:
    """How many runs of each mode; 0: all."""
    if runs == 0:
        return dict.fromkeys(modes, 0)
    shares = {mode: runs // len(modes) for mode in modes}
    shares[modes[0]] += runs - sum(shares.values())
    return {mode: share for mode, share in shares.items() if share}
