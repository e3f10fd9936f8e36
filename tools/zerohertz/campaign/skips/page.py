"""The page of the campaign: tools/docs/skips.md."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from zerohertz.campaign.flips import page as flips
from zerohertz.campaign.flips.campaign import Asked, Result, Row, summary
from zerohertz.campaign.skips.cases import ANSWER_S, PLAIN, SKIPS
from zerohertz.paths import ROOT

PAGE = ROOT / "tools" / "docs" / "skips.md"


def command_of(asked: Asked) -> str:
    return flips.command_of(asked, "skips", SKIPS)


def page_text(result: Result, command: str) -> str:
    """The committed result."""
    total = summary(result.every)
    groups = "\n".join(flips.grouped(result.bad)) or "None."
    return f"""\
# A skipped instruction

{flips.made_by(command, total)}

{how_to_read(total)}

{flips.table(result)}

## By function, the worst first

{groups}
"""


def how_to_read(total: Mapping[str, Any]) -> str:
    """What the columns mean."""
    modes = "\n".join(f"| `{skip.name}` | `{skip.mode.condition}` |" for skip in SKIPS.values())
    return f"""\
A run skips one instruction of the control interrupt in one control period, on the emulated core.
The image puts a no-operation there and removes it again (hal/qemu_mps2/inject.c). The image drives
the plant. Without `--runs` the campaign skips every instruction that one period of each mode
executes: one phase of the schedule of 16 periods. Rig, judge and classes are those of
`zh campaign flips` (flips.md).

| mode | condition of `zh campaign faults` |
|---|---|
{modes}

- `+fault`: the word of `i_u` goes to the end of its range in the period before or in the period
  itself (`{PLAIN}`); the instruction is skipped in the period in which the drive trips. The
  drive still has to trip within {1e3 * ANSWER_S:g} ms; a run that does not is a protection lost.
- `ready`: a skip before the run command; then the drive starts.
- The image ended by itself (fault handler, watchdog): declared, counted as an exception as well.
  {total["lock_ups"]} runs ended in a lock-up of the core. They count as declared, because on a
  board the watchdog ends it; the emulator cannot show what the motor does until then.
- One case again: `tools/zh campaign skips --case 'NAME'`."""


def row_text(row: Row) -> str:
    """One line about a run."""
    return f"{row['owner']}: {flips.row_text(row)}"
