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
from zerohertz.site import twin_data
from zerohertz.studio import catalog

SOURCE = ROOT / "tools" / "web" / "twin"
WORK = BUILD / "twin-web"
NODE = ("fs", "path", "crypto")  # of emscripten's loader, which never asks for them in a browser


def page(data: dict[str, Any], docs: str = "") -> str:
    """The twin's page; docs: address of the documentation beside it."""
    link = f'<nav><a href="{docs}">Documentation</a></nav>' if docs else ""
    style = (modules() / "uplot/dist/uPlot.min.css").read_text(encoding="utf-8")
    return _whole(
        "index.html",
        {
            "/*STYLE*/": style + (SOURCE / "style.css").read_text(encoding="utf-8"),
            "<!--DATA-->": _packed(json.dumps(data, separators=(",", ":")).encode()),
            "<!--WORKER-->": _bundle("src/worker.js"),
            "/*PAGE*/": _bundle("src/page.js"),
            '<nav id="docs-link"></nav>': link,
        },
    )


def studio_page() -> str:
    """The studio's page on a drive in the browser, or on a board by Web Serial."""
    data = json.dumps(twin_data.studio_content(), separators=(",", ":"))
    return _whole(
        "studio.html",
        {
            "/*STYLE*/": _bundle("../style.css") + _bundle("studio.css"),
            "<!--DATA-->": _packed(data.encode()),
            "<!--WORKER-->": _bundle("src/link_worker.js"),
            "/*CATALOG*/": catalog.script().replace("</", "<\\/"),
            "/*PAGE*/": _bundle("src/studio_here.js"),
        },
    )


def _whole(template: str, parts: dict[str, str]) -> str:
    _, wasm = build_twin()
    text = (SOURCE / template).read_text(encoding="utf-8")
    for mark, content in ({"<!--WASM-->": _packed(wasm.read_bytes())} | parts).items():
        if mark not in text:
            raise UserError(f"{SOURCE / template}: has no '{mark}'; restore it with git")
        text = text.replace(mark, content)
    return text


def modules() -> Path:
    """esbuild and uPlot, as pinned for the studio; fetched when that has changed."""
    if shutil.which("npm") is None:
        raise UserError("npm: not installed; run tools/zh site, which installs it")
    WORK.mkdir(parents=True, exist_ok=True)
    lock = (SOURCE.parent / "package-lock.json").read_text(encoding="utf-8")
    done = WORK / "node_modules" / "installed-lock.json"
    if not done.is_file() or done.read_text(encoding="utf-8") != lock:
        for name in ("package.json", "package-lock.json"):
            shutil.copyfile(SOURCE.parent / name, WORK / name)
        _run("npm", "ci", "--ignore-scripts", "--no-audit", "--no-fund", folder=WORK)
        done.write_text(lock, encoding="utf-8")
    return WORK / "node_modules"


def _bundle(name: str) -> str:
    """One script, or style, without imports; `</script` cannot stand in the page."""
    packages = modules()
    command = [packages / ".bin" / "esbuild", SOURCE / name, "--bundle", "--minify"]
    command += ["--format=iife", "--target=es2022", "--log-level=error"]
    command += [f"--external:{module}" for module in NODE]
    found = _run(*command, folder=WORK, modules=f"{packages}:{build_twin()[0].parent}")
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
