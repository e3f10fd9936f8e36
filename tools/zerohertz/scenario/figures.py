"""The result of `zh figures` as JSON, and the committed results in tools/docs."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from zerohertz import param_list
from zerohertz.paths import ROOT
from zerohertz.scenario.evaluate import Result, score, score_by_eye
from zerohertz.scenario.predicates import NOT_HELD_SHARE, NOT_HELD_TEXT
from zerohertz.scenario.setup import Setup, figure_scenario, scenario_file

DOCS = ROOT / "tools" / "docs"
COMPUTED_NOW = "computed now"
# A result has the one or the other number, by its protocol.
_TELLING = {"lost_s", "pre_error_rpm"}

Measured = Mapping[str, Any]

# Where the paper reports i_q* at 15 A with the shaft at standstill.
AT_LIMIT_IN_PAPER = ("8", "9")

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
    """What the worst seed's run is, and where it is unlike the instability that the paper shows."""
    said = _verdict(result.worst.measured)
    if result.key in AT_LIMIT_IN_PAPER and "standstill_limit_share" in result.worst.measured:
        return f"{said}; {_against_paper(result.worst.measured)}"
    return said


def _verdict(m: Measured) -> str:
    if "lost_s" in m:
        if m["lost_s"] is None:
            return "held to the end"
        where = "ramp" if m["lost_s"] < 40.0 else "dwell"
        return f"lost in the {where}, {m['lost_s']:.1f} s, {100 * m['lost_pu']:.0f} % T_N"
    if m["pre_error_rpm"] is None or m["pre_error_rpm"] > 60.0:
        return "does not reach 300"
    return _verdict_after_step(m)


def _verdict_after_step(m: Measured) -> str:
    """Of the step to standstill from 300 min^-1."""
    limit = _limit_text(m)
    if m["trip"]:
        # Free after the trip: its speed there is the load's and not the drive's.
        return f"trips ({m['trip']}) {m['trip_s']:.1f} s after the step{limit}"
    if m["hold_error_rpm"] is None:
        return f"ends early{limit}"
    if m["hold_error_rpm"] <= 60.0:
        w, i_q = m["ripple_w_rpm"], m["ripple_i_q_A"]
        bound = m["flux_bound_share"]
        held = f", estimate at its bounds {100 * bound:.0f} % of hold" if bound > 0.0 else ""
        # An estimate that jumps while the shaft happens to stand still holds nothing.
        if m["ripple_w_hat_rpm"] > 60.0:
            return f"shaft stands, estimate jumps, {m['ripple_w_hat_rpm']:.0f} min^-1 rms{held}"
        return f"holds zero, ripple {w:.2g} min^-1, {i_q:.2g} A{limit}{held}"
    sustained_rpm = m["sustained_error_rpm"] or 0.0
    done = "runs away, off" if sustained_rpm > 100.0 else "swings, off"
    return f"{done} by up to {m['hold_error_rpm']:.0f} min^-1{limit}"


def _limit_text(m: Measured) -> str:
    share = m["worst_second_limit_share"]
    return f", i_q* at its limit {100 * share:.0f} % of its worst second" if share else ""


def _against_paper(m: Measured) -> str:
    share = m["standstill_limit_share"] or 0.0
    if share > 0.5:
        return f"as in the paper, i_q* at its limit at standstill ({100 * share:.0f} % of hold)"
    return "the paper shows i_q* at its limit at standstill, ours " + (
        f"only for {100 * share:.0f} % of hold" if share >= 0.005 else "does not"
    )


def result_json(
    setup: Setup,
    results: Iterable[Result],
    sensitivity: Mapping[str, float] | None,
    source: str,
    acting: Iterable[Result] = (),
) -> dict[str, Any]:
    """The one JSON object of `zh figures --json`; `ours` is how each run went, in words.

    acting: the same with a guard that acts; what it makes of each run is a column of its own.
    """
    results = list(results)
    return {
        "config": setup.name,
        "score": score(results),
        **({"score_by_eye": score_by_eye(results)} if any(r.by_eye for r in results) else {}),
        "figures": {r.key: r.as_json() for r in results},
        "ours": {r.key: our_verdict(r) for r in results if r.worst.measured.keys() & _TELLING},
        "guard_acting": {
            r.key: {"match": r.match, "seeds_matched": r.seeds_matched, "ours": our_verdict(r)}
            for r in acting
            if r.worst.measured.keys() & _TELLING
        },
        "own_condition": f"{NOT_HELD_TEXT}: at most {100 * NOT_HELD_SHARE:g} % of hold, if STABLE",
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
    return stored["sensitivity"], stored["sensitivity_source"]


def inputs_sha256(setup: Setup) -> str:
    """Hash of what the result depends on, the code of firmware and plant left out."""
    params = param_list.defaults() | dict(setup.params)
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
    # What else there is to say about it, such as redrawn rigs, stays.
    note = content["sensitivity_source"].removeprefix(COMPUTED_NOW)
    named = f"committed result, {path.relative_to(ROOT)}"
    if content["sensitivity"] and not note.startswith(named):
        stored["sensitivity_source"] = named + note
    path.write_text(json.dumps(stored, indent=1) + "\n", encoding="utf-8")
    return path
