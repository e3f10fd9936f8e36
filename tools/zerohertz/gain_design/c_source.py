"""l_gain.c and l_gain.h from the content of l_gain.json, byte for byte the same on any machine.

Python's standard library alone: the build makes them (tools/generate_gain_table.py).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from zerohertz.gain_design.stored import float32_text

HEADER_NAME = "l_gain.h"
SOURCE_NAME = "l_gain.c"

_HEADER = """\
/* Observer gain table of the motor {motor}. Generated from l_gain.json.
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
/* Observer gain table of the motor {motor}. Generated from l_gain.json.
 *
 * Inputs (motor.toml), SHA-256:
 * {sha256}
 */
#include "l_gain.h"

static const observer_gain_t gain_entry[{entries}] = {{
{rows}
}};

const gain_table_t l_gain_{motor} = {{
    .magic = GAIN_TABLE_MAGIC,
    .version = GAIN_TABLE_VERSION,
    .motor_id = 0x{motor_id}u,
    .entry_count = {entries}u,
    .crc32c = 0x{crc32c}u,
    .step_rad_s = {step_rad_s},
    .entry = gain_entry,
}};
"""


def c_files(content: Mapping[str, Any]) -> dict[str, str]:
    """File name -> text, for the content of a l_gain.json."""
    entries = content["entries"]
    values = {
        "motor": content["motor"],
        "guard": content["motor"].upper(),
        "entries": len(entries),
        "step": content["step_elec_per_min"],
        "method": content["method"],
        "sha256": content["inputs_sha256"],
        "motor_id": content["motor_id"],
        "crc32c": content["crc32c"],
        "step_rad_s": _literal(content["step_rad_s"]),
        "rows": "\n".join(_row(entry["L"]) for entry in entries),
    }
    return {HEADER_NAME: _HEADER.format(**values), SOURCE_NAME: _SOURCE.format(**values)}


def _row(gain: Sequence[float]) -> str:
    return "    {" + ", ".join(map(_literal, gain)) + "},"


def _literal(value: float) -> str:
    return float32_text(value) + "f"
