"""`zh test` itself: order, failures, counts, lists."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from zerohertz.campaign.mutation import all_mutants
from zerohertz.errors import UserError
from zerohertz.testing import watchdog
from zerohertz.testing.counts import TimedTest, junit_outcome, slowest_tests
from zerohertz.testing.misra import cppcheck_suppressions, notices
from zerohertz.testing.runner import run_stages
from zerohertz.testing.stage import Log, Outcome, Stage
from zerohertz.testing.stages import (
    MUTATION_SAMPLES,
    PROVEN,
    all_stages,
    coverage_outcome,
    unbuilt,
)
from zerohertz.testing.watchdog import StoppedError


def run(stages, tmp_path):
    ended = []
    reports = run_stages(stages, tmp_path, 2, lambda s: None, lambda r: ended.append(r.stage.name))
    return {report.stage.name: report for report in reports}, ended


def passing(log: Log) -> Outcome:
    return Outcome(1, 0)


def failing(log: Log) -> Outcome:
    return Outcome(3, 1)


def test_a_stage_waits_for_what_it_needs(tmp_path):
    stages = [Stage("second", "", passing, needs=("first",)), Stage("first", "", passing)]
    reports, ended = run(stages, tmp_path)
    assert ended == ["first", "second"]
    assert all(report.ok for report in reports.values())


def test_a_failure_stops_only_what_depends_on_it(tmp_path):
    stages = [
        Stage("bad", "", failing),
        Stage("after", "", passing, needs=("bad",)),
        Stage("last", "", passing, needs=("after",)),
        Stage("other", "", passing, cores=2),
    ]
    reports, _ = run(stages, tmp_path)
    assert {name for name, report in reports.items() if report.ok} == {"other"}
    assert reports["after"].skipped
    assert reports["last"].outcome.failed == 1


def test_a_check_that_breaks_is_a_failure(tmp_path):
    def broken(log: Log) -> Outcome:
        raise RuntimeError("no")

    reports, _ = run([Stage("broken", "", broken)], tmp_path)
    assert not reports["broken"].ok
    assert "RuntimeError: no" in (tmp_path / "broken.log").read_text()


def test_a_stage_that_ran_nothing_is_a_failure(tmp_path):
    reports, _ = run([Stage("empty", "", lambda log: Outcome(0, 0))], tmp_path)
    assert not reports["empty"].ok


def test_a_missing_program_is_a_failed_check(tmp_path):
    outcome = Log(tmp_path / "x.log").check(("no-such-program-here",), ("true",), ("false",))
    assert (outcome.passed, outcome.failed) == (1, 2)
    assert "run tools/zh setup" in (tmp_path / "x.log").read_text()


def test_every_need_of_a_stage_exists():
    names = [stage.name for stage in all_stages()]
    assert len(set(names)) == len(names)
    assert all(need in names for stage in all_stages() for need in stage.needs)
    quick = {stage.name for stage in all_stages() if stage.quick}
    assert all(need in quick for s in all_stages() if s.quick for need in s.needs)


@pytest.mark.parametrize(
    ("cases", "expected"),
    [
        ('<testcase name="a"/><testcase name="b"/>', (2, 0)),
        ('<testcase name="a"/><testcase name="b"><failure/></testcase>', (1, 1)),
        ('<testcase name="a"><error/></testcase>', (0, 1)),
        ('<testcase name="a"/><testcase name="b"><skipped/></testcase>', (1, 0)),
        ('<testcase name="a" status="fail"/>', (0, 1)),
        ("", (0, 1)),
    ],
)
def test_junit_cases_are_counted(tmp_path, cases, expected):
    path = tmp_path / "junit.xml"
    path.write_text(f"<testsuites><testsuite>{cases}</testsuite></testsuites>")
    outcome = junit_outcome(path)
    assert (outcome.passed, outcome.failed) == expected


def test_no_junit_file_is_a_failure(tmp_path):
    assert junit_outcome(tmp_path / "none.xml").failed == 1


def test_the_slowest_tests_of_this_run_come_first(tmp_path):
    def junit(name: str, *cases: str) -> None:
        text = "".join(f"<testcase {case}/>" for case in cases)
        (tmp_path / f"{name}.xml").write_text(f"<testsuite>{text}</testsuite>")

    junit("ctest-unit", *(f'name="unit.{i}" classname="unit.{i}" time="0.{i}"' for i in range(9)))
    junit("pytest-tools", 'name="test_x" classname="tools.test_sim" time="7.5"', 'name="n"')
    junit("ctest-old", 'name="of an earlier run" time="99"')
    os.utime(tmp_path / "ctest-old.xml", (1.0, 1.0))
    slowest = slowest_tests(tmp_path, since=2.0)
    assert len(slowest) == 10
    assert slowest[0] == TimedTest("pytest-tools", "tools.test_sim.test_x", 7.5)
    assert slowest[1] == TimedTest("ctest-unit", "unit.8", 0.8)


def test_a_command_that_hangs_fails_its_check(tmp_path, monkeypatch):
    def hangs(process, output):
        process.wait()
        raise StoppedError("stopped: it hangs")

    monkeypatch.setattr(watchdog, "wait", hangs)
    assert Log(tmp_path / "x.log").check(("true",)) == Outcome(0, 1)
    assert "true: stopped: it hangs" in (tmp_path / "x.log").read_text()


def coverage(lines: int, branches: int) -> dict:
    counts = {"line_covered": lines, "line_total": 10, "branch_covered": branches}
    counts |= {"branch_total": 4, "line_percent": 10.0 * lines, "branch_percent": 25.0 * branches}
    return {"files": [{"filename": "core/pi.c", **counts}], **counts}


def test_coverage_below_all_lines_and_all_branches_fails():
    assert coverage_outcome(coverage(10, 4)) == Outcome(2, 0, "lines 100.0 %, branches 100.0 %")
    assert coverage_outcome(coverage(9, 4)).failed == 1
    assert coverage_outcome(coverage(9, 3)).failed == 2
    assert "short: pi.c" in coverage_outcome(coverage(10, 3)).note


def test_the_boot_loader_is_judged_as_the_firmware_is():
    assert {"firmware", "hal/boot"} == set(PROVEN) == set(MUTATION_SAMPLES)
    for name in MUTATION_SAMPLES:
        assert all_mutants(name)


def test_no_coverage_data_is_a_failure():
    assert coverage_outcome({**coverage(10, 4), "files": []}).failed == 1


def test_a_deviation_from_misra_needs_its_reason(tmp_path):
    listed = tmp_path / "deviations.txt"
    listed.write_text("# comment\n\n15.5 guard clauses return early\n20.1 params.c list expanded\n")
    assert cppcheck_suppressions(listed) == [
        "--suppress=misra-c2012-15.5",
        "--suppress=misra-c2012-20.1:*params.c",
    ]
    listed.write_text("15.5\n")
    with pytest.raises(UserError, match="line 1"):
        cppcheck_suppressions(listed)


def test_what_cppcheck_only_lists_is_counted():
    said = (
        "$ cppcheck --std=c11 --suppress=misra-c2012-2.5 /x/pi.c\n"
        "/x/pi.c:15:13: style: misra violation (use --rule-texts) [misra-c2012-5.9]\n"
        "static bool params_valid(void)\n            ^\n"
        "/x/pi.h:2:1: warning: Something is odd. [uninitvar]\n"
    )
    assert [line[:12] for line in notices(said)] == ["/x/pi.c:15:1", "/x/pi.h:2:1:"]
    assert notices("$ cppcheck --std=c11 /x/pi.c\n") == []


def test_a_source_that_no_target_builds_is_told():
    database = [{"file": "/x/test_pi.c"}]
    assert unbuilt([Path("/x/test_pi.c")], database) == []
    assert unbuilt([Path("/x/test_new.c")], database) == ["/x/test_new.c: in no CMakeLists.txt"]
