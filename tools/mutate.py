#!/usr/bin/env python3
"""Mutation testing of the firmware: does a unit test notice every small, wrong change?

    tools/zh python tools/mutate.py                        all mutants of firmware
    tools/zh python tools/mutate.py --sample 400 --seed 1  a seeded sample of them
    tools/zh python tools/mutate.py --file pi.c            those of one file

Survivors that may live are listed with reasons in tools/mutation_survivors.toml.
Exit code: 0 good, 1 score not reached or an accepted entry that matches nothing, 2 bad input.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

from zerohertz.campaign.mutation_report import Request, run_and_show
from zerohertz.errors import UserError


def main() -> int:
    """Judge mutants, print the survivors and the score."""
    default = Request()
    parser = argparse.ArgumentParser(description="Mutation testing of the firmware.")
    parser.add_argument("--folder", default=default.folder, help="folder below the checkout")
    parser.add_argument("--file", action="append", default=[], help="only this file, repeatable")
    parser.add_argument("--sample", type=int, default=default.sample, help="how many; 0: all")
    parser.add_argument("--seed", type=int, default=default.seed, help="of the sample")
    parser.add_argument("--jobs", type=int, default=default.jobs, help="workers")
    parser.add_argument("--minimum", type=float, default=default.minimum, help="score to reach")
    parser.add_argument("--json", type=Path, help="write the result there")
    given = parser.parse_args()
    if given.sample < 0:
        raise UserError(f"--sample: is {given.sample}; give a number of mutants, or 0 for all")
    if given.jobs < 1:
        raise UserError(f"--jobs: is {given.jobs}; give 1 or more")
    request = Request(given.folder, given.file, given.sample, given.seed, given.jobs, given.minimum)
    return 0 if run_and_show(request, given.json, sys.stdout)[1] else 1


if __name__ == "__main__":
    try:
        sys.exit(main())
    except UserError as error:
        print(f"error: {error}", file=sys.stderr)
        sys.exit(2)
