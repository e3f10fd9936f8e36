"""Where a rival beats ours, and who is best in each measure."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any

from zerohertz.arena.columns import COST, ROBUST, Found, Measure
from zerohertz.arena.entrant import OURS
from zerohertz.arena.scatter import WHILE_HELD, beyond_chance, same_runs, statistic

Part = Callable[[Mapping[str, Any]], Mapping[str, Any]]
WITH: Part = lambda each: each  # noqa: E731
BARE: Part = lambda each: each["bare"]  # noqa: E731
_HEAD = "| measure | ours | better |\n|---|---|---|\n"


def verdict(found: Found) -> str:
    """What beats ours: first beyond chance, then what another sample might turn round."""
    if OURS not in found:
        return "Ours did not take part."
    certain, scatter = beaten(found, True), beaten(found, False)
    if not certain and not scatter:
        return "No rival beats ours in any measure."
    parts = ["## Where a rival beats ours"]
    if certain:
        parts.append(_HEAD + "\n".join(certain))
    if scatter:
        parts.append(_SCATTER + "\n\n" + _HEAD + "\n".join(scatter))
    return "\n\n".join(parts)


_SCATTER = "Better by no more than chance, on the runs that both have (95 %):"


def beaten(found: Found, certain: bool) -> list[str]:
    """Each measure in which somebody is better than ours: a line of the page."""
    rivals = {name: each for name, each in found.items() if name != OURS}
    lines = []
    for text, part in (("", WITH), ("without helpers, ", BARE)):
        ours, theirs = part(found[OURS]), {n: part(each) for n, each in rivals.items()}
        for measure in (*ROBUST, *(COST if not text else ())):
            better = {}
            for name, each in theirs.items():
                pair = _pair(measure, each, ours)
                if (
                    measure.better(pair.theirs, pair.ours)
                    and _certain(measure, each, ours) == certain
                ):
                    better[name] = pair
            if better:
                lines.append(_line(measure, text, better))
    return lines


@dataclasses.dataclass(frozen=True)
class Pair:
    """A measure of a rival and of ours, and of how many runs alone; 0: of all there are."""

    theirs: float | None
    ours: float | None
    runs: int = 0


def _pair(measure: Measure, each: Mapping[str, Any], ours: Mapping[str, Any]) -> Pair:
    if not measure.runs:
        return Pair(measure.value(each), measure.value(ours))
    every = [part.get("envelope", {}).get("rows") for part in (each, ours)]
    tables = same_runs(every, measure.runs) if all(every) else []
    if not tables:
        return Pair(None, None)
    if measure.runs not in WHILE_HELD:
        return Pair(measure.value(each), measure.value(ours))
    values = [100.0 * statistic(table, measure.runs) for table in tables]
    return Pair(*values, len(tables[0]["index"]))


def _certain(measure: Measure, better: Mapping[str, Any], ours: Mapping[str, Any]) -> bool:
    """A map's points and an instruction count are no sample."""
    if not measure.runs or "envelope" not in better or "envelope" not in ours:
        return True
    return beyond_chance(better["envelope"]["rows"], ours["envelope"]["rows"], measure.runs)


def _line(measure: Measure, text: str, better: Mapping[str, Pair]) -> str:
    def value(name: str) -> float:
        return better[name].theirs or 0.0

    names = sorted(better, key=value, reverse=measure.more_is_better)
    said = ", ".join(f"{name} {_said(measure, better[name])}" for name in names)
    ours = better[names[0]]
    shown = "beside each" if ours.runs else measure.shown(ours.ours)
    return f"| {text}{measure.name} | {shown} | {said} |"


def _said(measure: Measure, pair: Pair) -> str:
    alone = f" against {measure.shown(pair.ours)} in {pair.runs} runs" if pair.runs else ""
    return measure.shown(pair.theirs) + alone


def winners(found: Found) -> str:
    """Who is best in each measure."""
    rows = ["| measure | with helpers | without helpers |", "|---|---|---|"]
    for measure in (*ROBUST, *COST):
        cells = [_winner(measure, {n: part(e) for n, e in found.items()}) for part in (WITH, BARE)]
        rows.append(f"| {measure.name} | {' | '.join(cells)} |")
    return "\n".join(rows)


def _winner(measure: Measure, found: Found) -> str:
    values, runs = _values(measure, found)
    if not values:
        return "-"
    best = max(values.values()) if measure.more_is_better else min(values.values())
    names = [n for n, v in values.items() if v == best]
    who = ", ".join(names) if len(names) < len(values) or len(values) == 1 else "all"
    return f"{who} ({measure.shown(best)}{f', {runs} runs' if runs else ''})"


def _values(measure: Measure, found: Found) -> tuple[dict[str, float], int]:
    """By names; of how many runs that all of them held, 0 for what needs none."""
    if measure.runs not in WHILE_HELD:
        known = {n: v for n, each in found.items() if (v := measure.value(each)) is not None}
        return known, 0
    rows = {n: each["envelope"]["rows"] for n, each in found.items() if "envelope" in each}
    tables = same_runs(list(rows.values()), measure.runs) if rows else []
    if not tables:
        return {}, 0
    values = [100.0 * statistic(table, measure.runs) for table in tables]
    return dict(zip(rows, values, strict=True)), len(tables[0]["index"])
