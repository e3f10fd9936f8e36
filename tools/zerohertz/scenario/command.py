"""`zh figures`: the paper's thirteen experiments and their verdicts. `zh identify`: the search."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

from zerohertz.console import progress_bar, short_paths, tell
from zerohertz.errors import UserError
from zerohertz.estimators import chosen
from zerohertz.options import Estimator, Json, Workers
from zerohertz.paths import BUILD, make_folder

if TYPE_CHECKING:
    from zerohertz.scenario.setup import Setup

IDENTIFY_LOG = BUILD / "identify" / "log.jsonl"


RequireOption = Annotated[int | None, typer.Option(help="Exit 1 if fewer figures than this match.")]


def register(app: typer.Typer) -> None:
    """Add `zh figures` and `zh identify`."""
    app.command("figures")(figures)
    app.command("identify")(identify)


def figures(
    config: Annotated[
        str,
        typer.Option(help="Configuration: paper, recommended, or a TOML file in the same form."),
    ] = "paper",
    seeds: Annotated[int, typer.Option(min=1, max=100, help="Number of noise seeds: 1 to N.")] = 6,
    sensitivity: Annotated[
        bool, typer.Option("--sensitivity", help="Compute the sensitivities again; takes minutes.")
    ] = False,
    estimator: Estimator = None,
    workers: Workers = 2,
    require: RequireOption = None,
    write: Annotated[
        bool, typer.Option("--write", help="Store the result in tools/docs, to be committed.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Run the experiments of Hasegawa (2005), Figs. 6-18, and judge them.

    Configuration `paper` is judged by the paper's outcomes. A figure matches only with a margin and
    for every seed. "by eye" is stricter: whoever sees both plots has to agree. Any other
    configuration is judged as a good drive in the same four situations. Exit 0 whatever the score,
    unless --require is given.
    """
    # Here and not above: other commands need not wait for scipy.
    from zerohertz.scenario import evaluate
    from zerohertz.scenario.figures import (
        COMPUTED_NOW,
        committed_sensitivity,
        result_json,
        write_committed,
    )
    from zerohertz.scenario.sensitivity import redraw_note, run_count
    from zerohertz.scenario.sensitivity import sensitivity as compute_sensitivity
    from zerohertz.scenario.setup import load_setup

    chosen.use(estimator, write)
    setup = load_setup(config)
    paper = setup.name == "paper"
    evaluated = evaluate.evaluate_figures if paper else evaluate.evaluate_situations
    number = seeds * (13 if paper else 4)
    with progress_bar("experiments", number) as progress:
        results = evaluated(setup, seeds, workers, progress)
    with progress_bar("with the guard acting", number) as progress:
        acting = evaluated(setup, seeds, workers, progress, guard_acts=True)
    if sensitivity and paper:
        with progress_bar("sensitivity", run_count()) as progress:
            spread, redrawn = compute_sensitivity(setup, workers=workers, progress=progress)
        source = f"{COMPUTED_NOW}{redraw_note(redrawn)}"
    else:
        spread, source = committed_sensitivity(setup)
    content = result_json(setup, results, spread, source, acting)
    if write:
        tell(f"written: {short_paths(write_committed(setup, content))}")
    if as_json:
        print(json.dumps(content))
    else:
        _print_table(content, results, setup)
    if require is not None and content["score"] < require:
        raise typer.Exit(1)


def _print_table(content: dict[str, Any], results: list[Any], setup: Setup) -> None:
    from zerohertz.scenario.figures import PAPER, our_verdict

    paper = setup.name == "paper"
    table = Table(title=f"configuration {setup.name}, {setup.rig_name}", title_justify="left")
    table.add_column("figure" if paper else "situation", justify="right" if paper else "left")
    if paper:
        table.add_column("experiment")
        table.add_column("paper")
    table.add_column("ours")
    table.add_column("match")
    table.add_column("seeds", justify="right")
    if paper:
        table.add_column("by eye")
    table.add_column("guard acting")
    table.add_column("why not, worst seed")
    for result in results:
        row = [result.key, *(PAPER[int(result.key)] if paper else ()), our_verdict(result)]
        row += [_word(result.match), f"{result.seeds_matched}/{len(result.judgements)}"]
        row += [_word(result.match_by_eye)] if paper else []
        table.add_row(*row, _acting(content, result), _why_not(result))
    console = Console()
    console.print(table)
    console.print(f"score {content['score']} of {len(results)}", highlight=False)
    if paper:
        eye = f"by eye {content['score_by_eye']} of {len(results)}: a stricter reading of its own"
        console.print(eye, highlight=False)
    console.print(f"beside the predicates, our own: {content['own_condition']}", highlight=False)
    if paper:
        spread = content["sensitivity"]
        text = ", ".join(f"{k}: {v}" for k, v in spread.items()) if spread else "not known"
        console.print(
            f"mean score with all rig parameters spread by 1 sigma: {text} "
            f"({content['sensitivity_source']})",
            highlight=False,
        )


def _word(match: bool) -> str:
    return "[green]yes[/green]" if match else "[red]no[/red]"


def _why_not(result: Any) -> str:
    """What the eye objects to only where the predicate holds."""
    if result.reason or not result.reason_by_eye:
        return result.reason or ""
    return f"by eye: {result.reason_by_eye}"


def _acting(content: dict[str, Any], result: Any) -> str:
    """The verdict with a guard that acts, where it is another one."""
    found = content["guard_acting"].get(result.key)
    if found is None or (found["match"], found["ours"]) == (
        result.match,
        content["ours"].get(result.key),
    ):
        return "same"
    return ("yes" if found["match"] else "no") + f": {found['ours']}"


def identify(
    hours: Annotated[float, typer.Option(min=0.001, help="Computing time, in hours.")] = 1.0,
    seed: Annotated[int, typer.Option(help="Seed of the random search.")] = 1,
    workers: Workers = 2,
    log: Annotated[
        Path,
        typer.Option(
            help="Log of all trials, one JSON object per line; an existing log is resumed."
        ),
    ] = IDENTIFY_LOG,
    start: Annotated[
        list[Path] | None, typer.Option(help="JSON file with a starting point; may be repeated.")
    ] = None,
    write: Annotated[
        Path | None,
        typer.Option(help="Write rig, configuration and motor.toml to this folder at the end."),
    ] = None,
) -> None:
    """Search for the rig and the tuning that reproduce the paper's figures.

    The ranges are in scenario/space.py. The result is a proposal; `zh figures --config FILE` judges
    it with all seeds.
    """
    from zerohertz.scenario.identify import Search, read_point, search
    from zerohertz.scenario.propose import write_proposal

    for option, folder in (("--log", log.parent), ("--write", write)):
        if folder:
            make_folder(folder, option)
    run = Search(log, seed, {path.stem: read_point(path) for path in start or ()})
    begin = time.monotonic()

    def report(state: Search, better: bool) -> None:
        if better and state.best:
            missing = [n for n, v in state.best.figures.items() if v < 1.0]
            tell(
                f"{time.monotonic() - begin:7.0f} s  {state.tried} tried, {state.full} to the end: "
                f"{state.best.matches} match, value {state.best.value:.3f} "
                f"(from {state.best.origin}; missing {', '.join(missing) or 'none'})"
            )

    search(run, 3600.0 * hours, workers, report)
    if run.best is None:
        raise UserError(f"{log}: nothing was tried to the end; give more --hours")
    print(json.dumps({"tried": run.tried, "value": run.best.value, "figures": run.best.figures}))
    if write:
        for path in write_proposal(run.best.point, write):
            tell(f"written: {path}")
