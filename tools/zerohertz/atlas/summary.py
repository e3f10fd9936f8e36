"""Counts and shares of a map's rows."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from zerohertz.atlas.classes import Outcome

HELD = (Outcome.ORIENTED, Outcome.HELD)


def counts(rows: Sequence[dict[str, Any]]) -> dict[str, int]:
    """Points of each class. Oriented ones are held, too; held + takeover + safe_stop + unsafe are
    all; a silent point is in its class as well."""
    ended = [row["outcome"] for row in rows]
    found = {"points": len(rows), "oriented": ended.count(Outcome.ORIENTED)}
    found["held"] = sum(outcome in HELD for outcome in ended)
    for outcome in (Outcome.TAKEOVER, Outcome.SAFE_STOP, Outcome.UNSAFE):
        found[outcome.value] = ended.count(outcome)
    found["silent"] = sum(row["silent"] for row in rows)
    return found


def shares(rows: Sequence[dict[str, Any]]) -> dict[str, float | int | None]:
    """What the supervisor said, of the time with torque; CLOSED of held points above 1 Hz."""
    held = [row for row in rows if row["outcome"] in HELD]
    above_s = sum(row["above_1Hz_s"] for row in held)
    closed_s = sum(row["closed_above_1Hz_s"] for row in held)
    mean = {
        f"{name}_share": sum(row[f"{name}_share"] for row in rows) / max(len(rows), 1)
        for name in ("closed", "degraded", "impressed")
    }
    return mean | {
        "closed_share_held_above_1Hz": closed_s / above_s if above_s > 0.0 else None,
        "failed_starts": sum(not row["started"] for row in rows),
    }


def causes(rows: Sequence[dict[str, Any]]) -> dict[str, dict[str, float]]:
    """What stopped points, the most frequent first: how many, and when the first of them."""
    stopped = [row for row in rows if row["cause"]]
    found = Counter(row["cause"] for row in stopped)
    return {
        cause: {
            "count": count,
            "first_s": min(row["cause_s"] for row in stopped if row["cause"] == cause),
        }
        for cause, count in found.most_common()
    }


def causes_text(found: Mapping[str, Mapping[str, float]]) -> str:
    """As one line."""
    return ", ".join(
        f"{cause} {each['count']} (first at {each['first_s']:.3f} s)"
        for cause, each in found.items()
    )


def percent(count: int, rows: int) -> float:
    return 100.0 * count / max(rows, 1)
