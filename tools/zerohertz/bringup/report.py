"""The report of a bring-up: report.md for people, report.json for programs and for going on."""

from __future__ import annotations

import json
from pathlib import Path

from zerohertz.bringup.procedure import BringUp, Done
from zerohertz.bringup.steps import STEPS, Step

MARKDOWN, JSON = "report.md", "report.json"


def write(state: BringUp, folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    text = json.dumps(state.as_json(), indent=1) + "\n"
    (folder / JSON).write_text(text, encoding="utf-8")
    (folder / MARKDOWN).write_text(page(state), encoding="utf-8")


def page(state: BringUp) -> str:
    """As Markdown."""
    lines = ["# Bring-up", "", f"`{state.identity}`, parameters and firmware `{state.stamp}`.", ""]
    lines += [f"**{verdict(state)}**", ""]
    for number, step in enumerate(STEPS, 1):
        done = state.steps.get(step.name)
        lines += [f"## {number}. {step.title}", ""]
        lines += _step_lines(step, done) if done else ["Not done yet.", ""]
    return "\n".join(lines)


def verdict(state: BringUp) -> str:
    """One line."""
    if state.passed:
        return f"All {len(STEPS)} steps fit."
    if state.findings:
        return "Does not fit: " + "; ".join(finding.name for finding in state.findings)
    return f"{len(state.steps)} of {len(STEPS)} steps fit, the others are not done yet."


def _step_lines(step: Step, done: Done) -> list[str]:
    lines = ["| what | measured | predicted |", "|---|---|---|"]
    for key, text in step.shown.items():
        values = [_number(of.get(key)) for of in (done.found, done.predicted)]
        lines.append(f"| {text} | {values[0]} | {values[1]} |")
    lines.append("")
    for finding in done.findings:
        lines += [f"- **{finding.name}**: {finding.text}. {finding.remedy}."]
    if done.flight:
        lines.append(f"- Recording: `{done.flight}`; `tools/zh replay --flight {done.flight}`")
    return lines + ([""] if done.findings or done.flight else [])


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.4g}"
