"""The stricter reading of PAPER_OUTCOMES.md: who looks at the paper's plot and at ours must agree.

On top of the predicate of each figure, with the same 2 % of margin and for every seed. Both scores
are reported; the first keeps its meaning.
"""

from __future__ import annotations

from collections.abc import Mapping

from zerohertz.scenario.predicates import (
    STABLE_FIGURES,
    STEP_FIGURES,
    TIGHT,
    Clause,
    Judgement,
    RampMeasures,
    StepMeasures,
    at_least,
    at_most,
    judge,
)

# i_q* at 15 A at the end, as the paper reports.
STUCK_FIGURES = (8, 9)
SANE_RPM: Mapping[int, float] = {11: 60.0}  # its estimate is biased in the paper too
SANE_OTHER_RPM = 30.0
REGAINED_S = 5.0
STUCK_SHARE = 0.5
AGREE_SHARE = 0.95
BEFORE_LOSS_RPM = 100.0


def judge_by_eye(figure: int, measures: Mapping[int, StepMeasures | RampMeasures]) -> Judgement:
    """The figure's own judgement and the clauses that an eye adds."""
    judgement = judge(figure, measures)
    seen = eye_clauses(figure, measures[figure], TIGHT)
    return Judgement((*judgement.clauses, *seen), judgement.measured)


def eye_clauses(figure: int, m: StepMeasures | RampMeasures, tight: float) -> tuple[Clause, ...]:
    if figure not in STEP_FIGURES:
        text = "|w_hat - w| one second before the loss"
        return (at_most(text, m.before_loss_rpm, BEFORE_LOSS_RPM, tight),)
    text = "rms of w_hat - w before the step"
    sane_rpm = SANE_RPM.get(figure, SANE_OTHER_RPM)
    sane = at_most(text, m.pre_estimate_rms_rpm, sane_rpm, tight)
    if figure in STABLE_FIGURES:
        agree = at_least("share of hold with |w_hat - w| <= 30", m.agree_share, AGREE_SHARE, tight)
        return (sane, agree)
    return (sane, *_not_regained(figure, m, tight))


def _not_regained(figure: int, m: StepMeasures, tight: float) -> tuple[Clause, ...]:
    if m.trip:  # nothing is held any more
        return ()
    text = "longest hold of zero in the last 10 s, s"
    found = (at_most(text, m.regained_s, REGAINED_S, tight),)
    if figure in STUCK_FIGURES:
        text = "share of the last 10 s with |i_q*| >= 12 A"
        found += (at_least(text, m.last_current_share, STUCK_SHARE, tight),)
    return found
