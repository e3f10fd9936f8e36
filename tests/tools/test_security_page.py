"""SECURITY.md names tests that exist, files that exist, and every parameter once."""

from __future__ import annotations

import re
from collections import Counter

from zerohertz import param_list
from zerohertz.paths import ROOT

PAGE = (ROOT / "SECURITY.md").read_text(encoding="utf-8")
INVARIANTS = re.findall(r"^\| (S\d+) \|(.*)\|(.*)\|(.*)\|$", PAGE, re.MULTILINE)
PARAMETERS = PAGE.split("## Parameters by harm")[1].split("## Not defended")[0]


def known_tests() -> str:
    files = [p for s in ("*.c", "*.py", "*.cpp") for p in (ROOT / "tests").rglob(s)]
    names = [f for p in files for f in re.findall(r"\b(test_\w+)\(", p.read_text("utf-8"))]
    cmake = (ROOT / "tests/fuzz/CMakeLists.txt").read_text("utf-8")
    fuzz = re.findall(r"NAME (fuzz\.\w+)", cmake)
    return " ".join([*names, *fuzz, "fuzz.fuzz_link", *campaigns()])


def campaigns() -> list[str]:
    """`powercut.update` stands for all runs of that name."""
    cmake = (ROOT / "tests/boot/CMakeLists.txt").read_text("utf-8")
    return re.findall(r"set\(name (powercut\.\w+)\.", cmake)


def test_each_invariant_names_tests_that_exist() -> None:
    known = set(known_tests().split())
    assert [name for name, *_ in INVARIANTS] == [f"S{k + 1}" for k in range(len(INVARIANTS))]
    assert len(INVARIANTS) >= 10
    for name, _, _, tests in INVARIANTS:
        named = re.findall(r"`([\w.]+)`", tests)
        assert named, name
        assert set(named) <= known, f"{name}: {set(named) - known}"


def test_each_invariant_names_files_that_exist() -> None:
    for name, _, where, _ in INVARIANTS:
        files = re.findall(r"`([\w./]+)`", where)
        assert files, name
        for file in files:
            found = (
                (ROOT / file).is_file() if "/" in file else any(ROOT.rglob(f"firmware/*/{file}"))
            )
            assert found, f"{name}: {file}"


def test_every_parameter_has_its_harm() -> None:
    """A new parameter: say in SECURITY.md what it can do in the wrong hands."""
    entries = param_list.entries()
    marked = re.findall(r"`(\w+)`( P)?", PARAMETERS)
    assert Counter(name for name, _ in marked) == Counter(entries.keys())
    protected = {name for name, mark in marked if mark}
    assert protected == {name for name, e in entries.items() if str(e.access) == "PROTECTED"}
