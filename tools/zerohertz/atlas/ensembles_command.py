"""`zh ensemble`: numbers of the data sheet over hundreds of plants, phases and noise seeds."""

from __future__ import annotations

import json
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

from zerohertz.options import Json, Seed, Workers


def register(app: typer.Typer) -> None:
    """Add `zh ensemble`."""
    app.command("ensemble")(ensemble)


def ensemble(
    names: Annotated[
        list[str] | None, typer.Argument(help="Ensembles to run; default: all.")
    ] = None,
    runs: Annotated[int, typer.Option(min=1, help="Number of runs of each ensemble.")] = 200,
    seed: Seed = 1,
    config: Annotated[
        str, typer.Option(help="Configuration: a name in host_sim/configs, or a TOML file.")
    ] = "recommended",
    only: Annotated[
        int | None, typer.Option(min=0, help="Run this one alone and list its faults.")
    ] = None,
    workers: Workers = 2,
    as_json: Json = False,
) -> None:
    """Measure performance over many random runs: crossings, load_steps, reversals, ripple.

    Plant, noise, phase and mission are random. Half of the runs have no voltage sensors. Prints
    median, quantiles and worst, and the share within the goal. Exit 1 if a goal is missed.
    """
    from zerohertz.atlas import ensembles
    from zerohertz.console import progress_bar
    from zerohertz.scenario.setup import load_setup

    setup = load_setup(config)
    asked = ensembles.chosen(names or [])
    if only is not None:
        _print_runs([ensembles.one(setup, name, seed, only)[0] for name in asked])
        return
    found: dict[str, dict[str, Any]] = {}
    for name in asked:
        with progress_bar(name, runs) as progress:
            rows = ensembles.rows_of(setup, name, runs, seed, workers, progress)
        found[name] = ensembles.summary(name, rows)
    if as_json:
        print(json.dumps({"config": setup.name, "seed": seed, **found}))
    else:
        _print(setup.name, seed, found)
    if not all(result["met"] for result in found.values()):
        raise typer.Exit(1)


def _print(config: str, seed: int, found: dict[str, dict[str, Any]]) -> None:
    # Wide enough for the numbers where nobody looks: a pipe has 80 columns.
    console = Console(width=max(Console().width, 120))
    table = Table(title=f"{config}, seed {seed}")
    for column in ("ensemble", "runs", "median", "95 %", "99 %", "worst", "goal", "within", "lost"):
        table.add_column(column, justify="left" if column == "ensemble" else "right")
    for name, r in found.items():
        values = [_number(r[key]) for key in ("median", "p95", "p99", "worst", "limit")]
        colour = "green" if r["met"] else "red"
        within = f"[{colour}]{100 * r['within']:.1f} %[/{colour}]"
        table.add_row(name, str(r["runs"]), *values, within, str(r["lost"]))
    console.print(table)
    for name, r in found.items():
        console.print(f"{name}: {r['goal']}; worst runs {r['worst_runs'][:5]}", highlight=False)


def _number(value: float | None) -> str:
    return "lost" if value is None else f"{value:.3g}"


def _print_runs(rows: list[dict[str, Any]]) -> None:
    for row in rows:
        shown = row | {"value": "lost" if row["lost"] else row["value"]}
        words = (f"{k} {v:.6g}" if isinstance(v, float) else f"{k} {v}" for k, v in shown.items())
        print(", ".join(words))
