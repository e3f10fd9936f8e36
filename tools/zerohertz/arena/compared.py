"""Where a rival beats ours, and who is best in each measure."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from zerohertz.arena.columns import COST, ROBUST, Found, Measure
from zerohertz.arena.entrant import OURS
from zerohertz.arena.scatter import beyond_chance

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
            better = [
                name
                for name, each in theirs.items()
                if measure.better(measure.value(each), measure.value(ours))
                and _certain(measure, each, ours) == certain
            ]
            if better:
                lines.append(_line(measure, text, ours, {name: theirs[name] for name in better}))
    return lines


def _certain(measure: Measure, better: Mapping[str, Any], ours: Mapping[str, Any]) -> bool:
    """A map's points and an instruction count are no sample."""
    if not measure.runs:
        return True
    return beyond_chance(better["envelope"]["rows"], ours["envelope"]["rows"], measure.runs)


def _line(measure: Measure, text: str, ours: Mapping[str, Any], better: Found) -> str:
    values = {name: measure.value(each) or 0.0 for name, each in better.items()}
    names = sorted(values, key=lambda n: values[n], reverse=measure.more_is_better)
    said = ", ".join(f"{name} {measure.shown(values[name])}" for name in names)
    return f"| {text}{measure.name} | {measure.shown(measure.value(ours))} | {said} |"


def winners(found: Found) -> str:
    """Who is best in each measure."""
    rows = ["| measure | with helpers | without helpers |", "|---|---|---|"]
    for measure in (*ROBUST, *COST):
        cells = [_winner(measure, {n: part(e) for n, e in found.items()}) for part in (WITH, BARE)]
        rows.append(f"| {measure.name} | {' | '.join(cells)} |")
    return "\n".join(rows)


def _winner(measure: Measure, found: Found) -> str:
    values = {n: v for n, each in found.items() if (v := measure.value(each)) is not None}
    if not values:
        return "-"
    best = max(values.values()) if measure.more_is_better else min(values.values())
    names = [n for n, v in values.items() if v == best]
    who = ", ".join(names) if len(names) < len(values) or len(values) == 1 else "all"
    return f"{who} ({measure.shown(best)})"
