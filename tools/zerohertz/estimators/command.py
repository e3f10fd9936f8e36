"""`zh estimator new` and `zh estimator test`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from zerohertz.console import short_paths
from zerohertz.estimators import new as making
from zerohertz.estimators.chosen import folder_of


def register(app: typer.Typer) -> None:
    """Add `zh estimator`."""
    group = typer.Typer(help="Bring your own estimator: tools/docs/estimator.md.")
    group.command("new")(new)
    group.command("test")(test)
    app.add_typer(group, name="estimator")


def new(
    name: Annotated[str, typer.Argument(help="Its name: small letters, digits and _.")],
    into: Annotated[Path, typer.Option(help="Folder in which its folder is made.")] = Path("."),
) -> None:
    """Write a folder with an estimator that runs the motor, to change into yours."""
    folder = making.new(name, into)
    shown = short_paths(folder)
    print(f"written: {shown}")
    print(f"next: tools/zh estimator test {shown}")
    print(f"      tools/zh atlas --estimator {shown}")


def test(
    estimator: Annotated[
        str, typer.Argument(metavar="DIR", help="Folder of the estimator, or its name.")
    ],
) -> None:
    """Build and run the estimator's own unit tests with the address sanitizer.

    Every test_*.c in the folder is one program. Exit 1 if one fails.
    """
    bad = 0
    for name, passed, said in making.run_tests(folder_of(estimator)):
        bad += not passed
        print(f"{said.rstrip()}\n{name}: {'passed' if passed else 'failed'}")
    if bad:
        raise typer.Exit(1)
