"""The page of the campaign: tools/docs/harm.md."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from typing import Any

from zerohertz.campaign.faults import excepted, judge
from zerohertz.campaign.faults.campaign import Result, Row, by_kind, summary
from zerohertz.campaign.faults.cases import cases
from zerohertz.campaign.faults.conditions import COVERING, covering, every_condition, names
from zerohertz.campaign.faults.kinds import every_kind
from zerohertz.campaign.rig import OVER_PU, bit_names
from zerohertz.paths import ROOT

PAGE = ROOT / "tools" / "docs" / "harm.md"
LISTED = 200  # undeclared cases on the page; --json has all of them
TITLES = {
    "single": "Every fault alone, at every condition",
    "pairs": f"Every two faults, at {COVERING} conditions",
    "triples": "Three faults at random",
}
_HEAD = (
    "| what | runs | harmless | declared before | declared after | undeclared | beyond the current "
    "| worst, A | fault to word, ms | harm to word, ms |\n|---|---|---|---|---|---|---|---|---|---|"
)


def page_text(result: Result, command: str) -> str:
    """The committed result."""
    total = summary(result.every)
    tables = "\n\n".join(
        f"## {TITLES[group]}\n\n{len(rows)} of {len(cases(group, 0, result.seed))} cases.\n\n"
        f"{_HEAD}\n" + "\n".join(_lines(rows))
        for group, rows in result.rows.items()
    )
    healthy = "\n".join(_healthy(result.healthy)) or "None."
    share = 100.0 * covering()[1]
    excepted_lines = "\n".join(_excepted(result))
    groups = "\n".join(grouped(result.of_the_fault)) or "None."
    listed = "\n".join(_cases(result.of_the_fault)) or "None."
    return f"""\
# Harm and whether it is declared

Made by `{command}`. {total["runs"]} runs: **{total["undeclared_harm"]} undeclared**,
{total["declared"]} declared, {total["harmless"]} harmless, {total["excepted"]} excepted. Of the
undeclared ones
{len(result.of_the_fault)} show a harm that the drive does not do at that condition by itself. A leg
was beyond the limit of the current in {total["over_current"]} runs, the worst with
{total["worst_A"]:g} A.

{how_to_read()}

{tables}

## Undeclared with nothing broken

The conditions of undeclared runs, again without a fault. Where the same harm is undeclared here,
the fault is not to blame; such runs are counted above and left out below.

{healthy}

## Undeclared, by fault and mode

{groups}

## Undeclared, case by case

{listed}

## Excepted

No observer of the words could tell these: the fault was there before the gates were ever on, and
the harm is by current alone. Beside it there may be another motor, inertia or load, a sag or loss
of the mains, and with the voltage from the duty a wrong line voltage. Everywhere else the kind
counts like any other.
[The list with its proofs](../zerohertz/campaign/faults/excepted.toml).

| fault | excepted here | worst of these, A | allowed by the proof, A |
|---|---|---|---|
{excepted_lines}

## Conditions of the pairs

{share:.0f} % of all pairs of two settings occur in these.

{names(covering()[0])}
"""


def how_to_read() -> str:
    """What the columns mean, with the judge's own numbers."""
    off = f"{judge.LIMIT_RPM:g} min^-1 away from what reference and torque limit allow"
    turns = "the shaft turned as fast against every reference of the last second"
    return f"""\
A run is one case: one to three faults, one condition. There are {len(every_kind()) - 1} faults and
{len(every_condition())} conditions. The configuration is the recommended one. The board has no
comparator; a rectifier feeds a dc link of 1 mF with a brake resistor. The plant's true current and
speed decide.

| harm | begins when |
|---|---|
| current | a leg was beyond {OVER_PU:g} x `i_trip_A` in {judge.OVER_PERIODS} periods in a row |
| overspeed | the shaft is beyond {judge.OVERSPEED_PU:g} x maximum speed |
| deviation | the shaft was {off} for {judge.DEVIATION_S:g} s |
| direction | {turns} for {judge.DIRECTION_S:g} s |

- **harmless**: no harm, and nothing declared.
- **declared before**: declared before any harm, or without one. A fault declares; for the speed so
  do `DERATED`, `REGENERATION` and "speed unknown".
- **declared after**: declared within {1e3 * judge.GRACE_S:g} ms after the harm began.
- **undeclared**: neither. **excepted**: neither, and proven to be beyond any observer of the words.
- Times are median / 95 % / worst. `fault to word` is the time from the first fault of a case to the
  declaration; a fault present from the start can only be found once the gates are on.
- With two or three faults a run counts in the row of each.
- One case again: `tools/zh campaign faults --case 'NAME'`."""


def _excepted(result: Result) -> Iterator[str]:
    for name, proven in excepted.every_proven().items():
        rows = [row for row in result.excepted if name in kind_names(row)]
        worst = f"{max(row['peak_A'] for row in rows):.1f}" if rows else ""
        allowed_A = proven.allowed_A(OVER_PU * result.i_trip_A)
        yield f"| {name} | {len(rows)} | {worst} | {allowed_A:.1f} |"


def kind_names(row: Row) -> list[str]:
    """Of the faults of a run."""
    return str(row["name"]).partition("@")[0].split("+")


def _lines(rows: Iterable[Row]) -> Iterator[str]:
    for what, some in by_kind(rows).items():
        s = summary(some)
        cells = (
            what,
            *(s[key] for key in ("runs", "harmless", "declared_before", "declared_after")),
            *(s[key] for key in ("undeclared_harm", "over_current", "worst_A")),
            _times(s["fault_to_word"]),
            _times(s["harm_to_word"]),
        )
        yield "| " + " | ".join(map(str, cells)) + " |"


def _times(found: dict[str, Any] | None) -> str:
    return "" if found is None else " / ".join(f"{ms:g}" for ms in found.values())


def grouped(rows: Iterable[Row]) -> Iterator[str]:
    """One line per set of faults and mode, the most frequent first."""
    every = list(rows)
    counts = Counter((row["kinds"], row["mode"]) for row in every)
    if counts:
        yield "| faults | mode | cases | harm | worst, A | worst, min^-1 off | speeds | loads |"
        yield "|---|---|---|---|---|---|---|---|"
    for (kinds, mode), _ in counts.most_common(LISTED):
        some = [row for row in every if (row["kinds"], row["mode"]) == (kinds, mode)]
        yield f"| {kinds} | {mode} | {' | '.join(_together(some))} |"


def _together(rows: list[Row]) -> Iterator[str]:
    """What rows of one fault and mode have in common."""
    harms = Counter(row["harm"] for row in rows).most_common()
    yield str(len(rows))
    yield ", ".join(f"{harm} {n}" for harm, n in harms)
    yield f"{max(row['peak_A'] for row in rows):.0f}"
    yield f"{max(row['off_rpm'] for row in rows):.0f}"
    yield " ".join(f"{rpm:g}" for rpm in sorted({row["speed_rpm"] for row in rows}))
    yield " ".join(sorted({row["load"] for row in rows}))


def _healthy(rows: Iterable[Row]) -> Iterator[str]:
    for row in rows:
        if row["verdict"] == judge.UNDECLARED:
            yield f"- `{row['name']}`: {row_text(row)}"


def _cases(rows: list[Row]) -> Iterator[str]:
    for row in rows[:LISTED]:
        yield f"- {row_text(row)}  \n  `{row['name']}`"
    if len(rows) > LISTED:
        yield f"- and {len(rows) - LISTED} more: `--json` names every one"


def row_text(row: Row) -> str:
    """One line about a run."""
    said = f"{bit_names(row['bits'])} after {row['word_ms']:g} ms" if row["bits"] else "no fault"
    harm = f"{row['harms']} at {row['harm_s']:.3f} s" if row["harms"] else "no harm"
    return (
        f"{row['verdict']}: {harm}, {said}, {row['peak_A']:.1f} A, {row['off_rpm']:.0f} min^-1 off"
    )
