"""Makes the package of tools/ importable, also for a plain `pytest tests/tools`."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tools"))
