"""Mutants are the changes they claim to be, and leave alone what is no behaviour."""

from __future__ import annotations

import subprocess
import sys

import pytest

from zerohertz.campaign import mutation_bench
from zerohertz.campaign.mutants import mutants
from zerohertz.campaign.mutation import Change, Result, all_mutants, draw, read_accepted
from zerohertz.errors import UserError
from zerohertz.paths import ROOT


def changed(text: str) -> set[str]:
    """What the last line of the text can become."""
    return {m.before_after(text)[1] for m in mutants("x.c", text)}


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("float f(void) { return a - b; }", "float f(void) { return a + b; }"),
        ("float f(void) { return a * b; }", "float f(void) { return a / b; }"),
        ("float f(void) { return -b; }", "float f(void) { return b; }"),
        ("int f(void) { return a < b; }", "int f(void) { return a <= b; }"),
        ("int f(void) { return a && b; }", "int f(void) { return a || b; }"),
        ("int f(void) { return !b; }", "int f(void) { return b; }"),
        ("float f(void) { return 2.0f; }", "float f(void) { return 0.0f; }"),
        ("float f(void) { return 2.0f; }", "float f(void) { return 2.2f; }"),
        ("int f(void) { return 3u; }", "int f(void) { return 4u; }"),
        ("int f(void) { return 0x10u; }", "int f(void) { return 0x11u; }"),
        ("void f(void) { s->x = y; }", "void f(void) { ; }"),
        ("void f(void) { g(y); }", "void f(void) { ; }"),
        ("float f(void) { return clampf(x, lo, hi); }", None),
        ("float f(void) { return minf(a, b); }", "float f(void) { return maxf(a, b); }"),
        ("float f(void) { return a.alpha; }", "float f(void) { return a.beta; }"),
        ("void f(void) { if (a) { } }", "void f(void) { if (!(a)) { } }"),
        ("#define LIMIT 4.0f /* why */", "#define LIMIT 0.0f /* why */"),
    ],
)
def test_an_operator_makes_its_mutant(text, expected):
    expected = expected or "float f(void) { return clampf(x, hi, lo); }"
    assert expected in changed(text)


@pytest.mark.parametrize(
    "text",
    [
        "/* a - b */",
        'const char *s = "a - b";',
        "#include <stdint.h>",
        "typedef struct { float *x; int y[4]; } s_t;",
        "enum { A = 1, B = 2 };",
        "float f(const ab_t *x, float *y);",
        "void f(void) { assert(a < b); }",
    ],
)
def test_what_is_no_behaviour_is_left_alone(text):
    assert mutants("x.c", text) == []


def test_a_declaration_is_not_removed():
    assert "void f(void) { ; }" not in changed("void f(void) { const float x = g; }")


def test_applying_a_mutant_changes_only_its_place():
    text = "int a = b + c;\nint d = e;\n"
    (plus,) = [m for m in mutants("x.c", text) if m.new == "-"]
    assert plus.apply(text) == "int a = b - c;\nint d = e;\n"


def test_a_sample_depends_on_the_seed_alone():
    population = mutants("x.c", "int f(void) { return a + b - c * d / e + g - h; }\n")
    assert draw(population, 3, 1) == draw(population, 3, 1)
    assert draw(population, 0, 1) == population
    assert len(draw(population, 3, 2)) == 3


@pytest.mark.parametrize(("option", "value"), [("--sample", "-3"), ("--jobs", "0")])
def test_a_senseless_number_is_refused(option, value):
    words = [sys.executable, ROOT / "tools" / "mutate.py", option, value]
    done = subprocess.run(words, capture_output=True, text=True, timeout=600)
    assert done.returncode == 2
    assert done.stderr.startswith(f"error: {option}: is {value}")


@pytest.mark.parametrize(
    ("script", "passes"),
    [("exit 0", True), ("exit 1", False), ("kill -SEGV $$", False), ("while :; do :; done", False)],
)
def test_a_test_that_fails_crashes_or_loops_kills_the_mutant(tmp_path, monkeypatch, script, passes):
    monkeypatch.setattr(mutation_bench, "TEST_CPU_LIMIT_S", 1)
    program = tmp_path / "test"
    program.write_text(f"#!/bin/sh\n{script}\n")
    program.chmod(0o755)
    assert mutation_bench._passes(program) == passes


def test_the_core_has_mutants_and_an_unknown_file_is_an_error():
    assert len(all_mutants("firmware/law")) > 500
    with pytest.raises(UserError, match=r"nothing\.c"):
        all_mutants("firmware/law", ["nothing.c"])


def test_an_accepted_survivor_needs_a_reason(tmp_path):
    listed = tmp_path / "survivors.toml"
    entry = '[[survivor]]\nfile = "a.c"\nline = "x = 1;"\nbecomes = "x = 2;"\n'
    listed.write_text(entry + 'reason = "both are clamped to the same value"\n')
    assert list(read_accepted(listed)) == [Change("a.c", "x = 1;", "x = 2;")]
    listed.write_text(entry)
    with pytest.raises(UserError, match="no reason"):
        read_accepted(listed)
    listed.write_text(entry + 'reason = "ok"\n')
    with pytest.raises(UserError, match="too short"):
        read_accepted(listed)


def test_the_score_leaves_out_accepted_and_equivalent_mutants():
    verdicts = {"killed": 18, "survived": 4, "invalid": 5, "equivalent": 6}
    result = Result(33, verdicts, accepted=2, survivors=({}, {}), stale=())
    assert result.counted == 20
    assert result.score == pytest.approx(18 / 20)
    assert result.raw_score == pytest.approx(18 / 22)
