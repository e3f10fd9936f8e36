"""The result of `zh figures` as JSON, and the committed results in tools/docs."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from zerohertz.paths import ROOT
from zerohertz.scenario.evaluate import Result, score
from zerohertz.scenario.setup import Setup, figure_scenario, parameter_defaults, scenario_file

DOCS = ROOT / "tools" / "docs"

# Figure -> experiment, what the paper shows.
PAPER: Mapping[int, tuple[str, str]] = {
    6: ("no load, L = 0", "stable, pulsating"),
    7: ("no load", "stable, quiet"),
    8: ("50 % load, L = 0", "unstable"),
    9: ("50 % load", "unstable"),
    10: ("50 % load, L = 0, eps1", "stable"),
    11: ("50 % load, eps1", "stable, biased estimate"),
    12: ("50 % load, eps1 near zero only", "stable, no bias"),
    13: ("50 % load, Rs/1.5, L = 0", "unstable"),
    14: ("50 % load, Rs/1.5, L = 0, eps1", "unstable"),
    15: ("50 % load, Rs/1.5", "unstable"),
    16: ("50 % load, Rs/1.5, eps1", "stable"),
    17: ("regenerating ramp", "lost in the ramp"),
    18: ("regenerating ramp, eps1", "lost in the dwell"),
}


def our_verdict(result: Result) -> str:
    """One or two words for what the worst seed's run is."""
    m = result.worst.measured
    if "lost_s" in m:
        if m["lost_s"] is None:
            return "held to the end"
        where = "ramp" if m["lost_s"] < 40.0 else "dwell"
        return f"lost in the {where}, {m['lost_s']:.1f} s, {100 * m['lost_pu']:.0f} % T_N"
    if m["pre_error_rpm"] is None or m["pre_error_rpm"] > 60.0:
        return "does not reach 300"
    if m["faulted"]:
        return "trips"
    if m["hold_error_rpm"] is not None and m["hold_error_rpm"] <= 60.0:
        w, i_q = m["ripple_w_rpm"], m["ripple_i_q_A"]
        return f"holds zero, ripple {w:.2g} min^-1, {i_q:.2g} A"
    return "runs away"


def result_json(
    setup: Setup, results: Iterable[Result], sensitivity: Mapping[str, float] | None, source: str
) -> dict[str, Any]:
    """The one JSON object of `zh figures --json`."""
    results = list(results)
    return {
        "config": setup.name,
        "score": score(results),
        "figures": {r.key: r.as_json() for r in results},
        "sensitivity": dict(sensitivity) if sensitivity else None,
        "sensitivity_source": source,
    }


def committed_path(setup: Setup) -> Path:
    return DOCS / f"figures_{setup.name}.json"


def committed_sensitivity(setup: Setup) -> tuple[dict[str, float] | None, str]:
    """Sensitivity of the committed result, when that is of this very rig and tuning."""
    path = committed_path(setup)
    if not path.exists():
        return None, "never computed; --sensitivity does"
    stored = json.loads(path.read_text(encoding="utf-8"))
    if not stored.get("sensitivity"):
        return None, "never computed; --sensitivity does"
    if stored.get("inputs_sha256") != inputs_sha256(setup):
        return None, "the committed one is of another rig or tuning; --sensitivity computes it"
    return stored["sensitivity"], f"committed result, {path.relative_to(ROOT)}"


def inputs_sha256(setup: Setup) -> str:
    """Hash of what the result depends on, the code of firmware and plant left out."""
    params = parameter_defaults() | dict(setup.params)
    digest = hashlib.sha256(json.dumps(params, sort_keys=True).encode())
    scenarios = [scenario_file(figure_scenario(n)) for n in PAPER]
    motor = [setup.motor_dir / name for name in ("motor.toml", "l_gain.json")]
    for path in (setup.rig, setup.board, *motor, *scenarios):
        digest.update(path.read_bytes())
    return digest.hexdigest()


def write_committed(setup: Setup, content: Mapping[str, Any]) -> Path:
    """Stores a result beside its inputs' hash."""
    path = committed_path(setup)
    path.parent.mkdir(parents=True, exist_ok=True)
    stored = dict(content) | {"inputs_sha256": inputs_sha256(setup)}
    stored["sensitivity_source"] = "committed result, " + str(path.relative_to(ROOT))
    path.write_text(json.dumps(stored, indent=1) + "\n", encoding="utf-8")
    return path
