"""Rules of CONVENTIONS on the firmware's object files: what they store and what they call."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

# What a freestanding image supplies itself (the compiler calls these for struct copies) and the
# one function of the maths library that gives the same bits everywhere.
ALLOWED_UNDEFINED = {"sqrtf", "memcpy", "memset", "memmove", "memcmp", "_GLOBAL_OFFSET_TABLE_"}
# The assert of the host's C library; a release image brings its own.
ALLOWED_UNDEFINED |= {"__assert_fail"}
# Sections of objects that can change. Relocated constants (.data.rel.ro) are constants.
_MUTABLE = re.compile(r"\.(data|bss|tdata|tbss)(\.(?!rel\.ro)\S*)?")


def check_build(build: Path) -> list[str]:
    """Breaches in the static libraries of firmware/ of a build folder."""
    archives = sorted((build / "firmware").rglob("*.a"))
    if not archives:
        return [f"{build / 'firmware'}: no library built"]
    defined = set().union(*(_symbols(archive, "--defined-only") for archive in archives))
    breaches = []
    for archive in archives:
        breaches += [
            f"{archive.name}: {member}: section {section} holds {size} bytes that can change"
            for member, section, size in _mutable_sections(archive)
        ]
        foreign = _symbols(archive, "--undefined-only") - defined - ALLOWED_UNDEFINED
        breaches += [f"{archive.name}: calls '{name}' of outside" for name in sorted(foreign)]
    return breaches


def _tool(*command: str | Path) -> str:
    return subprocess.run(
        [str(word) for word in command], check=True, capture_output=True, text=True
    ).stdout


def _symbols(archive: Path, which: str) -> set[str]:
    lines = _tool("nm", "--format=posix", which, archive).splitlines()
    return {line.split()[0] for line in lines if line and not line.endswith(":")}


def _mutable_sections(archive: Path) -> list[tuple[str, str, int]]:
    found = []
    member = ""
    for line in _tool("size", "-A", archive).splitlines():
        words = line.split()
        if line.rstrip().endswith(":"):
            member = words[0]
        elif len(words) == 3 and _MUTABLE.fullmatch(words[0]) and int(words[1]) > 0:
            found.append((member, words[0], int(words[1])))
    return found
