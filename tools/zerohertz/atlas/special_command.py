"""`zh special`: the special tests beside the atlas' maps, and performance."""

from __future__ import annotations

import dataclasses
import json
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

from zerohertz.atlas import special_drawn
from zerohertz.atlas.thermal import Thermal
from zerohertz.estimators import chosen
from zerohertz.options import Estimator, Json, Workers

if TYPE_CHECKING:
    from zerohertz.scenario.setup import Setup


def register(app: typer.Typer) -> None:
    """Add `zh special`."""
    app.command("special")(special)


ZERO_HERTZ = "zero_hertz"

RunsOption = Annotated[
    int, typer.Option(min=1, help="zero_hertz, hot_motor, torque: runs of each kind.")
]
SeedOption = Annotated[
    int, typer.Option(min=0, help="zero_hertz, hot_motor, torque: seed of the random runs.")
]
SpeedUpOption = Annotated[
    float,
    typer.Option(min=1.0, max=60.0, help="hot_motor: factor by which heating is accelerated."),
]
ThermalOption = Annotated[
    Thermal,
    typer.Option(
        help="hot_motor: it heats from cold; is warm when the processor starts; stays cool. "
        "After the hour the last two cross zero slowly under load."
    ),
]
ArrivalOption = Annotated[
    float,
    typer.Option(
        min=0.0, max=0.5, help="zero_hertz: largest relative Rs error when the load comes."
    ),
]
PictureOption = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE.png|FILE.gif",
        help="zero_hertz: only draw run 2 of the slow dwells; a .gif is animated.",
    ),
]
LoadStepOption = Annotated[
    float,
    typer.Option(min=-1.0, max=1.0, help="zero_hertz: share of the load switched every minute."),
]
ModulationOption = Annotated[
    str, typer.Option(help="zero_hertz: parameter dwell: speed, flux, off, or configured.")
]
IdentifyOption = Annotated[
    str,
    typer.Option(help="zero_hertz: parameter dead_time_identify: off, loss, curve, or configured."),
]


ConfigOption = Annotated[
    str, typer.Option(help="Configuration: a name in host_sim/configs, or a TOML file.")
]


def special(
    names: Annotated[
        list[str] | None, typer.Argument(help="Tests to run; default: all but the random ones.")
    ] = None,
    config: ConfigOption = "recommended",
    estimator: Estimator = None,
    workers: Workers = 2,
    as_json: Json = False,
    runs: RunsOption = 40,
    seed: SeedOption = 1,
    seconds: Annotated[
        float, typer.Option(min=30.0, help="zero_hertz: length of each dwell, s.")
    ] = 600.0,
    arrival: ArrivalOption = 0.2,
    load_step: LoadStepOption = 0.0,
    picture: PictureOption = None,
    speed_up: SpeedUpOption = 60.0,
    thermal: ThermalOption = Thermal.HEATS,
    modulation: ModulationOption = "configured",
    identify: IdentifyOption = "configured",
) -> None:
    """Run special tests on the atlas bench: long holds, slow crossings, performance.

    Tests: test_R, slow_crossing, dwell, situations, speed_range, static_accuracy, torque_rise,
    speed_bandwidth, starting_torque. Only when named, with random plants: zero_hertz (dwelling at
    zero stator frequency), hot_motor (an hour at rated torque from cold), torque (accuracy of
    torque mode). Exit 1 if a goal is missed.
    """
    chosen.use(estimator)
    if names and len(names) == 1 and names[0] in special_drawn.TESTS:
        special_drawn.command(names[0], config, (runs, seed, speed_up, thermal), workers, as_json)
        return
    if names == [ZERO_HERTZ]:
        setup = _identifying(config, identify)
        if picture is not None:
            _draw_dwell(setup, seed, seconds, arrival, picture)
            return
        asked_of = (runs, seed, seconds, arrival, load_step, modulation)
        _zero_hertz(setup, asked_of, workers, as_json)
        return
    from zerohertz.atlas.special import case_count, run_tests
    from zerohertz.console import progress_bar
    from zerohertz.scenario.setup import load_setup

    setup = load_setup(config)
    asked = names or []
    begin_s = time.monotonic()
    with progress_bar("special tests", case_count(setup, asked)) as progress:
        results = run_tests(setup, asked, workers, progress)
    if as_json:
        content: dict[str, Any] = {"config": setup.name}
        content |= {result.name: result.as_json() for result in results}
        print(json.dumps(content | {"run_s": round(time.monotonic() - begin_s, 1)}))
    else:
        _print(setup.name, results)
    if any(result.met is False for result in results):
        raise typer.Exit(1)


def _print(config: str, results: list[Any]) -> None:
    # Wide enough for the numbers where nobody looks: a pipe has 80 columns.
    console = Console(width=max(Console().width, 120))
    words = {True: "[green]met[/green]", False: "[red]missed[/red]", None: "-"}
    for result in results:
        console.print(f"{result.name}, {config}: {result.goal}", highlight=False)
        table = Table()
        table.add_column("case", no_wrap=True)
        table.add_column("ended", no_wrap=True)
        table.add_column("goal")
        numbers = [finding.as_json() for finding in result.findings]
        keys = [key for key in numbers[0] if key not in ("case", "verdict", "met")]
        for key in keys:
            table.add_column(key.replace("_", " "), justify="right")
        for row in numbers:
            values = ("-" if row[key] is None else f"{row[key]:.4g}" for key in keys)
            table.add_row(row["case"], row["verdict"], words[row["met"]], *values)
        console.print(table)
    met = {r.name: r.met for r in results if r.met is not None}
    console.print(f"goals met: {sum(met.values())} of {len(met)}", highlight=False)


def _identifying(config: str, identify: str) -> Setup:
    from zerohertz.errors import UserError
    from zerohertz.scenario.setup import load_setup

    setup = load_setup(config)
    known = {"configured": None, "off": 0, "loss": 1, "curve": 2}
    if identify not in known:
        raise UserError(f"--identify: '{identify}' is unknown; known are {', '.join(known)}")
    if (value := known[identify]) is None:
        return setup
    return dataclasses.replace(setup, params={**setup.params, "dead_time_identify": value})


def _zero_hertz(
    setup: Setup,
    asked_of: tuple[int, int, float, float, float, str],
    workers: int,
    as_json: bool,
) -> None:
    from zerohertz.atlas import zero_hertz
    from zerohertz.console import progress_bar
    from zerohertz.errors import UserError

    runs, seed, seconds, arrival, load_step, modulation = asked_of
    kinds = {"configured": {}, "off": {"dwell": 0}, "speed": {"dwell": 1}, "flux": {"dwell": 2}}
    if modulation not in kinds:
        raise UserError(f"--modulation: '{modulation}' is unknown; known are {', '.join(kinds)}")
    found: dict[str, dict[str, Any]] = {}
    for name, ask in {"slow": zero_hertz.Dwell(), "rated": zero_hertz.RATED}.items():
        ask = dataclasses.replace(
            ask,
            seconds=seconds,
            arrival_pu=arrival,
            load_step_pu=load_step,
            firmware=kinds[modulation],
        )
        with progress_bar(f"{ZERO_HERTZ}, {name}", runs) as progress:
            rows = zero_hertz.rows_of(setup, ask, runs, seed, workers, progress)
        found[name] = zero_hertz.summary(ask, rows) | {"rows": rows}
    met = {name: result["within"] == result["runs"] for name, result in found.items()}
    if as_json:
        # The keys of the slow dwells also by themselves: they are the test's first line.
        head = {key: value for key, value in found["slow"].items() if key != "rows"}
        content = {"config": setup.name, "seed": seed, **head, **found, "met": met}
        print(json.dumps(special_drawn.finite(content), allow_nan=False))
    else:
        _print_dwells(setup.name, seed, found)
    if not all(met.values()):
        raise typer.Exit(1)


def _draw_dwell(setup: Setup, seed: int, seconds: float, arrival: float, path: Path) -> None:
    from zerohertz.atlas import zero_hertz, zero_hertz_animation, zero_hertz_picture

    ask = zero_hertz.Dwell(seconds=seconds, arrival_pu=arrival)
    row, record = zero_hertz.one(setup, ask, seed, 2)
    if path.suffix == ".gif":
        zero_hertz_animation.write_gif(path, row, record)
    else:
        zero_hertz_picture.write_png(path, row, record)
    print(f"written: {path}")


def _print_dwells(config: str, seed: int, found: dict[str, dict[str, Any]]) -> None:
    console = Console(width=max(Console().width, 120))
    table = Table(title=f"{ZERO_HERTZ}, {config}, seed {seed}")
    table.add_column("", no_wrap=True)
    for name in found:
        table.add_column(name, justify="right")
    for key in next(iter(found.values())):
        if key not in ("rows", "lost_runs"):
            values = (result[key] for result in found.values())
            table.add_row(
                key.replace("_", " "),
                *(f"{v:.4g}" if isinstance(v, float) else str(v) for v in values),
            )
    console.print(table)
