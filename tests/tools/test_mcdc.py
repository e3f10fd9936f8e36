"""What the coverage of conditions says: read from llvm's JSON, told by file and line."""

from __future__ import annotations

from zerohertz.campaign.mcdc import as_dict, decisions
from zerohertz.paths import ROOT

SOURCE = "firmware/guard/monitor.c"


def exported(*conditions: list[bool]) -> dict:
    """As `llvm-cov-19 export` writes it: a function of the guard, and one of somebody else."""
    records = [[10 + k, 9, 10 + k, 85, 0, 5, seen] for k, seen in enumerate(conditions)]
    ours = {"filenames": [str(ROOT / SOURCE)], "mcdc_records": records}
    other = {"filenames": [str(ROOT / "tests/x.c")], "mcdc_records": [[1, 1, 1, 9, 0, 5, [False]]]}
    return {"data": [{"functions": [ours, other]}]}


def test_a_decision_has_its_place_and_its_conditions() -> None:
    (one,) = decisions(exported([True, True]))
    assert (one.file, one.line, one.conditions) == (SOURCE, 10, (True, True))
    assert one.gaps == ()


def test_a_condition_that_never_decides_alone_is_a_gap() -> None:
    found = decisions(exported([True, True], [False, True, False]))
    assert found[1].gaps == (1, 3)
    assert as_dict(found) == {
        "decisions": 2,
        "conditions": 5,
        "covered": 3,
        "gaps": [{"file": SOURCE, "line": 11, "conditions": (1, 3)}],
    }


def test_an_inline_function_counts_once_for_all_who_use_it() -> None:
    both = exported([True, False])
    both["data"][0]["functions"] += exported([False, True])["data"][0]["functions"]
    (one,) = decisions(both)
    assert one.conditions == (True, True)


def test_nothing_measured_is_no_coverage() -> None:
    assert as_dict(decisions(exported()))["decisions"] == 0
