"""A flight's file: who the drive was, its parameters and gain table, and the rows it recorded.

Eight bytes "ZHFLIGHT", then one zlib stream: length of the head (u32), the head (JSON), rows of
twelve bytes (firmware/host/flight.h). A recording of the last seconds has no start among its rows;
its head holds the state of the drive before the first one. The last row is the recorder's own and
says how it ended; a file without it ends where the recording program died.
"""

from __future__ import annotations

import base64
import json
import struct
import zlib
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from enum import IntEnum
from pathlib import Path
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from zerohertz.errors import UserError
from zerohertz.gain_design.crc32c import crc32c
from zerohertz.gain_design.stored import JSON_NAME, read_table_json
from zerohertz.link.flight import ROW_BYTES
from zerohertz.paths import ROOT

MAGIC = b"ZHFLIGHT"
MARK = 0x8000  # of a row that is no sample
PARAMETER, END = 0x8002, 0x80FF
_FORMAT = 1
_FORMAT_MIDDLE = 2  # with the state that the rows begin with
_FLUSH_BYTES = 64 * 1024


class Ending(IntEnum):
    """Why a recording ended."""

    DIED = 0  # no word of it in the file
    STOPPED = 1
    FAULT = 2
    GAP = 3  # the drive's memory was full: what came later is lost
    LINK = 4  # the line was gone, or the drive was reset


ENDING = {
    Ending.DIED: "the recording program died",
    Ending.STOPPED: "stopped",
    Ending.FAULT: "a fault",
    Ending.GAP: "a gap: the link was too slow",
    Ending.LINK: "the link was gone",
}


@dataclass(frozen=True)
class Middle:
    """Where a recording begins that dropped its older rows."""

    state: bytes  # of the drive, as zh_flight_snapshot of host_sim/flight_replay.h has it
    dropped_periods: int  # between the start and the first row
    source: str  # the checkout that made the state: another firmware cannot read it


@dataclass(frozen=True)
class Head:
    """What a replay needs beside the rows."""

    identity: str
    motor_id: int
    table_crc32c: int  # 0: the drive used none
    period_s: float
    parameters: dict[str, float]  # in the order of the drive's numbers
    gain: npt.NDArray[np.float32] | None  # (entries, 4); None: nobody had it
    middle: Middle | None = None  # None: the rows begin with a start of the drive

    def as_json(self) -> dict[str, Any]:
        table = None
        if self.gain is not None:
            table = base64.b64encode(self.gain.astype("<f4").tobytes()).decode()
        told = {
            "format": _FORMAT,
            **{k: getattr(self, k) for k in ("identity", "motor_id", "table_crc32c", "period_s")},
            "parameters": self.parameters,
            "gain": table,
        }
        if self.middle is not None:
            state = base64.b64encode(zlib.compress(self.middle.state)).decode()
            told |= {"format": _FORMAT_MIDDLE, "middle": asdict(self.middle) | {"state": state}}
        return told

    @classmethod
    def of_json(cls, read: dict[str, Any]) -> Self:
        table = read["gain"]
        gain = None
        if table is not None:
            gain = np.frombuffer(base64.b64decode(table), "<f4").reshape(-1, 4)
        middle = None
        if read["format"] == _FORMAT_MIDDLE:
            state = zlib.decompress(base64.b64decode(read["middle"]["state"]))
            middle = Middle(**read["middle"] | {"state": state})
        return cls(
            *(read[k] for k in ("identity", "motor_id", "table_crc32c", "period_s")),
            read["parameters"],
            gain,
            middle,
        )


class FlightWriter:
    """Rows as they come; `close` says why it ended."""

    def __init__(self, path: Path, head: Head) -> None:
        try:
            self._file = path.open("wb")
        except OSError as error:
            raise UserError(f"{path}: cannot be written ({error})") from None
        self._pack = zlib.compressobj(6)
        self._unflushed = 0
        text = json.dumps(head.as_json()).encode()
        self._file.write(MAGIC + self._pack.compress(struct.pack("<I", len(text)) + text))

    def put(self, rows: bytes) -> None:
        self._file.write(self._pack.compress(rows))
        self._unflushed += len(rows)
        if self._unflushed >= _FLUSH_BYTES:
            self._unflushed = 0
            self._file.write(self._pack.flush(zlib.Z_SYNC_FLUSH))
            self._file.flush()

    def close(self, why: Ending, lost_periods: int) -> None:
        self.put(struct.pack("<HHII", END, why, lost_periods, 0))
        self._file.write(self._pack.flush())
        self._file.close()


@dataclass(frozen=True)
class Flight:
    """A file that was read."""

    head: Head
    rows: npt.NDArray[np.uint32]  # (rows, 3), without the recorder's last one
    ending: Ending
    lost_periods: int  # known to be missing behind the last row

    @property
    def periods(self) -> int:
        return int(np.count_nonzero((self.rows[:, 0] & MARK) == 0))

    @classmethod
    def read(cls, path: Path) -> Self:
        try:
            data = path.read_bytes()
        except OSError as error:
            raise UserError(f"{path}: cannot be read ({error.strerror})") from None
        try:
            content = zlib.decompressobj().decompress(data.removeprefix(MAGIC))
            length = struct.unpack_from("<I", content)[0]
            head = json.loads(content[4 : 4 + length])
            if not data.startswith(MAGIC) or head["format"] not in (_FORMAT, _FORMAT_MIDDLE):
                raise ValueError
            found = Head.of_json(head)
        except (zlib.error, struct.error, ValueError, KeyError, TypeError):
            raise UserError(f"{path}: is no flight of tools/zh record") from None
        body = content[4 + length :]
        rows = np.frombuffer(body[: len(body) // ROW_BYTES * ROW_BYTES], "<u4").reshape(-1, 3)
        if len(rows) and rows[-1, 0] & 0xFFFF == END:
            return cls(found, rows[:-1], Ending(rows[-1, 0] >> 16), int(rows[-1, 1]))
        return cls(found, rows, Ending.DIED, 0)


def find_table(crc: int, folders: tuple[Path, ...] = ()) -> npt.NDArray[np.float32] | None:
    """The gain table with this CRC, of these motor folders or of gain_tables/."""
    for path in _tables(folders):
        content = read_table_json(path)
        if int(content["crc32c"], 16) == crc:
            return np.array([entry["L"] for entry in content["entries"]], np.float32)
    return None


def _tables(folders: tuple[Path, ...]) -> Iterator[Path]:
    for folder in (*folders, *sorted((ROOT / "gain_tables").iterdir())):
        if (folder / JSON_NAME).is_file():
            yield folder / JSON_NAME


def table_crc(gain: npt.NDArray[np.float32]) -> int:
    """As the firmware computes it over the table in flash."""
    return crc32c(gain.astype("<f4").tobytes())
