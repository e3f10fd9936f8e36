"""A mutation run: draw mutants, judge them on all cores, set the accepted survivors apart."""

from __future__ import annotations

import random
import tomllib
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path
from queue import SimpleQueue

from zerohertz.build import PRESET, configure_tests
from zerohertz.campaign.mutants import Mutant, mutants
from zerohertz.campaign.mutation_bench import (
    EQUIVALENT,
    INVALID,
    KILLED,
    SURVIVED,
    MutationBench,
    Tree,
    is_rival,
)
from zerohertz.errors import UserError
from zerohertz.paths import BUILD, ROOT

# A program's main and its way there: no unit test links them.
ON_THE_CORE = ("boot_main.c", "boot_reset.c")
ACCEPTED_FILE = ROOT / "tools" / "mutation_survivors.toml"


@dataclass(frozen=True)
class Change:
    """A mutant as a reader sees it, and as the list of accepted ones names it."""

    file: str
    line: str
    becomes: str


@dataclass(frozen=True)
class Result:
    """Counts, and the survivors that nobody has accepted."""

    total: int
    verdicts: dict[str, int]
    accepted: int
    survivors: tuple[dict[str, str | int], ...]
    stale: tuple[dict[str, str], ...]

    @property
    def counted(self) -> int:
        """Mutants that can be told from the original and that nobody accepted."""
        return self.verdicts[KILLED] + len(self.survivors)

    @property
    def score(self) -> float:
        """Killed of those counted."""
        return self.verdicts[KILLED] / self.counted if self.counted else 0.0

    @property
    def raw_score(self) -> float:
        """Killed of all that compile to other code, accepted or not."""
        judged = self.verdicts[KILLED] + self.verdicts[SURVIVED]
        return self.verdicts[KILLED] / judged if judged else 0.0

    def as_dict(self) -> dict:
        """For the JSON file."""
        return {
            "total": self.total,
            "invalid": self.verdicts[INVALID],
            "equivalent": self.verdicts[EQUIVALENT],
            "killed": self.verdicts[KILLED],
            "survived": self.verdicts[SURVIVED],
            "accepted": self.accepted,
            "counted": self.counted,
            "score": round(self.score, 5),
            "raw_score": round(self.raw_score, 5),
            "survivors": list(self.survivors),
            "stale": list(self.stale),
        }


def all_mutants(folder: str, only: Sequence[str] = ()) -> list[Mutant]:
    """Mutants of the C files of a folder, or of those named in `only`."""
    files = _files(ROOT / folder)
    unknown = set(only) - {path.name for path in files}
    if unknown or not files:
        raise UserError(f"{folder}: no file {', '.join(sorted(unknown)) or '*.c'}; see its listing")
    chosen = [path for path in files if not only or path.name in only]
    return [m for path in chosen for m in mutants(str(path.relative_to(ROOT)), path.read_text())]


def _files(folder: Path) -> list[Path]:
    found = sorted(folder.rglob("*.[ch]"))
    return [path for path in found if not is_rival(path) and path.name not in ON_THE_CORE]


def read_accepted(path: Path = ACCEPTED_FILE) -> dict[Change, str]:
    """Accepted survivors and why each may live."""
    if not path.is_file():
        return {}
    accepted = {}
    for number, entry in enumerate(tomllib.loads(path.read_text()).get("survivor", []), start=1):
        missing = {"file", "line", "becomes", "reason"} - entry.keys()
        if missing or len(entry["reason"].strip()) < 10:
            what = f"no {', '.join(sorted(missing))}" if missing else "reason is too short"
            raise UserError(f"{path.name}: survivor {number}: {what}; say why it may live")
        accepted[Change(entry["file"], entry["line"], entry["becomes"])] = entry["reason"]
    return accepted


def run(
    chosen: Sequence[Mutant], jobs: int, done: Callable[[str], None], whole: bool = False
) -> Result:
    """Judge the chosen mutants; `whole` also looks for accepted ones that no longer exist."""
    work = BUILD / "mutation"
    configure_tests()
    bench = MutationBench(work, BUILD / PRESET)
    trees: SimpleQueue[Tree] = SimpleQueue()
    for number in range(jobs):
        trees.put(Tree(work / f"tree-{number}"))

    def judge(mutant: Mutant) -> str:
        tree = trees.get()
        try:
            verdict = bench.judge(tree, mutant)
        finally:
            trees.put(tree)
        done(verdict)
        return verdict

    with ThreadPoolExecutor(max_workers=jobs) as pool:
        verdicts = list(pool.map(judge, chosen))
    return _result(chosen, verdicts, whole)


def _result(chosen: Sequence[Mutant], verdicts: Sequence[str], whole: bool) -> Result:
    texts = {mutant.file: (ROOT / mutant.file).read_text() for mutant in chosen}
    accepted = read_accepted()
    seen: set[Change] = set()
    survivors = []
    for mutant, verdict in zip(chosen, verdicts, strict=True):
        change = Change(mutant.file, *mutant.before_after(texts[mutant.file]))
        if verdict == SURVIVED and change in accepted:
            seen.add(change)
        elif verdict == SURVIVED:
            survivors.append({**asdict(change), "number": mutant.line, "kind": mutant.kind})
    counts = Counter(verdicts)
    stale = [asdict(c) for c in accepted if whole and c.file in texts and c not in seen]
    return Result(
        total=len(chosen),
        verdicts={name: counts[name] for name in (KILLED, SURVIVED, INVALID, EQUIVALENT)},
        accepted=counts[SURVIVED] - len(survivors),
        survivors=tuple(survivors),
        stale=tuple(stale),
    )


def draw(population: Sequence[Mutant], sample: int, seed: int) -> list[Mutant]:
    """A sample that depends on the seed alone; 0 takes all."""
    if sample <= 0 or sample >= len(population):
        return list(population)
    return sorted(
        random.Random(seed).sample(list(population), sample), key=lambda m: (m.file, m.start)
    )
