"""The pictures of the site in tools/docs: `tools/zh python -m zerohertz.site.pictures`.

Needs a site in build/site (`zh site`), Chromium and the packages of the tests.
"""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path
from typing import Any

from PIL import Image
from playwright.sync_api import Page, sync_playwright

from zerohertz.paths import BUILD, ROOT

SITE = BUILD / "site"
DOCS = ROOT / "tools" / "docs"
SIZE: Any = {"width": 1280, "height": 830}
COLORS = 128
HELD_S = 14.0  # of the drive's time: the flux has been steered


def main() -> None:
    """Take both."""
    with sync_playwright() as tool:
        chromium = shutil.which("chromium")
        browser = tool.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        page = browser.new_page(viewport=SIZE, color_scheme="light")
        page.goto((SITE / "index.html").as_uri())
        page.wait_for_selector(".md-search__input", state="visible")
        _take(page, DOCS / "site_start.png")
        page.goto((SITE / "twin.html").as_uri() + "#hand")
        page.wait_for_selector("html[data-ready=yes]")
        _go_to_zero(page)
        _take(page, DOCS / "twin_wedge.png")
        browser.close()


def _go_to_zero(page: Page) -> None:
    status = "document.getElementById('status').innerText"
    page.select_option("#hand-pace", "4")
    page.wait_for_function(f"/running/.test({status})")
    page.wait_for_timeout(700)
    page.click("#hand-zero")
    page.wait_for_timeout(1000 * HELD_S / 4)


def _take(page: Page, path: Path) -> None:
    """With a palette: a third of the bytes."""
    with tempfile.TemporaryDirectory() as folder:
        raw = Path(folder) / "raw.png"
        page.screenshot(path=raw)
        Image.open(raw).convert("RGB").quantize(COLORS).save(path, optimize=True)
    print(f"{path.relative_to(ROOT)}: {path.stat().st_size} bytes")


if __name__ == "__main__":
    main()
