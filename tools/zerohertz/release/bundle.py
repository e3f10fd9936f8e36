"""The folder of `zh release`: all that a version is, with checksums, contents and notes."""

from __future__ import annotations

import hashlib
import json
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path

from zerohertz import __version__
from zerohertz.errors import UserError
from zerohertz.paths import ROOT, need_checkout

CHECKSUMS, SBOM, NOTES = "SHA256SUMS", "zerohertz.cdx.json", "NOTES.md"
IMAGE_SUFFIXES = (".elf", ".bin", ".hex")
Made = list[Path]


def make(
    into: Path, parts: Mapping[str, Callable[[Path], Made]], tell: Callable[[str], None]
) -> Made:
    """All files of the release, those that describe the others last."""
    need_checkout("zh release")
    notes = notes_of((ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), __version__)
    into = into.absolute()
    if any(into.iterdir()):
        raise UserError(f"--into: {into}: is not empty; name a new folder")
    files: Made = []
    for name, part in parts.items():
        tell(f"zh: {name}")
        files += part(into)
    return [*files, *_described(into, files, notes)]


def _described(into: Path, files: Made, notes: str) -> Made:
    from zerohertz.release.sbom import sbom

    document, text, sums = into / SBOM, into / NOTES, into / CHECKSUMS
    document.write_text(json.dumps(sbom(files, into), indent=1) + "\n", encoding="utf-8")
    text.write_text(notes, encoding="utf-8")
    lines = [f"{_sha256(path)}  {path.relative_to(into)}\n" for path in (*files, document, text)]
    sums.write_text("".join(lines), encoding="utf-8")
    return [document, text, sums]


def notes_of(changelog: str, version: str) -> str:
    """The section of a version; UserError when there is none."""
    begin = re.search(rf"^## {re.escape(version)}\b.*\n", changelog, re.MULTILINE)
    if begin is None:
        raise UserError(f"CHANGELOG.md: no section '## {version}'; write one")
    rest = changelog[begin.end() :]
    end = re.search(r"^## ", rest, re.MULTILINE)
    body = rest[: end.start()] if end else rest
    return f"# ZeroHertz {version}\n\n{body.strip()}\n"


def parts() -> dict[str, Callable[[Path], Made]]:
    """What a release has, in the order in which it is made."""
    return {"wheel and sources": _packages, "images": images, "FMUs": _fmus, "site": _site}


def _packages(into: Path) -> Made:
    from zerohertz.release.wheel import build_sdist, build_wheel

    return [build_wheel(into), build_sdist(into)]


def images(into: Path) -> Made:
    """Of every port that has a board to be flashed."""
    from zerohertz.build import build_image
    from zerohertz.image.ports import ports

    made = []
    for name in (name for name, port in ports().items() if port.openocd_target):
        elf = build_image(name)
        for suffix in IMAGE_SUFFIXES:
            if elf.with_suffix(suffix).is_file():
                copy = into / f"zerohertz-{__version__}-{name}{suffix}"
                made.append(Path(shutil.copy(elf.with_suffix(suffix), copy)))
    return made


def _fmus(into: Path) -> Made:
    from zerohertz.release.fmu import build_fmus

    return build_fmus(into, "recommended")


def _site(into: Path) -> Made:
    folder = into / "site"
    command = (sys.executable, "-m", "zerohertz", "site", "--out", folder.absolute())
    subprocess.run(command, check=True, cwd=ROOT, stdout=subprocess.DEVNULL)
    name = into / f"zerohertz-{__version__}-site"
    archive = Path(shutil.make_archive(str(name), "zip", folder))
    shutil.rmtree(folder)
    return [archive]


def _sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()
