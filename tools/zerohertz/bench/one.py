"""One scenario on one image, within seconds: for work on the length of the control period."""

from __future__ import annotations

from rich.console import Console
from rich.table import Table

from zerohertz.image import cycles, interrupt
from zerohertz.image.interrupt import Interrupt


def show(found: Interrupt, rows: int) -> None:
    """For a terminal."""
    console = Console(highlight=False, soft_wrap=True)
    load = interrupt.load_of(
        found.mean, found.worst + found.live_change, found.cycles_per_instruction
    )
    console.print(
        f"{found.scenario} {found.config}: mean {found.mean} instructions, worst {found.worst} "
        f"(period {found.worst_period}, {found.worst_state}), live change +{found.live_change}, "
        f"trace +{found.trace}"
    )
    console.print(
        f"estimate: {found.cycles_per_instruction} cycles per instruction ({cycles.MODEL_NAME}), "
        f"{load.cycles_mean} mean = {load.load_mean_percent} % at 168 MHz, "
        f"{load.cycles_worst} worst with a live change"
    )
    text = "  ".join(f"{s.slot}: {s.mean:.0f}/{s.worst}" for s in found.slots)
    console.print(f"slots, mean/worst in RUN: {text}")
    console.print(_functions(found, rows))


def _functions(found: Interrupt, rows: int) -> Table:
    """The first rows, and what the others have together."""
    title = f"functions, periods {found.first} to {found.last}"
    table = Table(title=title, title_justify="left")
    for column in ("function", "file"):
        table.add_column(column, no_wrap=True)
    for column in ("instructions", "cycles"):
        table.add_column(column, justify="right")
    for row in found.functions[:rows]:
        table.add_row(row.function, row.file, f"{row.instructions:.1f}", f"{row.cycles:.1f}")
    table.add_section()
    for name, some in (("others", found.functions[rows:]), ("all", found.functions)):
        instructions = sum(row.instructions for row in some)
        used = sum(row.cycles for row in some)
        table.add_row(name, str(len(some)), f"{instructions:.1f}", f"{used:.1f}")
    return table
