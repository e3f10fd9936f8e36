"""Counts tests, and finds the slow ones, in the JUnit files that ctest and pytest write."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path

from zerohertz.testing.stage import Outcome


@dataclass(frozen=True)
class TimedTest:
    """A test, the JUnit file that names it, and how long it took."""

    run: str
    name: str
    seconds: float


def slowest_tests(folder: Path, since: float, count: int = 10) -> list[TimedTest]:
    """The slowest tests of the JUnit files in `folder` written after `since`, a time of day."""
    tests = [
        TimedTest(path.stem, _full_name(case), float(case.get("time", 0.0)))
        for path in sorted(folder.glob("*.xml"))
        if path.stat().st_mtime >= since
        for case in ET.parse(path).iter("testcase")
    ]
    return sorted(tests, key=lambda test: -test.seconds)[:count]


def junit_outcome(path: Path) -> Outcome:
    """Passed and failed cases of a JUnit file; no file, or no case at all, is one failure."""
    if not path.is_file():
        return Outcome(0, 1, "no test ran")
    cases = list(ET.parse(path).iter("testcase"))
    skipped = sum(_has(case, "skipped") or case.get("status") == "disabled" for case in cases)
    failed = sum(
        _has(case, "failure") or _has(case, "error") or case.get("status") == "fail"
        for case in cases
    )
    passed = len(cases) - failed - skipped
    if passed + failed == 0:
        return Outcome(0, 1, "no test ran")
    note = f"{passed} of {passed + failed} tests passed"
    return Outcome(passed, failed, note + (f", {skipped} skipped" if skipped else ""))


def _full_name(case: ET.Element) -> str:
    """pytest names the file as the class; ctest repeats the test's name there."""
    name, owner = case.get("name", "?"), case.get("classname", "")
    return name if owner in ("", name) else f"{owner}.{name}"


def _has(case: ET.Element, tag: str) -> bool:
    return case.find(tag) is not None
