"""`zh arena`: estimators against each other, in the same drive on the same plants."""

from __future__ import annotations

import json
import time
from typing import TYPE_CHECKING, Annotated

import typer

from zerohertz.console import short_paths, tell
from zerohertz.errors import UserError
from zerohertz.options import Fresh, Json, Out, Seed, Workers

if TYPE_CHECKING:
    from zerohertz.arena.entrant import Entrant

PARTS = ("maps", "envelope", "figures", "instructions")


def register(app: typer.Typer) -> None:
    """Add `zh arena`."""
    app.command("arena")(arena)


def arena(
    names: Annotated[
        list[str] | None,
        typer.Argument(metavar="NAME", help="Entrants beside ours; without names: all of them."),
    ] = None,
    estimator: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME|DIR|FILE.py:CLASS",
            help="Another entrant; may be repeated. An arena.toml in its folder is read.",
        ),
    ] = None,
    only: Annotated[
        list[str] | None,
        typer.Option(help=f"Only this part: {', '.join(PARTS)}; may be repeated."),
    ] = None,
    points: Annotated[
        int, typer.Option(min=0, help="Points of each map, spread evenly over it; 0: all 245.")
    ] = 0,
    runs: Annotated[int, typer.Option(min=1, help="Runs of the envelope.")] = 40,
    bare_runs: Annotated[
        int, typer.Option(min=0, help="Runs without what the drive finds out; 0: as --runs.")
    ] = 0,
    seed: Seed = 2005,
    workers: Workers = 2,
    out: Out = None,
    fresh: Fresh = False,
    write: Annotated[
        bool, typer.Option("--write", help="Write the page to tools/docs, to be committed.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Run estimators on the maps, the envelope and the paper's protocols, and rank them.

    Every entrant has the same drive around it, with what the drive finds out (Rs, inverter) and
    without. It writes one page, and keeps every answer until its inputs change: the same command
    goes on where an interrupted one stopped. Exit 1 if an --estimator did not run. The entrants:
    tools/zerohertz/arena/entrants. How to add one: tools/docs/estimator.md.
    """
    # Here and not above: other commands need not wait for numpy and pyarrow.
    from zerohertz.arena import campaign, page

    began = time.monotonic()
    asked = (names or [], estimator or [], only or [])
    chosen, parts = _entrants(*asked[:2], write), _parts(asked[2])
    folder = out or campaign.FOLDER
    options = campaign.Options(parts, points, runs, bare_runs, seed, workers, fresh, folder)
    found = campaign.run(chosen, options, tell)
    command = page.command_of(*asked, (points, runs, bare_runs, seed), write)
    path = page.write(page.DOCS if write else folder, found, command)
    if as_json:
        print(json.dumps({"command": command, "estimators": page.as_json(found)}))
    else:
        print(page.ranking(found))
    tell(f"{time.monotonic() - began:.0f} s; {short_paths(path)}")
    strangers = chosen[len(chosen) - len(asked[1]) :]
    raise typer.Exit(1 if any(found[each.name]["errors"] for each in strangers) else 0)


def _parts(only: list[str]) -> tuple[str, ...]:
    for part in only:
        if part not in PARTS:
            raise UserError(f"--only: no '{part}'; there are {', '.join(PARTS)}")
    return tuple(only) or PARTS


def _entrants(names: list[str], estimators: list[str], write: bool) -> list[Entrant]:
    from zerohertz.arena.entrant import OURS, known, of_user

    if write and (names or estimators):
        raise UserError("--write: the page has every entrant; leave out names and --estimator")
    all_of_them = known()
    for name in names:
        if name not in all_of_them:
            raise UserError(f"NAME: no entrant '{name}'; there are {', '.join(all_of_them)}")
    wanted = [n for n in all_of_them if not names or n in (OURS, *names)]
    found = {name: all_of_them[name] for name in wanted}
    for text in estimators:
        entrant = of_user(text)
        if entrant.name in found:
            raise UserError(f"--estimator: {text}: there is an entrant '{entrant.name}' already")
        found[entrant.name] = entrant
    return list(found.values())
