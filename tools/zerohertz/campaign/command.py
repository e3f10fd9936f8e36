"""`zh campaign`: long runs over everything, of which `zh test` takes samples."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from zerohertz.bringup import command as bring_up
from zerohertz.campaign import mcdc as coverage
from zerohertz.campaign import powercut as cuts
from zerohertz.campaign.faults.command import faults
from zerohertz.campaign.flips.command import flips
from zerohertz.campaign.mutation_report import Request, as_dict, run_and_show
from zerohertz.campaign.notebooks import notebooks
from zerohertz.campaign.skips.command import skips
from zerohertz.campaign.updatecut import update
from zerohertz.commission.command import register_campaign
from zerohertz.configuration.command import register_campaign as register_configurations
from zerohertz.console import progress_bar, tell
from zerohertz.errors import UserError
from zerohertz.options import Json, Workers

if TYPE_CHECKING:
    from zerohertz.campaign.fuzz import Part


def register(app: typer.Typer) -> None:
    """Add `zh campaign` and its runs."""
    campaign = typer.Typer(help="Long campaigns; `zh test` runs samples of them.")
    app.add_typer(campaign, name="campaign")

    @campaign.callback()
    def group() -> None:
        """Long campaigns; `zh test` runs samples of them."""

    bring_up.register_campaign(campaign)
    register_campaign(campaign)
    register_configurations(campaign)

    campaign.command("mutation")(mutation)
    campaign.command("mcdc")(mcdc)
    campaign.command("powercut")(powercut)
    campaign.command("update")(update)
    campaign.command("fuzz")(fuzz)
    campaign.command("fieldbus")(fieldbus)
    campaign.command("monitor")(monitor)
    campaign.command("faults")(faults)
    campaign.command("flips")(flips)
    campaign.command("skips")(skips)
    campaign.command("notebooks")(notebooks)


def mutation(
    folder: Annotated[str, typer.Option(help="Folder to mutate.")] = "firmware",
    sample: Annotated[int, typer.Option(min=0, help="Number of mutants; 0: all.")] = 0,
    seed: Annotated[int, typer.Option(help="Seed of the random sample.")] = 2005,
    minimum: Annotated[float, typer.Option(help="Mutation score to reach.")] = 0.95,
    as_json: Annotated[
        bool,
        typer.Option("--json", help="Print one JSON object on stdout, everything else on stderr."),
    ] = False,
    output: Annotated[Path | None, typer.Option(help="Also write the JSON to this file.")] = None,
) -> None:
    """Check that the unit tests detect small wrong changes of the firmware (mutants)."""
    request = Request(folder=folder, sample=sample, seed=seed, minimum=minimum)
    result, good = run_and_show(request, output, sys.stderr if as_json else sys.stdout)
    if as_json:
        print(json.dumps(as_dict(request, result), indent=2))
    raise typer.Exit(0 if good else 1)


def mcdc(
    jobs: Annotated[int, typer.Option(min=1, help="Number of parallel tests.")] = 2,
    as_json: Annotated[
        bool,
        typer.Option("--json", help="Print one JSON object on stdout, everything else on stderr."),
    ] = False,
) -> None:
    """Measure the MC/DC coverage of guard and sequence by the unit tests.

    Needs clang 19 and llvm 19: tools/zh installs them from Debian, about 500 MB.
    """
    tell("building and running the unit tests with clang 19")
    found = coverage.run(jobs)
    gaps = [decision for decision in found if decision.gaps]
    if as_json:
        print(json.dumps(coverage.as_dict(found), indent=2))
    for decision in gaps:
        said = ", ".join(map(str, decision.gaps))
        text = f"{decision.file}:{decision.line}: condition {said} never decides alone"
        print(text, file=sys.stderr if as_json else sys.stdout)
    total = coverage.as_dict(found)
    text = (
        f"{total['covered']} of {total['conditions']} conditions in {total['decisions']} decisions"
    )
    print(text, file=sys.stderr if as_json else sys.stdout)
    raise typer.Exit(1 if gaps or not found else 0)


def powercut(
    triple: Annotated[int, typer.Option(min=1, help="Number of random triple cuts.")] = 1_000_000,
    seed: Annotated[int, typer.Option(min=0, help="Seed of all random draws.")] = 2005,
    jobs: Annotated[int, typer.Option(min=1, help="Number of parallel runs.")] = 2,
    write: Annotated[bool, typer.Option(help="Write tools/docs/powercut.md.")] = False,
    as_json: Annotated[
        bool,
        typer.Option("--json", help="Print one JSON object on stdout, everything else on stderr."),
    ] = False,
) -> None:
    """Cut the power at any moment, and check that the stored parameters survive."""

    def show(row: cuts.Row) -> None:
        text = f"{row.what}, unit of {row.unit_bytes} bytes: {row.runs} runs"
        print(f"{text}, {row.failed} failed", file=sys.stderr if as_json else sys.stdout)

    rows = cuts.run_all(triple, seed, jobs, show)
    if write:
        cuts.PAGE.write_text(cuts.page_text(rows, triple, seed), encoding="utf-8")
    if as_json:
        print(json.dumps({"seed": seed, "runs": [asdict(row) for row in rows]}, indent=2))
    raise typer.Exit(0 if cuts.good(rows) else 1)


def fuzz(
    parser: Annotated[int, typer.Option(min=0, help="Number of inputs to the frame parser.")] = 10
    ** 8,
    whole: Annotated[int, typer.Option(min=0, help="Number of inputs to the whole link.")] = 10**6,
    sil: Annotated[int, typer.Option(min=0, help="Number of frames into the SIL drive.")] = 10**7,
    image: Annotated[int, typer.Option(min=0, help="Number of frames into the image.")] = 10**5,
    seed: Annotated[int, typer.Option(min=1, help="Seed of all random inputs.")] = 2005,
    as_json: Json = False,
    output: Annotated[Path | None, typer.Option(help="Also write the JSON to this file.")] = None,
) -> None:
    """Send random frames, and check that none breaks the link or changes a duty."""
    from zerohertz.campaign import fuzz as campaign_fuzz

    _tell_parts(campaign_fuzz.run_all(parser, whole, sil, image, seed), seed, as_json, output)


def fieldbus(
    modbus: Annotated[int, typer.Option(min=0, help="Number of frames on Modbus.")] = 10**6,
    can: Annotated[int, typer.Option(min=0, help="Number of frames on CAN.")] = 10**7,
    hours: Annotated[
        float, typer.Option(min=0.0, help="Hours of a PLC's random traffic, on each bus.")
    ] = 1.0,
    seed: Annotated[int, typer.Option(min=1, help="Seed of all random inputs.")] = 2005,
    as_json: Json = False,
    output: Annotated[Path | None, typer.Option(help="Also write the JSON to this file.")] = None,
) -> None:
    """Send random frames and a PLC's traffic: no duty changes, no command is lost."""
    from zerohertz.campaign import fieldbus as buses

    _tell_parts(buses.run_all(modbus, can, hours, seed), seed, as_json, output)


def _tell_parts(found: Iterator[Part], seed: int, as_json: bool, output: Path | None) -> None:
    """Each part as it ends; exit 1 when one does not hold."""
    from zerohertz.campaign import fuzz as campaign_fuzz

    tell = sys.stderr if as_json else sys.stdout
    parts: list[Part] = []
    for part in found:
        parts.append(part)
        word = "holds" if part.good else "DOES NOT HOLD"
        said = f"{part.name}: {part.done} of {part.wanted}, {part.seconds:.0f} s: {word}"
        print("\n  ".join(filter(None, (said, part.note))), file=tell, flush=True)
        if output is not None:
            campaign_fuzz.write(output, campaign_fuzz.as_json(seed, parts))
    if as_json:
        print(campaign_fuzz.as_json(seed, parts))
    raise typer.Exit(0 if all(part.good for part in parts) else 1)


def monitor(
    hours: Annotated[
        float, typer.Option(min=0.0, help="Hours without any fault, to find false alarms; 0: none.")
    ] = 10.0,
    sample: Annotated[int, typer.Option(min=0, help="Cases per group; 0: all.")] = 0,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the random sample.")] = 2005,
    workers: Workers = 2,
    out: Annotated[Path | None, typer.Option(help="Folder for the result rows.")] = None,
    fresh: Annotated[
        bool,
        typer.Option("--fresh/--resume", help="Run everything again, or only what is missing."),
    ] = False,
    write: Annotated[bool, typer.Option(help="Write tools/docs/monitor.md.")] = False,
    as_json: Json = False,
) -> None:
    """Inject faults: each must be detected or harmless, without false alarms."""
    # Here and not above: other commands need not wait for numpy and pyarrow.
    from zerohertz.atlas.run import RunOptions
    from zerohertz.campaign import monitor as watched
    from zerohertz.paths import BUILD

    if write and (sample or not hours):
        raise UserError("--write: the page needs every case and the fault-free hours")
    how = RunOptions(out or BUILD / "monitor", workers, None, fresh)
    result = watched.run_all(hours, sample, seed, how, tell, progress_bar)
    if write:
        command = f"tools/zh campaign monitor --hours {hours:g} --write"
        watched.PAGE.write_text(watched.page_text(result, command), encoding="utf-8")
    if as_json:
        print(json.dumps(watched.as_dict(result), indent=2))
    else:
        for name, group in watched.as_dict(result)["groups"].items():
            print(f"{name}: {group}")
        print(f"nothing broken: {result.quiet}")
    raise typer.Exit(0 if result.good else 1)
