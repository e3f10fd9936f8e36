"""Which parameters exclude each other: param_rules.def, in float32 as the firmware has it.

Python's standard library alone: the build checks with it what it puts into an image.
"""

from __future__ import annotations

import math
import operator
import re
from collections.abc import Mapping
from dataclasses import dataclass

from zerohertz.param_list import FOLDER, float32

RULES = FOLDER / "param_rules.def"
_RULE = re.compile(
    r"^PARAM_RULE\((\w+), (\w+), (\w+), ([-+.\de]+)f, (\w+), (\w+), (\d)u\)$", re.MULTILINE
)
NO_LIMIT = 1e30
_RELATIONS = {
    "AT_MOST": (operator.le, "at most"),
    "BELOW": (operator.lt, "below"),
    "AT_LEAST": (operator.ge, "at least"),
    "ABOVE": (operator.gt, "above"),
}


@dataclass(frozen=True)
class Rule:
    """One line of the list."""

    first: str
    relation: str
    limit: str
    factor: float
    second: str
    when: str
    least: int

    def limit_of(self, p: Mapping[str, float]) -> float:
        if self.limit == "LEAKAGE":
            return float32(math.sqrt(float32(p["Ls_H"] * p["Lr_H"])))
        if self.limit == "TRANSIENT":
            kr = float32(p["M_H"] / p["Lr_H"])
            leakage = float32(p["Ls_H"] - float32(kr * p["M_H"]))
            return float32(leakage / float32(p["Rs_ohm"] + float32(float32(kr * kr) * p["Rr_ohm"])))
        if self.limit == "STANDING":
            return float32(float32(self.factor * p["Rr_ohm"]) / p["Lr_H"])
        if self.limit == "NUMBER":
            return self.factor
        if self.limit == "INVERSE":
            return float32(self.factor / p[self.second])
        if self.limit in ("FLUX", "RESISTIVE"):
            scale = p["M_H"] if self.limit == "FLUX" else p["Rs_ohm"]
            return float32(float32(self.factor * scale) * p[self.second])
        if self.limit == "EMF":
            flux_Wb = float32(p["M_H"] * p["i_d_A"])
            most = float32(float32(self.factor * p[self.second]) / flux_Wb)
            return NO_LIMIT if p["weaken_share"] > 0.0 else most
        scale = 1.0 if self.limit == "PER_PERIOD" else p[self.second]
        scaled = float32(self.factor * scale)
        return scaled if self.limit == "SCALED" else float32(scaled / p["period_s"])

    def broken(self, p: Mapping[str, float]) -> bool:
        if not (p[self.when] > 0.0 and p[self.when] >= self.least):
            return False
        kept, _ = _RELATIONS[self.relation]
        return not kept(p[self.first], self.limit_of(p))

    def text(self, p: Mapping[str, float]) -> str:
        """What is wrong, and what is allowed."""
        _, word = _RELATIONS[self.relation]
        said = f"{self.first}: {p[self.first]:g} has to be {word} {self.limit_of(p):g}"
        return (
            said if self.second == self.first else f"{said} with {self.second} = {p[self.second]:g}"
        )

    @property
    def words(self) -> str:
        """The limit as a formula for a reader."""
        factor = "" if self.factor == 1.0 else f"{self.factor:.6g} "
        _, word = _RELATIONS[self.relation]
        return (
            f"{word} "
            + {
                "NUMBER": f"{self.factor:.6g}",
                "SCALED": f"{factor}`{self.second}`",
                "PER_PERIOD": f"{self.factor:.6g} / `period_s`",
                "RATE": f"{factor}`{self.second}` / `period_s`",
                "LEAKAGE": "sqrt(`Ls_H` `Lr_H`)",
                "INVERSE": f"{self.factor:.6g} / `{self.second}`",
                "FLUX": f"{factor}`M_H` `{self.second}`",
                "RESISTIVE": f"{factor}`Rs_ohm` `{self.second}`",
                "EMF": f"{factor}`{self.second}` / (`M_H` `i_d_A`) where `weaken_share` is 0",
                "STANDING": f"{factor}`Rr_ohm` / `Lr_H`",
                "TRANSIENT": "leakage inductance / (`Rs_ohm` + (`M_H`/`Lr_H`)^2 `Rr_ohm`)",
            }[self.limit]
        )


def rules() -> list[Rule]:
    """In the order in which the firmware looks at them."""
    return [
        Rule(*names, float32(float(factor)), second, when, int(least))
        for *names, factor, second, when, least in _RULE.findall(RULES.read_text(encoding="utf-8"))
    ]


def conflict(parameters: Mapping[str, float]) -> str:
    """The first rule that is broken, in words; '' for none."""
    return next((rule.text(parameters) for rule in rules() if rule.broken(parameters)), "")
