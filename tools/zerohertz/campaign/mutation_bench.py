"""Builds mutants and runs the unit tests on them.

Every worker owns a copy of the sources. Of a mutated .c file one object is compiled; of a header
all objects that include it. The object is linked before the library of the unmutated ones, so the
linker takes the mutated one. Only tests that link or include the file are run, its own first.
"""

from __future__ import annotations

import json
import re
import shlex
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

from zerohertz.campaign.mutants import Mutant
from zerohertz.errors import UserError
from zerohertz.paths import ROOT
from zerohertz.testing.watchdog import limit_cpu

FOLDERS = ("firmware", "hal", "gain_tables", "tests/unit", "tests/boot")
ESTIMATORS = ROOT / "firmware" / "law" / "estimator"
FLAGS = ("-std=c11", "-O0", "-w", "-ffp-contract=off", "-fmax-errors=1")
COMPILE_TIMEOUT_S = 60.0
TEST_CPU_LIMIT_S = 5

KILLED, SURVIVED, INVALID, EQUIVALENT = "killed", "survived", "invalid", "equivalent"


SECOND_PART = str(ROOT / "hal" / "stm32g431")


def is_rival(path: Path) -> bool:
    """An estimator beside the drive's own: it defines functions of the same names."""
    return ESTIMATORS in path.parent.parents and path.parent.name != "hasegawa"


@dataclass(frozen=True)
class Unit:
    """One source file: its path below the root, its -I and -D flags, and the files it includes."""

    source: str
    flags: tuple[str, ...]
    includes: frozenset[str]

    @property
    def object_name(self) -> str:
        """A flat, unique name."""
        return self.source.replace("/", "__") + ".o"

    @property
    def is_test(self) -> bool:
        """Whether it has a main function of its own."""
        return Path(self.source).name.startswith("test_")


class MutationBench:
    """The unmutated objects, and which test depends on which file."""

    def __init__(self, work: Path, build: Path) -> None:
        self.base = work / "base"
        shutil.rmtree(work, ignore_errors=True)
        self.tree = Tree(work / "base-tree")
        self.base.mkdir(parents=True)
        self.units = {unit.source: unit for unit in self._read_units(build)}
        if not any(unit.is_test for unit in self.units.values()):
            raise UserError(f"{build}: no unit test configured; run cmake --preset host")
        for unit in self.units.values():
            done = self.tree.compile(unit, self.base / unit.object_name)
            if done != 0:
                raise UserError(f"{unit.source}: does not compile; mend it before mutating it")
        self._make_library()
        self.members = {test: self._link_base(test) for test in self.units.values() if test.is_test}
        self.assembly: dict[str, bytes] = {}

    def tests_of(self, file: str) -> list[Unit]:
        """Tests that depend on a file, cheapest diagnosis first: its own, then the smallest."""
        users = self._users(file)
        own = f"test_{Path(file).stem}.c"
        tests = [t for t, members in self.members.items() if (members | {t.source}) & users]
        return sorted(
            tests, key=lambda t: (Path(t.source).name != own, len(self.members[t]), t.source)
        )

    def judge(self, tree: Tree, mutant: Mutant) -> str:
        """Killed by a test, survived all, equivalent to the original, or no C at all."""
        original = (ROOT / mutant.file).read_text()
        tree.write(mutant.file, mutant.apply(original))
        try:
            verdict = self._run_tests(tree, mutant.file)
            if verdict == SURVIVED and self._same_code(tree, mutant.file):
                return EQUIVALENT
            return verdict
        finally:
            tree.write(mutant.file, original)

    def _run_tests(self, tree: Tree, file: str) -> str:
        objects: dict[str, Path] = {}
        for test in self.tests_of(file):
            needed = {test.source, *self.members[test]} & self._users(file)
            for source in sorted(needed - set(objects)):
                unit = self.units[source]
                target = tree.folder / unit.object_name
                if tree.compile(unit, target) != 0:
                    return INVALID
                objects[source] = target
            program = tree.folder / "program"
            if self._link(test, [objects[s] for s in sorted(needed)], program).returncode != 0:
                return INVALID
            if not _passes(program):
                return KILLED
        return SURVIVED

    def _same_code(self, tree: Tree, file: str) -> bool:
        """Whether gcc -O2 gives the same assembly as for the original, in every user."""
        for source in sorted(self._users(file)):
            unit = self.units[source]
            if source not in self.assembly:
                self.assembly[source] = self.tree.assembly(unit)
            if tree.assembly(unit) != self.assembly[source]:
                return False
        return True

    def _users(self, file: str) -> set[str]:
        return {s for s, unit in self.units.items() if s == file or file in unit.includes}

    def _read_units(self, build: Path) -> list[Unit]:
        database = build / "compile_commands.json"
        if not database.is_file():
            raise UserError(f"{database}: missing; run cmake --preset host")
        # The C of the gain tables is made by the build.
        ours = (*FOLDERS, str((build / "gain_tables").relative_to(ROOT)))
        units = {}
        for entry in json.loads(database.read_text()):
            source = Path(entry["file"])
            is_unity = source.name == "unity.c"
            relative = str(source.relative_to(ROOT)) if source.is_relative_to(ROOT) else ""
            if source.suffix != ".c" or not (is_unity or relative.startswith(ours)):
                continue
            # Of two parts with drivers of the same names one is enough.
            if is_rival(source) or SECOND_PART in entry["command"]:
                continue
            flags = _flags(entry["command"])
            name = relative or str(source)
            units[name] = Unit(name, flags, frozenset(self.tree.includes(name, flags)))
        return list(units.values())

    def _make_library(self) -> None:
        objects = [self.base / unit.object_name for unit in self.units.values() if not unit.is_test]
        subprocess.run(["ar", "rcs", self.base / "all.a", *objects], check=True)

    def _link_base(self, test: Unit) -> frozenset[str]:
        """Link a test unmutated; the files whose objects the linker took."""
        program = self.base / Path(test.source).stem
        done = self._link(test, [self.base / test.object_name], program, "-Wl,--trace,--trace")
        if done.returncode != 0:
            raise UserError(f"{test.source}: does not link: {done.stderr.strip()}")
        if not _passes(program):
            raise UserError(f"{test.source}: fails without any mutation; mend it first")
        taken = set(re.findall(r"all\.a\)?\(?([^()\s]+\.o)", done.stdout))
        return frozenset(s for s, unit in self.units.items() if unit.object_name in taken)

    def _link(
        self, test: Unit, objects: list[Path], program: Path, *flags: str
    ) -> subprocess.CompletedProcess[str]:
        own = self.base / test.object_name
        if not any(path.name == own.name for path in objects):
            objects = [own, *objects]
        words = ["gcc", *flags, "-o", program, *objects, self.base / "all.a", "-lm"]
        return subprocess.run(words, capture_output=True, text=True, timeout=COMPILE_TIMEOUT_S)


class Tree:
    """A copy of the sources in which one file at a time is mutated."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        folder.mkdir(parents=True)
        for name in FOLDERS:
            shutil.copytree(ROOT / name, folder / name)

    def write(self, file: str, text: str) -> None:
        """Replace one file."""
        (self.folder / file).write_text(text)

    def compile(self, unit: Unit, target: Path) -> int:
        """Exit code of the compiler."""
        return self._gcc(unit, *FLAGS, "-c", "-o", target).returncode

    def assembly(self, unit: Unit) -> bytes:
        """Optimised code as text: equal for equivalent sources, whatever the lines are called."""
        done = self._gcc(unit, *FLAGS, "-O2", "-S", "-o", "-")
        return done.stdout

    def includes(self, source: str, flags: tuple[str, ...]) -> set[str]:
        """Files that a source includes, below the root."""
        unit = Unit(source, flags, frozenset())
        words = self._gcc(unit, "-MM").stdout.decode().replace("\\\n", " ").split()[1:]
        # What lies beside the source is named relative to the folder.
        paths = [self.folder / word for word in words]
        return {str(p.relative_to(self.folder)) for p in paths if p.is_relative_to(self.folder)}

    def _gcc(self, unit: Unit, *options: str | Path) -> subprocess.CompletedProcess[bytes]:
        moved = [self._moved(flag) for flag in unit.flags]
        # Relative where possible, so that both trees give the same assembly.
        source = unit.source if (self.folder / unit.source).exists() else ROOT / unit.source
        return subprocess.run(
            ["gcc", *moved, *options, source],
            cwd=self.folder,
            capture_output=True,
            timeout=COMPILE_TIMEOUT_S,
        )

    def _moved(self, flag: str) -> str:
        """An include path into the checkout, led here instead; the test framework stays there."""
        for name in FOLDERS:
            flag = flag.replace(str(ROOT / name), str(self.folder / name))
        return flag


def _flags(command: str) -> tuple[str, ...]:
    """What of a compiler's command says where to look and what is defined."""
    words = shlex.split(command)
    pairs = zip(words, [*words[1:], ""], strict=True)
    found = ((word, after) if word == "-isystem" else (word,) for word, after in pairs)
    return tuple(w for ws in found if ws[0].startswith(("-I", "-D", "-isystem")) for w in ws)


def _passes(program: Path) -> bool:
    """Whether a test program ends well; one that crashes or computes for ever does not."""
    quiet = subprocess.DEVNULL
    with subprocess.Popen([program], stdin=quiet, stdout=quiet, stderr=quiet) as process:
        limit_cpu(process, TEST_CPU_LIMIT_S)
        return process.wait() == 0
