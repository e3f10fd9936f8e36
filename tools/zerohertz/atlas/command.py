"""`zh atlas`: what the drive holds with wrong parameters, point by point."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Annotated, Any

import typer

from zerohertz.errors import UserError
from zerohertz.paths import BUILD

VOLTAGE = {"sensors": 0, "duty": 1}


def register(app: typer.Typer) -> None:
    """Add `zh atlas`."""
    app.command("atlas")(atlas)


def atlas(
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
        means = Means(folder / other, workers, scheduler, fresh)
        for points in chosen:
            name = "/".join(filter(None, (other, points[0].map)))
            with output.progress_bar(name, len(points)) as progress:
                results[name] = run_map(on, points, means, output.tell, progress)
    test_R = output.test_R(setup, bench, workers) if standard else None
    content = output.store(folder, setup.name, results, test_R, time.monotonic() - began)
    if as_json:
        print(json.dumps(content))
    else:
        output.print_table(setup.name, results)
        output.tell(f"rows, PNG and HTML: {folder}/*/")


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
