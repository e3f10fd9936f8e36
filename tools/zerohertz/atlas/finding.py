"""What one case of a special test measured."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Any


@dataclasses.dataclass(frozen=True)
class Finding:
    """A case by name, how it ended, whether that meets the goal (None: only reported), numbers."""

    case: str
    verdict: str
    met: bool | None
    measured: Mapping[str, float | None]

    def as_json(self) -> dict[str, Any]:
        numbers = {name: _number(value) for name, value in self.measured.items()}
        return {"case": self.case, "verdict": str(self.verdict), "met": self.met, **numbers}


def _number(value: float | None) -> float | None:
    """JSON has no infinity and no NaN."""
    return None if value is None or not math.isfinite(value) else round(float(value), 4)
