"""The words of a gain table packed for flash, without loss: lines of blocks, and what lies above.

Seen as 32-bit words each column of the table is nearly a straight line over a few entries. A block
keeps that line, and per entry four residuals in the narrowest layout that holds all of the block.
firmware/law/estimator/hasegawa/gain_table.c unpacks; integers only, so that every machine packs the same.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Sequence

BLOCK_ENTRIES = 16  # GAIN_BLOCK_ENTRIES
WHOLE_WORDS = 8
# Half-words per entry -> (column, bits) from the least significant bit on. The widths are those
# that pack the tables of this repository best; whole words hold anything.
LAYOUTS = {
    1: ((0, 1), (1, 3), (2, 4), (3, 8)),
    2: ((0, 5), (1, 5), (2, 9), (3, 13)),
    4: ((0, 6), (1, 18), (2, 18), (3, 22)),
    WHOLE_WORDS: ((0, 32), (1, 32), (2, 32), (3, 32)),
}
_MODULUS = 1 << 32

Row = Sequence[int]


@dataclasses.dataclass(frozen=True)
class Block:
    """gain_block_t: four lines, and where the residuals above them lie."""

    base: tuple[int, ...]
    slope: tuple[int, ...]
    first: int
    half_words: int


@dataclasses.dataclass(frozen=True)
class Packed:
    """The blocks, and the half-words of every entry in turn."""

    blocks: tuple[Block, ...]
    residuals: tuple[tuple[int, ...], ...]

    @property
    def padding(self) -> int:
        """Half-words that fill the last block up, and the one beyond that unpacking looks at."""
        return -len(self.residuals) % BLOCK_ENTRIES * self.blocks[-1].half_words + 1


def pack(rows: Sequence[Row]) -> Packed:
    """Rows of four 32-bit words."""
    blocks: list[Block] = []
    residuals: list[tuple[int, ...]] = []
    first = 0
    for start in range(0, len(rows), BLOCK_ENTRIES):
        columns = list(zip(*rows[start : start + BLOCK_ENTRIES], strict=True))
        base, slope, above = zip(*map(_line, columns), strict=True)
        bits = [max(residual).bit_length() for residual in above]
        fits = (n for n, layout in LAYOUTS.items() if all(bits[c] <= b for c, b in layout))
        half_words = next(fits, WHOLE_WORDS)
        if half_words == WHOLE_WORDS:
            base, slope, above = (0,) * 4, (0,) * 4, columns
        blocks.append(Block(base, slope, first, half_words))
        residuals += [_half_words(row, half_words) for row in zip(*above, strict=True)]
        first += half_words * len(columns[0])
    return Packed(tuple(blocks), tuple(residuals))


def _line(words: Row) -> tuple[int, int, list[int]]:
    """Base, slope and residuals >= 0 of the line with the least largest residual."""
    heights = [words[0]]  # the words without their wrap-around
    for before, after in itertools.pairwise(words):
        step = (after - before + _MODULUS // 2) % _MODULUS - _MODULUS // 2
        heights.append(heights[-1] + step)
    steps = [after - before for before, after in itertools.pairwise(heights)] or [0]

    def above(slope: int) -> list[int]:
        return [height - n * slope for n, height in enumerate(heights)]

    def spread(slope: int) -> int:
        return max(above(slope)) - min(above(slope))

    low, high = min(steps), max(steps)
    while high - low > 2:  # the spread is convex
        third = (high - low) // 3
        if spread(low + third) <= spread(high - third):
            high -= third
        else:
            low += third
    slope = min(range(low, high + 1), key=spread)
    base = min(above(slope))
    return base % _MODULUS, slope % _MODULUS, [height - base for height in above(slope)]


def _half_words(residuals: Row, half_words: int) -> tuple[int, ...]:
    packed, shift = 0, 0
    for column, bits in LAYOUTS[half_words]:
        packed |= residuals[column] << shift
        shift += bits
    return tuple(packed >> 16 * k & 0xFFFF for k in range(half_words))
