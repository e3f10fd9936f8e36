"""The gain tables of the report: certified; on request also designed afresh and compared."""

from __future__ import annotations

import dataclasses
import multiprocessing
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from zerohertz.check.certificate import Report, certify
from zerohertz.check.stored_table import read_stored_table
from zerohertz.gain_design.stored import read_table_json
from zerohertz.gain_design.table import design_table, gains_of, table_json
from zerohertz.motor import Motor, load_motor, motor_toml
from zerohertz.paths import ROOT

REDESIGN_TOLERANCE = 1.0e-3  # solvers and processors differ in the last digits


@dataclasses.dataclass(frozen=True)
class TableOutcome:
    """One motor: what a fresh design gave and what is proven about the committed table."""

    motor: str
    folder: Path
    method: str
    entries: int
    design_s: float | None  # None: no fresh design was asked for
    difference: float | None  # relative, the fresh design against the committed table
    certificate: Report

    @property
    def holds(self) -> bool:
        """The committed table is what the design gives, and passes its certificate."""
        same = self.difference is None or self.difference <= REDESIGN_TOLERANCE
        return same and self.certificate.passed


def motor_folders() -> list[Path]:
    """Every motor of the project."""
    return sorted(path.parent for path in (ROOT / "gain_tables").glob("*/motor.toml"))


def check_tables(
    folders: list[Path], out: Path | None, workers: int, progress: Callable[[int], None]
) -> list[TableOutcome]:
    """All motors, one process each; fresh tables go to `out`/<motor>, None: no fresh design."""
    tasks = [(folder, out) for folder in folders]
    found = []
    with multiprocessing.get_context("spawn").Pool(max(1, workers)) as pool:
        for outcome in pool.imap(_check_table, tasks, chunksize=1):
            found.append(outcome)
            progress(len(found))
    return found


def _check_table(task: tuple[Path, Path | None]) -> TableOutcome:
    folder, out = task
    motor = load_motor(folder)
    design_s, difference = (None, None) if out is None else _fresh(motor, folder, out)
    return TableOutcome(
        motor=motor.name,
        folder=folder,
        method=motor.design.method,
        entries=motor.design.entries,
        design_s=design_s,
        difference=difference,
        certificate=certify(read_stored_table(folder)),
    )


def _fresh(motor: Motor, folder: Path, out: Path) -> tuple[float, float]:
    """CPU time of a fresh design, and how far the committed table is from it."""
    start_s = time.process_time()
    fresh = design_table(motor)
    design_s = time.process_time() - start_s
    copy = out / motor.name
    copy.mkdir(parents=True, exist_ok=True)
    (copy / "motor.toml").write_text(motor_toml(motor), encoding="utf-8")
    (copy / "l_gain.json").write_text(table_json(fresh), encoding="utf-8")
    stored = read_table_json(folder / "l_gain.json")
    return design_s, _difference(gains_of(stored), fresh.gain)


def _difference(stored: np.ndarray, fresh: np.ndarray) -> float:
    """Largest |difference| / |gain| over both complex gains and all speeds."""
    old, new = (_complex_gains(gain) for gain in (stored, fresh))
    if old.shape != new.shape:
        return float("inf")
    tiny = float(np.finfo(np.float32).tiny)  # L = 0 against L = 0
    return float(np.max(np.abs(new - old) / np.maximum(np.abs(old), tiny)))


def _complex_gains(gain: np.ndarray) -> np.ndarray:
    return gain.astype(float).reshape(-1, 2, 2) @ np.array([1.0, 1.0j])
