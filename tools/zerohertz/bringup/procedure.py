"""One bring-up: step after step, each against its prediction, until one does not fit.

What was passed is kept in the report's JSON. A later run goes on behind it, as long as the drive
has the same firmware and the same parameters; else it starts anew.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from zerohertz.bringup.bench import Bench, fault_text
from zerohertz.bringup.flight import recorded
from zerohertz.bringup.measure import Numbers, bench_limits
from zerohertz.bringup.model import model_of
from zerohertz.bringup.person import Person
from zerohertz.bringup.steps import STEPS, Step
from zerohertz.bringup.wiring import Finding
from zerohertz.commission.board_run import borrowed
from zerohertz.errors import UserError

FORMAT = 1
Say = Callable[[str], None]


@dataclass(frozen=True)
class Done:
    """A step that was made: what was measured, predicted, and found."""

    name: str
    found: Numbers
    predicted: Numbers
    findings: list[Finding]
    flight: str = ""

    @property
    def passed(self) -> bool:
        return not self.findings


@dataclass
class BringUp:
    """Of one drive, as far as it has come."""

    identity: str
    parameters: Numbers
    steps: dict[str, Done] = field(default_factory=dict)

    @property
    def passed(self) -> bool:
        return len(self.steps) == len(STEPS) and all(d.passed for d in self.steps.values())

    @property
    def findings(self) -> list[Finding]:
        return [finding for done in self.steps.values() for finding in done.findings]

    @property
    def stamp(self) -> str:
        """Of firmware and parameters: what a step was passed with."""
        text = json.dumps([self.identity, self.parameters], sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:16]

    def as_json(self) -> dict[str, Any]:
        return {
            "format": FORMAT,
            "passed": self.passed,
            "identity": self.identity,
            "stamp": self.stamp,
            "steps": [asdict(done) for done in self.steps.values()],
            "parameters": self.parameters,
        }


def of_drive(bench: Bench) -> BringUp:
    """Nothing done yet."""
    values = bench.drive.get(list(bench.drive.parameters))
    return BringUp(bench.drive.identity.text, values)


def resumed(fresh: BringUp, path: Path, say: Say) -> BringUp:
    """With the steps of the file that were passed on this drive as it is."""
    if not path.exists():
        return fresh
    try:
        kept = json.loads(path.read_text(encoding="utf-8"))
        if kept["format"] != FORMAT or kept["stamp"] != fresh.stamp:
            say("firmware or parameters have changed since the last run: from the first step on")
            return fresh
        for step in kept["steps"]:
            findings = [Finding(**finding) for finding in step["findings"]]
            done = Done(**step | {"findings": findings})
            if not done.passed:
                break
            fresh.steps[done.name] = done
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise UserError(f"{path}: is no report of a bring-up ({error}); delete it") from None
    return fresh


def go_on(
    bench: Bench,
    state: BringUp,
    person: Person,
    say: Say,
    keep: Callable[[BringUp], None],
    steps: Sequence[Step] = STEPS,
    flights: Path | None = None,
) -> None:
    """The steps that are left; ends behind the first that does not fit. keep: after each."""
    if "supply" in state.steps:
        bench.u_dc_V = state.steps["supply"].found["u_dc_V"]
    for number, step in enumerate(steps, 1):
        if step.name in state.steps:
            say(f"{number}. {step.title}: passed before")
            continue
        done = _make(bench, state, step, person, say, flights)
        state.steps[step.name] = done
        keep(state)
        for finding in done.findings:
            say(f"   DOES NOT FIT: {finding.name}: {finding.text}")
            say(f"   {finding.remedy}")
        if not done.passed:
            return
        say("   fits")


def _make(
    bench: Bench, state: BringUp, step: Step, person: Person, say: Say, flights: Path | None
) -> Done:
    number = STEPS.index(step) + 1
    say(f"{number}. {step.title}\n   connect: {step.connect}\n   the drive: {step.does}")
    person.ready(f"   step {number} of {len(STEPS)}")
    questions = {reading.name: reading for reading in step.readings}

    def meter(name: str) -> float:
        return person.read(step.name, questions[name], bench.keep_alive)

    if step.name == "supply":
        found = step.measure(bench, meter)
        bench.u_dc_V = found["u_dc_V"]
        return Done(
            step.name, found, {}, step.judge(found, {}, _judged_by(bench, state.parameters))
        )
    file = flights / f"{step.name}.flight" if flights and step.gates else None
    with borrowed(bench.drive, bench_limits(bench)):
        bench.ready()
        with recorded(bench, file) as flight:
            found = step.measure(bench, meter)
        predicted = _prediction(bench, step)
    findings = step.judge(found, predicted, _judged_by(bench, state.parameters))
    return Done(step.name, found, predicted, findings, flight)


def _judged_by(bench: Bench, parameters: Mapping[str, float]) -> Numbers:
    period_s = bench.drive.identity.period_s
    return dict(parameters) | {"u_dc_V": bench.u_dc_V, "period_s": period_s}


def _prediction(bench: Bench, step: Step) -> Numbers:
    with model_of(bench) as (model, meter):
        predicted = step.measure(model, meter)
    if faults := int(predicted.get("faults", 0.0)):
        raise UserError(
            f"the model of this drive trips in step {step.name} ({fault_text(faults)}): the "
            "parameters do not describe a motor that runs; commission it first"
        )
    return predicted
