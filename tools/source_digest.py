#!/usr/bin/env python3
"""Writes a digest of the firmware's sources. A state of one firmware goes into the same one only.

Python's standard library alone, as everything that the build runs.
"""

from __future__ import annotations

import argparse
import hashlib
from pathlib import Path

SUFFIXES = {".c", ".h", ".def"}


def sources(folders: list[Path]) -> list[Path]:
    """In the order of their names below the folders."""
    return [
        path
        for folder in folders
        for path in sorted(folder.rglob("*"), key=lambda p: p.relative_to(folder).as_posix())
        if path.suffix in SUFFIXES
    ]


def digest(paths: list[Path], estimator: str) -> int:
    """The first 32 bits of a SHA-256 over the estimator's name and all of them."""
    whole = hashlib.sha256(estimator.encode())
    for path in paths:
        whole.update(hashlib.sha256(path.read_bytes()).digest())
    return int.from_bytes(whole.digest()[:4], "little")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folders", nargs="+", type=Path)
    parser.add_argument("--estimator", required=True, help="its name, or its folder elsewhere")
    parser.add_argument("--out", required=True, type=Path)
    parser.add_argument("--depfile", required=True, type=Path)
    asked = parser.parse_args()
    estimator = Path(asked.estimator)
    paths = sources([*asked.folders, *([estimator] if estimator.is_dir() else [])])
    asked.out.parent.mkdir(parents=True, exist_ok=True)
    found = digest(paths, estimator.name)
    asked.out.write_text(f"#define ZH_FIRMWARE_SOURCES 0x{found:08X}u\n", encoding="utf-8")
    names = " ".join(str(path).replace(" ", "\\ ") for path in paths)
    asked.depfile.write_text(f"{asked.out}: {names}\n", encoding="utf-8")


if __name__ == "__main__":
    main()
