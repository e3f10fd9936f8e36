"""`zh campaign flips`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from zerohertz.console import progress_bar, tell
from zerohertz.errors import UserError
from zerohertz.options import Fresh, Json, Mode, Out, Scheduler, Seed, Workers

if TYPE_CHECKING:
    from zerohertz.campaign.flips.campaign import Asked


def flips(
    runs: Annotated[
        int,
        typer.Option(
            min=0, help="Size of the random sample, shared equally by the modes; 0: all bits."
        ),
    ] = 0,
    mode: Mode = None,
    member: Annotated[
        str, typer.Option(help="Only members of unit_t whose name begins like this.")
    ] = "",
    seed: Seed = 2005,
    workers: Workers = 2,
    scheduler: Scheduler = None,
    out: Out = None,
    fresh: Fresh = False,
    case: Annotated[str | None, typer.Option(help="Only this case.")] = None,
    list_: Annotated[bool, typer.Option("--list", help="Only list all members and modes.")] = False,
    write: Annotated[bool, typer.Option(help="Write tools/docs/flips.md.")] = False,
    as_json: Json = False,
) -> None:
    """Flip bits of a drive's RAM: does one do undeclared harm, or disable a protection?

    Exit 1 if one does. How to read the result: tools/docs/flips.md.
    """
    from zerohertz.campaign.flips.campaign import Asked
    from zerohertz.campaign.flips.layout import leaves
    from zerohertz.campaign.flips.modes import MODES, mode_of

    if list_:
        print("\n".join((*(leaf.path for leaf in leaves()), "", *MODES)))
    elif case is not None:
        _one(case, as_json)
    else:
        modes = tuple(mode_of(name).name for name in mode or MODES)
        asked = Asked(modes, runs, seed, member)
        _many(asked, (out, workers, scheduler, fresh), write, as_json)


def _one(name: str, as_json: bool) -> None:
    from zerohertz.campaign.flips.campaign import is_bad
    from zerohertz.campaign.flips.cases import case_of
    from zerohertz.campaign.flips.modes import bench
    from zerohertz.campaign.flips.page import row_text
    from zerohertz.campaign.flips.run import run_cases

    row = run_cases(bench(), [case_of(name)])[0]
    print(json.dumps(row, indent=2) if as_json else row_text(row))
    raise typer.Exit(1 if is_bad(row) else 0)


def _many(
    asked: Asked, where: tuple[Path | None, int, str | None, bool], write: bool, as_json: bool
) -> None:
    from zerohertz.atlas.run import RunOptions
    from zerohertz.campaign.flips import campaign, page
    from zerohertz.paths import BUILD

    if write and asked.member:
        raise UserError("--write: the page needs all members; leave out --member")
    out, workers, scheduler, fresh = where
    folder = BUILD / "flips" / (asked.member or "all") / str(asked.runs)
    how = RunOptions(out or folder, workers, scheduler, fresh)
    result = campaign.run_all(asked, how, tell, progress_bar)
    if write:
        page.PAGE.write_text(page.page_text(result, page.command_of(asked)), encoding="utf-8")
    campaign.show(result, as_json)
    raise typer.Exit(1 if result.bad else 0)
