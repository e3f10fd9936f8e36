"""`zh run`: a drive at a speed or with a torque, for as long as somebody watches."""

from __future__ import annotations

import functools
import math
import time
from typing import Annotated

import typer
from rich.console import Console
from rich.live import Live
from rich.text import Text

from zerohertz.errors import UserError
from zerohertz.image import fault_page
from zerohertz.link import client as link
from zerohertz.link.client import Client
from zerohertz.link.command import (
    POLL_S,
    RPM_PER_RAD_S,
    BaudOption,
    PortOption,
    SealKeyOption,
    SilOption,
    TcpOption,
    open_client,
    status_line,
)
from zerohertz.link.line import DEFAULT_BAUD, DEFAULT_TCP_PORT

KEEP_ALIVE_S = 0.2


def register(app: typer.Typer) -> None:
    """Add `zh run`."""
    app.command("run")(run)


def run(
    rpm: Annotated[
        float | None, typer.Option(help="Speed in min^-1; the sign gives the direction.")
    ] = None,
    torque_Nm: Annotated[
        float | None,
        typer.Option(
            "--torque-Nm",
            help="Torque instead of speed; the sign gives the direction. The shaft may speed up to "
            "torque_speed_max_rad_s.",
        ),
    ] = None,
    seconds: Annotated[
        float | None,
        typer.Option(min=0.0, help="Run for this long, then stop. Default: until interrupted."),
    ] = None,
    valid_s: Annotated[
        float,
        typer.Option(
            "--valid",
            min=0.0,
            max=60.0,
            help="The drive stops after this long without a command, s of its own clock; 0: "
            "command_timeout_s applies.",
        ),
    ] = 1.0,
    reset: Annotated[bool, typer.Option("--reset", help="Reset faults first.")] = False,
    stop: Annotated[
        bool, typer.Option("--stop", help="Only stop the drive; needs no key.")
    ] = False,
    key: SealKeyOption = None,
    port: PortOption = None,
    baud: BaudOption = DEFAULT_BAUD,
    sil: SilOption = False,
    tcp: TcpOption = DEFAULT_TCP_PORT,
) -> None:
    """Run the drive and show its state. It stops when this command ends or dies.

    Warnings are shown and do not end the run. Exit 1 if a fault that stops the drive is present at
    the end.
    """
    wanted = [value for value in (rpm, torque_Nm) if value is not None]
    if len(wanted) + stop > 1 or not (wanted or stop or reset):
        raise UserError("give --rpm SPEED or --torque-Nm TORQUE, or --stop, or --reset")
    if not all(map(math.isfinite, wanted)):
        raise UserError("--rpm, --torque-Nm: a finite number is needed")
    with open_client(port, baud, sil, tcp, key, share=True) as drive:
        if reset:
            drive.command(link.RESET)
            time.sleep(POLL_S)
        if not wanted:
            drive.command(0)
        else:
            _run_until(drive, (rpm or 0.0) / RPM_PER_RAD_S, torque_Nm, seconds, valid_s)
        time.sleep(POLL_S)
        status = drive.status()
        Console(highlight=False).print(status_line(status))
        raise typer.Exit(1 if stopping(status.faults) != 0 else 0)


def _run_until(
    drive: Client,
    speed_rad_s: float,
    torque_Nm: float | None,
    seconds: float | None,
    valid_s: float,
) -> None:
    until_s = math.inf if seconds is None else time.monotonic() + seconds
    told = 0
    try:
        with Live(console=Console(stderr=True, highlight=False), auto_refresh=False) as live:
            while time.monotonic() < until_s:
                drive.command(link.RUN, speed_rad_s, valid_s, torque_Nm)
                status = drive.status()
                live.update(Text(status_line(status)), refresh=True)
                for text in warnings(status.faults & ~told):
                    live.console.print(f"warning: {text}", soft_wrap=True)
                told |= status.faults
                if stopping(status.faults) != 0:
                    return
                time.sleep(max(min(KEEP_ALIVE_S, until_s - time.monotonic()), 0.0))
    except KeyboardInterrupt:
        pass
    finally:
        drive.stop()


@functools.cache
def _told_only() -> dict[int, fault_page.Entry]:
    """By bit, the faults that change nothing (WARN) or only limit the drive (DERATE)."""
    return {1 << e.bit: e for e in fault_page.entries() if e.reaction in ("WARN", "DERATE")}


def stopping(faults: int) -> int:
    """The bits that end a run: all but those known to be told only."""
    return faults & ~sum(_told_only())


def warnings(faults: int) -> list[str]:
    """What the bits that are told only mean, and what helps."""
    return [
        f"{e.name}: {e.text}; {e.remedy}" for bit, e in _told_only().items() if faults & bit != 0
    ]
