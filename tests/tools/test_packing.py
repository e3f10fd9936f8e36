"""Packing of gain tables: lossless whatever the words are, and as small as the layouts allow."""

from __future__ import annotations

import random

import pytest

from zerohertz.check.c_table import c_table_words
from zerohertz.gain_design.c_source import SOURCE_NAME, c_files
from zerohertz.gain_design.packing import BLOCK_ENTRIES, LAYOUTS, pack

MODULUS = 2**32


def round_trip(rows: list[list[int]]) -> list[int]:
    """Out of the C text, by the reader of `zh certify`, which shares no code with the packer."""
    content = {
        **dict.fromkeys(("inputs_sha256", "motor_id", "crc32c", "method"), "0"),
        "motor": "m",
        "entries": len(rows),
        "step_elec_per_min": 2,
        "step_rad_s_word": "3e567750",
        "l_words": [f"{word:08x}" for row in rows for word in row],
    }
    return c_table_words(c_files(content)[SOURCE_NAME])


def lines(residuals: list[list[int]]) -> list[list[int]]:
    """Rows on lines that wrap round, the residuals above them."""
    base = (0xFFFFFFF0, 0x00000010, 0x7FFFFFFE, 0x80000001)
    slope = (3, -5, 0x00123456, -0x00123456)
    return [
        [(base[c] + n * slope[c] + row[c]) % MODULUS for c in range(4)]
        for n, row in enumerate(residuals)
    ]


@pytest.mark.parametrize("count", [1, 2, 15, 16, 17, 32, 40])
@pytest.mark.parametrize("bits", [0, 1, 4, 8, 16, 24, 32])
def test_any_words_come_back(count: int, bits: int) -> None:
    source = random.Random(count * 100 + bits)
    rows = lines([[source.randrange(1 << bits) for _ in range(4)] for _ in range(count)])
    assert round_trip(rows) == [word for row in rows for word in row]


@pytest.mark.parametrize("half_words", [1, 2, 4])
def test_a_block_takes_the_narrowest_layout_that_holds_it(half_words: int) -> None:
    """Saw teeth of which no slope takes anything away: the widest residual decides."""
    widths = dict(LAYOUTS[half_words])
    for column in widths:
        for more in (0, 1):
            full = dict(widths)
            full[column] += more
            holds = [n for n, layout in LAYOUTS.items() if all(full[c] <= b for c, b in layout)]
            top = [(1 << full[c]) - 1 for c in range(4)]
            tooth = [[t * (n % 3 == 1) for t in top] for n in range(BLOCK_ENTRIES)]
            packed = pack(lines(tooth))
            assert packed.blocks[0].half_words == min(holds)
            assert (min(holds) == half_words) == (more == 0)
            rows = lines(tooth)
            assert round_trip(rows) == [word for row in rows for word in row]


def test_residuals_follow_one_another_and_the_last_block_is_filled_up() -> None:
    rows = lines([[0, 0, 0, 0]] * 20)
    rows[3] = [1, 2, 3, 4]  # whole words in the first block
    packed = pack(rows)
    assert [block.half_words for block in packed.blocks] == [8, 1]
    assert [block.first for block in packed.blocks] == [0, 16 * 8]
    assert [len(row) for row in packed.residuals] == [8] * 16 + [1] * 4
    # gain_table_valid: 16 entries of every block, and one half-word behind.
    assert sum(map(len, packed.residuals)) + packed.padding == 16 * 8 + 16 + 1
    assert packed.blocks[0].base == packed.blocks[0].slope == (0, 0, 0, 0)
