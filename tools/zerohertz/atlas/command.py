"""`zh atlas`: what the drive holds with wrong parameters, point by point."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from zerohertz.console import progress_bar, short_paths, tell
from zerohertz.errors import UserError
from zerohertz.paths import BUILD

if TYPE_CHECKING:
    from zerohertz.atlas.run import Means

VOLTAGE = {"sensors": 0, "duty": 1}


def register(app: typer.Typer) -> None:
    """Add `zh atlas`."""
    app.command("atlas")(atlas)


def atlas(
    names: Annotated[
        list[str] | None,
        typer.Argument(metavar="NAME", help="Recipes of --means, configurations of --compare."),
    ] = None,
    config: Annotated[
        str, typer.Option(help="recommended, paper, no_gain, or a TOML file like theirs.")
    ] = "recommended",
    standard: Annotated[
        bool, typer.Option("--standard", help="Maps i, ii and drift, and test R.")
    ] = False,
    maps: Annotated[
        list[str] | None, typer.Option("--map", help="i, ii, drift, rr or m; may be repeated.")
    ] = None,
    random: Annotated[int, typer.Option(min=0, help="A sample of N points off the grid.")] = 0,
    seed: Annotated[int, typer.Option(min=0, help="Of the sample.")] = 1,
    loaded: Annotated[
        float, typer.Option(min=2.0, max=600.0, help="Of the sample: seconds under load.")
    ] = 12.0,
    sets: Annotated[
        list[str] | None, typer.Option("--set", help="Firmware parameter name=value, last word.")
    ] = None,
    plant: Annotated[
        list[str] | None,
        typer.Option(help="Rig or board section.key=value, for example inverter.model=switched."),
    ] = None,
    variation: Annotated[
        str | None, typer.Option(help="Another plant by name, or all (atlas/variations.py).")
    ] = None,
    voltage: Annotated[
        str | None, typer.Option(help="Voltage the observer uses: sensors or duty.")
    ] = None,
    workers: Annotated[int, typer.Option("-j", "--workers", min=1, help="Processes.")] = 2,
    scheduler: Annotated[
        str | None, typer.Option(help="Address of a Dask scheduler, instead of --workers.")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Folder of the results.")] = None,
    fresh: Annotated[
        bool,
        typer.Option("--fresh/--resume", help="Run everything again, or only what is missing."),
    ] = False,
    throughput: Annotated[
        bool, typer.Option("--throughput", help="Measure points per second, and stop.")
    ] = False,
    means: Annotated[
        bool, typer.Option("--means", help="What each mean is worth (atlas/means.py), and stop.")
    ] = False,
    compare: Annotated[
        bool, typer.Option("--compare", help="Maps of configurations in one picture, and stop.")
    ] = False,
    count: Annotated[
        int, typer.Option("--points", min=0, help="Of --means: so many of each map; 0: all.")
    ] = 0,
    write: Annotated[
        bool, typer.Option("--write", help="Of --means, --compare: to tools/docs, for a commit.")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON object on stdout.")] = False,
) -> None:
    """Run the real firmware over a map of speed x load x errors, and class every point.

    Without --standard, --map or --random: map i. Rows go to Parquet, maps to PNG and HTML.
    """
    # Here and not above: other commands need not wait for numpy and pyarrow.
    from zerohertz.atlas import output
    from zerohertz.atlas.run import Means, run_map
    from zerohertz.atlas.variations import benches
    from zerohertz.scenario.setup import load_setup

    began = time.monotonic()
    if means or compare:
        folder = out or BUILD / "atlas" / ("means" if means else "")
        how = Means(folder, workers, scheduler, fresh)
        if means:
            _means(names or [], how, count, write, as_json)
        else:
            _compare(names or [], how, maps or [], write)
        return
    if names:
        raise UserError(f"'{names[0]}': names go with --means or --compare")
    firmware = _firmware(sets or [], voltage)
    setup = load_setup(config)
    overrides = _assignments("--plant", plant or [], numbers=False)
    plants = benches(setup, firmware, overrides, variation)
    bench = next(iter(plants.values()))
    if throughput:
        output.print_throughput(bench, workers, as_json)
        return
    chosen = _chosen(standard, maps or [], random, seed, loaded)
    folder = out or BUILD / "atlas" / "-".join(filter(None, (setup.name, voltage)))
    if variation is not None:
        folder = folder / "variations"
    results = {}
    for other, on in plants.items():
        how = Means(folder / other, workers, scheduler, fresh)
        for points in chosen:
            name = "/".join(filter(None, (other, points[0].map)))
            with progress_bar(name, len(points)) as progress:
                results[name] = run_map(on, points, how, tell, progress)
    test_R = output.test_R(setup, bench, workers) if standard else None
    content = output.store(folder, setup.name, results, test_R, time.monotonic() - began)
    if as_json:
        print(json.dumps(content))
    else:
        output.print_table(setup.name, results)
        tell(f"rows, PNG and HTML: {short_paths(folder)}/*/")


def _means(names: list[str], how: Means, points: int, write: bool, as_json: bool) -> None:
    from zerohertz.atlas import means_table
    from zerohertz.atlas.means import recipes

    if write and points:
        raise UserError("--write: the page has every point; leave out --points")
    began = time.monotonic()
    found = list(means_table.run_recipes(recipes(names), points, how, tell, progress_bar))
    if write:
        means_table.write_page(found, names)
    if as_json:
        print(json.dumps(means_table.as_json(found, time.monotonic() - began)))
    else:
        means_table.print_table(found)


def _compare(names: list[str], how: Means, maps: list[str], write: bool) -> None:
    from zerohertz.atlas import compare
    from zerohertz.paths import ROOT

    if len(maps) > 1:
        raise UserError("--map: --compare draws one")
    name = maps[0] if maps else "i"
    rows = compare.run(names or list(compare.CONFIGS), name, how, tell, progress_bar)
    path = ROOT / "tools" / "docs" / "atlas.png" if write else how.out / "compare.png"
    compare.write_png(path, rows)
    tell(f"{short_paths(path)}: {path.stat().st_size / 1000:.0f} kB")


def _firmware(lines: list[str], voltage: str | None) -> dict[str, Any]:
    if voltage is not None and voltage not in VOLTAGE:
        raise UserError(f"--voltage: '{voltage}': give sensors or duty")
    chosen = {} if voltage is None else {"voltage_source": VOLTAGE[voltage]}
    return chosen | _assignments("--set", lines, numbers=True)


def _chosen(standard: bool, maps: list[str], random: int, seed: int, loaded_s: float) -> list[Any]:
    """The points of every map asked for, each map once."""
    from zerohertz.atlas.points import STANDARD, random_sample, standard_map

    names = [*(STANDARD if standard else ()), *maps]
    if not names and not random:
        names = ["map_i"]
    chosen = {points[0].map: points for points in map(standard_map, names)}
    if random:
        chosen["random"] = random_sample(random, seed, loaded_s)
    return list(chosen.values())


def _assignments(option: str, lines: list[str], numbers: bool) -> dict[str, Any]:
    values: dict[str, Any] = {}
    for line in lines:
        name, equals, text = line.partition("=")
        if not equals or not name or not text:
            raise UserError(f"{option}: '{line}': write name=value")
        try:
            values[name] = float(text)
        except ValueError:
            if numbers:
                raise UserError(f"{option}: {name}: '{text}' is no number") from None
            values[name] = text
    return values
