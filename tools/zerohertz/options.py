"""Options that several commands share."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import typer

from zerohertz.errors import UserError

Seed = Annotated[int, typer.Option(min=0, help="Seed of the random sample.")]
Mode = Annotated[list[str] | None, typer.Option(help="Only this mode; may be repeated.")]
Workers = Annotated[
    int, typer.Option("-j", "--workers", "--parallel", min=1, help="Number of parallel processes.")
]
Scheduler = Annotated[
    str | None, typer.Option(help="Address of a Dask scheduler, instead of local processes.")
]
Out = Annotated[Path | None, typer.Option(help="Folder for the result rows.")]
Fresh = Annotated[
    bool, typer.Option("--fresh/--resume", help="Run everything again, or only what is missing.")
]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object on stdout.")]
Estimator = Annotated[
    str | None,
    typer.Option(
        "--estimator",
        metavar="NAME|DIR|FILE.py:CLASS",
        help="Another estimator for the drive: one of firmware/law/estimator, a folder made by "
        "`zh estimator new`, or a Python class.",
    ),
]


def refuse_given(context: typer.Context, options: Mapping[str, str], why: str) -> None:
    """UserError for an option of the running command that would do nothing.

    options: parameters of its function, as they are typed.
    """
    for name, typed in options.items():
        source = context.get_parameter_source(name)
        if source is not None and source.name == "COMMANDLINE":
            raise UserError(f"{typed}: {why}; leave it out")
