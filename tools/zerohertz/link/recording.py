"""What a drive recorded, as columns with a time axis, and as files: CSV, MDF4."""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from zerohertz.errors import UserError
from zerohertz.link.client import Client

_UNITS = (
    *("rad_s", "per_s", "kg_m2", "min", "Wb", "ohm", "rpm", "degC"),
    *("Nm", "Hz", "rad", "A", "V", "H", "s"),
)
_UNIT = re.compile(rf"_({'|'.join(_UNITS)})$")


@dataclass(frozen=True)
class Recording:
    """Columns by signal name; t_s is 0 at the trigger."""

    t_s: npt.NDArray[np.float64]
    columns: dict[str, npt.NDArray[np.float32] | npt.NDArray[np.uint32]]
    comment: str


def unit_of(name: str) -> str:
    """The unit that ends the name of a signal; empty for a bare number."""
    found = _UNIT.search(name)
    return found.group(1).replace("rad_s", "rad/s").replace("per_s", "1/s") if found else ""


def recording(
    client: Client, words: list[tuple[int, ...]], numbers: tuple[int, ...], zero_row: int, step: int
) -> Recording:
    """Rows of words as the drive gave them; `step` periods from one to the next."""
    by_number = list(client.signals.values())
    table = np.array(words, dtype=np.uint32).reshape(len(words), len(numbers))
    columns = {}
    for k, number in enumerate(numbers):
        signal = by_number[number]
        column = np.ascontiguousarray(table[:, k])
        columns[signal.name] = column if signal.whole else column.view(np.float32)
    # The period came as a float32; what was meant are whole nanoseconds.
    t_s = (np.arange(len(words)) - zero_row) * (step * round(client.identity.period_s, 9))
    return Recording(t_s, columns, client.identity.text)


def write(path: Path, record: Recording) -> None:
    """By the name's ending: .csv, .mf4."""
    if path.suffix == ".csv":
        _write_csv(path, record)
    elif path.suffix == ".mf4":
        _write_mdf(path, record)
    else:
        raise UserError(f"{path}: end it in .csv or .mf4")


def _write_csv(path: Path, record: Recording) -> None:
    try:
        with path.open("w", newline="", encoding="utf-8") as file:
            lines = csv.writer(file, lineterminator="\n")
            lines.writerow(("t_s", *record.columns))
            for row in zip(record.t_s, *record.columns.values(), strict=True):
                # Nine digits are a float32 exactly.
                lines.writerow(f"{value:.9g}" for value in row)
    except OSError as error:
        raise UserError(f"{path}: cannot be written ({error})") from None


def _write_mdf(path: Path, record: Recording) -> None:
    try:
        from asammdf import MDF, Signal
    except ImportError:
        raise UserError(f"{path}: MDF4 needs asammdf; run tools/zh setup, or write .csv") from None
    with MDF(version="4.10") as file:
        file.append(
            [
                Signal(samples=column, timestamps=record.t_s, name=name, unit=unit_of(name))
                for name, column in record.columns.items()
            ],
            comment=record.comment,
        )
        try:
            file.save(path, overwrite=True)
        except OSError as error:
            raise UserError(f"{path}: cannot be written ({error})") from None
