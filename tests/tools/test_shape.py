"""What is too long or too branched is told; what is at the limit is not."""

from __future__ import annotations

import pytest

from zerohertz.testing.shape import LIMITS, check_text, check_tree, files_checked

C, PYTHON, CPP = LIMITS


def c_function(lines: int, branches: int = 0, parameters: str = "void") -> str:
    body = ["    if (a) { b(); }"] * branches
    body += ["    /* a comment counts */"] * (lines - 3 - branches)
    return "\n".join([f"COLD static INLINE bool f({parameters})", "{", *body, "}"]) + "\n"


def python_function(lines: int, branches: int = 0) -> str:
    body = ["    if a: b()"] * branches + ["    a = 1"] * (lines - 1 - branches)
    return "\n".join(["def f(", *body]).replace("def f(", "def f():") + "\n"


@pytest.mark.parametrize(
    ("name", "text", "limits", "expected"),
    [
        ("x.c", c_function(40), C, []),
        ("x.c", c_function(41), C, [":1 f: 41 lines, at most 40"]),
        ("x.h", c_function(41), C, [":1 f: 41 lines, at most 40"]),
        ("x.c", c_function(30, branches=9), C, []),
        ("x.c", c_function(30, branches=10), C, [":1 f: 11 complexity, at most 10"]),
        ("x.c", c_function(9, parameters="int a, int b, int c, int d, int e"), C, []),
        (
            "x.c",
            c_function(9, parameters="int a, int b, int c, int d, int e, int f"),
            C,
            [":1 f: 6 parameters, at most 5"],
        ),
        ("x.c", "\n" * 300, C, []),
        ("x.c", "\n" * 301, C, [": 301 lines, at most 300"]),
        ("x.cpp", c_function(60), CPP, []),
        ("x.cpp", c_function(61), CPP, [":1 f: 61 lines, at most 60"]),
        ("x.cpp", c_function(30, branches=12), CPP, [":1 f: 13 complexity, at most 12"]),
        ("x.py", python_function(60), PYTHON, []),
        ("x.py", python_function(61), PYTHON, [":1 f: 61 lines, at most 60"]),
        ("x.py", python_function(30, branches=11), PYTHON, []),
        ("x.py", python_function(30, branches=12), PYTHON, [":1 f: 13 complexity, at most 12"]),
    ],
)
def test_what_is_over_a_limit_is_told(name, text, limits, expected):
    assert check_text(name, text, limits) == expected


@pytest.mark.parametrize(
    "text",
    [
        "CHECKED bool f(void)\n{\n    return %s;\n}\n",
        "float f(void)\n{\n    return %s;\n}\n",
        "INLINE bool\nf(const x_config_t *cfg)\n{\n    const bool x = %s;\n}\n",
    ],
)
def test_operators_count_as_branches(text):
    and_or = text % (" && ".join("abcdef") + " || " + " || ".join("ghijk"))
    choices = text % ("a ? b : " * 11 + "c")
    assert "11 complexity" in check_text("x.c", and_or, C)[0]
    assert "12 complexity" in check_text("x.c", choices, C)[-1]


def test_a_function_after_macros_and_conditional_code_is_seen():
    text = (
        "#ifdef NDEBUG\n#define CHECK(x)\n#else\n#define CHECK(x) { assert(x); }\n#endif\n"
        'ZH_SECTION(".ramfunc") COLD static bool small(void)\n{\n    return true;\n}\n\n'
    )
    assert [line.split(":")[1] for line in check_text("x.c", text + c_function(50), C)] == ["11 f"]


def test_a_command_inside_another_function_counts_for_both():
    text = "def register(app):\n    @app.command()\n    def run():\n" + "        a = 1\n" * 61
    assert [line.split(":")[1] for line in check_text("x.py", text, PYTHON)] == [
        "3 register.run",
        "1 register",
    ]


def test_a_tree_is_searched_folder_by_folder(tmp_path):
    for name, text in {
        "firmware/law/mode/vector.c": c_function(41),
        "hal/port/main.c": c_function(41),
        "host_sim/plant.cpp": c_function(61),
        "tools/zerohertz/x.py": python_function(61),
        "tests/unit/test_x.c": c_function(500),
    }.items():
        (tmp_path / name).parent.mkdir(parents=True)
        (tmp_path / name).write_text(text)
    assert files_checked(tmp_path) == 4
    assert [line.split(" ")[0] for line in check_tree(tmp_path)] == [
        "firmware/law/mode/vector.c:1",
        "hal/port/main.c:1",
        "tools/zerohertz/x.py:1",
        "host_sim/plant.cpp:1",
    ]
