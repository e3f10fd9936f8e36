"""Options that the resumable campaigns share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

Seed = Annotated[int, typer.Option(min=0, help="Of the sample.")]
Mode = Annotated[list[str] | None, typer.Option(help="This mode only; may be repeated.")]
Workers = Annotated[int, typer.Option("-j", "--workers", "--parallel", min=1, help="Processes.")]
Scheduler = Annotated[
    str | None, typer.Option(help="Address of a Dask scheduler instead of processes.")
]
Out = Annotated[Path | None, typer.Option(help="Folder of the rows.")]
Fresh = Annotated[
    bool, typer.Option("--fresh/--resume", help="Everything again, or what is missing.")
]
Json = Annotated[bool, typer.Option("--json", help="One JSON object on stdout.")]
