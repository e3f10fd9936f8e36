"""The committed hashes: tests/sil/golden.json, and how two sets of them differ.

"signals" has one hash per traced signal over all runs; the hash of one signal does not depend on
which others there are. "runs" has one line per run: the first 24 bits of every signal's hash in
that run, four characters each in the order of "signals", to tell where a difference begins.
"""

from __future__ import annotations

import base64
import dataclasses
import hashlib
import json
from collections.abc import Iterable, Mapping
from pathlib import Path

from zerohertz.errors import UserError
from zerohertz.paths import ROOT

FILE = ROOT / "tests" / "sil" / "golden.json"
CELL = 4  # characters

Hashes = Mapping[str, int]


@dataclasses.dataclass(frozen=True)
class Golden:
    """Hashes of a set of runs."""

    signals: dict[str, str]
    runs: dict[str, dict[str, str]]  # by run, then by signal

    @property
    def over_all(self) -> str:
        """One hash over the names and hashes of all signals."""
        text = "\n".join(f"{name} {value}" for name, value in sorted(self.signals.items()))
        return hashlib.blake2b(text.encode(), digest_size=8).hexdigest()


@dataclasses.dataclass(frozen=True)
class Difference:
    """What differs between the committed hashes and those of now."""

    signals: dict[str, list[str]]  # signal -> runs in which it differs
    added: list[str]  # signals that the file does not have
    gone: list[str]
    runs_added: list[str]
    runs_gone: list[str]

    @property
    def none(self) -> bool:
        return not any(getattr(self, field.name) for field in dataclasses.fields(self))


def digest(hashes: Iterable[int]) -> str:
    """One hash of 64 bits for several, in hexadecimal."""
    data = b"".join(value.to_bytes(8, "big") for value in hashes)
    return hashlib.blake2b(data, digest_size=8).hexdigest()


def golden_of(found: Mapping[str, Hashes]) -> Golden:
    """From the hashes of every run and signal."""
    names = list(next(iter(found.values())))
    signals = {name: digest(hashes[name] for hashes in found.values()) for name in names}
    runs = {run: {name: _cell(hashes[name]) for name in names} for run, hashes in found.items()}
    return Golden(signals, runs)


def difference(committed: Golden, now: Golden, whole: bool) -> Difference:
    """`whole`: every run was made, so that a run may be missing."""
    return Difference(
        signals=_differing(committed, now),
        added=_not_in(committed.signals, now.signals),
        gone=_not_in(now.signals, committed.signals),
        runs_added=_not_in(committed.runs, now.runs),
        runs_gone=_not_in(now.runs, committed.runs) if whole else [],
    )


def _not_in(known: Mapping[str, object], names: Iterable[str]) -> list[str]:
    return [name for name in names if name not in known]


def _differing(committed: Golden, now: Golden) -> dict[str, list[str]]:
    """Signals that differ, each with the runs that tell so, of what both have."""
    runs = [run for run in now.runs if run in committed.runs]
    same_runs = list(committed.runs) == list(now.runs)
    found = {}
    for name in now.signals:
        if name not in committed.signals:
            continue
        where = [run for run in runs if committed.runs[run][name] != now.runs[run][name]]
        # A run shows 24 bits of its hash; over the same runs the signal's own hash says more.
        if where or (same_runs and committed.signals[name] != now.signals[name]):
            found[name] = where
    return found


def write(golden: Golden, path: Path) -> None:
    """As committed: one line per signal and run."""
    content = {
        "all": golden.over_all,
        "signals": golden.signals,
        "runs": {run: "".join(cells.values()) for run, cells in golden.runs.items()},
    }
    path.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")


def read(path: Path) -> Golden:
    """UserError when there is none, or it is damaged."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        signals, lines = dict(content["signals"]), dict(content["runs"])
        runs = {
            run: {name: line[CELL * k :][:CELL] for k, name in enumerate(signals)}
            for run, line in lines.items()
        }
    except FileNotFoundError:
        raise UserError(f"{path}: no such file; write it with `zh golden --write`") from None
    except (ValueError, KeyError, TypeError) as error:
        raise UserError(
            f"{path}: damaged ({error!r}); restore it with git, or `zh golden --write`"
        ) from None
    if any(len(line) != CELL * len(signals) for line in lines.values()):
        raise UserError(f"{path}: damaged (a line of a run is cut); restore it with git")
    return Golden(signals, runs)


def _cell(value: int) -> str:
    return base64.b64encode(value.to_bytes(8, "big")[:3]).decode()
