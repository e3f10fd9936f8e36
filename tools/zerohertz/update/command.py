"""`zh update`: keys, signed images, and sending them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, DownloadColumn, Progress, TextColumn, TimeRemainingColumn

from zerohertz.errors import UserError
from zerohertz.link.line import DEFAULT_BAUD, SerialLine
from zerohertz.update import image as images
from zerohertz.update.image import Image
from zerohertz.update.loader import Loader, send


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
) -> None:
    """Sign an image and send it to a drive with a boot loader, or make the keys for that.

    The loader listens after every reset: start this command, then switch the drive off and on.
    The loader refuses an image of another board, of an older version or with another signature.
    """
    console = Console(stderr=True)
    if sign is None:
        for option, given in (("--version", version), ("--board", board), ("--key", key)):
            if given is not None:
                raise UserError(f"{option}: only with --sign")
    if make_key is not None:
        if (image, sign, port) != (None, None, None):
            raise UserError("--make-key: makes keys alone; leave out IMAGE, --sign and --port")
        public = images.make_key(make_key)
        console.print(f"private key {make_key}: keep it; public key {public}: for the loader")
        return
    if image is None:
        raise UserError(
            "IMAGE: is missing; give a signed image, a file for --sign to make, or --make-key"
        )
    if sign is not None:
        _sign(sign, image, version, board, key)
        console.print(f"{image} is signed", highlight=False)
    signed = images.read(image)
    if port is not None:
        _send(signed, port, baud, wait_s, console)
    elif sign is None:
        print(f"{image}: version {signed.version} for {signed.board}, {len(signed.file)} bytes")


def _sign(
    binary: Path, image: Path, version: int | None, board: str | None, key: Path | None
) -> None:
    if version is None:
        raise UserError("--version: is missing; give a number above that of every image before")
    name = binary.with_name("board.txt")
    if board is None and not name.is_file():
        raise UserError(f"--board: is missing; {name} would name it")
    try:
        content = binary.read_bytes()
    except OSError as error:
        raise UserError(f"--sign {binary}: cannot be read ({error.strerror})") from None
    seed = images.read_key(key)
    made = images.make(content, board or name.read_text().strip(), version, seed)
    try:
        image.write_bytes(made.file)
    except OSError as error:
        raise UserError(f"{image}: cannot be written ({error.strerror})") from None


def _send(image: Image, port: str, baud: int, wait_s: float, console: Console) -> None:
    line = SerialLine(port, baud)
    columns = (TextColumn("{task.description}"), BarColumn(), DownloadColumn())
    try:
        with Progress(*columns, TimeRemainingColumn(), console=console) as progress:
            task = progress.add_task("waiting for the loader", total=len(image.application))

            def hint(what: str) -> None:
                progress.console.print(f"{what}: switch the drive off and on now", highlight=False)

            def done(count: int) -> None:
                progress.update(task, completed=count, description="sending")

            state = send(Loader(line), image, wait_s, done, hint)
    finally:
        line.close()
    console.print(f"version {state.running} is proven; the drive starts it", highlight=False)
