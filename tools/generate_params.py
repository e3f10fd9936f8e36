#!/usr/bin/env python3
"""Writes the C header with the parameters of a flash image: a configuration on a board.

Python's standard library alone: a build needs nothing of tools/requirements.txt.
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
from zerohertz.build import ESTIMATOR
from zerohertz.errors import UserError
from zerohertz.generated import write_depfile
from zerohertz.image.param_header import header


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--config", required=True, help="of host_sim/configs, or a TOML file")
    parser.add_argument("--board", help="of host_sim/boards, or a TOML file; not the config's")
    parser.add_argument("--motor", type=Path, help="motor folder; not the config's")
    parser.add_argument("--estimator-params", type=Path, help="list of the estimator's own")
    parser.add_argument("--fieldbus", action="store_true", help="the image has one")
    parser.add_argument("--out", type=Path, required=True, help="the header")
    parser.add_argument("--depfile", type=Path, help="what it depends on, for make and ninja")
    given = parser.parse_args()
    if given.estimator_params:
        os.environ[ESTIMATOR] = str(given.estimator_params.parent)
    try:
        made = header(given.config, given.board, given.motor, given.fieldbus)
        given.out.parent.mkdir(parents=True, exist_ok=True)
        given.out.write_text(made.text, encoding="utf-8")
        if given.depfile:
            write_depfile(given.depfile, given.out, made.inputs)
    except UserError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    except OSError as error:
        print(f"error: {error.filename}: {error.strerror}; correct the path", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
