"""`zh campaign monitor`: does the firmware notice what breaks, and only that?

Every fault of monitor_cases.py on the atlas' runner, then hours in which nothing is broken; the
result is one page.
"""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from typing import Any

from zerohertz.atlas.run import RunOptions, Tell, run_map
from zerohertz.atlas.simulate import make_bench
from zerohertz.campaign import monitor_cases as cases
from zerohertz.campaign import monitor_quiet, monitor_run
from zerohertz.campaign.rig import bit_names
from zerohertz.paths import ROOT
from zerohertz.scenario.setup import load_setup

PAGE = ROOT / "tools" / "docs" / "monitor.md"
CONFIG = "recommended"
Bar = Callable[[str, int], AbstractContextManager[Callable[[int], None]]]
Rows = list[dict[str, Any]]


@dataclasses.dataclass(frozen=True)
class Result:
    """Rows by group, and the summary of the quiet hours (None: not run)."""

    rows: dict[str, Rows]
    quiet: dict[str, Any] | None

    @property
    def good(self) -> bool:
        """Every case detected or harmless, no false alarm, the speed known."""
        failed = any(row["verdict"] == "FAILED" for rows in self.rows.values() for row in rows)
        return not failed and (self.quiet is None or monitor_quiet.good(self.quiet))


def run_all(hours: float, sample: int, seed: int, how: RunOptions, tell: Tell, bar: Bar) -> Result:
    """`sample` cases of each group, 0: all; `hours` without a fault, 0: none."""
    bench = make_bench(load_setup(CONFIG))
    rows = {}
    for name, every in cases.groups().items():
        chosen = sampled(every, sample, seed)
        with bar(name, len(chosen)) as progress:
            rows[name] = run_map(bench, chosen, how, tell, progress, monitor_run.run_cases)
    quiet = None
    if hours > 0.0:
        with bar("nothing broken, 1/100 h", round(100.0 * hours)) as progress:
            missions = monitor_quiet.run_all(
                hours, how.workers, lambda done_h: progress(round(100.0 * done_h))
            )
        quiet = monitor_quiet.summary(missions)
    return Result(rows, quiet)


def sampled(every: Sequence[cases.Case], count: int, seed: int) -> list[cases.Case]:
    """A seeded sample in the order of the whole; all of it for 0."""
    import numpy as np

    if count == 0 or count >= len(every):
        return list(every)
    chosen = np.random.default_rng(seed).choice(len(every), count, replace=False)
    return [every[k] for k in sorted(chosen.tolist())]


def summary(rows: Rows) -> dict[str, Any]:
    """Counts, delays and the worst current of some rows."""
    verdicts = Counter(row["verdict"] for row in rows)
    delays = sorted(row["delay_s"] for row in rows if row["verdict"] == "detected")
    bits = Counter(bit_names(row["bits"]) for row in rows if row["bits"])
    return {
        "cases": len(rows),
        **{name: verdicts[name] for name in ("detected", "harmless", "FAILED")},
        "taken_over": sum(row["said"] == "taken over" for row in rows),
        "median_ms": _ms(delays[len(delays) // 2]) if delays else None,
        "worst_ms": _ms(delays[-1]) if delays else None,
        "over_periods": max(row["over_periods"] for row in rows),
        "peak_A": round(max(row["peak_A"] for row in rows), 1),
        "bits": dict(bits.most_common()),
    }


def as_dict(result: Result) -> dict[str, Any]:
    groups = {name: summary(rows) for name, rows in result.rows.items()}
    return {"good": result.good, "groups": groups, "quiet": result.quiet}


def _ms(seconds: float) -> float:
    return round(1e3 * seconds, 1)


def _lines(rows: Rows) -> Iterator[str]:
    """A line per kind and signal, in the order of the rows."""
    for what, kind in dict.fromkeys((row["what"], row["kind"]) for row in rows):
        yield _line(what, kind, [r for r in rows if (r["what"], r["kind"]) == (what, kind)])


def _line(what: str, kind: str, rows: Rows) -> str:
    s = summary(rows)
    said = ", ".join(f"{name} {n}" for name, n in s["bits"].items())
    delay = "" if s["median_ms"] is None else f"{s['median_ms']:g} / {s['worst_ms']:g}"
    return (
        f"| {what} | {kind} | {s['detected']} | {s['harmless']} | {s['FAILED']} | {delay} | "
        f"{s['peak_A']:g} | {said} |"
    )


def _failures(rows: Rows) -> Iterator[str]:
    for row in rows:
        if row["verdict"] == "FAILED":
            yield (
                f"- {row['what']} {row['kind']} at {row['speed_rpm']:g} min^-1, "
                f"{row['load_pu']:+g}: said {row['said']} {bit_names(row['bits'])}, at the end "
                f"{row['end_rpm']:.0f} min^-1 off, {row['over_periods']} periods beyond "
                f"{monitor_run.OVER_A:g} A"
            )


def page_text(result: Result, command: str) -> str:
    """The committed result."""
    sensor = summary(result.rows["sensor"])
    severities = "\n".join(
        f"| {kind} {cases.SEVERITY[kind]:g} | {meaning} |" for kind, meaning in SEVERITY_IS.items()
    )
    points = ", ".join(f"{n:g}/{load:+g}" for n, load in cases.OPERATING_POINTS)
    head = "| what | kind | detected | harmless | FAILED | delay, ms: median / worst | peak, A |"
    tables = "\n\n".join(
        f"## {TITLES[name]}\n\n{head} said first |\n|---|---|---|---|---|---|---|---|\n"
        + "\n".join(_lines(rows))
        for name, rows in result.rows.items()
    )
    failures = "\n".join(line for rows in result.rows.values() for line in _failures(rows))
    return f"""\
# The monitor against injected faults

Made by `{command}`; `tools/zh test` runs a sample.

Configuration `{CONFIG}` with the brake resistor of the bench: the atlas' motor and shaft, a dc link
of 1 mF behind a rectifier, comparators that open the gates at 25 A inside 2 us. Each fault comes
two seconds after the load, at {len(cases.OPERATING_POINTS)} operating points. `peak` is the largest
true current of a leg, `said first` the bits of
the first period with a fault.

| operating points: min^-1 / share of rated torque |
|---|
| {points} |

| severity | is |
|---|---|
{severities}

- **detected**: a fault is latched, or the supervisor declared IMPRESSED and stays with it.
- **harmless**: nothing is declared and nothing is wrong: still running, speed within
  {monitor_run.END_RPM:g} min^-1 at the end and never off by {monitor_run.FAR_RPM:g} for longer than
  {1e3 * monitor_run.FAR_S:g} ms, current within its limit.
- **FAILED**: neither, or a leg current beyond {monitor_run.OVER_A:g} A for more than
  {monitor_run.OVER_PERIODS} periods.

Sensors: **{sensor["cases"]} cases, {sensor["detected"]} detected, {sensor["harmless"]} harmless,
{sensor["FAILED"]} failed**; the true current was beyond {monitor_run.OVER_A:g} A for at most
{sensor["over_periods"]} periods in a row, in the other groups for
{max(max(r["over_periods"] for r in rows) for rows in result.rows.values())}.

{tables}

## Failures

{failures or "None."}

## Nothing broken

{_quiet_text(result.quiet)}
"""


SEVERITY_IS = {
    "gain": "factor",
    "offset": "share of full scale",
    "delayed": "periods",
    "intermittent": "share of the samples that read zero",
}

TITLES = {
    "sensor": "Sensors",
    "open_phase": "Lost motor phase",
    "earth": "Leg to earth",
    "short": "Terminals u and v joined by 20 uH and 20 mohm",
    "collapse": "Supply of the dc link gone for good",
    cases.AT_START: "Two sensors exchanged before the first start (delay: from the gates on)",
    "exchanged": "Two sensors exchanged while running: a multiplexer out of step",
    "sag": "Supply at 50 % for a second: to be ridden through",
}


def _quiet_text(quiet: dict[str, Any] | None) -> str:
    if quiet is None:
        return "Not run."
    rows = {"all": quiet, **quiet["plants"]}
    table = "\n".join(_quiet_line(name, row) for name, row in rows.items())
    return f"""\
Random missions: speeds, loads, noise, errors of sensors and inverter, true Rs .5 to 1.5 of the
rig's. Every fault bit and warning of a mission that the drive holds is a false alarm. `unknown`:
share of the held time above {monitor_quiet.SPLIT_HZ:g} Hz in which it says that it does not know
its speed, at most {100.0 * monitor_quiet.UNKNOWN_SHARE:g} %. `swings`: false alarms before which
the true torque swung for {monitor_quiet.SWING_S:g} s by more than {monitor_quiet.SWING_NM:g} Nm
(standard deviation): the guard names what the law does. `not held`: missions that it does not
hold, and how many of them are told.

| inverter, voltage | missions held | hours | false alarms | swings | unknown, % | not held | told |
|---|---|---|---|---|---|---|---|
{table}"""


def _quiet_line(name: str, q: dict[str, Any]) -> str:
    bits = ", ".join(f"{bit_names(int(b, 16))} {n}" for b, n in q["false_bits"].items())
    said = f" ({bits})" if bits else ""
    unknown = 100.0 * (q["unknown_share"] or 0.0)
    return (
        f"| {name} | {q['held']} | {q['held_hours']:g} | {q['false_alarms']}{said} | "
        f"{q['of_a_swing']} | {unknown:.2g} | {q['missions'] - q['held']} | "
        f"{q['alarms_not_held']} |"
    )
