"""Rows on disk: Parquet parts while a map is running, one file when it is done.

A part is written under another name and renamed, so that a crash leaves whole parts only. Parts
belong to one fingerprint (firmware library, bench, points, how rows are made); with another one
they are dropped.
"""

from __future__ import annotations

import dataclasses
import hashlib
import inspect
import json
import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from zerohertz.atlas.simulate import RIG, Bench, run_points
from zerohertz.errors import UserError
from zerohertz.paths import ROOT

FINISHED = "atlas.parquet"
_KEY = b"fingerprint"
_HERE = Path(__file__).parent


def fingerprint(bench: Bench, points: Sequence[Any], run: Callable[..., Any] = run_points) -> str:
    """Of everything a row depends on; `run` makes it, with the SOURCES its module names."""
    digest = hashlib.sha256()
    table = [dataclasses.astuple(point) for point in points]
    digest.update(json.dumps([dataclasses.asdict(bench), table], sort_keys=True).encode())
    motor = ROOT / bench.motor_dir
    sources = (RIG, ROOT / bench.board, motor / "motor.toml", motor / "l_gain.json")
    maker = (Path(inspect.getfile(run)), *getattr(inspect.getmodule(run), "SOURCES", ()))
    for path in (*sources, _HERE / "classes.py", _HERE / "simulate.py", *maker):
        digest.update(path.read_bytes())
    return digest.hexdigest()


class Store:
    """The rows of one map in one folder."""

    def __init__(self, folder: Path, mark: str) -> None:
        self._folder, self._mark = folder, mark
        self._next = 0

    def open(self, fresh: bool) -> tuple[list[dict[str, Any]], bool]:
        """Rows of an earlier run with the same fingerprint; True when others were dropped."""
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise UserError(f"--out: {self._folder}: {error.strerror}; name another") from None
        rows: list[dict[str, Any]] = []
        dropped = False
        for path in (*sorted(self._folder.glob("part-*.parquet")), self._folder / FINISHED):
            if not path.is_file():
                continue
            found = None if fresh else self._read(path)
            if found is None:
                path.unlink()
                dropped = True
            elif path.name == FINISHED:
                return found, dropped
            else:
                rows += found
                self._next = int(path.stem.split("-")[1]) + 1
        return rows, dropped

    def add(self, rows: list[dict[str, Any]]) -> None:
        """One more part."""
        self._write(self._folder / f"part-{self._next:05d}.parquet", rows)
        self._next += 1

    def finish(self, rows: list[dict[str, Any]]) -> Path:
        """All rows in the order of the points; the parts go."""
        path = self._folder / FINISHED
        self._write(path, rows)
        for part in self._folder.glob("part-*.parquet"):
            part.unlink()
        return path

    def _read(self, path: Path) -> list[dict[str, Any]] | None:
        try:
            table = pq.read_table(path)
        except (pa.ArrowInvalid, OSError):
            return None  # cut short by a power failure: its points are run again
        mark = (table.schema.metadata or {}).get(_KEY, b"").decode()
        return table.to_pylist() if mark == self._mark else None

    def _write(self, path: Path, rows: list[dict[str, Any]]) -> None:
        table = pa.Table.from_pylist(rows).replace_schema_metadata({_KEY: self._mark.encode()})
        scratch = path.with_suffix(".tmp")
        pq.write_table(table, scratch)
        os.replace(scratch, path)
