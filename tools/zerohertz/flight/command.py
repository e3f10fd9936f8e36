"""`zh record`, and `zh replay --flight`: a drive's flight into a file, and run again."""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console

from zerohertz.drive import State
from zerohertz.flight.file import ENDING, Ending, Flight
from zerohertz.flight.record import Progress, Recorded
from zerohertz.flight.wanted import Wanted
from zerohertz.link.command import (
    BaudOption,
    PortOption,
    SealKeyOption,
    SilOption,
    TcpOption,
    fault_names,
    open_client,
)
from zerohertz.link.line import DEFAULT_BAUD, DEFAULT_TCP_PORT
from zerohertz.options import Json

_NEEDED = ("state", "duty_u", "duty_v", "duty_w", "gates_on")


def register(app: typer.Typer) -> None:
    """Add `zh record`."""
    app.command("record")(record)


def record(
    file: Annotated[Path, typer.Argument(metavar="FILE.flight", help="Where to write it.")],
    seconds: Annotated[
        float, typer.Option(min=0.0, help="Of the drive's time; without: until interrupted.")
    ] = math.inf,
    until_fault: Annotated[
        bool, typer.Option("--until-fault", help="End when a fault has opened the gates.")
    ] = False,
    before_s: Annotated[
        float | None,
        typer.Option("--before-fault", min=0.0, help="Keep only so many seconds before a fault."),
    ] = None,
    after_s: Annotated[
        float, typer.Option("--after", min=0.0, help="Seconds to record behind that fault.")
    ] = 0.1,
    wait_s: Annotated[
        float, typer.Option("--wait", min=0.0, help="Seconds to wait until the drive is READY.")
    ] = 3600.0,
    key: SealKeyOption = None,
    port: PortOption = None,
    baud: BaudOption = DEFAULT_BAUD,
    sil: SilOption = False,
    tcp: TcpOption = DEFAULT_TCP_PORT,
    as_json: Json = False,
) -> None:
    """Record what the drive is given in every control period, for `zh replay --flight`.

    With --before-fault it may go on for days. It keeps that many seconds, and writes them when a
    fault has opened the gates or it is interrupted. After a gap it begins again.

    The recording begins with a start of the drive's control state: the drive has to be READY. It
    measures its current offsets again and is READY as after power-up; a warm motor counts as cold.
    Nothing else changes: run it with `zh run` or from the studio. Exit code 1 when the link was
    too slow: the file then ends at the gap.
    """
    with open_client(port, baud, sil, tcp, key, share=True) as drive:
        ends = until_fault or before_s is not None
        wanted = Wanted(file, seconds, before_s, after_s if ends else None)
        told = wanted.record(drive, wait_s, _say, _progress)
    if as_json:
        print(json.dumps(_as_json(told, file), indent=2))
    else:
        print(_text(told, file))
    raise typer.Exit(1 if told.ending is Ending.GAP else 0)


def _say(text: str) -> None:
    print(f"zh: {text}", file=sys.stderr)


def _progress(p: Progress, period_s: float) -> bool:
    if sys.stderr.isatty():
        waiting = f"{100.0 * p.behind / max(p.room, 1):.0f} % of its memory waits"
        line = f"{p.periods * period_s:9.2f} s  {p.rows_per_s * 12e-3:6.1f} kB/s  {waiting}"
        print(f"\r{line}", end="", file=sys.stderr, flush=True)
    return True


def _text(told: Recorded, file: Path) -> str:
    lines = [
        f"{file}: {told.periods} periods, {told.periods * told.period_s:.3f} s, "
        f"{file.stat().st_size} bytes; ended by {ENDING[told.ending]}"
    ]
    if told.ending is Ending.GAP:
        lines.append(
            f"the link carried {told.rows_per_s * 12e-3:.1f} kB/s, the drive makes "
            f"{12e-3 / told.period_s:.1f} kB/s; at least {told.lost_periods} periods behind the "
            "last one are lost. What the file holds is whole and can be replayed."
            + (" A fault has opened the gates." if told.fault else "")
        )
    if told.why:
        lines.append(told.why)
    return "\n".join(lines)


def _as_json(told: Recorded, file: Path) -> dict[str, Any]:
    return {
        "file": str(file),
        "periods": told.periods,
        "seconds": told.periods * told.period_s,
        "ending": told.ending.name,
        "lost_periods": told.lost_periods,
        "bytes_per_s": told.rows_per_s * 12.0,
    }


def replay_flight(
    file: Path,
    changed: dict[str, float],
    out: Path | None,
    signals: str,
    motor_dir: Path | None,
    as_json: bool,
) -> None:
    """What `zh replay --flight` does. Exit code 1: not what the drive did."""
    from zerohertz.flight.replay import replay

    flight = Flight.read(file)
    folders = (motor_dir,) if motor_dir is not None else ()
    names = _names(signals)
    every = out is not None and not names
    shown = None if every else [*dict.fromkeys([*names, *_NEEDED])]
    found = replay(flight, shown, None, folders)
    other = replay(flight, shown, changed, folders) if changed else None
    if out is not None:
        _write(out, other or found, names, flight)
    told = _replayed(flight, found) | (
        {"changed": _changed(changed, found, other)} if other else {}
    )
    if as_json:
        print(json.dumps(told, indent=2))
    else:
        _show(file, told)
    raise typer.Exit(1 if found.differs or found.ended else 0)


def _names(signals: str) -> list[str]:
    return [name.strip() for name in signals.split(",") if name.strip()]


def _replayed(flight: Flight, found: Any) -> dict[str, Any]:
    from zerohertz.flight.replay import former_lines

    period_s = flight.head.period_s
    return {
        "identity": flight.head.identity,
        "former_parameters": former_lines(flight.head),
        "dropped_periods": flight.head.middle.dropped_periods if flight.head.middle else 0,
        "periods": found.periods,
        "recorded_periods": flight.periods,
        "seconds": found.periods * period_s,
        "ending": flight.ending.name,
        "lost_periods": flight.lost_periods,
        "checks": found.checks,
        "equal": not found.differs,
        "equal_periods": found.equal_periods,
        "stopped": found.ended,
        "last_state": _state(found),
        "first_fault": fault_names(found.first_fault),
        "fault_s": found.fault_period * period_s if found.first_fault else None,
    }


def _state(found: Any) -> str:
    states = found.signals["state"]
    return State(int(states[-1])).name if len(states) else ""


def _changed(changed: dict[str, float], found: Any, other: Any) -> dict[str, Any]:
    """Where the two part: the plant of a recording does not answer to other duties."""
    n = min(found.periods, other.periods)
    duties = ("duty_u", "duty_v", "duty_w", "gates_on")
    pairs = [(found.signals[d][:n], other.signals[d][:n]) for d in duties]
    parts = np.flatnonzero(np.any([a.view(np.uint32) != b.view(np.uint32) for a, b in pairs], 0))
    return {
        "parameters": changed,
        "parts_at_period": int(parts[0]) if len(parts) else None,
        "last_state": _state(other),
        "first_fault": fault_names(other.first_fault),
        "fault_period": other.fault_period if other.first_fault else None,
    }


def _write(out: Path, found: Any, names: list[str], flight: Flight) -> None:
    from zerohertz.link.recording import Recording as Columns
    from zerohertz.link.recording import write

    t_s = np.arange(found.periods) * round(flight.head.period_s, 9)
    kept = {n: c for n, c in found.signals.items() if not names or n in names}
    write(out, Columns(t_s, kept, flight.head.identity))


def _show(file: Path, told: dict[str, Any]) -> None:
    console = Console(highlight=False, markup=False, soft_wrap=True)
    console.print(f"{file}: {told['identity']}")
    for line in told["former_parameters"]:
        console.print(line)
    ending = ENDING[Ending[told["ending"]]]
    console.print(
        f"{told['periods']} of {told['recorded_periods']} periods replayed, "
        f"{told['seconds']:.3f} s; the recording was ended by {ending}"
    )
    if told["dropped_periods"]:
        dropped = told["dropped_periods"]
        console.print(f"the last seconds only: {dropped} periods before them were not kept")
    if told["lost_periods"]:
        console.print(f"at least {told['lost_periods']} periods behind the last one are lost")
    if told["stopped"]:
        console.print(f"the file {told['stopped']}")
    console.print(_verdict(told))
    fault = f", {told['first_fault']} at {told['fault_s']:.4f} s" if told["first_fault"] else ""
    console.print(f"ends in {told['last_state']}{fault}")
    if "changed" in told:
        _show_changed(console, told["changed"], told["seconds"] / max(told["periods"], 1))


def _verdict(told: dict[str, Any]) -> str:
    if not told["checks"]:
        return "too short for a digest of the drive's outputs: nothing to compare with"
    if told["equal"]:
        return f"equal to the drive in every bit of its outputs ({told['checks']} digests)"
    return (
        f"DIFFERS from the drive after period {told['equal_periods']}: is this firmware that of "
        "the recording?"
    )


def _show_changed(console: Console, changed: dict[str, Any], period_s: float) -> None:
    names = ", ".join(f"{name} = {value:g}" for name, value in changed["parameters"].items())
    at = changed["parts_at_period"]
    if at is None:
        console.print(f"with {names}: the same duties in every period")
    else:
        console.print(
            f"with {names}: the first other duty at {at * period_s:.4f} s; from there on the "
            "recorded currents answer to the old ones"
        )
    fault = changed["fault_period"]
    when = f", {changed['first_fault']} at {fault * period_s:.4f} s" if fault is not None else ""
    if fault is not None and at is not None and fault > at:
        when += " (behind the first other duty: no evidence)"
    console.print(f"  ends in {changed['last_state']}{when or ', no fault'}")
