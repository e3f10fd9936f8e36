#!/usr/bin/env python3
"""Writes l_gain.c and l_gain.h of a motor folder: the gain table that an image carries.

Python's standard library alone: a build needs nothing of tools/requirements.txt.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
from zerohertz.errors import UserError
from zerohertz.gain_design.c_source import c_files
from zerohertz.gain_design.stored import JSON_NAME, read_motor_table
from zerohertz.generated import write_depfile


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="motor folder: motor.toml and l_gain.json")
    parser.add_argument("--out", type=Path, required=True, help="folder for the two C files")
    parser.add_argument("--depfile", type=Path, help="what l_gain.c depends on, for make and ninja")
    given = parser.parse_args()
    try:
        content = read_motor_table(given.folder)
        given.out.mkdir(parents=True, exist_ok=True)
        for name, text in c_files(content).items():
            (given.out / name).write_text(text, encoding="utf-8")
        if given.depfile:
            inputs = (given.folder / "motor.toml", given.folder / JSON_NAME)
            write_depfile(given.depfile, given.out / "l_gain.c", inputs)
    except UserError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
