"""`zh campaign configurations`: every command of tools/docs/own_motor.md, as it is printed."""

from __future__ import annotations

import os
import re
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from zerohertz.paths import ROOT

PAGE = ROOT / "tools" / "docs" / "own_motor.md"


@dataclass(frozen=True)
class Ran:
    """One command of the page."""

    command: str
    code: int
    output: str


def blocks(page: str) -> list[list[str]]:
    """The commands of each block of the page; one block is one motor."""
    found = re.findall(r"```sh\n(.*?)```", page, flags=re.DOTALL)
    return [[line for line in block.splitlines() if line.strip()] for block in found]


def run_block(commands: list[str], home: Path) -> Iterator[Ran]:
    """In a shell at the checkout's root, `~` being an empty folder. Ends with what fails."""
    for command in commands:
        done = subprocess.run(
            command,
            shell=True,
            cwd=ROOT,
            env=os.environ | {"HOME": str(home)},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            check=False,
        )
        yield Ran(command, done.returncode, done.stdout)
        if done.returncode != 0:
            return
