"""The rules on the firmware's text and objects refuse what they are there to refuse."""

from __future__ import annotations

import subprocess

import pytest

from zerohertz.testing import object_rules
from zerohertz.testing.source_rules import check_text, check_tree


def breaches(text: str) -> list[str]:
    return [what for _, what in check_text(text)]


@pytest.mark.parametrize(
    "line",
    [
        "void *p = malloc(4u);",
        'printf("x");',
        "goto out;",
        "double x = 1.0f;",
        "float y = sinf(x);",
        "float y = sqrt(x);",
        "float y = 0.5 * x;",
        "float y = 1e-3 * x;",
        "static int count;",
        "void f(void) { static float memory = 0.0f; }",
        "static const char *name = 0;",
        "typedef void (*callback)(int);",
    ],
)
def test_what_the_firmware_must_not_do_is_refused(line):
    assert len(breaches(line)) == 1


@pytest.mark.parametrize(
    "line",
    [
        "/* malloc, goto and 0.5 in a comment */",
        "float y = sqrtf(x) + 0.5f + 1e-3f;",
        "static const float table[2] = {1.0f, 2.0f};",
        "static const char *const name = 0;",
        "static float scaled(float x) { return x; }",
        "static inline bool ok(void);",
        "y = state.log + other->exp;",
        "uint32_t n = 0x1Eu;",
    ],
)
def test_what_the_firmware_may_do_passes(line):
    assert breaches(line) == []


def test_the_line_of_a_breach_is_told():
    text = "/* two\n   lines */\n#include <stdint.h>\n\nstatic int count;\n"
    assert check_text(text) == [(5, "static data that can change; state belongs in a struct")]


def test_function_pointers_live_in_the_hal(tmp_path):
    text = "typedef void (*callback)(int);\n"
    assert check_text(text, pointers=True) == []
    for folder in ("firmware/law/base", "hal/include"):
        (tmp_path / folder).mkdir(parents=True)
        (tmp_path / folder / "x.h").write_text(text)
    assert [line.split(":")[0] for line in check_tree(tmp_path)] == ["firmware/law/base/x.h"]


def test_a_tree_is_searched_folder_by_folder(tmp_path):
    base = tmp_path / "firmware" / "law" / "base"
    base.mkdir(parents=True)
    (base / "bad.c").write_text("int x;\ngoto y;\n")
    assert [line.split(": ")[0] for line in check_tree(tmp_path)] == ["firmware/law/base/bad.c:2"]


def build_archives(root, core_text: str) -> None:
    for name in ("law", "host"):
        folder = root / "firmware" / name
        folder.mkdir(parents=True)
        text = core_text if name == "law" else f"int {name}(void) {{ return 1; }}\n"
        (folder / "x.c").write_text(text)
        subprocess.run(["gcc", "-c", "x.c", "-fno-builtin", "-w"], cwd=folder, check=True)
        subprocess.run(["ar", "rcs", f"lib{name}.a", "x.o"], cwd=folder, check=True)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("const int table[2] = {1, 2};\nint f(void) { return table[1]; }\n", ""),
        ("int counter = 1;\n", ".data"),
        ("static int counter; int *f(void) { return &counter; }\n", ".bss"),
        ("float sinf(float); float f(float x) { return sinf(x); }\n", "'sinf'"),
        ("float sqrtf(float); float f(float x) { return sqrtf(x); }\n", ""),
        ("int host(void); int f(void) { return host(); }\n", ""),
        ("void *malloc(unsigned long); void *f(void) { return malloc(1); }\n", "'malloc'"),
    ],
)
def test_objects_with_state_or_foreign_calls_are_refused(tmp_path, text, expected):
    build_archives(tmp_path, text)
    found = object_rules.check_build(tmp_path)
    assert len(found) == (1 if expected else 0)
    assert all(expected in line for line in found)


def test_missing_libraries_are_a_breach(tmp_path):
    assert len(object_rules.check_build(tmp_path)) == 1
