"""What a release is made of, as CycloneDX 1.6: files, what is compiled in, what they need.

Python packages come from the lock files with the hashes that pip demands, those of the pages from
npm's lock file, those of Debian with the versions of this machine.
"""

from __future__ import annotations

import base64
import hashlib
import json
import re
import shutil
import subprocess
import uuid
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from zerohertz import __version__
from zerohertz.paths import ROOT

TOOLS = ROOT / "tools"
# Compiled into the library, the images or the site: C and C++ headers, and what compilers add.
COMPILED_IN = (
    "libeigen3-dev",
    "libtomlplusplus-dev",
    "nlohmann-json3-dev",
    "gcc",
    "gcc-arm-none-eabi",
    "libnewlib-arm-none-eabi",
    "emscripten",
)
NEEDED = ("numpy",)  # by the wheel; all other Python packages serve single commands

_PIN = re.compile(r"^([A-Za-z0-9_.-]+)==([^\s;\\]+)")
_HASH = re.compile(r"--hash=sha256:([0-9a-f]{64})")


def sbom(files: Sequence[Path], folder: Path) -> dict[str, Any]:
    """The document of these files of a folder; the same for the same content."""
    components = [*_files(files, folder), *_python(), *_monocypher(), *_npm(), *_debian()]
    content = json.dumps(components, sort_keys=True).encode()
    serial = uuid.UUID(bytes=hashlib.sha256(content).digest()[:16], version=4)
    return {
        "bomFormat": "CycloneDX",
        "specVersion": "1.6",
        "serialNumber": f"urn:uuid:{serial}",
        "version": 1,
        "metadata": {
            "component": {
                "type": "firmware",
                "bom-ref": "zerohertz",
                "name": "zerohertz",
                "version": __version__,
                "licenses": [{"license": {"id": "Apache-2.0"}}],
            }
        },
        "components": components,
        "dependencies": [
            {"ref": "zerohertz", "dependsOn": sorted({part["bom-ref"] for part in components})}
        ],
    }


def _files(files: Sequence[Path], folder: Path) -> Iterator[dict[str, Any]]:
    for path in files:
        name = str(path.relative_to(folder))
        digest = hashlib.sha256(path.read_bytes()).hexdigest()
        yield {
            "type": "file",
            "bom-ref": f"file:{name}",
            "name": name,
            "hashes": [{"alg": "SHA-256", "content": digest}],
        }


def _part(kind: str, name: str, version: str, scope: str) -> dict[str, Any]:
    purl = f"pkg:{kind}/{name}@{version}"
    return {
        "type": "library",
        "bom-ref": purl,
        "name": name,
        "version": version,
        "scope": scope,
        "purl": purl,
    }


def _python() -> list[dict[str, Any]]:
    """Every pinned package once; its hashes are those of all its files, as pip has them."""
    found: dict[str, dict[str, Any]] = {}
    for lock in sorted(TOOLS.glob("requirements*.lock")):
        for entry in re.split(r"\n(?=\S)", lock.read_text(encoding="utf-8")):
            if match := _PIN.match(entry):
                name = match[1].lower()
                part = _part("pypi", name, match[2], "required" if name in NEEDED else "optional")
                hashes = [{"alg": "SHA-256", "content": h} for h in _HASH.findall(entry)]
                found[part["purl"]] = part | {"hashes": hashes}
    return list(found.values())


def _monocypher() -> Iterator[dict[str, Any]]:
    """What a boot loader is compiled with, and the source distribution that carries it."""
    lock = (TOOLS / "monocypher.lock").read_text(encoding="utf-8")
    (carrier,) = re.finditer(_PIN.pattern, lock, re.MULTILINE)
    (version,) = re.findall(r"^# monocypher\.c: version (\S+)$", lock, re.MULTILINE)
    hashes = [{"alg": "SHA-256", "content": h} for h in _HASH.findall(lock)]
    yield _part("pypi", carrier[1], carrier[2], "optional") | {"hashes": hashes}
    licence = {"expression": "BSD-2-Clause OR CC0-1.0"}
    yield _part("generic", "monocypher", version, "optional") | {"licenses": [licence]}


def _npm() -> Iterator[dict[str, Any]]:
    """What the pages use; builds for other platforms are left out."""
    lock = json.loads((TOOLS / "web" / "package-lock.json").read_text(encoding="utf-8"))
    for path, entry in lock["packages"].items():
        if path and not entry.get("optional"):
            name = path.removeprefix("node_modules/").replace("@", "%40")
            scope = "optional" if entry.get("dev") else "required"
            algorithm, _, content = entry["integrity"].partition("-")
            digest = base64.b64decode(content).hex()
            hashes = [{"alg": algorithm.upper().replace("SHA", "SHA-"), "content": digest}]
            yield _part("npm", name, entry["version"], scope) | {"hashes": hashes}


def _debian() -> Iterator[dict[str, Any]]:
    if shutil.which("dpkg-query") is None:
        return
    command = ("dpkg-query", "-W", "-f", "${Package} ${Version} ${db:Status-Status}\n")
    done = subprocess.run((*command, *COMPILED_IN), capture_output=True, text=True, check=False)
    for line in done.stdout.splitlines():
        name, version, status = line.split()
        if status == "installed":
            yield _part("deb/debian", name, version.replace(":", "%3A"), "required")
