"""`zh site`: the twin and the documentation as one static folder."""

from __future__ import annotations

import gzip
from pathlib import Path
from typing import Annotated

import typer

TWIN = "twin.html"


def register(app: typer.Typer) -> None:
    """Add `zh site`."""
    app.command("site")(site)


def site(
    out: Annotated[Path, typer.Option(help="Folder for the site.")] = Path("build/site"),
    only_twin: Annotated[
        bool, typer.Option("--only-twin", help="Only write the simulator page, no documentation.")
    ] = False,
) -> None:
    """Write a static site: the drive in the browser, and the documentation.

    Open index.html from the folder; no server is needed. The first time it installs emscripten from
    Debian (109 MB to fetch, 0.8 GB installed) and doxygen (6 MB, 22 MB installed), and builds
    firmware and plant as WebAssembly.
    """
    from zerohertz.console import short_paths, tell
    from zerohertz.paths import make_folder
    from zerohertz.site import docs, twin_data, twin_page

    make_folder(out, "--out")
    tell("zh: running the atlas and the figures for the twin")
    data = twin_data.content()
    tell("zh: building firmware and plant as WebAssembly")
    page = twin_page.page(data, docs="" if only_twin else "index.html")
    if only_twin:
        (out / TWIN).write_text(page, encoding="utf-8")
    else:
        tell("zh: writing the documentation")
        links = docs.build(out, {TWIN: page, "studio.html": twin_page.studio_page()})
        print(f"{short_paths((out / 'index.html').resolve())}: {links} links checked")
    size_MB = len(gzip.compress(page.encode(), 9)) / 1e6
    print(f"{short_paths((out / TWIN).resolve())}: {size_MB:.2f} MB gzipped")
