"""What a generated file was made from, as make and ninja read it."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from pathlib import Path

from zerohertz.paths import ROOT


def write_depfile(depfile: Path, target: Path, inputs: Iterable[Path]) -> None:
    """A rule for `target`: the inputs, and every module of tools/ that was loaded to make it."""
    files = (getattr(module, "__file__", None) for module in list(sys.modules.values()))
    modules = (Path(file) for file in files if file and Path(file).is_relative_to(ROOT / "tools"))
    needed = sorted({str(path.resolve()) for path in (*inputs, *modules)})
    rule = " ".join(text.replace(" ", "\\ ") for text in (f"{target}:", *needed))
    depfile.write_text(rule + "\n", encoding="utf-8")
