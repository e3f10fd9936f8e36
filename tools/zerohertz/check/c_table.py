"""The words that a generated l_gain.c unpacks to, read from its text as a compiler would.

Written from firmware/law/estimator/hasegawa/gain_table.h alone; shares no code with what packed them.
"""

from __future__ import annotations

import re
from pathlib import Path

BLOCK_ENTRIES = 16
_NUMBER = re.compile(r"\b(0x[0-9a-fA-F]+|[0-9]+)u\b")


def c_table_faults(path: Path, words: list[str]) -> list[str]:
    """What speaks against l_gain.c; nothing when there is none, as where only a json is kept."""
    if not path.exists():
        return []
    try:
        unpacked = c_table_words(path.read_text(encoding="utf-8"))
    except (ValueError, IndexError) as error:
        return [f"{path.name}: cannot be read as a packed table: {error}; run zh design"]
    if len(unpacked) != len(words):
        return [f"{path.name}: {len(unpacked)} words, l_words has {len(words)}; run zh design"]
    wrong = [k for k, word in enumerate(words) if int(word, 16) != unpacked[k]]
    return [
        f"{path.name}: entry {k // 4} unpacks to {unpacked[k]:08x}, l_words has {words[k]}; "
        "run zh design"
        for k in wrong[:1]
    ]


def c_table_words(text: str) -> list[int]:
    """Four words per entry, from the numbers of the two arrays and the entry count."""
    numbers = _array(text, "gain_blocks")
    residuals = _array(text, "gain_residuals")
    count = re.search(r"\.entry_count = (\d+)u", text)
    if count is None or len(numbers) % 10:
        raise ValueError("no entry_count, or a block without its ten numbers")
    words: list[int] = []
    for entry in range(int(count[1])):
        block, n = divmod(entry, BLOCK_ENTRIES)
        first, half_words, *lines = numbers[10 * block : 10 * block + 10]
        at = residuals[first + n * half_words :][:half_words]
        for column, residual in enumerate(_residuals(at)):
            words.append((lines[2 * column] + n * lines[2 * column + 1] + residual) % 2**32)
    return words


def _residuals(at: list[int]) -> tuple[int, int, int, int]:
    """l1_re l1_im l2_re l2_im out of 1, 2, 4 or 8 half-words."""
    if len(at) == 1:
        return at[0] % 2, at[0] // 2 % 8, at[0] // 16 % 16, at[0] // 256
    if len(at) == 2:
        both = at[0] + at[1] * 65536
        return both % 32, both // 32 % 32, both // 1024 % 512, both // 524288
    if len(at) == 4:
        all_four = sum(half_word << 16 * k for k, half_word in enumerate(at))
        return (
            all_four % 2**6,
            all_four // 2**6 % 2**18,
            all_four // 2**24 % 2**18,
            all_four // 2**42,
        )
    if len(at) == 8:
        low, high = at[0::2], at[1::2]
        first, second, third, fourth = (a + b * 65536 for a, b in zip(low, high, strict=True))
        return first, second, third, fourth
    raise ValueError(f"{len(at)} half-words per entry")


def _array(text: str, name: str) -> list[int]:
    found = re.search(rf"\b{name}\[\d+\] = \{{(.*?)\}};", text, re.DOTALL)
    if found is None:
        raise ValueError(f"no array {name}")
    return [int(number, 0) for number in _NUMBER.findall(found[1])]
