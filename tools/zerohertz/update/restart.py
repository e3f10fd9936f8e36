"""From the application into its boot loader, and back: requests of the host link."""

from __future__ import annotations

import struct
import time

from zerohertz.errors import UserError
from zerohertz.link.client import Client, NoAnswerError, Op, RefusedError
from zerohertz.link.line import Line

_WHAT = "the restart for the update"
_OF_A_LOADER = 9  # what a loader answers to a request that is not its own
_NO_SUCH_OP, _NOT_NOW = (5, 6), 8  # 6: an older application, to which the request is too long
# Longer than a loader waits behind the last request (hal/boot/boot_link.h).
QUIET_S = 3.5
_STARTS_WITHIN_S = 25.0


def into_loader(line: Line, key: bytes, timeout_s: float = 0.5) -> None:
    """The application resets itself; UserError says why it does not.

    The reset may be faster than the answer: then the loader gets the repeated request, or nobody.
    """
    drive = Client(line, timeout_s, key)
    try:
        drive.sealed(Op.LOADER, struct.pack("<I", drive.session), _WHAT)
    except NoAnswerError:
        return
    except RefusedError as refused:
        if refused.status == _OF_A_LOADER:
            return
        if refused.status == _NOT_NOW:
            raise UserError(
                "the drive runs, or saves its parameters: stop it (zh run --stop) and try again"
            ) from None
        if refused.status in _NO_SUCH_OP:
            raise UserError(
                "the application has no boot loader below it: put one there with a programmer (zh "
                "flash --loader). If it has one but is older than this request, add --by-hand"
            ) from None
        raise


def application(line: Line, version: int, timeout_s: float = 0.5, quiet_s: float = QUIET_S) -> str:
    """Waits for what the loader starts, and returns what it says it is."""
    until_s = time.monotonic() + _STARTS_WITHIN_S
    while True:
        time.sleep(quiet_s)
        try:
            return Client(line, timeout_s).identity.text
        except UserError:
            if time.monotonic() > until_s:
                raise UserError(
                    f"version {version} is installed and proven, but does not answer; switch the "
                    "drive off and on, and send a newer version if that does not help"
                ) from None
