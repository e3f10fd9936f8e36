"""l_gain.c and l_gain.h from the content of l_gain.json, byte for byte the same on any machine."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from zerohertz.errors import UserError
from zerohertz.gain_design.packing import BLOCK_ENTRIES, Block, pack

HEADER_NAME = "l_gain.h"
SOURCE_NAME = "l_gain.c"

_HEADER = """\
/* Observer gain table of the motor {motor}. Generated from l_gain.json: do not edit.
 *
 * {entries} entries of L(w), one per {step} elec. min^-1 from standstill; method {method}.
 * Inputs (motor.toml), SHA-256:
 * {sha256}
 */
#ifndef L_GAIN_{guard}_H
#define L_GAIN_{guard}_H

#include "gain_table.h"

extern const gain_table_t l_gain_{motor};

#endif
"""

_SOURCE = """\
/* Observer gain table of the motor {motor}. Generated from l_gain.json: do not edit.
 *
 * Packed without loss (gain_table.h): blocks of {block_entries} entries with the lines of their
 * words, then what the words lie above them, one entry per row.
 * Inputs (motor.toml), SHA-256:
 * {sha256}
 */
#include "l_gain.h"

/* clang-format off */
static const gain_block_t gain_blocks[{block_count}] = {{
{blocks}
}};
static const uint16_t gain_residuals[{residual_count}] = {{
{residuals}
}};
/* clang-format on */

const gain_table_t l_gain_{motor} = {{
    .magic = GAIN_TABLE_MAGIC,
    .version = GAIN_TABLE_VERSION,
    .motor_id = 0x{motor_id}u,
    .entry_count = {entries}u,
    .crc32c = 0x{crc32c}u,
    .step_rad_s = {step_rad_s},
    .block = gain_blocks,
    .residual = gain_residuals,
    .residual_count = {residual_count}u,
}};
"""


def c_files(content: Mapping[str, Any]) -> dict[str, str]:
    """File name -> text, for the content of a l_gain.json."""
    words = [int(word, 16) for word in content["l_words"]]
    packed = pack([words[k : k + 4] for k in range(0, len(words), 4)])
    residuals = [*packed.residuals, *[(0,)] * packed.padding]
    values = {
        "motor": content["motor"],
        "guard": content["motor"].upper(),
        "entries": content["entries"],
        "step": content["step_elec_per_min"],
        "method": content["method"],
        "sha256": content["inputs_sha256"],
        "motor_id": content["motor_id"],
        "crc32c": content["crc32c"],
        "step_rad_s": _literal(np.uint32(int(content["step_rad_s_word"], 16)).view(np.float32)),
        "block_entries": BLOCK_ENTRIES,
        "block_count": len(packed.blocks),
        "blocks": "\n".join(map(_block, packed.blocks)),
        "residual_count": sum(map(len, residuals)),
        "residuals": "\n".join("    " + " ".join(f"0x{h:04x}u," for h in r) for r in residuals),
    }
    return {HEADER_NAME: _HEADER.format(**values), SOURCE_NAME: _SOURCE.format(**values)}


def read_table_json(path: Path | str) -> dict[str, Any]:
    """Content of a l_gain.json; UserError when it is none."""
    try:
        content = json.loads(Path(path).read_text(encoding="utf-8"))
        if len(content["l_words"]) != 4 * content["entries"]:
            raise UserError(f"{path}: l_words: not 4 words per entry; run zh design")
    except FileNotFoundError:
        raise UserError(f"{path}: no such file; run zh design") from None
    except (json.JSONDecodeError, UnicodeDecodeError, KeyError, TypeError) as error:
        raise UserError(f"{path}: not a gain table ({error!r}); run zh design") from None
    return content


def _block(block: Block) -> str:
    pairs = zip(block.base, block.slope, strict=True)
    lines = "{" + ", ".join(f"{{0x{base:08x}u, 0x{slope:08x}u}}" for base, slope in pairs) + "}"
    return f"    {{{block.first}u, {block.half_words}u, {lines}}},"


def _literal(value: np.float32) -> str:
    """Nine significant digits give every float32 back exactly."""
    text = f"{float(value):.9g}"
    return text + ("f" if "." in text or "e" in text else ".0f")
