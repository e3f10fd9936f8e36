"""The page of the campaign: tools/docs/flips.md."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from zerohertz.campaign.faults import judge
from zerohertz.campaign.flips.campaign import Asked, Result, Row, by_owner, summary
from zerohertz.campaign.flips.layout import leaves
from zerohertz.campaign.flips.modes import MODES, PLAIN
from zerohertz.campaign.flips.run import UNDECLARED
from zerohertz.campaign.rig import bit_names
from zerohertz.paths import ROOT

PAGE = ROOT / "tools" / "docs" / "flips.md"
_COLUMNS = (
    *("runs", "harmless", "healed", "declared", "stopped_without_reason"),
    *("undeclared_harm", "protections_lost", "exceptions", "hangs"),
)
_HEAD = (
    "| mode | runs | harmless | healed | declared | stopped without a reason | undeclared harm "
    "| protections lost | of the declared: exceptions | hangs |\n" + "|---" * 10 + "|"
)


def command_of(asked: Asked, name: str = "flips", every: Iterable[str] = MODES) -> str:
    """What makes the page of a campaign whose modes are `every`."""
    runs = f" --runs {asked.runs} --seed {asked.seed}" if asked.runs else ""
    modes = "" if asked.modes == tuple(every) else "".join(f" --mode {m}" for m in asked.modes)
    return f"tools/zh campaign {name}{runs}{modes} --write"


def made_by(command: str, total: Mapping[str, Any]) -> str:
    """The paragraph that a page begins with; total: of summary()."""
    return f"""\
Made by `{command}`. {total["runs"]} runs: **{total["undeclared_harm"]} with undeclared harm**,
**{total["protections_lost"]} with a protection silently lost**; {total["declared"]} declared,
{total["stopped_without_reason"]} stopped without a reason."""


def page_text(result: Result, command: str) -> str:
    """The committed result."""
    total = summary(result.every)
    groups = "\n".join(grouped(result.bad)) or "None."
    return f"""\
# A flipped bit of a drive's RAM

{made_by(command, total)}

{how_to_read()}

{table(result)}

Plain faults that went unanswered: {_counts(Counter(total["lost"])) or "none"}.
In {total["lost_in_i_f"]} of these runs the flip had made the drive leave its estimate for I-f
operation, which does not look for every one of them.

## By the C object, the worst first

{groups}
"""


def how_to_read() -> str:
    """What the columns mean."""
    bits = sum(8 * leaf.size for leaf in leaves())
    modes = "\n".join(f"| `{mode.name}` | `{mode.condition}` |" for mode in MODES.values())
    return f"""\
A run is one flip: one bit of one member of `unit_t` (firmware/unit/unit.h: {bits} bits as the host
lays them out), in one mode, at a random moment. Rig, judge and harms are those of `zh campaign
faults` (harm.md). The host link is silent meanwhile, and nothing is traced. Without `--runs` every
bit is flipped in every mode.

| mode | condition of `zh campaign faults` |
|---|---|
{modes}

`start` flips between run command and RUN; `ready` flips before the run command, then starts.

- **harmless**: duties, gates and fault bits are those of the run without a flip.
- **healed**: they differ, without harm.
- **declared**: a fault before the harm or within {1e3 * judge.GRACE_S:g} ms, or without harm. A
  memory access that the host refuses (exception) and an endless loop (hang) count here: on a board
  the fault handler or the watchdog opens the gates.
- **stopped without a reason**: the gates go off without a fault.
- **undeclared harm**: harm that nothing declares; `gates`: on in two successive periods before the
  run command.
- **protections lost**: in a run of its own each plain fault follows the flip by 60 ms or more:
  {", ".join(PLAIN)}.
  It counts as lost when the drive trips on it without the flip, and with the flip neither trips
  nor stops within twice the time and {1e3 * judge.GRACE_S:g} ms.
- One case again: `tools/zh campaign flips --case 'NAME'`."""


def table(result: Result) -> str:
    """A line per mode."""
    lines = [_line(mode, rows) for mode, rows in result.rows.items()]
    return "\n".join((_HEAD, *lines, _line("all", result.every)))


def _line(name: str, rows: Iterable[Row]) -> str:
    found = summary(rows)
    return "| " + " | ".join((name, *(str(found[key]) for key in _COLUMNS))) + " |"


def grouped(rows: Iterable[Row]) -> Iterator[str]:
    """One line per C object."""
    groups = by_owner(rows)
    if groups:
        yield "| object | harm | lost | harms | plain faults | worst, A | min^-1 off | e.g. |"
        yield "|---" * 8 + "|"
    for owner, some in groups:
        harms = Counter(harm for row in some for harm in row["harms"].split())
        lost = Counter(plain for row in some for plain in row["lost"].split())
        cells = (
            f"`{owner}`",
            str(sum(row["class"] == UNDECLARED for row in some)),
            str(sum(bool(row["lost"]) for row in some)),
            _counts(harms),
            _counts(lost),
            f"{max(row['peak_A'] for row in some):.0f}",
            f"{max(row['off_rpm'] for row in some):.0f}",
            f"`{some[0]['name']}`",
        )
        yield "| " + " | ".join(cells) + " |"


def _counts(found: Counter[str]) -> str:
    return ", ".join(f"{name} {n}" for name, n in found.most_common())


def row_text(row: Row) -> str:
    """One line about a run."""
    said = bit_names(row["bits"]) or row["died"] or "no fault"
    harm = f" ({row['harms']})" if row["harms"] else ""
    lost = f", lost: {row['lost']}" if row["lost"] else ""
    return (
        f"{row['class']}{harm}: {said}, {row['peak_A']:.1f} A, "
        f"{row['off_rpm']:.0f} min^-1 off{lost}"
    )
