"""`zh demo`: everything in one command, ending in a report. `zh report`, `zh animate`: pictures."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.table import Table

from zerohertz.console import short_paths
from zerohertz.errors import UserError
from zerohertz.options import Workers
from zerohertz.paths import BUILD, make_folder

if TYPE_CHECKING:
    from zerohertz.report.page import Report

OUT = BUILD / "report"


def register(app: typer.Typer) -> None:
    """Add `zh demo`, `zh report` and `zh animate`."""
    app.command("demo")(demo)
    app.command("report")(picture)
    app.command("animate")(animate)


def demo(
    seeds: Annotated[
        int, typer.Option(min=1, max=100, help="Number of noise seeds per experiment.")
    ] = 6,
    workers: Workers = 2,
    out: Annotated[Path, typer.Option(help="Folder for the report.")] = OUT,
    design: Annotated[
        bool, typer.Option("--design", help="Also design the gain tables afresh and compare them.")
    ] = False,
) -> None:
    """Build, prove the gain tables, run all experiments, write a report.

    At the end it prints the verdicts and the path of the report, which opens in any browser without
    network. A figure that does not match the paper is shown as such and does not change the exit
    code. Exit 1 if a committed gain table differs from a fresh design or is not proven.
    """
    # Here and not above: other commands need not wait for scipy.
    from zerohertz.report.demo import make_report
    from zerohertz.scenario.setup import load_setup

    make_folder(out, "--out")
    start_s = time.monotonic()
    console = Console(stderr=True)
    report = make_report(
        load_setup("paper"),
        load_setup("recommended"),
        out,
        seeds=seeds,
        workers=workers,
        console=console,
        design=design,
    )
    _print_verdicts(report)
    page = out / "index.html"
    print(f"\nreport: {short_paths(page)} ({page.stat().st_size / 1e6:.1f} MB)")
    print(f"{time.monotonic() - start_s:.0f} s in all; open it in a browser")
    wrong = [table.motor for table in report.tables if not table.holds]
    if wrong:
        print(
            f"gain tables that do not hold: {', '.join(wrong)}; see zh design --check, zh certify"
        )
        raise typer.Exit(1)


def picture(
    png: Annotated[Path, typer.Option(metavar="FILE", help="PNG file to write.")],
    figure: Annotated[
        int | None, typer.Option(min=6, max=18, help="Experiment of the paper, by figure number.")
    ] = None,
    situation: Annotated[
        str | None,
        typer.Option(help="Instead of --figure: no_load, load_50, load_50_rs_1.5 or regen_ramp."),
    ] = None,
    config: Annotated[
        str,
        typer.Option(help="Configuration: paper, recommended, or a TOML file in the same form."),
    ] = "paper",
    seed: Annotated[int, typer.Option(min=1, help="Noise seed.")] = 1,
    width: Annotated[int, typer.Option(min=300, max=6000, help="Width in pixels.")] = 1200,
) -> None:
    """Run one experiment and draw it as a PNG file.

    The README's picture: --config recommended --situation regen_ramp --png tools/docs/fig18.png
    """
    from zerohertz.report.pictures import write_png
    from zerohertz.scenario.evaluate import Run
    from zerohertz.scenario.setup import load_setup

    if png.suffix.lower() != ".png":
        raise UserError(f"--png: {png.name}: only PNG is written; give a name that ends in .png")
    scenario, title = _experiment(figure, situation)
    setup = load_setup(config)
    try:
        size = write_png(Run(setup, scenario, seed), png, title, width)
    except OSError as error:
        raise UserError(f"{png}: cannot be written: {error.strerror}; name another") from None
    print(f"{png}: {size / 1e3:.0f} kB")


def animate(
    gif: Annotated[Path, typer.Option(metavar="FILE.gif", help="Animation to write.")],
    load: Annotated[float, typer.Option(min=-1.2, max=1.2, help="Load over rated torque.")] = 1.0,
    rs: Annotated[float, typer.Option(min=0.3, max=3.0, help="True Rs over nameplate Rs.")] = 1.0,
    config: Annotated[
        str, typer.Option(help="Configuration: a name in host_sim/configs, or a TOML file.")
    ] = "recommended",
) -> None:
    """Animate the slow passage through zero stator frequency, five times real time.

    The README's picture: --gif tools/docs/zero_crossing.gif
    """
    from zerohertz.report.animation import write_gif
    from zerohertz.scenario.setup import load_setup

    if gif.suffix.lower() != ".gif":
        raise UserError(f"--gif: {gif.name}: only GIF is written; give a name that ends in .gif")
    setup = load_setup(config)
    try:
        made = write_gif(setup, gif, load, rs)
    except OSError as error:
        raise UserError(f"{gif}: cannot be written: {error.strerror}; name another") from None
    print(
        f"{gif}: {made.frames} frames, {made.bytes / 1e3:.0f} kB; at worst the estimate is off by "
        f"{made.worst_rpm:.1f} min^-1 and {made.worst_deg:.1f} degrees"
    )


def _experiment(figure: int | None, situation: str | None) -> tuple[int, str]:
    """Figure whose scenario is run, and the title of its picture."""
    from zerohertz.report.experiments import EXPERIMENTS, SITUATIONS
    from zerohertz.scenario import evaluate

    if (figure is None) == (situation is None):
        raise UserError("--figure, --situation: give one of them")
    if figure is not None:
        e = EXPERIMENTS[figure]
        return figure, f"Fig. {figure}: L {e.L}, ε₁ {e.eps1}, load {e.load}, Rs {e.observer_Rs}"
    if situation not in SITUATIONS:
        raise UserError(f"--situation: no '{situation}'; there are {', '.join(SITUATIONS)}")
    return evaluate.SITUATIONS[situation], SITUATIONS[situation]


def _print_verdicts(report: Report) -> None:
    from zerohertz.report.page import short_reason
    from zerohertz.scenario.evaluate import score, score_by_eye
    from zerohertz.scenario.figures import PAPER, our_verdict

    console = Console()
    table = Table(title="Hasegawa (2005) and ours", title_justify="left")
    for name in ("fig.", "experiment", "paper", "ours, worst seed", "match", "seeds", "by eye"):
        table.add_column(name, justify="right" if name in ("fig.", "seeds") else "left")
    for result in report.results:
        table.add_row(
            result.key,
            *PAPER[int(result.key)],
            our_verdict(result),
            "[blue]yes[/blue]" if result.match else "[red]NO[/red]",
            f"{result.seeds_matched}/{len(result.judgements)}",
            "[blue]yes[/blue]" if result.match_by_eye else "[red]NO[/red]",
        )
    console.print()
    console.print(table)
    for result in report.results:
        if not result.match_by_eye:
            console.print(f"Fig. {result.key}: {short_reason(result)}", highlight=False)
    matched, seen = score(report.results), score_by_eye(report.results)
    said = f"paper: {matched} of {len(report.results)} figures match, {seen} by eye"
    console.print(said, highlight=False)
    for result in report.situations:
        word = "held" if result.match else "not held"
        console.print(f"recommended: {result.key}: {word} ({our_verdict(result)})", highlight=False)
    for t in report.tables:
        proof = f"{t.certificate.proven} of {t.certificate.entries} entries proven"
        console.print(f"gain table {t.motor} ({t.method}): {proof}", highlight=False)
