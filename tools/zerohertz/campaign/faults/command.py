"""`zh campaign faults`."""

from __future__ import annotations

import json
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from zerohertz.console import progress_bar, tell
from zerohertz.errors import UserError
from zerohertz.options import Fresh, Json, Out, Scheduler, Workers


class Which(StrEnum):
    """Groups of cases."""

    single = "single"
    pairs = "pairs"
    triples = "triples"
    all = "all"


def faults(
    runs: Annotated[
        int,
        typer.Option(
            min=0, help="Size of the random sample, shared equally by the groups; 0: all cases."
        ),
    ] = 0,
    kinds: Annotated[
        Which,
        typer.Option(
            help="single: every fault at every condition; pairs: every two at 24 conditions; "
            "triples: 20 000 at random; all: the three."
        ),
    ] = Which.all,
    seed: Annotated[int, typer.Option(min=0, help="Seed of sample and triples.")] = 2005,
    workers: Workers = 2,
    scheduler: Scheduler = None,
    out: Out = None,
    fresh: Fresh = False,
    case: Annotated[
        str | None, typer.Option(help="Only this case, named as in the page and the JSON.")
    ] = None,
    list_: Annotated[
        bool, typer.Option("--list", help="Only list all faults and conditions.")
    ] = False,
    write: Annotated[bool, typer.Option(help="Write tools/docs/harm.md.")] = False,
    as_json: Json = False,
) -> None:
    """Search for harm, judged by the true current and speed, that the drive does not declare.

    Exit 1 if there is any. How to read the result: tools/docs/harm.md.
    """
    if list_:
        _list()
    elif case is not None:
        _one(case, as_json)
    else:
        _many(kinds, runs, seed, (out, workers, scheduler, fresh), write, as_json)


def _list() -> None:
    from zerohertz.campaign.faults.conditions import every_condition
    from zerohertz.campaign.faults.kinds import every_kind

    print("\n".join((*every_kind(), "", *(c.name for c in every_condition()))))


def _one(name: str, as_json: bool) -> None:
    from zerohertz.campaign.faults.cases import case_of
    from zerohertz.campaign.faults.judge import UNDECLARED
    from zerohertz.campaign.faults.page import row_text
    from zerohertz.campaign.faults.run import bench_of_campaign, run_case

    row = run_case(bench_of_campaign(), case_of(name))
    print(json.dumps(row, indent=2) if as_json else row_text(row))
    raise typer.Exit(1 if row["verdict"] == UNDECLARED else 0)


def _many(
    kinds: Which,
    runs: int,
    seed: int,
    where: tuple[Path | None, int, str | None, bool],
    write: bool,
    as_json: bool,
) -> None:
    from zerohertz.atlas.run import RunOptions
    from zerohertz.campaign.faults import campaign, page
    from zerohertz.paths import BUILD

    if write and kinds != Which.all:
        raise UserError("--write: the page needs all groups; leave out --kinds")
    out, workers, scheduler, fresh = where
    how = RunOptions(
        out or BUILD / "faults" / (str(runs) if runs else "all"), workers, scheduler, fresh
    )
    result = campaign.run_all(kinds, runs, seed, how, tell, progress_bar)
    if write:
        sample = f" --runs {runs}" if runs else ""
        text = page.page_text(result, f"tools/zh campaign faults{sample} --seed {seed} --write")
        page.PAGE.write_text(text, encoding="utf-8")
    if as_json:
        print(json.dumps(campaign.as_dict(result), indent=2))
    else:
        for group, rows in result.rows.items():
            print(f"{group}: {campaign.summary(rows)}")
        if result.healthy:
            print(f"undeclared: {len(result.undeclared)}, of the fault: {len(result.of_the_fault)}")
        print("\n".join(page.grouped(result.of_the_fault)))
    raise typer.Exit(1 if result.undeclared else 0)
