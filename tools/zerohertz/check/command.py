"""`zh certify`: proves the stored gain tables, entry by entry, in exact arithmetic."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from zerohertz.check.certificate import Report, certify
from zerohertz.check.stored_table import StoredTable, read_stored_table
from zerohertz.console import progress_bar, short_paths, tell
from zerohertz.errors import UserError
from zerohertz.options import Json
from zerohertz.paths import BUILD, ROOT

# What a folder may be besides a motor's: it -> the motor folder, or None. The check shares no code
# with the design, so the room of configurations adds its own here.
other_folders: list[Callable[[Path], Path | None]] = []


def register(app: typer.Typer) -> None:
    app.command("certify")(certify_tables)


def certify_tables(
    motor_dirs: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="MOTOR_DIR", help="Motor folders; default: every one in gain_tables."
        ),
    ] = None,
    as_json: Json = False,
    plot: Annotated[
        bool,
        typer.Option("--plot", help="Also draw root loci (Fig. 4) and gamma, in build/certify."),
    ] = False,
) -> None:
    """Prove every entry of the stored gain tables in exact rational arithmetic.

    Checks the LMIs (14)-(16) at both speed errors, the Euler disc |1 + T s| < 1, the CRC, and that
    the table belongs to motor.toml. Negative speed follows by conjugation and is not checked
    separately.

    The verdict holds at the speeds of the entries. The report also counts the entries that are
    proven for all speeds up to half a step off, with a gamma 1 % larger. Exit 1 unless every entry
    is proven, whatever the method; the report says which inequalities hold. In a gamma_pr table, a
    gamma of 1 or more bounds nothing and counts as not proven. The orientation error then has no
    bound: "any", or null in the JSON.
    """
    # What was found is the answer; with --json that is the object alone.
    answer = Console(stderr=as_json)
    reports = []
    for given in motor_dirs or _default_motor_dirs():
        folder = _folder(given)
        reports.append(_certified(read_stored_table(folder)))
        _say(reports[-1], answer)
        if plot:
            _draw(folder, reports[-1].name)
    if as_json:
        print(json.dumps({"motors": {report.name: _as_json(report) for report in reports}}))
    failed = [report for report in reports if not report.passed]
    for report in failed:
        tell(f"error: {report.name}: {_why(report)}")
    if failed:
        raise typer.Exit(1)


def _folder(given: Path) -> Path:
    """Of a motor; it may be named by its motor.toml."""
    for resolve in other_folders:
        if (found := resolve(given)) is not None:
            return found
    folder = given.parent if given.name == "motor.toml" else given
    if given.exists() and not folder.is_dir():
        raise UserError(f"{given}: is not a motor folder; name the one with l_gain.json")
    return folder


def _why(report: Report) -> str:
    if report.proven != report.entries:
        return f"only {report.proven} of {report.entries} entries are proven"
    return report.faults[0]


def _default_motor_dirs() -> list[Path]:
    return sorted(path.parent for path in (ROOT / "gain_tables").glob("*/motor.toml"))


def _certified(table: StoredTable) -> Report:
    with progress_bar(f"{table.name}: proving", len(table.gain)) as progress:
        return certify(table, progress)


def _say(report: Report, console: Console) -> None:
    lines = [
        f"{report.name} ({report.method}): {'passed' if report.passed else 'FAILED'}, "
        f"{report.proven} of {report.entries} entries proven at their speed, one X for all "
        f"inequalities; {report.intervals} up to half a step off it, gamma 1 % larger",
        f"  largest gamma {_number(report.max_gamma, '.4g')}, field-orientation error up to "
        f"{_number(report.max_angle_deg, '.1f', ' deg')}",
        f"  largest |1 + T s| {report.max_euler_radius:.6f}, adaptation gain negative at most over "
        f"{report.max_negative_gain_band_rad_s:.3g} rad/s of stator frequency",
    ]
    if report.without_bound:
        lines.append(
            f"  warning: gamma is 1 or more for {report.without_bound} entries: that gives no "
            "bound of the field orientation"
        )
    if report.proven != report.entries:
        held = ", ".join(f"{name} {count}" for name, count in report.holds.items())
        lines.append(f"  entries for which each holds: {held}")
    lines += [f"  {text}" for text in (*report.faults, *report.failures)]
    for line in lines:
        console.print(line, highlight=False, soft_wrap=True, markup=False)


def _number(value: float | None, form: str, unit: str = "") -> str:
    return "any" if value is None else format(value, form) + unit


def _as_json(report: Report) -> dict[str, Any]:
    return {
        "entries": report.entries,
        "proven": report.proven,
        "intervals_proven": report.intervals,
        "without_bound": report.without_bound,
        "max_gamma": report.max_gamma,
        "max_angle_deg": report.max_angle_deg,
        "max_euler_radius": report.max_euler_radius,
        "max_negative_gain_band_rad_s": report.max_negative_gain_band_rad_s,
        "method": report.method,
        "holds": report.holds,
        "passed": report.passed,
        "faults": list(report.faults),
        "failures": list(report.failures),
    }


def _draw(folder: Path, name: str) -> None:
    from zerohertz.check.plots import figure_4, figure_gamma  # matplotlib takes half a second

    for draw, kind in ((figure_4, "fig04"), (figure_gamma, "gamma")):
        path = BUILD / "certify" / f"{name}_{kind}.png"
        draw(folder / "l_gain.json", path)
        tell(f"  {short_paths(path)}")
