"""What a live change of a parameter costs the control period that takes it.

The same run twice, without and with a change in every round of the background, to the values that
are in force already: both runs agree in every bit, and two periods differ by the change alone.
"""

from __future__ import annotations

from zerohertz.build import build_image
from zerohertz.errors import UserError
from zerohertz.image import loop
from zerohertz.image.command import PRESETS, Experiment, job_of
from zerohertz.image.loop import End, Inject

CHANGES_MIN = 100


def worst_extra(experiment: Experiment, without: loop.PilRun) -> int:
    """Most instructions that a change adds to a period of `without`, a run of the experiment."""
    periods = len(without.each.instructions)
    ran = loop.run(
        job_of(experiment, periods),
        build_image(PRESETS[experiment.config]),
        inject=Inject.LIVE_CHANGE,
        inject_at=0,
    )
    if ran.end is not End.EQUAL:
        raise UserError(f"{experiment.name}: a live change alters the run: {ran.difference}")
    extra = ran.each.instructions - without.each.instructions
    changes = int((extra > 0).sum())
    if changes < CHANGES_MIN:
        raise UserError(f"{experiment.name}: only {changes} periods took a live change")
    return int(extra.max())
