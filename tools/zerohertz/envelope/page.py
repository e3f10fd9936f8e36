"""The page of the envelope: tools/docs/envelope.md."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Sequence

from zerohertz.envelope import campaign
from zerohertz.envelope.axes import AXES, NOT_DRAWN, TOLD_FACTOR
from zerohertz.envelope.campaign import MEASURES, Result, Row
from zerohertz.envelope.feasible import MARGIN
from zerohertz.paths import ROOT

PAGE = ROOT / "tools" / "docs" / "envelope.md"


def page_text(result: Result, command: str) -> str:
    """The committed result."""
    rows = result.possible
    return f"""\
# The envelope

Made by `{command}`. {len(result.rows)} runs; {len(result.impossible)} of them ask for more torque
or voltage than there is and count apart. Every run draws all axes at once. The firmware is that of
`recommended`; motors other than Table 1's have the drive that commissioning derives.

{table([("all", rows)])}

{len(result.impossible)} impossible runs: {impossible_harm(result)} undeclared harm.

## Numbers

{measures(rows)}

## What ended runs

{_faults(rows)}

## By axis

![The outcome of the runs, axis by axis](envelope.png)

A range is cut into {campaign.BINS} parts with equal numbers of runs.

{_axes(rows)}

## The {len(result.worst)} worst

`tools/zh envelope --seed {result.sample.seed} --only K` runs one again and keeps its trace.

{worst(result)}

## What is drawn

| axis | values | meaning |
|---|---|---|
{drawn()}

- `dead_time_told`: the firmware's value is the true one times {_told()}.
- Amperes are those of Table 1's motor (10.7 A rated, power invariant); other motors in proportion.
- A threshold or a capacitance too small for the plant's integration is raised to its minimum.
- A pulsating load swings the free shaft by 10 min^-1 at most (at 2 pole pairs); its run has no
  torque ripple.
{_not_drawn()}

## How it is judged

- **undeclared harm**: by the judge of [`zh campaign faults`](harm.md).
- **false trip**: a fault although the mission can be done: torque and voltage that it asks for stay
  below {MARGIN:.0%} of what motor, dc link and current limit give (`envelope/feasible.py`).
- **held**: gates on throughout; in each hold mean error below 30 min^-1, standard deviation below
  15, never off by 150 (at 2 pole pairs; in proportion for others).
- **oriented above 1 Hz**: share of the held time above 1 Hz in which the flux is within 25 degrees
  and 25 % of where the drive believes it.
- **ripple**: 95 % quantile of the runs' worst hold.
"""


def impossible_harm(result: Result) -> int:
    return sum(row["undeclared_harm"] for row in result.impossible)


def table(parts: Sequence[tuple[str, Sequence[Row]]]) -> str:
    """One line per part."""
    lines = [
        "| runs with | runs | undeclared harm | false trips | held | oriented above 1 Hz "
        "| ripple |",
        "|---|---|---|---|---|---|---|",
    ]
    for text, rows in parts:
        s = campaign.summary(rows)
        ripple = s["torque_ripple_p95_pu"]
        cells = (
            text,
            s["runs"],
            s["undeclared_harm"]["count"],
            s["false_trips"]["count"],
            f"{100.0 * s['held']['share']:.1f} %",
            f"{100.0 * s['oriented_above_1Hz']['share']:.1f} %",
            "" if ripple is None else f"{100.0 * ripple:.1f} %",
        )
        lines.append("| " + " | ".join(map(str, cells)) + " |")
    return "\n".join(lines)


def measures(rows: Sequence[Row]) -> str:
    lines = ["| quantity | median | 95 % | 99 % | worst |", "|---|---|---|---|---|"]
    for name, text in MEASURES.items():
        cells = ("" if q is None else f"{q:.3g}" for q in campaign.quantiles(rows, name))
        lines.append(f"| {text} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def _faults(rows: Sequence[Row]) -> str:
    found = campaign.as_counts(rows)
    return "\n".join(f"- {text}: {count}" for text, count in found) or "Nothing."


def _axes(rows: Sequence[Row]) -> str:
    titles = (textwrap.fill(f"**{axis.name}**: {axis.text}", 100) for axis in AXES)
    tables = (table(campaign.parts(axis, rows)) for axis in AXES)
    return "\n\n".join(f"{title}\n\n{part}" for title, part in zip(titles, tables, strict=True))


def worst(result: Result) -> str:
    lines = ["| run | verdict | harm | fault | held | ripple | motor | mission |", "|---" * 8 + "|"]
    lines += [f"| {' | '.join(_worst(row))} |" for row in result.worst]
    return "\n".join(lines)


def _worst(row: Row) -> Iterator[str]:
    yield str(row["index"])
    yield row["verdict"].replace("_", " ")
    yield row["harm"]
    yield row["fault"]
    yield "yes" if row["held"] else "no"
    ripple = row["torque_ripple_pu"]
    yield "" if ripple is None else f"{100.0 * ripple:.1f} %"
    yield row["motor"]
    yield row["mission"]


def drawn() -> str:
    return "\n".join(f"| {axis.name} | {axis.values} | {axis.text} |" for axis in AXES)


def _not_drawn() -> str:
    return textwrap.fill(f"- Not drawn: {'; '.join(NOT_DRAWN)}.", 100, subsequent_indent="  ")


def _told() -> str:
    return ", ".join(f"{factor:g} ({name})" for name, factor in TOLD_FACTOR.items())
