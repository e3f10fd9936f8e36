"""`zh golden`: every traced signal of many runs against the committed hashes."""

from __future__ import annotations

import dataclasses
import json
import time
from typing import TYPE_CHECKING, Annotated

import typer

from zerohertz.console import progress_bar, short_paths, tell
from zerohertz.errors import UserError
from zerohertz.options import Json, Workers

if TYPE_CHECKING:
    from zerohertz.golden.store import Difference, Golden

RUNS_SHOWN = 3


def register(app: typer.Typer) -> None:
    """Add `zh golden`."""
    app.command("golden")(golden)


def golden(
    only: Annotated[
        str,
        typer.Option(
            help="Only runs with these parts in their name, e.g. fig16,weakening,monitor."
        ),
    ] = "",
    quick: Annotated[bool, typer.Option("--quick", help="Only every fifth run.")] = False,
    write: Annotated[
        bool, typer.Option("--write", help="Store the present hashes of all runs, to be committed.")
    ] = False,
    workers: Workers = 2,
    as_json: Json = False,
) -> None:
    """Compare every traced signal with its committed hash. Exit 1 if one bit differs.

    It runs the thirteen figures as `paper` and as `recommended`, the cases of `zh modes` and a
    sample of `zh campaign monitor`. The hashes in tests/sil/golden.json cover all signals of every
    control period.
    """
    # Here and not above: other commands need not wait for numpy.
    from zerohertz.golden import runs, store

    if write and (only or quick):
        raise UserError("golden: --write: the file needs all runs; leave out --only and --quick")
    committed = None if write and not store.FILE.is_file() else store.read(store.FILE)
    names = runs.select(only, quick)
    begin = time.monotonic()
    with progress_bar("runs", len(names)) as progress:
        now = store.golden_of(runs.run_all(names, workers, progress))
    seconds = time.monotonic() - begin
    difference = store.difference(committed or now, now, whole=not (only or quick))
    if as_json:
        print(json.dumps(_as_dict(now, difference, seconds), indent=2))
    else:
        print(text(now, difference))
    if write:
        store.write(now, store.FILE)
        tell(f"written: {short_paths(store.FILE)}")
    elif not difference.none:
        raise typer.Exit(1)


def text(now: Golden, found: Difference) -> str:
    """What differs, a line each, and a line that sums it up."""
    size = f"{len(now.signals)} signals, {len(now.runs)} runs"
    if found.none:
        return f"{size}: no bit differs; hash {now.over_all}"
    lines = [f"{'signal':<24} {'runs':>4}  first differs in"] if found.signals else []
    for name, runs in found.signals.items():
        more = ", ..." if len(runs) > RUNS_SHOWN else ""
        lines.append(f"{name:<24} {len(runs):>4}  {', '.join(runs[:RUNS_SHOWN])}{more}")
    for word, names in (
        ("signals not in the file", found.added),
        ("signals only in the file", found.gone),
        ("runs not in the file", found.runs_added),
        ("runs only in the file", found.runs_gone),
    ):
        if names:
            lines.append(f"{word}: {', '.join(names)}")
    differing = {run for runs in found.signals.values() for run in runs}
    lines.append(
        f"{size}: {len(found.signals)} signals differ, in {len(differing)} runs; "
        f"hash {now.over_all}"
    )
    return "\n".join(lines)


def _as_dict(now: Golden, found: Difference, seconds: float) -> dict[str, object]:
    return {
        "equal": found.none,
        "all": now.over_all,
        "signals": now.signals,
        "runs": list(now.runs),
        "difference": dataclasses.asdict(found),
        "seconds": round(seconds, 1),
    }
