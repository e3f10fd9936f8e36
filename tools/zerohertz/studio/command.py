"""`zh studio`: watch and run a drive in the browser."""

from __future__ import annotations

import asyncio
import contextlib
import signal
import socket
import sys
import threading
import webbrowser
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from zerohertz.errors import UserError
from zerohertz.link.command import (
    BaudOption,
    KeyOption,
    NameArgument,
    PortOption,
    SilOption,
    TcpOption,
    one_configuration,
    serving_note,
    sil_job,
)
from zerohertz.link.line import DEFAULT_BAUD, DEFAULT_TCP_PORT, Line, TcpLine, UnixLine
from zerohertz.link.ports import BrokerEnd, line_to, socket_beside
from zerohertz.link.siphash import load_key
from zerohertz.options import refuse_given

DEFAULT_PAGE_PORT = 8405


@dataclass(frozen=True)
class Simulated:
    """The drive that `zh studio` brings along when no other is named."""

    config: str
    rig: str | None
    load_Nm: str
    set_params: list[str]
    speed: float
    keep: Path | None


def register(app: typer.Typer) -> None:
    """Add `zh studio`."""
    app.command("studio")(studio)


def studio(
    context: typer.Context,
    name: NameArgument = None,
    port: PortOption = None,
    baud: BaudOption = DEFAULT_BAUD,
    sil: SilOption = False,
    tcp: TcpOption = DEFAULT_TCP_PORT,
    key: KeyOption = None,
    page: Annotated[
        int, typer.Option(min=0, max=65535, help="Local port of the page; 0: any free port.")
    ] = DEFAULT_PAGE_PORT,
    browser: Annotated[
        bool, typer.Option("--browser/--no-browser", help="Open the page in the browser.")
    ] = True,
    config: Annotated[str | None, typer.Option(help="Simulated drive: the same as NAME.")] = None,
    rig: Annotated[
        str | None, typer.Option(help="Simulated drive: motor, in host_sim/rigs/motors.")
    ] = None,
    load_Nm: Annotated[
        str, typer.Option("--load", help="Simulated drive: load torque in Nm, or [[s, Nm], ...].")
    ] = "0",
    set_params: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=VALUE", help="Simulated drive: firmware parameter."),
    ] = None,
    speed: Annotated[
        float, typer.Option(min=0.1, max=8.0, help="Simulated drive: simulated seconds per second.")
    ] = 1.0,
    keep: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Simulated drive: flash file, keeps parameters and fault record."
        ),
    ] = None,
) -> None:
    """Show and run a drive on a page in the browser.

    --port connects to a board, --sil to the drive of `zh serve`. Without either, the command starts
    a simulated drive. Other commands (run, trace, get, set, faults, commission) work at the same
    time.
    """
    from zerohertz.studio.bundle import ensure_bundle

    _refuse_ignored(context, port is not None, sil)
    secret = load_key(key)
    folder = ensure_bundle()
    simulated = Simulated(
        one_configuration(name, config), rig, load_Nm, set_params or [], speed, keep
    )
    with contextlib.ExitStack() as stack:
        listening = stack.enter_context(contextlib.closing(_listening(page)))
        if port is not None:
            dial = stack.enter_context(_board(port, baud, secret))
        elif sil:
            TcpLine(tcp).close()  # says now when nobody is there
            dial = lambda: TcpLine(tcp)  # noqa: E731
        else:
            dial = stack.enter_context(_simulated(simulated, tcp))
        asyncio.run(_serve(folder, listening, dial, secret, _rig_file(rig), browser))


# Of the drive that the command brings along.
_ITS_OWN = {
    "name": "NAME",
    "config": "--config",
    "load_Nm": "--load",
    "set_params": "--set",
    "speed": "--speed",
    "keep": "--keep",
}


def _refuse_ignored(context: typer.Context, board: bool, served: bool) -> None:
    """An option that does nothing here is a mistake about which drive is shown."""
    if board and served:
        raise UserError("which drive? give --port DEVICE or --sil, or neither for a simulated one")
    if board:
        why = "--port names a board, and this is for a simulated drive"
        refuse_given(context, _ITS_OWN | {"rig": "--rig", "tcp": "--tcp"}, why)
        return
    refuse_given(context, {"baud": "--baud"}, "only with --port")
    if served:
        refuse_given(context, _ITS_OWN, "the drive of --sil has what `zh serve` was given")


def _rig_file(rig: str | None) -> Path | None:
    from zerohertz.commission.folder import rig_file

    return rig_file(rig) if rig is not None else None


def _listening(page: int) -> socket.socket:
    listening = socket.socket()
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listening.bind(("127.0.0.1", page))
    except OSError as error:
        raise UserError(f"--page {page}: cannot be used ({error}); give another one") from None
    listening.listen(16)
    listening.setblocking(False)
    return listening


async def _serve(
    folder: Path,
    listening: socket.socket,
    dial: object,
    key: bytes,
    rig: Path | None,
    browser: bool,
) -> None:
    from zerohertz.studio.pages import serve_pages
    from zerohertz.studio.tools import Tools

    stop = asyncio.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        asyncio.get_running_loop().add_signal_handler(number, stop.set)
    address = f"http://127.0.0.1:{listening.getsockname()[1]}/"
    print(f"zh: studio at {address} (end it with Ctrl-C)", file=sys.stderr, flush=True)
    if browser:
        threading.Thread(target=webbrowser.open, args=(address,), daemon=True).start()
    await serve_pages(folder, listening, dial, key, Tools(dial, key, rig), stop)
    print("zh: studio has ended", file=sys.stderr)


@contextlib.contextmanager
def _board(port: str, baud: int, key: bytes) -> Iterator[object]:
    """Each page has a line of its own to the broker of this port, which may be ours."""
    line, hub = line_to(port, baud, key, share=True)
    line.close()

    def dial() -> Line:
        return UnixLine(socket_beside(port), wait_s=0.0)

    with hub or contextlib.nullcontext():
        yield dial


@contextlib.contextmanager
def _simulated(wanted: Simulated, tcp: int) -> Iterator[object]:
    """A drive in a thread, with a port for the other commands."""
    from zerohertz.link import server

    job = sil_job(wanted.config, wanted.load_Nm, wanted.set_params, wanted.rig)
    stop = threading.Event()
    end = _free_end(tcp)
    with contextlib.closing(end), server.LinkedDrive(job, keep=wanted.keep) as drive:
        arguments = (drive, end, wanted.speed, lambda: not stop.is_set())
        thread = threading.Thread(target=server.serve, args=arguments, daemon=True)
        thread.start()
        print(serving_note(end.name, end.port), file=sys.stderr)
        try:
            yield end.hub.line
        finally:
            stop.set()
            thread.join(10.0)


def _free_end(tcp: int) -> BrokerEnd:
    """At the usual port, or at a free one when `zh serve` has it."""
    try:
        return BrokerEnd(tcp)
    except UserError:
        if tcp != DEFAULT_TCP_PORT:
            raise
        return BrokerEnd(0)
