"""tools/docs/modbus.md: the registers of the Modbus slave, from the firmware's lists."""

from __future__ import annotations

from zerohertz import param_list
from zerohertz.image.fieldbus_list import grouped, signals, writable
from zerohertz.param_list import Entry
from zerohertz.paths import ROOT

PAGE = ROOT / "tools" / "docs" / "modbus.md"
LIST_AT, GROUP = 1000, 100  # modbus_map.h

_HEAD = """\
# Modbus registers

Generated from the lists of the firmware by `tools/zh params --page`: do not edit. What the slave
does, and how to enable it: [fieldbus](../../firmware/fieldbus/README.md).

Addresses are those on the line, from 0. Some masters count from 1, or write 40001 for holding
register 0 and 30001 for input register 0. A value of 32 bits takes two registers, **the high word
first**. It is written whole, by function 16; reading may begin anywhere.

## Commands: holding registers

| address | type | what |
|---|---|---|
| 0 | u16 | control word: bit 0 run, 1 coast (gates off), 2 torque mode, \
7 fault reset (rising edge) |
| 1 | i16 | speed reference, min^-1 |
| 2 | f32 | the same speed reference with its decimals, min^-1; the later write counts |
| 4 | f32 | torque reference in torque mode, Nm |

## Actual values: input registers

| address | type | what |
|---|---|---|
| 0 | u16 | status word: bit 0 ready, 1 gates on, 2 follows its reference, 3 fault, 4 warning, \
5 the bus may command, 6 run was low and counts, 7 the bus was silent, 8 the speed is unknown |
| 1 | i16 | speed, min^-1; -32768: unknown |
| 2 | i16 | torque, 0.1 Nm |
| 3 | i16 | rms current of a phase, 0.01 A |
| 4 | i16 | dc link, 0.1 V |
| 5 | u16 | state: {states} |
| 6 | u32 | latched faults, the bits of [faults](faults.md) |
| 8 | f32 | speed, min^-1; not a number: unknown |
| 10 | f32 | torque, Nm |
| 12 | f32 | rms current of a phase, A |
| 14 | f32 | dc link, V |

## Parameters: holding registers

A group begins at 1000 plus 100 times its number. [Parameters](parameters.md) has texts, units and
ranges. Only those marked **W** can be written; each other one needs the authenticated session of
the host link ([SECURITY](../../SECURITY.md)). Whole numbers and choices are u32.
"""
_SIGNALS = """\
## Signals: input registers

Signal n of `signal_list.def` stands at 1000 + 2 n. The last ones are those of the estimator that is
linked.

| address | type | name | what |
|---|---|---|---|"""
_COLUMNS = "| address | type | name | unit | |\n|---|---|---|---|---|"
_STATES = (
    *("boot", "self-test", "ready", "premagnetise", "run", "ramp down", "coast"),
    *("commissioning", "fault", "torque off"),
)


def page_text() -> str:
    """The whole page."""
    states = ", ".join(f"{k} {name}" for k, name in enumerate(_STATES))
    parts = [_HEAD.format(states=states)]
    groups = param_list.groups()
    for number, (group, (name, _)) in enumerate(groups.items()):
        rows = "\n".join(_row(g, k, e) for g, k, e in grouped() if e.group == group)
        title = f"### {name[0].upper()}{name[1:]}, from {LIST_AT + GROUP * number}"
        parts.append(
            f"{title}\n\n| address | type | name | unit | |\n|---|---|---|---|---|\n{rows}\n"
        )
    rows = "\n".join(
        f"| {LIST_AT + 2 * n} | {'f32' if s.is_float else 'u32'} | `{s.name}` | {s.text} |"
        for n, s in enumerate(signals())
    )
    parts.append(f"{_SIGNALS}\n{rows}\n")
    return "\n".join(parts)


def address(group: int, position: int) -> int:
    """The first of a parameter's two registers."""
    return LIST_AT + GROUP * group + 2 * position


def _row(group: int, position: int, entry: Entry) -> str:
    kind = "u32" if entry.whole else "f32"
    mark = "**W**" if entry.name in writable() else ""
    return f"| {address(group, position)} | {kind} | `{entry.name}` | {entry.unit} | {mark} |"


def stale() -> bool:
    """Whether the committed page is not that of the lists."""
    return not PAGE.is_file() or PAGE.read_text(encoding="utf-8") != page_text()


def write() -> None:
    """The page where it belongs."""
    PAGE.write_text(page_text(), encoding="utf-8")
