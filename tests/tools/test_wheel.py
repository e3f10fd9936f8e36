"""The package of `zh wheel`: from the source distribution into an empty virtual environment."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

from zerohertz.golden.runs import hashes_of
from zerohertz.paths import BUILD, ROOT
from zerohertz.release.wheel import MAX_BYTES, build_sdist, build_wheel, mirror, platform_tag

EXAMPLES = ROOT / "tools" / "zerohertz" / "examples"
RUN = "figures.fig16.recommended"
SAMPLE = ("1_first_run", "4_your_observer", "7_monte_carlo")  # all: `zh campaign notebooks`
SITE = Path(pytest.__file__).parents[1]  # what this checkout has installed, but for the package


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    sdist = build_sdist(folder)
    with tarfile.open(sdist) as archive:
        archive.extractall(folder, filter="data")
    unpacked = folder / sdist.name.removesuffix(".tar.gz")
    files = {p.relative_to(unpacked): p for p in unpacked.rglob("*") if p.is_file()}
    # In a place that stays: objects of unchanged sources are used again.
    return build_wheel(folder, mirror(BUILD / "test_wheel", files))


@pytest.fixture(scope="module")
def python(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Of an environment with the wheel and what it asks for."""
    folder = tmp_path_factory.mktemp("venv")
    subprocess.run((sys.executable, "-m", "venv", "--without-pip", folder), check=True)
    program = folder / "bin" / "python"
    pip = (sys.executable, "-m", "pip", "--python", program, "install", "--quiet")
    subprocess.run((*pip, "-c", ROOT / "tools" / "requirements.txt", wheel), check=True)
    return program


def run(python: Path, *words: object, **environment: str) -> subprocess.CompletedProcess[str]:
    """Away from the checkout, of which it may see nothing."""
    given = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "ZEROHERTZ"))}
    return subprocess.run(
        [str(word) for word in (python, *words)],
        cwd=python.parent,
        env=given | environment,
        capture_output=True,
        text=True,
        timeout=300,
    )


def test_the_wheel_is_small_and_holds_every_module_and_file_of_a_run(wheel: Path) -> None:
    assert wheel.stat().st_size < MAX_BYTES
    names = set(zipfile.ZipFile(wheel).namelist())
    tools = ROOT / "tools"
    modules = {str(p.relative_to(tools)) for p in (tools / "zerohertz").rglob("*.py")}
    assert modules <= names
    data = {
        f"zerohertz/packed/{path.relative_to(ROOT)}"
        for folder in ("gain_tables", "host_sim")
        for path in (ROOT / folder).rglob("*")
        if path.suffix == ".toml" or path.name == "l_gain.json"
    }
    assert data <= names
    assert "zerohertz/py.typed" in names


def test_numpy_is_the_only_requirement(python: Path) -> None:
    installed = {p.name.split("-")[0] for p in python.parents[1].rglob("*.dist-info")}
    assert installed == {"numpy", "zerohertz"}


def test_the_import_takes_less_than_300_ms(python: Path) -> None:
    code = "import time; t = time.process_time(); from zerohertz import Drive, Plant; "
    code += "print(time.process_time() - t)"
    assert min(float(run(python, "-c", code).stdout) for _ in range(3)) < 0.3


def test_the_library_gives_the_bits_of_the_native_build(python: Path) -> None:
    code = "import json; from zerohertz.golden import runs; "
    done = run(python, "-c", code + f"print(json.dumps(runs.hashes_of({RUN!r})))")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) == dict(hashes_of(RUN))


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.py")), ids=lambda path: path.stem)
def test_the_examples_run(python: Path, path: Path) -> None:
    others = {} if path.stem == "python_plant" else {"PYTHONPATH": str(SITE)}
    done = run(python, path, **others)
    assert done.returncode == 0, done.stderr
    assert ("reward" if "gym" in path.stem else "estimated") in done.stdout.splitlines()[-1]


def notebooks() -> list[Path]:
    every = sorted((ROOT / "tools" / "notebooks").glob("*.ipynb"))
    if os.environ.get("ZH_ALL_NOTEBOOKS") == "1":
        return every
    return [path for path in every if path.stem in SAMPLE]


@pytest.mark.parametrize("path", notebooks(), ids=lambda path: path.stem)
def test_a_notebook_needs_the_wheel_alone(python: Path, path: Path, tmp_path: Path) -> None:
    """Its cells in their order; others' packages come from this environment."""
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    code = "\n\n".join("".join(c["source"]) for c in cells if c["cell_type"] == "code")
    script = tmp_path / f"{path.stem}.py"
    script.write_text(f"{code}\n\nimport zerohertz\nprint(zerohertz.__file__)\n")
    done = run(python, script, PYTHONPATH=str(SITE), MPLBACKEND="Agg")
    assert done.returncode == 0, done.stderr
    assert Path(done.stdout.splitlines()[-1]).is_relative_to(python.parents[1])


def test_ours_and_the_rivals_are_libraries_of_their_own(python: Path) -> None:
    text = (ROOT / "tools" / "cmake" / "ZhEstimator.cmake").read_text()
    rivals = text.split("set(ZH_RIVALS", 1)[1].split(")", 1)[0].split()
    code = (
        "import sys; from zerohertz.estimator import Estimator, built_library, events\n"
        "from zerohertz.paths import ROOT\n"
        "motor = ROOT / 'gain_tables' / 'hasegawa2005'\n"
        "for name in sys.argv[1:]:\n"
        "    with Estimator(motor, period_s=2e-4, library=built_library(name)) as estimator:\n"
        "        print(name, len(estimator.run(events(5, i_alpha_A=1.0))))\n"
    )
    names = ["hasegawa", *rivals]
    done = run(python, "-c", code, *names)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.split() == [word for name in names for word in (name, "5")]


def test_zh_names_the_extra_that_it_lacks(python: Path) -> None:
    done = run(python.parent / "zh", "modes")
    assert done.returncode == 2
    assert "pip install 'zerohertz[cli]'" in done.stderr


@pytest.mark.parametrize(("command", "text"), [("test", "needs the sources"), ("pil", "needs")])
def test_a_command_that_needs_the_checkout_says_so(python: Path, command: str, text: str) -> None:
    done = run(python, "-m", "zerohertz", command, PYTHONPATH=str(SITE))
    assert done.returncode == 2
    assert done.stderr.startswith(f"error: zh {command}: {text}")
    assert done.stderr.count("\n") == 1


def test_zh_judges_the_golden_runs_from_the_wheel(python: Path) -> None:
    done = run(python, "-m", "zerohertz", "golden", "--only", "fig18", PYTHONPATH=str(SITE))
    assert (done.returncode, done.stderr) == (0, "")
    assert "no bit differs" in done.stdout


@pytest.mark.parametrize(
    ("symbols", "tag"),
    [
        ("GLIBC_2.2.5 GLIBC_2.14", "manylinux_2_28_x86_64"),
        ("GLIBC_2.32 GLIBCXX_3.4.29", "manylinux_2_34_x86_64"),
        ("GLIBC_2.17 GLIBCXX_3.4.30", "manylinux_2_35_x86_64"),
        ("GLIBC_2.99", None),
    ],
)
def test_the_platform_is_as_old_as_the_symbols_allow(symbols: str, tag: str | None) -> None:
    assert platform_tag(symbols) == tag
