"""The twin as one HTML file: page, worker, WebAssembly and data.

It so works when it is opened as a file, without any server: such a page may load neither scripts
nor data that lie beside it. What is large is packed with gzip and written as base64.
"""

from __future__ import annotations

import base64
import gzip
import json
import os
import shutil
import subprocess
from pathlib import Path
from typing import Any

from zerohertz.build import build_twin
from zerohertz.errors import UserError
from zerohertz.paths import BUILD, ROOT

SOURCE = ROOT / "tools" / "web" / "twin"
WORK = BUILD / "twin-web"
NODE = ("fs", "path", "crypto")  # of emscripten's loader, which never asks for them in a browser


def page(data: dict[str, Any], docs: str = "") -> str:
    """The whole page; docs: address of the documentation beside it."""
    script, wasm = build_twin()
    packages = modules()
    link = f'<nav><a href="{docs}">Documentation</a></nav>' if docs else ""
    parts = {
        "/*STYLE*/": (packages / "uplot/dist/uPlot.min.css").read_text(encoding="utf-8")
        + (SOURCE / "style.css").read_text(encoding="utf-8"),
        "<!--WASM-->": _packed(wasm.read_bytes()),
        "<!--DATA-->": _packed(json.dumps(data, separators=(",", ":")).encode()),
        "<!--WORKER-->": _bundle("worker.js", packages, script.parent),
        "/*PAGE*/": _bundle("page.js", packages, script.parent),
        '<nav id="docs-link"></nav>': link,
    }
    text = (SOURCE / "index.html").read_text(encoding="utf-8")
    for mark, content in parts.items():
        if mark not in text:
            raise UserError(f"{SOURCE / 'index.html'}: has no '{mark}'; restore it with git")
        text = text.replace(mark, content)
    return text


def modules() -> Path:
    """esbuild and uPlot, as pinned in package-lock.json; fetched when that has changed."""
    if shutil.which("npm") is None:
        raise UserError("npm: not installed; run tools/zh site, which installs it")
    WORK.mkdir(parents=True, exist_ok=True)
    lock = (SOURCE / "package-lock.json").read_text(encoding="utf-8")
    done = WORK / "node_modules" / "installed-lock.json"
    if not done.is_file() or done.read_text(encoding="utf-8") != lock:
        for name in ("package.json", "package-lock.json"):
            shutil.copyfile(SOURCE / name, WORK / name)
        _run("npm", "ci", "--ignore-scripts", "--no-audit", "--no-fund", folder=WORK)
        done.write_text(lock, encoding="utf-8")
    return WORK / "node_modules"


def _bundle(name: str, packages: Path, wasm_folder: Path) -> str:
    """One script without imports; `</script` cannot stand in the page."""
    command = [packages / ".bin" / "esbuild", SOURCE / "src" / name, "--bundle", "--minify"]
    command += ["--format=iife", "--target=es2020", "--log-level=error"]
    command += [f"--external:{module}" for module in NODE]
    found = _run(*command, folder=WORK, modules=f"{packages}:{wasm_folder}")
    return found.replace("</script", "<\\/script")


def _packed(content: bytes) -> str:
    return base64.b64encode(gzip.compress(content, 9, mtime=0)).decode()


def _run(*command: str | Path, folder: Path, modules: str = "") -> str:
    environment = os.environ | ({"NODE_PATH": modules} if modules else {})
    done = subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    if done.returncode != 0:
        words = " ".join(map(str, command[:3]))
        raise UserError(f"'{words}' failed: {done.stderr.strip()[-2000:]}")
    return done.stdout
