"""A map from its points to stored rows."""

from __future__ import annotations

import contextlib
import dataclasses
import time
from collections.abc import Callable, Generator, Iterable, Sequence
from pathlib import Path
from typing import Any

from zerohertz.atlas.parallel import Rows, run_all
from zerohertz.atlas.simulate import Bench, run_points
from zerohertz.atlas.store import Store, fingerprint

ROWS_PER_PART = 500
PART_EVERY_S = 60.0  # what a power failure costs of slow rows

Tell = Callable[[str], None]
Progress = Callable[[int], None]


@dataclasses.dataclass(frozen=True)
class RunOptions:
    """How and where to run."""

    out: Path
    workers: int = 2
    scheduler: str | None = None
    fresh: bool = False


def run_map(
    bench: Bench,
    points: Sequence[Any],
    options: RunOptions,
    tell: Tell,
    progress: Progress,
    run: Callable[[Bench, Sequence[Any]], Rows] = run_points,
) -> list[dict[str, Any]]:
    """All rows in the order of the points; those of an earlier, same run are not run again.

    Another `run` has points of its own: dataclasses with map and index, and sim_s (what a point
    takes, simulated seconds) or speed_rpm and loaded_s.
    """
    name = points[0].map
    store = Store(options.out / name, fingerprint(bench, points, run))
    rows, dropped = store.open(options.fresh)
    if dropped and not options.fresh:
        tell(f"{name}: starts anew: firmware, configuration or points differ from the stored ones")
    if rows:
        tell(f"{name}: {len(rows)} of {len(points)} points are stored already")
    done = {row["index"] for row in rows}
    progress(len(rows))
    missing = [point for point in points if point.index not in done]
    if missing:
        parts = run_all(bench, missing, options.workers, options.scheduler, run)
        with contextlib.closing(_stored(parts, store)) as ready:
            for part in ready:
                rows += part
                progress(len(rows))
        rows.sort(key=lambda row: row["index"])
        store.finish(rows)
    return rows


def _stored(parts: Iterable[Rows], store: Store) -> Generator[Rows, None, None]:
    """The same parts; what is finished stays finished when the run is interrupted or breaks."""
    unsaved: Rows = []
    saved_s = time.monotonic()
    try:
        for part in parts:
            unsaved += part
            yield part
            if len(unsaved) >= ROWS_PER_PART or time.monotonic() - saved_s >= PART_EVERY_S:
                store.add(unsaved)
                unsaved, saved_s = [], time.monotonic()
    except BaseException:
        if unsaved:
            store.add(unsaved)
        raise
