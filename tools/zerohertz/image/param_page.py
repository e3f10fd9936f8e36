"""tools/docs/parameters.md from the parameter list that the firmware is built from."""

from __future__ import annotations

from collections.abc import Iterable

from zerohertz import param_list
from zerohertz.param_list import Entry
from zerohertz.param_rules import Rule, rules
from zerohertz.paths import ROOT

PAGE = ROOT / "tools" / "docs" / "parameters.md"

_HEAD = """\
# Parameters

Generated from `firmware/parameters/*.def` by `tools/zh params --page`: do not edit.

**Access**: RUN at any time, READY with the gates off, PROTECTED with the gates off and the drive
unlocked (`firmware/host/access.h`). **Ranges** include their ends; a stored value outside today's
range falls back to the default, and the store says so (`firmware/host/param_store.h`). **Choices**
are set by name or by number (`tools/zh set lost_action fault`). Values that exclude each other are
refused; the answer names both parameters and the range that is left.

Currents and voltages are lengths of power-invariant vectors, sqrt(3) times the rms value of a
phase, unless the text says "phase". Speeds in rad/s are electrical.
"""
_COLUMNS = """\
| name | unit | range or choices | default | access | what |
|---|---|---|---|---|---|"""
_RULES = """\
## Values that exclude each other

From `firmware/parameters/param_rules.def`; a set that breaks a rule is refused, and the answer
names both parameters and the limit.

| parameter | has to be | |
|---|---|---|"""
_FORMER = """\
## Names of former lists

A saved record, or a configuration, may still have these. `tools/zh connect` names each one that a
drive found in its record.

| name | now |
|---|---|"""


def page_text(entries: Iterable[Entry] | None = None) -> str:
    """The page for these parameters, by default the firmware's."""
    listed = list(param_list.entries().values() if entries is None else entries)
    parts = [_HEAD]
    for group, (name, text) in param_list.groups().items():
        rows = "\n".join(_row(entry) for entry in listed if entry.group == group)
        if rows:
            parts.append(f"## {name[0].upper()}{name[1:]}\n\n{text}\n\n{_COLUMNS}\n{rows}\n")
    lines = "\n".join(f"| `{r.first}` | {r.words} | {_condition(r)} |" for r in rules())
    parts.append(f"{_RULES}\n{lines}\n")
    former = "\n".join(f"| `{name}` | {now.text} |" for name, now in param_list.former().items())
    parts.append(f"{_FORMER}\n{former}\n")
    return "\n".join(parts)


def _row(entry: Entry) -> str:
    span, default = f"{entry.minimum} .. {entry.maximum}", entry.default
    if entry.choices:
        span = ", ".join(f"{k} `{name}`" for k, name in enumerate(entry.choices))
        default = f"`{entry.choices[int(entry.default)]}`"
    elif entry.whole:
        span += ", whole"
    text = entry.text.replace("|", "\\|")
    return f"| `{entry.name}` | {entry.unit} | {span} | {default} | {entry.access} | {text} |"


def _condition(rule: Rule) -> str:
    """When the rule holds; '' for always."""
    if rule.when == "period_s":
        return ""
    choices = param_list.entries()[rule.when].choices
    value = f" is `{choices[rule.least]}`" if rule.least else " is not 0"
    if choices and not rule.least:
        value = " is `on`"
    return f"when `{rule.when}`{value}"


def stale() -> bool:
    """Whether the committed page is not that of the list."""
    return not PAGE.is_file() or PAGE.read_text(encoding="utf-8") != page_text()


def write() -> None:
    """The page where it belongs."""
    PAGE.write_text(page_text(), encoding="utf-8")
