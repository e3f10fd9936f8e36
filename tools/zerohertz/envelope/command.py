"""`zh envelope`."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from zerohertz.assignments import assignments
from zerohertz.console import progress_bar, short_paths, tell
from zerohertz.errors import UserError
from zerohertz.estimators import chosen
from zerohertz.options import Estimator, Fresh, Json, Out, Scheduler, Seed, Workers
from zerohertz.paths import BUILD

if TYPE_CHECKING:
    from zerohertz.envelope.run import Sample


def register(app: typer.Typer) -> None:
    """Add `zh envelope`."""
    app.command("envelope")(envelope)


def envelope(
    runs: Annotated[int, typer.Option(min=1, help="Number of runs; each draws every axis.")] = 200,
    seed: Seed = 2005,
    fix: Annotated[
        list[str] | None,
        typer.Option(
            metavar="AXIS=VALUE", help="Fix an axis instead of drawing it; may be repeated."
        ),
    ] = None,
    sets: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=VALUE", help="Firmware parameter; overrides all else."),
    ] = None,
    only: Annotated[
        int | None, typer.Option(min=0, metavar="K", help="Only run K of this seed, with a trace.")
    ] = None,
    why: Annotated[
        bool, typer.Option(help="With --only: find the axis whose plain value mends the run.")
    ] = False,
    axes: Annotated[bool, typer.Option("--axes", help="Only list all axes.")] = False,
    estimator: Estimator = None,
    workers: Workers = 2,
    scheduler: Scheduler = None,
    out: Out = None,
    fresh: Fresh = False,
    write: Annotated[bool, typer.Option(help="Write tools/docs/envelope.md.")] = False,
    as_json: Json = False,
) -> None:
    """Run the drive on random inverters, motors, loads and missions, and judge every run.

    Judged by the plant's true speed, flux and torque. Exit 1 if there is undeclared harm or
    a false trip. How to read the result: tools/docs/envelope.md.
    """
    # Here and not above: other commands need not wait for numpy and pyarrow.
    from zerohertz.envelope.axes import fixed
    from zerohertz.envelope.run import Sample

    if axes:
        _list()
        return
    chosen.use(estimator, write)
    sample = Sample(seed, fixed(fix or []), assignments("--set", sets or [], numbers=True))
    name = f"{sample.options} {chosen.chosen_name()}".strip()
    folder = out or BUILD / "envelope" / name.replace("--", "").replace(" ", "-")
    if only is not None:
        raise typer.Exit(_one(sample, only, folder, why, as_json))
    if why:
        raise UserError("--why: asks about one run; name it with --only")
    if write and (fix or sets):
        raise UserError("--write: the page has every axis drawn; leave out --fix and --set")
    raise typer.Exit(_many(sample, runs, (folder, workers, scheduler, fresh), write, as_json))


def _list() -> None:
    from zerohertz.envelope.axes import AXES

    for axis in AXES:
        print(f"{axis.name}: {axis.text}\n    {axis.values}")


def _one(sample: Sample, index: int, folder: Path, why: bool, as_json: bool) -> int:
    from zerohertz.envelope import picture
    from zerohertz.envelope.axes import AXES
    from zerohertz.envelope.run import run_case
    from zerohertz.envelope.why import mending

    row, plan, record = run_case(sample.case(index))
    path = picture.keep_trace(folder / "traces", plan, record, row)
    shown = dict(row)
    if why:
        with progress_bar("axes", len(AXES)) as progress:
            shown["mended_by"] = mending(sample, index, progress)
    lines = [f"{key}: {value}" for key, value in shown.items()]
    print(json.dumps(shown, indent=2) if as_json else "\n".join(lines))
    tell(f"trace: {short_paths(path.with_suffix(''))}.parquet and .svg")
    return 1 if row["undeclared_harm"] or row["false_trip"] else 0


def _many(
    sample: Sample,
    runs: int,
    where: tuple[Path, int, str | None, bool],
    write: bool,
    as_json: bool,
) -> int:
    from zerohertz.atlas.run import RunOptions
    from zerohertz.envelope import campaign, page, picture

    folder, workers, scheduler, fresh = where
    began = time.monotonic()
    how = RunOptions(folder, workers, scheduler, fresh)
    result = campaign.run_all(sample, runs, how, tell, progress_bar)
    command = f"tools/zh envelope --runs {runs} {sample.options}"
    traces = picture.keep_worst(folder / "traces", result)
    shown = picture.write(folder, result, traces, command)
    rows = picture.write_rows(folder, result)
    if write:
        page.PAGE.write_text(page.page_text(result, f"{command} --write"), encoding="utf-8")
        picture.write_png(page.PAGE.with_suffix(".png"), result)
    content = campaign.as_dict(result)
    if as_json:
        print(json.dumps(content, indent=2))
    else:
        print(page.table([("all", result.possible)]), page.measures(result.possible), sep="\n\n")
        print(f"\n{page.worst(result)}\n")
    tell(f"{time.monotonic() - began:.0f} s; {short_paths(shown)}, {short_paths(rows)}")
    bad = content["undeclared_harm"]["count"] or content["false_trips"]["count"]
    return 1 if bad else 0
