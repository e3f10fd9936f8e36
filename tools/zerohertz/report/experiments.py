"""The paper's thirteen experiments in words: what is set, what the paper shows, what ours did."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

Number = float | bool | None
RUNAWAY_RPM = 3000.0  # beyond it a run is a trip


@dataclasses.dataclass(frozen=True)
class Experiment:
    """One figure of the paper."""

    figure: int
    L: str
    eps1: str
    load: str
    observer_Rs: str
    paper: str  # what its figure shows


@dataclasses.dataclass(frozen=True)
class Group:
    """Figures that are to be compared with one another."""

    title: str
    text: str
    figures: tuple[int, ...]


EXPERIMENTS: Mapping[int, Experiment] = {
    e.figure: e
    for e in (
        Experiment(6, "0", "off", "none", "nominal", "holds 0 min⁻¹, but speed and i_q pulsate"),
        Experiment(7, "designed", "off", "none", "nominal", "holds 0 min⁻¹ almost without ripple"),
        Experiment(8, "0", "off", "50 %", "nominal", "unstable, i_q at its 15 A limit"),
        Experiment(9, "designed", "off", "50 %", "nominal", "unstable, i_q at its 15 A limit"),
        Experiment(10, "0", "on", "50 %", "nominal", "stable"),
        Experiment(
            11, "designed", "on", "50 %", "nominal", "stable, less i_q ripple; ω̂ off at 300 min⁻¹"
        ),
        Experiment(
            12, "designed", "near 0 Hz", "50 %", "nominal", "stable, and ω̂ right at 300 min⁻¹"
        ),
        Experiment(13, "0", "off", "50 %", "÷ 1.5", "unstable"),
        Experiment(14, "0", "on", "50 %", "÷ 1.5", "unstable"),
        Experiment(15, "designed", "off", "50 %", "÷ 1.5", "unstable"),
        Experiment(16, "designed", "on", "50 %", "÷ 1.5", "stable"),
        Experiment(
            17, "designed", "off", "−100 % ramp", "nominal", "lost before rated load and 0 Hz"
        ),
        Experiment(
            18,
            "designed",
            "on",
            "−100 % ramp",
            "nominal",
            "held to rated load, about 0 Hz; lost when it stays there",
        ),
    )
}

GROUPS = (
    Group(
        "The observer gain, no load",
        "The speed command steps from 300 to 0 min⁻¹. With L = 0 the paper's drive pulsates at "
        "standstill; with the designed gain it is quiet.",
        (6, 7),
    ),
    Group(
        "50 % load: the gain alone is not enough",
        "The same step against half the rated torque. In the paper i_q runs into its limit and "
        "the shaft does not follow, with and without the designed gain.",
        (8, 9),
    ),
    Group(
        "The ε₁-modification",
        "A leak of the speed estimate, eq. (19), makes standstill under load stable. It costs a "
        "steady error at 300 min⁻¹ (Fig. 11), which goes when the leak acts near 0 Hz only "
        "(Fig. 12).",
        (10, 11, 12),
    ),
    Group(
        "The observer's stator resistance is too low",
        "The observer is given the nominal resistance divided by 1.5. In the paper only L and "
        "the ε₁-modification together hold the drive.",
        (13, 14, 15, 16),
    ),
    Group(
        "Regeneration down to 0 Hz",
        "60 min⁻¹ while the load pushes ever harder, rated torque after 40 s: slip and speed "
        "cancel, the stator frequency goes to zero and nothing turns that could be observed.",
        (17, 18),
    ),
)

SITUATIONS = {
    "no_load": "no load, 300 → 0 min⁻¹",
    "load_50": "50 % load, 300 → 0 min⁻¹",
    "load_50_rs_1.5": "50 % load, 300 → 0 min⁻¹, observer Rs ÷ 1.5",
    "regen_ramp": "60 min⁻¹, load 0 → −100 % in 40 s, then 40 s dwell",
}


def observed(measured: Mapping[str, Number]) -> str:
    """What a run did, in the words and units of the table."""
    return _ramp_observed(measured) if "lost_pu" in measured else _step_observed(measured)


def _ramp_observed(m: Mapping[str, Number]) -> str:
    end = f"{m['f_s_end_Hz']:+.2f} Hz at the end of the ramp".replace("-", "−")
    lost_s, lost_pu = m["lost_s"], m["lost_pu"]
    if lost_s is None or lost_pu is None:
        return f"held to the end; {end}"
    where = f"in the ramp at {100 * lost_pu:.0f} %" if lost_s < 40.0 else "in the dwell at 100 %"
    return f"lost after {lost_s:.1f} s, {where} load; {end}"


def _step_observed(m: Mapping[str, Number]) -> str:
    share = m["worst_second_limit_share"]
    limit = f"; i_q* at its limit for {100 * share:.0f} % of a second" if share else ""
    if _number(m["pre_error_rpm"]) > 60.0:
        return "does not reach 300 min⁻¹"
    if m["faulted"]:
        return f"trips ({m['trip']}){limit}"
    if _number(m["peak_speed_rpm"]) > RUNAWAY_RPM:
        return f"runs away beyond {RUNAWAY_RPM:.0f} min⁻¹{limit}"
    if m["trip"]:
        return f"trips ({m['trip']}){limit}"
    if m["sustained_error_rpm"] > 100.0:
        return f"loses the speed, off by {m['sustained_error_rpm']:.0f} min⁻¹ for 0.5 s{limit}"
    return (
        f"stays within {m['hold_error_rpm']:.0f} min⁻¹; ripple ω {m['ripple_w_rpm']:.1f}, "
        f"ω̂ {m['ripple_w_hat_rpm']:.1f} min⁻¹, i_q {m['ripple_i_q_A']:.2f} A; "
        f"ω̂ off by {m['pre_estimate_error_rpm']:.1f} min⁻¹ at 300{limit}"
    )


def _number(value: Number) -> float:
    """A number that is missing was not finite."""
    return float("inf") if value is None else float(value)
