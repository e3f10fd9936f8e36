"""The documentation as static pages: MkDocs Material, and a check of every link."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from collections.abc import Mapping
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import yaml

from zerohertz.console import tell
from zerohertz.errors import UserError
from zerohertz.paths import BUILD
from zerohertz.site import c_reference, pages, twin_page

CONFIG = Path(__file__).with_name("mkdocs.yml")
STYLE = Path(__file__).with_name("site.css")
WORK = BUILD / "site-docs"
SHIM = "assets/javascripts/iframe-worker.js"
_SHIM_SCRIPT = re.compile(r'src="?https?://[^">\s]*iframe-worker/shim"?')


def build(out: Path, made: Mapping[str, str]) -> int:
    """Write the site into `out`, with pages made elsewhere; returns how many links were checked."""
    config = yaml.safe_load(CONFIG.read_text(encoding="utf-8"))
    config["nav"] += pages.unlisted(config["nav"])
    sources = list(pages.leaves(config["nav"]))
    shutil.rmtree(WORK, ignore_errors=True)
    folder = WORK / "pages"
    pages.stage(sources, folder)
    if not c_reference.write(folder, WORK):
        tell("zh: no doxygen here: the page of the C interface says how to get it")
    for name, text in made.items():
        (folder / name).write_text(text, encoding="utf-8")
    shutil.copyfile(STYLE, folder / STYLE.name)
    config |= {"nav": pages.placed(config["nav"]), "docs_dir": str(folder)}
    file = WORK / "mkdocs.yml"
    file.write_text(yaml.safe_dump(config, sort_keys=False), encoding="utf-8")
    # Not into `out` itself: MkDocs empties the folder that it writes.
    made = WORK / "site"
    _run_mkdocs(file, made)
    _bring_the_shim(made)
    wrong, count = broken_links(made)
    if wrong:
        raise UserError("site: links that lead nowhere: " + "; ".join(wrong[:10]))
    shutil.copytree(made, out, dirs_exist_ok=True)
    return count


def _run_mkdocs(file: Path, out: Path) -> None:
    command = (sys.executable, "-m", "mkdocs", "build", "--quiet", "--strict", "--clean")
    done = subprocess.run(
        (*command, "--config-file", file, "--site-dir", out),
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode != 0:
        raise UserError(f"mkdocs: {(done.stderr + done.stdout).strip()[-3000:]}")


def _bring_the_shim(out: Path) -> None:
    """Search needs a worker, which a page opened as a file only has through this script; MkDocs
    Material would fetch it from the network."""
    shutil.copyfile(twin_page.modules() / "iframe-worker/shim/index.js", out / SHIM)
    for path in out.rglob("*.html"):
        text = path.read_text(encoding="utf-8")
        local = "../" * (len(path.relative_to(out).parts) - 1) + SHIM
        path.write_text(_SHIM_SCRIPT.sub(f'src="{local}"', text), encoding="utf-8")


class _Page(HTMLParser):
    """Addresses that a page leads to, and its anchors."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.links: list[str] = []
        self.anchors: set[str] = set()
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Collect href, src, id and name."""
        for name, value in attrs:
            if name in ("href", "src") and value:
                self.links.append(value)
            elif name in ("id", "name") and value:
                self.anchors.add(value)


def broken_links(folder: Path) -> tuple[list[str], int]:
    """Links within the site that lead nowhere, or outside; and how many there are."""
    found = {
        path: _Page(path.read_text(encoding="utf-8"))
        for path in folder.rglob("*.html")
        if path.name != "404.html"
    }
    wrong = []
    count = 0
    for path, page in found.items():
        for link in page.links:
            count += 1
            if not _leads_somewhere(path, link, found):
                wrong.append(f"{path.relative_to(folder)}: {link}")
    return wrong, count


def _leads_somewhere(path: Path, link: str, found: dict[Path, _Page]) -> bool:
    parts = urlsplit(link)
    if parts.scheme in ("data", "mailto", "blob"):
        return True
    if parts.scheme or parts.netloc:
        return False  # nothing is fetched from the network, and no registry is named
    target = (path.parent / unquote(parts.path)).resolve() if parts.path else path.resolve()
    if not target.is_file():
        return False
    page = found.get(target)
    # Addresses within the twin are names of its tabs.
    return (
        not parts.fragment
        or page is None
        or target.name == "twin.html"
        or (unquote(parts.fragment) in page.anchors)
    )
