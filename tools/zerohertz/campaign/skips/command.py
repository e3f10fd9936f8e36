"""`zh campaign skips`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from zerohertz.console import progress_bar, tell
from zerohertz.options import Fresh, Json, Mode, Out, Scheduler, Seed, Workers

if TYPE_CHECKING:
    from zerohertz.campaign.flips.campaign import Asked


def skips(
    runs: Annotated[
        int,
        typer.Option(min=0, help="Size of the random sample, shared equally by the modes; 0: all."),
    ] = 0,
    mode: Mode = None,
    seed: Seed = 2005,
    workers: Workers = 2,
    scheduler: Scheduler = None,
    out: Out = None,
    fresh: Fresh = False,
    case: Annotated[str | None, typer.Option(help="Only this case.")] = None,
    list_: Annotated[bool, typer.Option("--list", help="Only list all cases.")] = False,
    write: Annotated[bool, typer.Option(help="Write tools/docs/skips.md.")] = False,
    as_json: Json = False,
) -> None:
    """Skip instructions of the image: does one do undeclared harm, or disable a protection?

    Exit 1 if one does. How to read the result: tools/docs/skips.md.
    """
    from zerohertz.campaign.flips.campaign import Asked
    from zerohertz.campaign.skips.cases import SKIPS, cases, skip_of

    modes = tuple(skip_of(name).name for name in mode or SKIPS)
    if list_:
        print("\n".join(case.name for name in modes for case in cases(name, 0, seed)))
    elif case is not None:
        _one(case, as_json)
    else:
        _many(Asked(modes, runs, seed), (out, workers, scheduler, fresh), write, as_json)


def _one(name: str, as_json: bool) -> None:
    from zerohertz.campaign.flips.campaign import is_bad
    from zerohertz.campaign.skips.cases import case_of
    from zerohertz.campaign.skips.page import row_text
    from zerohertz.campaign.skips.run import run_case

    row = run_case(case_of(name))
    print(json.dumps(row, indent=2) if as_json else row_text(row))
    raise typer.Exit(1 if is_bad(row) else 0)


def _many(
    asked: Asked, where: tuple[Path | None, int, str | None, bool], write: bool, as_json: bool
) -> None:
    from zerohertz.atlas.run import RunOptions
    from zerohertz.campaign.flips.campaign import show
    from zerohertz.campaign.skips import campaign, page
    from zerohertz.paths import BUILD

    out, workers, scheduler, fresh = where
    how = RunOptions(out or BUILD / "skips" / str(asked.runs), workers, scheduler, fresh)
    result = campaign.run_all(asked, how, tell, progress_bar)
    if write:
        page.PAGE.write_text(page.page_text(result, page.command_of(asked)), encoding="utf-8")
    show(result, as_json)
    raise typer.Exit(1 if result.bad else 0)
