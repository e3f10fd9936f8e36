"""The one exception that stands for a mistake of the user, not of the program."""

from __future__ import annotations


class UserError(Exception):
    """Bad input. Its text is the whole message: `<file>: <key>: what is wrong; remedy`.

    The command line prints it on one line as `error: ...` and exits with 2, without a traceback.
    """
