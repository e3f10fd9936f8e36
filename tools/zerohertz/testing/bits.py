"""The same bits from every build: closed-loop runs of the figures, library against library.

    python -m zerohertz.testing.bits LIBRARY LIBRARY ...

Every recorded signal of every control period is compared, firmware and plant alike; the first
difference is named. The builds differ in compiler, optimisation level and instruction set.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

# Stable, lost, tripping, and with L, eps1 and a wrong Rs: every branch of the law is met.
FIGURES = (7, 11, 14, 17)


def dump(path: Path) -> None:
    """Runs the figures with the library of ZEROHERTZ_SIL and keeps everything recorded."""
    import dataclasses

    from zerohertz import sim
    from zerohertz.scenario.evaluate import Run, job
    from zerohertz.scenario.setup import load_setup

    setup = load_setup("paper")
    signals = {}
    for figure in FIGURES:
        record = sim.run(dataclasses.replace(job(Run(setup, figure, 1)), decimate=1))
        signals |= {f"fig{figure} {name}": column for name, column in record.columns.items()}
    np.savez(path, **signals)


def first_difference(a: Path, b: Path) -> str | None:
    """Where two dumps part, None when they are the same bits."""
    with np.load(a) as one, np.load(b) as other:
        for name in one.files:
            x, y = one[name].view(np.uint32), other[name].view(np.uint32)
            if x.shape != y.shape:
                return f"{name}: {x.shape[0]} and {y.shape[0]} periods"
            where = np.flatnonzero(x != y)
            if where.size:
                return f"{name}: {where.size} periods differ, the first is {where[0]}"
        return None


def compare(libraries: list[Path]) -> int:
    with tempfile.TemporaryDirectory() as folder:
        dumps = []
        for number, library in enumerate(libraries):
            dumps.append(Path(folder) / f"{number}.npz")
            env = os.environ | {"ZEROHERTZ_SIL": str(library)}
            command = (sys.executable, "-m", "zerohertz.testing.bits", "--dump", str(dumps[-1]))
            subprocess.run(command, env=env, check=True)
        with np.load(dumps[0]) as one:
            periods = sum(one[f"fig{figure} t_s"].size for figure in FIGURES)
        differing = 0
        for library, other in zip(libraries[1:], dumps[1:], strict=True):
            difference = first_difference(dumps[0], other)
            differing += difference is not None
            print(f"{library}: {difference or f'0 differing bits in {periods} periods'}")
        return 1 if differing else 0


if __name__ == "__main__":
    if sys.argv[1] == "--dump":
        dump(Path(sys.argv[2]))
    else:
        sys.exit(compare([Path(argument) for argument in sys.argv[1:]]))
