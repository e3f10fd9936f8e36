"""`zh update`: keys, signed images, and sending them."""

from __future__ import annotations

import functools
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, DownloadColumn, Progress, TextColumn, TimeRemainingColumn

from zerohertz.errors import UserError
from zerohertz.link.line import DEFAULT_BAUD, SerialLine
from zerohertz.link.siphash import load_key
from zerohertz.update import image as images
from zerohertz.update import restart
from zerohertz.update.image import Image
from zerohertz.update.loader import Loader, send

_EVERYBODYS = "everybody has the development key, which signs this"
_NO_IMAGE = "IMAGE: is missing; give a signed image, a file for --sign to make, or --make-key"


def register(app: typer.Typer) -> None:
    """Add `zh update`."""
    app.command("update")(update)


def update(
    image: Annotated[
        Path | None, typer.Argument(help="Signed image, NAME.zhu; --sign makes it.")
    ] = None,
    port: Annotated[
        str | None, typer.Option(help="Serial port of the drive: send the image there.")
    ] = None,
    baud: Annotated[int, typer.Option(help="Baud rate of the serial port.")] = DEFAULT_BAUD,
    wait_s: Annotated[
        float, typer.Option("--wait", min=1.0, help="Seconds to wait for the boot loader.")
    ] = 60.0,
    make_key: Annotated[
        Path | None,
        typer.Option(help="Make a private key in this file, and the public one in FILE.pub."),
    ] = None,
    sign: Annotated[
        Path | None,
        typer.Option(help="Sign this above/firmware.bin; IMAGE is made; --port sends it, too."),
    ] = None,
    version: Annotated[
        int | None, typer.Option(help="Of the image to sign: higher than any before.")
    ] = None,
    board: Annotated[
        str | None, typer.Option(help="Of the image to sign; default: board.txt beside it.")
    ] = None,
    key: Annotated[
        Path | None,
        typer.Option(help="Private key; default: the development key, which everybody has."),
    ] = None,
    drive_key: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="The drive's key, which lets it restart; as for zh run."),
    ] = None,
    by_hand: Annotated[
        bool, typer.Option(help="Do not restart the drive; somebody switches it off and on.")
    ] = False,
) -> None:
    """Sign an image and send it to a drive with a boot loader, or make the keys for that.

    With --port the drive restarts into its loader, takes the image, proves it and starts it; its
    gates have to be off. A line that was lost does no harm: give the same command again.
    The loader refuses an image of another board, of an older version or with another signature.
    """
    console = Console(stderr=True)
    _only_with("--port", port, {"--drive-key": drive_key, "--by-hand": by_hand or None})
    _only_with("--sign", sign, {"--version": version, "--board": board, "--key": key})
    if make_key is not None:
        _make_key(make_key, (image, sign, port), console)
        return
    if image is None:
        raise UserError(_NO_IMAGE)
    if sign is not None:
        _sign(sign, image, version, board, key, console)
        console.print(f"{image} is signed", highlight=False)
    signed = images.read(image)
    if port is not None:
        access = None if by_hand else load_key(drive_key, "--drive-key")
        _send(signed, port, baud, wait_s, access, console)
    elif sign is None:
        print(f"{image}: version {signed.version} for {signed.board}, {len(signed.file)} bytes")


def _make_key(path: Path, others: tuple[object, ...], console: Console) -> None:
    if any(other is not None for other in others):
        raise UserError("--make-key: makes keys alone; leave out IMAGE, --sign and --port")
    public = images.make_key(path)
    console.print(f"private key {path}: keep it; public key {public}: for the loader")


def _only_with(name: str, value: object, options: dict[str, object]) -> None:
    for option, given in options.items():
        if value is None and given is not None:
            raise UserError(f"{option}: only with {name}")


def _sign(
    binary: Path,
    image: Path,
    version: int | None,
    board: str | None,
    key: Path | None,
    console: Console,
) -> None:
    if version is None:
        raise UserError("--version: is missing; give a number above that of every image before")
    name = binary.with_name("board.txt")
    told = name.read_text().split() if name.is_file() else []
    if board is None and not told:
        raise UserError(f"--board: is missing; {name} would name it")
    try:
        content = binary.read_bytes()
    except OSError as error:
        raise UserError(f"--sign {binary}: cannot be read ({error.strerror})") from None
    seed = images.read_key(key)
    if seed == images.DEVELOPMENT_SEED:
        if "release" in told[1:]:
            raise UserError(f"--key: {_EVERYBODYS}, and this is a release; --make-key makes yours")
        console.print(f"warning: {_EVERYBODYS}; a release needs --key FILE", highlight=False)
    made = images.make(content, board or told[0], version, seed)
    try:
        image.write_bytes(made.file)
    except OSError as error:
        raise UserError(f"{image}: cannot be written ({error.strerror})") from None


def _send(
    image: Image, port: str, baud: int, wait_s: float, key: bytes | None, console: Console
) -> None:
    line = SerialLine(port, baud)
    columns = (TextColumn("{task.description}"), BarColumn(), DownloadColumn())
    try:
        with Progress(*columns, TimeRemainingColumn(), console=console) as progress:
            task = progress.add_task("waiting for the loader", total=len(image.application))

            def hint(what: str) -> None:
                progress.console.print(f"{what}: switch the drive off and on now", highlight=False)

            def done(count: int) -> None:
                progress.update(task, completed=count, description="sending")

            call = functools.partial(restart.into_loader, line, key) if key is not None else None
            state = send(Loader(line), image, wait_s, done, hint, call)
        console.print(f"version {state.running} is proven; the drive starts it", highlight=False)
        console.print(restart.application(line, state.running), highlight=False)
    finally:
        line.close()
