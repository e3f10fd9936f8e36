"""What the tests of the browser's side share: the built twin and what it knows."""

from __future__ import annotations

import json
import shutil
import sys
from pathlib import Path
from typing import Any

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tools"))

from zerohertz.build import build_twin
from zerohertz.site import twin_data


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
