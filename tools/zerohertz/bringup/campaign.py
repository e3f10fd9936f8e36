"""`zh campaign bringup`: healthy benches pass, and each seeded wiring fault is named."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from zerohertz.bringup import procedure
from zerohertz.bringup.person import Simulated
from zerohertz.bringup.rig import bench_of
from zerohertz.bringup.seeds import Place, Seed, faulty_places, healthy_places, seeds_of
from zerohertz.errors import UserError
from zerohertz.paths import ROOT

PAGE = ROOT / "tools" / "docs" / "bringup.md"
BEGIN, END = "<!-- made by zh campaign bringup -->", "<!-- end -->"


@dataclass(frozen=True)
class Row:
    """One bring-up. seed '': nothing is wrong."""

    place: str
    seed: str
    step: int  # the last one
    named: str
    good: bool


def bring_up(place: Place, seed: Seed | None, number: int) -> Row:
    """On the simulated bench; number: of the noise. A model that does not run ends it."""
    faults = dict(seed.faults) if seed else {}
    changes = place.changes(seed) if seed else {}
    firmware = {} if place.has_lines else {"voltage_source": 1.0}
    firmware |= dict(seed.firmware) if seed else {}
    with bench_of(place.rig, place.board, number, faults, changes, firmware) as (bench, meter):
        state = procedure.of_drive(bench)
        try:
            procedure.go_on(bench, state, Simulated(meter), _quiet, _quiet)
        except UserError as error:
            return Row(
                place.name, seed.name if seed else "", len(state.steps) + 1, str(error), False
            )
    good = seed.named(state.findings) if seed else state.passed
    named = "; ".join(finding.name for finding in state.findings)
    return Row(place.name, seed.name if seed else "", len(state.steps), named, good)


def _quiet(_: object) -> None:
    pass


def run_all(number: int, show: Callable[[Row], None]) -> list[Row]:
    cases: list[tuple[Place, Seed | None]] = [(place, None) for place in healthy_places()]
    cases += [(place, seed) for place in faulty_places() for seed in seeds_of(place)]
    rows = []
    for place, seed in cases:
        rows.append(bring_up(place, seed, number))
        show(rows[-1])
    return rows


def page_part(rows: list[Row], number: int) -> str:
    """Both tables of the page."""
    healthy = [row for row in rows if not row.seed]
    faulty = [row for row in rows if row.seed]
    lines = [
        BEGIN,
        "",
        f"Made by `tools/zh campaign bringup --seed {number} --write`: {good_of(faulty)} seeded",
        f"faults are named, {good_of(healthy)} healthy benches pass.",
        "",
        "| healthy bench | all steps fit |",
        "|---|---|",
        *(f"| {row.place} | {row.named or 'yes'} |" for row in healthy),
        "",
    ]
    return "\n".join([*lines, *_fault_lines(faulty), "", END])


def good_of(rows: list[Row]) -> str:
    return f"{sum(row.good for row in rows)} of {len(rows)}"


def _fault_lines(faulty: list[Row]) -> list[str]:
    """A column per bench."""
    places = list(dict.fromkeys(row.place for row in faulty))
    lines = [
        f"| seeded fault | {' | '.join(f'named at step, {place}' for place in places)} |",
        "|---" * (1 + len(places)) + "|",
    ]
    for seed in dict.fromkeys(row.seed for row in faulty):
        cells = [_cell(faulty, seed, place) for place in places]
        lines.append(f"| {seed} | {' | '.join(cells)} |")
    return lines


def _cell(rows: list[Row], seed: str, place: str) -> str:
    for row in rows:
        if (row.seed, row.place) == (seed, place):
            return f"{row.step}: {row.named}" if row.good else f"**NO**, {row.step}: {row.named}"
    return "no such sensor"


def write_page(rows: list[Row], number: int) -> None:
    text = PAGE.read_text(encoding="utf-8")
    before, rest = text.split(BEGIN, 1)
    PAGE.write_text(before + page_part(rows, number) + rest.split(END, 1)[1], encoding="utf-8")
