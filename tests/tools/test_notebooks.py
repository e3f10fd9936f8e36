"""The notebooks run from top to bottom and are stored without results."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from zerohertz.build import ensure_built
from zerohertz.paths import ROOT

nbformat = pytest.importorskip("nbformat")
nbclient = pytest.importorskip("nbclient")

FOLDER = ROOT / "tools" / "notebooks"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))
# The others run with `zh campaign notebooks`.
SAMPLE = ("1_first_run", "3_gain_table", "7_monte_carlo")
LONGEST_S = 180  # of a cell; a notebook takes a third of that on a machine with nothing else to do


def asked_for() -> list[Path]:
    everything = os.environ.get("ZH_ALL_NOTEBOOKS") == "1"
    return [path for path in NOTEBOOKS if everything or path.stem in SAMPLE]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_no_results_are_committed(path: Path) -> None:
    notebook = nbformat.read(path, as_version=4)
    nbformat.validate(notebook)
    assert all(not cell.outputs for cell in notebook.cells if cell.cell_type == "code")
    assert all(cell.execution_count is None for cell in notebook.cells if "outputs" in cell)


@pytest.mark.parametrize("path", asked_for(), ids=lambda path: path.stem)
def test_it_runs(path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ensure_built()
    monkeypatch.setenv("PYTHONPATH", str(ROOT / "tools"))
    monkeypatch.setenv("IPYTHONDIR", str(tmp_path / "ipython"))
    monkeypatch.setenv("MPLBACKEND", "module://matplotlib_inline.backend_inline")
    notebook = nbformat.read(path, as_version=4)
    # Where it runs nothing but the package can be seen.
    client = nbclient.NotebookClient(
        notebook, timeout=LONGEST_S, resources={"metadata": {"path": str(tmp_path)}}
    )
    client.execute()
