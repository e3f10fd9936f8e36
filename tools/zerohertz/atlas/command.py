"""`zh atlas`: what the drive holds with wrong parameters, point by point."""

from __future__ import annotations

import dataclasses
import json
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from zerohertz.assignments import assignments
from zerohertz.console import progress_bar, short_paths, tell
from zerohertz.errors import UserError
from zerohertz.estimators import chosen
from zerohertz.options import Estimator, Json, Workers
from zerohertz.paths import BUILD

if TYPE_CHECKING:
    from zerohertz.atlas.run import RunOptions
    from zerohertz.atlas.simulate import Bench
    from zerohertz.scenario.setup import Setup

VOLTAGE = {"sensors": 0, "duty": 1}


NamesArgument = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="NAME", help="With --features: recipes. With --compare: configurations."
    ),
]
ConfigOption = Annotated[
    str,
    typer.Option(
        help="Configuration: recommended, paper, no_gain, or a TOML file in the same form."
    ),
]
StandardOption = Annotated[
    bool, typer.Option("--standard", help="Run maps i, ii and drift, and test R.")
]
MapsOption = Annotated[
    list[str] | None,
    typer.Option("--map", help="Map to run: i, ii, drift, rr or m; may be repeated."),
]
RandomOption = Annotated[int, typer.Option(min=0, help="Run N random points off the grid instead.")]
LoadedOption = Annotated[
    float, typer.Option(min=2.0, max=600.0, help="With --random: seconds under load.")
]
SetsOption = Annotated[
    list[str] | None,
    typer.Option("--set", help="Firmware parameter NAME=VALUE; overrides all else."),
]
PlantOption = Annotated[
    list[str] | None,
    typer.Option(help="Rig or board value SECTION.KEY=VALUE, e.g. inverter.model=switched."),
]
VariationOption = Annotated[
    str | None, typer.Option(help="Plant variation by name, or all of them (atlas/variations.py).")
]
VoltageOption = Annotated[
    str | None, typer.Option(help="Voltage source of the observer: sensors or duty.")
]
SchedulerOption = Annotated[
    str | None, typer.Option(help="Address of a Dask scheduler, instead of --workers.")
]
FreshOption = Annotated[
    bool, typer.Option("--fresh/--resume", help="Run everything again, or only what is missing.")
]
ThroughputOption = Annotated[
    bool, typer.Option("--throughput", help="Only measure how many points run per second.")
]
FeaturesOption = Annotated[
    bool,
    typer.Option(
        "--features", help="Only measure what each feature contributes (atlas/features.py)."
    ),
]
CompareOption = Annotated[
    bool,
    typer.Option("--compare", help="Only draw the maps of several configurations in one picture."),
]
CountOption = Annotated[
    int, typer.Option("--points", min=0, help="Only with --features: points per map; 0: all.")
]
WriteOption = Annotated[
    bool,
    typer.Option(
        "--write", help="With --features or --compare: write to tools/docs, to be committed."
    ),
]


def register(app: typer.Typer) -> None:
    """Add `zh atlas`."""
    app.command("atlas")(atlas)


def atlas(
    names: NamesArgument = None,
    config: ConfigOption = "recommended",
    standard: StandardOption = False,
    maps: MapsOption = None,
    random: RandomOption = 0,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the random sample.")] = 1,
    loaded: LoadedOption = 12.0,
    sets: SetsOption = None,
    plant: PlantOption = None,
    variation: VariationOption = None,
    voltage: VoltageOption = None,
    estimator: Estimator = None,
    workers: Workers = 2,
    scheduler: SchedulerOption = None,
    out: Annotated[Path | None, typer.Option(help="Folder for the results.")] = None,
    fresh: FreshOption = False,
    throughput: ThroughputOption = False,
    features: FeaturesOption = False,
    compare: CompareOption = False,
    count: CountOption = 0,
    write: WriteOption = False,
    as_json: Json = False,
) -> None:
    """Run the firmware over a map of speed, load and parameter errors, and classify each point.

    Without --standard, --map or --random it runs map i. It writes the rows as Parquet and the maps
    as PNG and HTML. What the maps show: tools/zerohertz/atlas/README.md.
    """
    # Here and not above: other commands need not wait for numpy and pyarrow.
    from zerohertz.atlas import output
    from zerohertz.atlas.run import RunOptions

    began = time.monotonic()
    chosen.use(estimator)
    if features or compare:
        folder = out or BUILD / "atlas" / chosen.chosen_name() / ("features" if features else "")
        how = RunOptions(folder, workers, scheduler, fresh)
        if features:
            _features(names, how, count, write, as_json)
        else:
            _compare(names, how, maps, write)
        return
    _refuse(names, count)
    setup, plants = _plants(config, _firmware(sets, voltage), plant, variation)
    bench = next(iter(plants.values()))
    if throughput:
        output.print_throughput(bench, workers, as_json)
        return
    points = _chosen(standard, maps, random, seed, loaded)
    folder = out or _folder(setup.name, voltage, variation)
    results = _run_maps(plants, points, RunOptions(folder, workers, scheduler, fresh))
    test_R = output.test_R(setup, bench, workers) if standard else None
    content = output.store(folder, setup.name, results, test_R, time.monotonic() - began)
    if as_json:
        print(json.dumps(content))
    else:
        output.print_table(setup.name, results)
        tell(f"rows, PNG and HTML: {short_paths(folder)}/*/")


def _refuse(names: list[str] | None, count: int) -> None:
    """What only a table of features has."""
    if names:
        raise UserError(f"'{names[0]}': names need --features or --compare")
    if count:
        raise UserError(
            "--points: only with --features; a map is always whole: take --random for fewer points"
        )


def _plants(
    config: str, firmware: dict[str, Any], plant: list[str] | None, variation: str | None
) -> tuple[Setup, dict[str, Bench]]:
    """The configuration, and the plants that its firmware meets, by name."""
    from zerohertz.atlas.variations import benches
    from zerohertz.scenario.setup import load_setup

    setup = load_setup(config)
    overrides = assignments("--plant", plant or [], numbers=False)
    return setup, benches(setup, firmware, overrides, variation)


def _folder(config: str, voltage: str | None, variation: str | None) -> Path:
    folder = BUILD / "atlas" / "-".join(filter(None, (config, voltage, chosen.chosen_name())))
    return folder / "variations" if variation is not None else folder


def _run_maps(
    plants: dict[str, Bench], chosen: list[Any], options: RunOptions
) -> dict[str, list[dict[str, Any]]]:
    """The rows of each map on each plant."""
    from zerohertz.atlas.run import run_map

    results = {}
    for other, on in plants.items():
        how = dataclasses.replace(options, out=options.out / other)
        for points in chosen:
            name = "/".join(filter(None, (other, points[0].map)))
            with progress_bar(name, len(points)) as progress:
                results[name] = run_map(on, points, how, tell, progress)
    return results


def _features(
    wanted: list[str] | None, how: RunOptions, points: int, write: bool, as_json: bool
) -> None:
    from zerohertz.atlas import features_table
    from zerohertz.atlas.features import recipes

    if write and (points or chosen.chosen_name()):
        raise UserError("--write: the page has every point, with our estimator; leave out --points")
    began = time.monotonic()
    names = wanted or []
    found = list(features_table.run_recipes(recipes(names), points, how, tell, progress_bar))
    if write:
        features_table.write_page(found, names)
    if as_json:
        print(json.dumps(features_table.as_json(found, time.monotonic() - began)))
    else:
        features_table.print_table(found)


def _compare(names: list[str] | None, how: RunOptions, maps: list[str] | None, write: bool) -> None:
    from zerohertz.atlas import compare
    from zerohertz.paths import ROOT

    name, *more = maps or ["i"]
    if more:
        raise UserError("--map: --compare draws only one map; give one")
    rows = compare.run(names or list(compare.CONFIGS), name, how, tell, progress_bar)
    path = ROOT / "tools" / "docs" / "atlas.png" if write else how.out / "compare.png"
    compare.write_png(path, rows)
    tell(f"{short_paths(path)}: {path.stat().st_size / 1000:.0f} kB")


def _firmware(lines: list[str] | None, voltage: str | None) -> dict[str, Any]:
    if voltage is not None and voltage not in VOLTAGE:
        raise UserError(f"--voltage: '{voltage}': give sensors or duty")
    source = {} if voltage is None else {"voltage_source": VOLTAGE[voltage]}
    return source | assignments("--set", lines or [], numbers=True)


def _chosen(
    standard: bool, maps: list[str] | None, random: int, seed: int, loaded_s: float
) -> list[Any]:
    """The points of every map asked for, each map once."""
    from zerohertz.atlas.points import STANDARD, random_sample, standard_map

    names = [*(STANDARD if standard else ()), *(maps or ())]
    if not names and not random:
        names = ["map_i"]
    found = {points[0].map: points for points in map(standard_map, names)}
    if random:
        found["random"] = random_sample(random, seed, loaded_s)
    return list(found.values())
