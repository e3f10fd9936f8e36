"""What the tests of the browser's side share: the built twin and what it knows."""

from __future__ import annotations

import json
import shutil
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tools"))

from zerohertz.build import build_twin
from zerohertz.site import docs, twin_data, twin_page

LAPTOP = {"width": 1280, "height": 860}
WAIT_MS = 180_000


@pytest.fixture(scope="session")
def twin_js() -> Path:
    if shutil.which("emcc") is None:
        pytest.skip("no emscripten here: tools/zh test --only web installs it")
    return build_twin()[0]


@pytest.fixture(scope="session")
def data() -> dict[str, Any]:
    """Without the atlas; the hashes are those of the native library, computed now."""
    return twin_data.content(atlas=False)


@pytest.fixture(scope="session")
def data_file(data: dict[str, Any], tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("twin") / "data.json"
    path.write_text(json.dumps(data), encoding="utf-8")
    return path


@pytest.fixture(scope="session")
def site(twin_js: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder that `zh site` writes."""
    del twin_js
    pytest.importorskip("mkdocs", reason="tools/zh test --only web installs it")
    folder = tmp_path_factory.mktemp("site")
    twin = twin_page.page(twin_data.content(), docs="index.html")
    docs.build(folder, {"twin.html": twin, "studio.html": twin_page.studio_page()})
    return folder


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    chromium = shutil.which("chromium")
    if chromium is None:
        pytest.skip("no chromium here: tools/zh test --only web installs it")
    tools = pytest.importorskip("playwright.sync_api")
    with tools.sync_playwright() as tool:
        # The sandbox needs what a container does not give.
        browser = tool.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        yield browser
        browser.close()


@pytest.fixture
def open_page(browser: Any, site: Path) -> Iterator[Callable[..., Any]]:
    """Opens a file of the site without a network; at the end no script may have failed."""
    failures: list[str] = []
    contexts = []

    def opened(file: str, size: dict[str, int] = LAPTOP) -> Any:
        context = browser.new_context(viewport=size, reduced_motion="reduce", offline=True)
        contexts.append(context)
        page = context.new_page()
        page.set_default_timeout(WAIT_MS)
        page.on("pageerror", lambda error: failures.append(str(error)))
        page.on("request", lambda r: failures.append(r.url) if r.url.startswith("http") else None)
        page.add_init_script(
            "window.runs = []; addEventListener('run', (e) => window.runs.push(e.detail))"
        )
        page.goto(f"{site.as_uri()}/{file}")
        return page

    yield opened
    for context in contexts:
        context.close()
    assert not failures
