"""Counts tests in the JUnit files that ctest and pytest write."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

from zerohertz.testing.stage import Outcome


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


def _has(case: ET.Element, tag: str) -> bool:
    return case.find(tag) is not None
