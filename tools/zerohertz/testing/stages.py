"""The stages of `zh test`."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterable
from pathlib import Path

from zerohertz.paths import BUILD, ROOT
from zerohertz.testing import (
    eva,
    include_rules,
    object_rules,
    page_rules,
    shape,
    source_rules,
    text_rules,
)
from zerohertz.testing.counts import junit_outcome
from zerohertz.testing.misra import cppcheck_suppressions, notices
from zerohertz.testing.stage import Log, Outcome, Stage

LOGS = BUILD / "test-logs"
PYTHON = Path(sys.executable)
RUFF = (PYTHON, "-m", "ruff")
CODESPELL = (PYTHON, "-m", "codespell_lib")
MYPY = (PYTHON, "-m", "mypy", "--config-file", "tools/pyproject.toml")
# What others build on; what these import is checked with them.
TYPED = ("drive", "plant", "sim", "sim_steps", "estimator", "gym")
RUFF_CONFIG = ("--config", "tools/pyproject.toml")
PYTHON_FOLDERS = ("tools", "tests")
C_FOLDERS = ("firmware", "hal", "host_sim", "tests")
SHELL_SCRIPTS = (
    "tools/zh",
    "tools/fetch_unity.sh",
    "tools/fetch_monocypher.sh",
    "tools/lock.sh",
    ".ci/run",
)
C_SUFFIXES = (".c", ".h", ".cpp", ".hpp")

# Of the firmware, with gcc: host_sim/CMakeLists.txt.
VARIANTS = ("O0", "O2", "O3", "native")
# Presets of the flash images.
IMAGES = (
    "qemu_mps2",
    "qemu_mps2_paper",
    "qemu_mps2_fieldbus",
    "stm32f405",
    "stm32f405_fieldbus",
    "stm32g431_esc",
    "stm32g431_ihm08m1",
    "template",
)

# Tested to the last branch and in every small change, and against MISRA.
PROVEN = ("firmware", "hal/boot")
# For cppcheck: but the loader's way from reset to main, which is the core's and not C's; and the
# headers of others that a loader includes.
START_UP = ("boot_reset.c",)
LOADER_NEEDS = (
    ROOT / "hal" / "cortex_m" / "cm_registers.h",
    ROOT / "tests" / "boot" / "toy" / "monocypher.h",
)

# CONVENTIONS 11: of the mutants that are not equivalent to the original.
MUTATION_SCORE_MIN = 0.95
MUTATION_SAMPLES = {"firmware": 400, "hal/boot": 60}
MUTATION_SEED = 2005


def all_stages() -> list[Stage]:
    """Every stage; the long ones that others wait for come first."""
    mutation = Stage("mutation", "seeded sample of mutants", _mutation, needs=("unit",), cores=2)
    return [*_that_run_the_code(), *_that_read_the_code(), mutation]


def _that_run_the_code() -> list[Stage]:
    return [
        Stage("build", "gcc, warnings as errors", _build("host"), quick=True),
        Stage("images", "flash images of every port", _images, quick=True),
        Stage("clang", "clang, warnings as errors, and its unit tests", _clang),
        Stage("unit", "unit tests", _ctest("host", "unit"), needs=("build",), quick=True),
        Stage(
            "powercut",
            "stored parameters under power cuts, a sample",
            _ctest("host", "powercut"),
            needs=("build",),
        ),
        Stage("sil", "plant in the loop", _ctest("host", "sil"), needs=("build",)),
        Stage("tools", "Python tests", _pytest("tests/tools"), needs=("build",)),
        Stage(
            "pil",
            "flash image on the emulated core",
            _pytest("tests/pil", "tests/fault"),
            needs=("build", "images"),
        ),
        Stage(
            "reference",
            "plant against independent truths",
            _ctest("host", "reference"),
            needs=("build",),
            quick=True,
        ),
        Stage("studio", "page of zh studio in Chromium", _pytest("tests/studio"), needs=("build",)),
        Stage(
            "web", "firmware, plant and page in a browser", _pytest("tests/web"), needs=("build",)
        ),
        Stage("asan", "sanitizers: unit, reference, fuzz", _build_and_ctest("asan")),
        *_that_read_for_minutes(),
        Stage(
            "bits",
            "gcc -O0 .. -O3, native and clang: the same bits",
            _bits,
            needs=("build", "clang"),
        ),
        Stage(
            "golden",
            "every traced signal has the committed bits",
            _golden,
            needs=("build",),
            cores=2,
            quick=True,
        ),
        Stage("coverage", "line and branch coverage of the firmware", _coverage),
    ]


def _that_read_for_minutes() -> list[Stage]:
    """Before the short ones: the last long stage would have one core, and the other wait for it."""
    return [
        Stage("tidy-cpp", "clang-tidy on the plant", _tidy(".cpp"), needs=("clang",)),
        Stage("cppcheck", "cppcheck with MISRA C:2012", _cppcheck),
    ]


def _that_read_the_code() -> list[Stage]:
    return [
        Stage("tidy-c", "clang-tidy on the firmware", _tidy(".c"), needs=("clang",)),
        Stage(
            "generated",
            "gain tables fresh and proven, pages of parameters and faults fresh",
            _generated,
        ),
        Stage("format", "clang-format", _format, quick=True),
        Stage("ruff", "ruff check and format", _ruff, quick=True),
        Stage("types", "mypy --strict on the Python interface", _types),
        Stage("shell", "shellcheck", _shell, quick=True),
        Stage("pages", "lines, links, words and spelling of all texts", _pages, quick=True),
        Stage("shape", "size of functions and files, layers, include cycles", _shape, quick=True),
        Stage("eva", "Frama-C on the guard: any input", _eva, asked=True),
        Stage(
            "rules",
            "identifiers, objects, nothing unbuilt",
            _rules,
            needs=("build", "images"),
            quick=True,
        ),
    ]


def c_files(folders: Iterable[str] = C_FOLDERS, suffixes: Iterable[str] = C_SUFFIXES) -> list[Path]:
    """C and C++ files of the checkout."""
    wanted = set(suffixes)
    return sorted(p for f in folders for p in (ROOT / f).rglob("*") if p.suffix in wanted)


def _build(preset: str) -> Callable[[Log], Outcome]:
    def run(log: Log) -> Outcome:
        if log.run("cmake", "--preset", preset, "-DZH_BUILD_TESTS=ON") != 0:
            return Outcome(0, 1, "configuring failed")
        if log.run("cmake", "--build", "--preset", preset, "--parallel", "2") != 0:
            return Outcome(0, 1, "the build failed")
        return Outcome(1, 0)

    return run


def _ctest(preset: str, test_preset: str) -> Callable[[Log], Outcome]:
    def run(log: Log) -> Outcome:
        junit = LOGS / f"ctest-{preset}-{test_preset}.xml"
        junit.unlink(missing_ok=True)
        code = log.run("ctest", "--preset", test_preset, "--output-junit", junit)
        outcome = junit_outcome(junit)
        if code != 0 and outcome.failed == 0:
            return Outcome(outcome.passed, 1, f"ctest ended with {code}")
        return outcome

    return run


def _build_and_ctest(preset: str) -> Callable[[Log], Outcome]:
    def run(log: Log) -> Outcome:
        built = _build(preset)(log)
        if built.failed:
            return built
        tested = _ctest(preset, preset)(log)
        return Outcome(built.passed + tested.passed, tested.failed, tested.note)

    return run


def _images(log: Log) -> Outcome:
    configured = log.check(*(("cmake", "--preset", preset) for preset in IMAGES))
    if configured.failed:
        return configured
    return log.check(*(("cmake", "--build", "--preset", preset) for preset in IMAGES))


_clang = _build_and_ctest("clang")


def _pytest(*folders: str) -> Callable[[Log], Outcome]:
    def run(log: Log) -> Outcome:
        junit = LOGS / f"pytest-{Path(folders[0]).name}.xml"
        junit.unlink(missing_ok=True)
        config = ("-c", "tools/pyproject.toml")
        code = log.run(PYTHON, "-m", "pytest", *config, f"--junitxml={junit}", *folders)
        outcome = junit_outcome(junit)
        if code != 0 and outcome.failed == 0:
            return Outcome(outcome.passed, 1, f"pytest ended with {code}")
        return outcome

    return run


def _coverage(log: Log) -> Outcome:
    folder = BUILD / "coverage"
    for stale in folder.rglob("*.gcda"):
        stale.unlink()
    tested = _build_and_ctest("coverage")(log)
    if tested.failed:
        return tested
    summary = LOGS / "coverage.json"
    summary.unlink(missing_ok=True)
    html = folder / "report"
    html.mkdir(exist_ok=True)
    judged = [word for name in PROVEN for word in ("--filter", f"{ROOT / name}/")]
    firmware = ("--root", ROOT, *judged, folder)
    log.run(
        *("gcovr", *firmware, "--exclude-unreachable-branches", "--branches", "--txt", "-"),
        *("--json-summary", summary, "--html-details", html / "index.html"),
    )
    return coverage_outcome(json.loads(summary.read_text()))


def coverage_outcome(summary: dict) -> Outcome:
    """One check for lines and one for branches: both of what is PROVEN have to be 100 %."""
    files = [f for f in summary["files"] if f["line_total"] > 0]
    note = f"lines {summary['line_percent']} %, branches {summary['branch_percent']} %"
    bad = [
        Path(f["filename"]).name
        for f in files
        if f["line_covered"] < f["line_total"] or f["branch_covered"] < f["branch_total"]
    ]
    if not files:
        return Outcome(0, 1, "no coverage data")
    lines_short = summary["line_covered"] < summary["line_total"]
    branches_short = summary["branch_covered"] < summary["branch_total"]
    failed = lines_short + branches_short
    return Outcome(2 - failed, failed, note + (f"; short: {', '.join(bad)}" if bad else ""))


def _tidy(suffix: str) -> Callable[[Log], Outcome]:
    def run(log: Log) -> Outcome:
        folder = _tidy_database()
        sources = {Path(entry["file"]) for entry in _commands(folder)}
        ours = [s for s in c_files(("firmware", "hal", "host_sim"), (suffix,)) if s in sources]
        return log.check(*(("clang-tidy", "--quiet", "-p", folder, source) for source in ours))

    return run


def _tidy_database() -> Path:
    """A folder whose compile_commands.json has each file once.

    clang-tidy reads a file once for each of its commands, and the libraries of the estimators and
    of the optimisation levels compile the same files: 770 commands for 179 files.
    """
    once = {entry["file"]: entry for entry in reversed(_commands(BUILD / "clang"))}
    folder = BUILD / "clang" / "tidy"
    folder.mkdir(exist_ok=True)
    (folder / "compile_commands.json").write_text(json.dumps(list(once.values())))
    return folder


def _commands(folder: Path) -> list[dict[str, str]]:
    return json.loads((folder / "compile_commands.json").read_text())


def _bits(log: Log) -> Outcome:
    target = ("--target", "zh_sil_variants", "--parallel", "2")
    if log.run("cmake", "--build", "--preset", "host", *target) != 0:
        return Outcome(0, 1, "the build failed")
    name = "libzerohertz_sil"
    libraries = [
        BUILD / "host" / "host_sim" / f"{name}.so",
        BUILD / "clang" / "host_sim" / f"{name}.so",
        *(BUILD / "host" / "host_sim" / f"{name}_{variant}.so" for variant in VARIANTS),
    ]
    return log.check((PYTHON, "-m", "zerohertz.testing.bits", *libraries))


def _golden(log: Log) -> Outcome:
    return log.check((PYTHON, "-m", "zerohertz", "golden"))


def _generated(log: Log) -> Outcome:
    zh = (PYTHON, "-m", "zerohertz")
    return log.check((*zh, "design", "--check"), (*zh, "certify"), (*zh, "params", "--check"))


def _cppcheck(log: Log) -> Outcome:
    """Once around each estimator, which all define the same types.

    The runs of the other estimators read num.h with its hints for gcc and clang too; in the run
    over all files that would be two configurations more of each.
    """
    hints: tuple[str, ...] = ("-U__GNUC__", "-U__clang__", "-U__OPTIMIZE__")
    suppressions = cppcheck_suppressions(ROOT / "firmware" / "misra_deviations.txt")
    code = 0
    for sources, headers in cppcheck_runs(
        [s for s in c_files((*PROVEN, "hal/include"), (".c",)) if s.name not in START_UP],
        [*c_files((*PROVEN, "hal/include"), (".h", ".def")), *LOADER_NEEDS],
    ):
        # Absolute, as the sources are: a header found by two paths would define its types twice.
        folders = sorted({header.parent for header in headers})
        code |= log.run(
            *("cppcheck", "--std=c11", "--quiet", "--addon=misra", "--inline-suppr", "-j", "1"),
            *("--enable=warning,style,performance,portability", "--error-exitcode=1"),
            *(f"-I{folder}" for folder in folders),
            "-UZH_ESTIMATOR_PARAMS",  # names a file
            *hints,
            "--suppress=missingIncludeSystem",
            *suppressions,
            *sources,
        )
        hints = ()
    listed = notices(log.path.read_text(encoding="utf-8", errors="replace"))
    failed = code != 0 or bool(listed)
    return Outcome(int(not failed), int(failed), f"{len(listed)} listed" if listed else "")


def cppcheck_runs(
    sources: list[Path], headers: list[Path], default: str = "hasegawa"
) -> list[tuple[list[Path], list[Path]]]:
    """Sources and headers of a run each: all with the default estimator, then each other one."""
    contract = ROOT / "firmware" / "law" / "estimator"
    found = {source.parent.name for source in sources if source.parent.parent == contract}
    runs = []
    for name in (default, *sorted(found - {default})):
        others = {contract / other for other in found - {name}}
        around = [header for header in headers if header.parent not in others]
        own = [source for source in sources if source.parent == contract / name]
        rest = [source for source in sources if source.parent not in others]
        runs.append((rest if name == default else own, around))
    return runs


def _eva(log: Log) -> Outcome:
    count, text = eva.alarms("eva_guard")
    log.write(text)
    seen = eva.alarms_with_defect("eva_guard")
    log.write(f"with a defect: {seen} alarms")
    failed = int(count > 0) + int(seen == 0)
    return Outcome(2 - failed, failed, f"{count} alarms, {seen} with a defect seeded")


def _format(log: Log) -> Outcome:
    return log.check(("clang-format", "--dry-run", "-Werror", *c_files()))


def _ruff(log: Log) -> Outcome:
    return log.check(
        (*RUFF, "check", *RUFF_CONFIG, *PYTHON_FOLDERS),
        (*RUFF, "format", "--check", *RUFF_CONFIG, *PYTHON_FOLDERS),
    )


def _types(log: Log) -> Outcome:
    return log.check((*MYPY, *(f"tools/zerohertz/{name}.py" for name in TYPED)))


def _shell(log: Log) -> Outcome:
    return log.check(("shellcheck", *SHELL_SCRIPTS))


def _pages(log: Log) -> Outcome:
    pages = page_rules.pages(ROOT)
    sources = text_rules.tracked(ROOT, *text_rules.HEADERS)
    if not pages or not sources:
        return Outcome(0, 1, "no page or no header found")
    texts = text_rules.of_pages(ROOT) + text_rules.of_sources(ROOT)
    texts += (commands := text_rules.of_commands())
    helps = log.path.with_suffix(".help.txt")
    helps.write_text("\n".join(passage.text for passage in commands), encoding="utf-8")
    spelling = log.check((*CODESPELL, *map(str, (*pages, *sources, helps))))
    long = text_rules.long_sentences(texts)
    log.write("\n".join(long))
    rules = _no_breaches(log, page_rules.check_tree(ROOT), text_rules.breaches(texts))
    failed = rules.failed + spelling.failed
    note = f"{len(long)} of {len(texts)} texts beyond {text_rules.AIM} words"
    return Outcome(rules.passed + spelling.passed, failed, rules.note or spelling.note or note)


def _shape(log: Log) -> Outcome:
    if shape.files_checked(ROOT) == 0:
        return Outcome(0, 1, "no source found")
    return _no_breaches(
        log,
        shape.check_tree(ROOT),
        include_rules.check_layers(ROOT),
        include_rules.check_cycles(ROOT),
    )


def _rules(log: Log) -> Outcome:
    if source_rules.files_checked(ROOT) == 0:
        return Outcome(0, 1, "no source found")
    database = [
        entry
        for preset in ("host", *IMAGES)
        for entry in json.loads((BUILD / preset / "compile_commands.json").read_text())
    ]
    return _no_breaches(
        log,
        source_rules.check_tree(ROOT),
        object_rules.check_build(BUILD / "host"),
        unbuilt(c_files(suffixes=(".c", ".cpp")), database),
    )


def _no_breaches(log: Log, *checks: list[str]) -> Outcome:
    """One check for each list of breaches, which has to be empty."""
    breaches = [breach for check in checks for breach in check]
    for breach in breaches:
        log.write(breach)
    failed = sum(bool(check) for check in checks)
    return Outcome(len(checks) - failed, failed, f"{len(breaches)} breaches" if failed else "")


def unbuilt(sources: Iterable[Path], database: Iterable[dict]) -> list[str]:
    """Sources that no CMakeLists.txt names: a test that is not built cannot fail. The estimators of
    tests/estimator, the one behind Python and the FMU are built by their tests and commands."""
    built = {Path(entry["file"]) for entry in database}
    own = {ROOT / "tests" / "estimator", *(ROOT / "host_sim" / n for n in ("fmu", "python_bridge"))}
    return [
        f"{source}: in no CMakeLists.txt"
        for source in sources
        if source not in built and own.isdisjoint(source.parents)
    ]


def _mutation(log: Log) -> Outcome:
    outcomes = [_mutation_of(log, *sample) for sample in MUTATION_SAMPLES.items()]
    failed = sum(outcome.failed for outcome in outcomes)
    return Outcome(len(outcomes) - failed, failed, "; ".join(o.note for o in outcomes))


def _mutation_of(log: Log, folder: str, sample: int) -> Outcome:
    result = LOGS / f"mutation-{folder.replace('/', '-')}.json"
    result.unlink(missing_ok=True)
    code = log.run(
        *(PYTHON, "tools/mutate.py", "--folder", folder, "--sample", sample),
        *("--seed", MUTATION_SEED, "--jobs", 2, "--minimum", MUTATION_SCORE_MIN),
        *("--json", result),
    )
    if not result.is_file():
        return Outcome(0, 1, f"{folder}: no result")
    score = json.loads(result.read_text())
    killed = f"{score['killed']} of {score['counted']} mutants killed"
    return Outcome(
        int(code == 0), int(code != 0), f"{folder}: {killed}, score {score['score']:.3f}"
    )
