"""Which way includes go (CONVENTIONS 2): layer by layer in the firmware, nowhere in a circle.

A header is found as the compiler finds it: beside the file that includes it, else wherever its
name, with the folders written before it, leads.
"""

from __future__ import annotations

import graphlib
from pathlib import Path

from zerohertz.c_source import includes

_BASE = ("firmware/law/base", "firmware/parameters")
_LAW = "firmware/law"
_ESTIMATOR = "firmware/law/estimator"
_ROOMS = (
    "firmware/law/measurement",
    _ESTIMATOR,
    "firmware/law/confidence",
    "firmware/law/mode",
    "firmware/law/reference",
    "firmware/law/voltage",
)

# Folder -> folders whose headers it may include beside its own; /* stands for any one folder.
# Only the estimator's contract knows which estimator is linked.
MAY_INCLUDE = {
    "firmware/law/base": (),
    "firmware/parameters": ("firmware/law/base",),
    "firmware/law/measurement": _BASE,
    _ESTIMATOR: (*_BASE, f"{_ESTIMATOR}/*"),
    f"{_ESTIMATOR}/*": (*_BASE, _ESTIMATOR),
    "firmware/law/confidence": (*_BASE, _ESTIMATOR),
    "firmware/law/reference": (*_BASE, _ESTIMATOR),
    "firmware/law/voltage": _BASE,
    "firmware/law/mode": (
        *(*_BASE, _ESTIMATOR, "firmware/law/measurement"),
        *("firmware/law/reference", "firmware/law/voltage"),
    ),
    "firmware/guard": ("firmware/law/base",),
    _LAW: (*_BASE, *_ROOMS, "firmware/guard"),
    "firmware/sequence": (*_BASE, *_ROOMS, "firmware/guard", _LAW),
    "firmware/host": (*_BASE, "firmware/guard"),
    "firmware/unit": (
        *(*_BASE, *_ROOMS, "firmware/guard", _LAW),
        *("firmware/sequence", "firmware/host", "hal/include"),
    ),
    "firmware/fieldbus": (
        *(*_BASE, *_ROOMS, "firmware/guard", _LAW),
        *("firmware/sequence", "firmware/host", "firmware/unit", "hal/include"),
    ),
    "firmware/terminals": (
        *(*_BASE, *_ROOMS, "firmware/guard", _LAW),
        *("firmware/sequence", "firmware/host", "firmware/unit", "hal/include"),
    ),
    "hal/include": (),
}
# The background works on devices, as one struct of operations (CONVENTIONS 9). The list of signals
# ends with those of the estimator that is linked. ADC words reach the measurement uncopied.
ALSO = {
    "firmware/law/measurement": ("hal_drive_io.h",),
    "firmware/host": ("hal_devices.h",),
    "firmware/unit": ("estimator_signals.def",),
}
# <stdatomic.h> for the fence of handover.h, which holds the compiler and is no instruction.
# <math.h> for sqrtf and fabsf alone, exact and one instruction each: any other function of it is
# refused by name (source_rules) and by object_rules.
SYSTEM_HEADERS = {
    f"<{name}.h>" for name in "float limits math stdatomic stdbool stddef stdint".split()
}

_LAYERED = ("firmware", "hal/include")
_ACYCLIC = ("firmware", "hal", "host_sim")
_SUFFIXES = (".c", ".h", ".cpp", ".hpp", ".def")


def check_layers(root: Path) -> list[str]:
    """Every include of the firmware against the direction, as `file:line: what is wrong`."""
    files = _files(root, _LAYERED)
    breaches = []
    for path in files:
        folder = _row_of(path)
        if folder is None:
            breaches.append(f"{path}:1: {path.parent} has no row in include_rules.MAY_INCLUDE")
            continue
        for line, name in includes((root / path).read_text(encoding="utf-8")):
            what = _refused(folder, path, name, files)
            breaches += [f"{path}:{line}: {what}"] if what else []
    return breaches


def check_cycles(root: Path) -> list[str]:
    """One include cycle of firmware, hal and host_sim, if there is any."""
    files = _files(root, _ACYCLIC)
    graph = {
        path: {
            header
            for _, name in includes((root / path).read_text(encoding="utf-8"))
            if name.startswith('"')
            for header in _found(path, name.strip('"'), files)
        }
        for path in files
    }
    try:
        graphlib.TopologicalSorter(graph).prepare()
    except graphlib.CycleError as error:
        # graphlib lists each file before the one that includes it.
        cycle = [str(path) for path in reversed(error.args[1])]
        return [f"{cycle[0]}:1: include cycle: {' -> '.join(cycle)}"]
    return []


def _files(root: Path, folders: tuple[str, ...]) -> list[Path]:
    return sorted(
        path.relative_to(root)
        for folder in folders
        for path in (root / folder).rglob("*")
        if path.suffix in _SUFFIXES
    )


def _row_of(path: Path) -> str | None:
    """The row of a file's folder."""
    rows = (path.parent.as_posix(), (path.parent.parent / "*").as_posix())
    return next((row for row in rows if row in MAY_INCLUDE), None)


def _found(path: Path, name: str, files: list[Path]) -> list[Path]:
    """The headers that `name` may mean in `path`: the one beside it, else all of that name."""
    beside = path.parent / name
    if beside in files:
        return [beside]
    wanted = Path(name).parts
    return [file for file in files if file.parts[-len(wanted) :] == wanted]


def _refused(folder: str, path: Path, name: str, files: list[Path]) -> str | None:
    """Why a file of `folder` may not include `name`, with its quotes or angle brackets."""
    if name.startswith("<"):
        if name in SYSTEM_HEADERS:
            return None
        return f"{folder} may not include {name}: not freestanding"
    name = name.strip('"')
    headers = _found(path, name, files)
    if not headers:
        return f'"{name}" is in none of {", ".join(_LAYERED)}'
    allowed = (folder, *MAY_INCLUDE[folder])
    for header in headers:
        if _row_of(header) not in allowed and header.name not in ALSO.get(folder, ()):
            return f'{folder} may not include "{name}" of {header.parent.as_posix()}'
    return None
