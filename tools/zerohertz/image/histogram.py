"""What the control interrupt of an image executes, instruction by instruction: a plugin in the
emulator counts (host_sim/instruction_count.c), the image's debug information tells the functions,
those that the compiler inlined included."""

from __future__ import annotations

import dataclasses
import re
import subprocess
import tempfile
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from zerohertz import sim
from zerohertz.build import build_image, ensure_built
from zerohertz.errors import UserError
from zerohertz.image import cycles, stack
from zerohertz.image.loop import PilRun, run

SLOTS = 16
_PLUGIN = "zh_instruction_count"
_BASE = 0x0040_0000  # of the code: hal/qemu_mps2/memory.ld
_COUNTED = "counted_interrupt"  # hal/qemu_mps2/main.c
_CALL = re.compile(rf"^ +[0-9a-f]+:\tbl\t([0-9a-f]+) <{_COUNTED}>\n +([0-9a-f]+):", re.MULTILINE)


@dataclass(frozen=True)
class Row:
    """One function of the source, mean over the periods counted."""

    function: str
    file: str
    instructions: float
    cycles: float
    by_slot: tuple[float, ...]  # of each slot; empty when the schedule stood still meanwhile


@dataclass(frozen=True)
class Histogram:
    """Periods first..last of one run."""

    run: PilRun
    first: int
    last: int
    rows: tuple[Row, ...]  # most instructions first

    @property
    def instructions(self) -> float:
        """Per period; the run counts the call itself and the timer's readings on top."""
        return sum(row.instructions for row in self.rows)

    @property
    def cycles_per_instruction(self) -> float:
        """Of what the interrupt executes; entry and exit of the exception not included."""
        return sum(row.cycles for row in self.rows) / self.instructions


def executed(job: sim.Job, preset: str, period: int) -> dict[int, int]:
    """Address -> how often the control interrupt executes it in that period."""
    _, counted = _counted(job, build_image(preset), period, period)
    return {address: times for address, (times, _) in counted[period % SLOTS].items()}


def count(job: sim.Job, preset: str, first: int, last: int) -> Histogram:
    """Run `job` on the image of a preset and count in its periods first..last."""
    elf = build_image(preset)
    ran, counted = _counted(job, elf, first, last)
    rows = _rows(elf, stack.disassembly(elf), counted, _phases(ran, first, last))
    return Histogram(ran, first, last, rows)


def _counted(
    job: sim.Job, elf: Path, first: int, last: int
) -> tuple[PilRun, dict[int, dict[int, tuple[int, int]]]]:
    library = ensure_built(_PLUGIN).folder / "host_sim" / f"lib{_PLUGIN}.so"
    call = _CALL.search(stack.disassembly(elf))
    if call is None:
        raise UserError(f"{elf}: no call of {_COUNTED}; the interrupt of main.c has to make it")
    with tempfile.TemporaryDirectory(prefix="zh-count-") as folder:
        out = Path(folder) / "counts"
        window = f"begin=0x{call[1]},end=0x{call[2]},first={first},last={last}"
        plugin = f"{library},out={out},base={_BASE:#x},{window}"
        # Up to `last` the run has to go; what it has behind it costs time only.
        ran = run(dataclasses.replace(job, max_steps=last + 1), elf, plugin=plugin)
        if not out.is_file():
            raise UserError(f"emulator: counted nothing; it said: {ran.text}")
        return ran, _read(out)


def _read(file: Path) -> dict[int, dict[int, tuple[int, int]]]:
    """Window modulo 16 -> address -> executed, left."""
    found: dict[int, dict[int, tuple[int, int]]] = defaultdict(dict)
    for line in file.read_text().splitlines():
        phase, address, executed, left = line.split()
        found[int(phase)][int(address, 16)] = (int(executed), int(left))
    return found


def _phases(ran: PilRun, first: int, last: int) -> dict[int, list[int]]:
    """Window modulo 16 -> the slots that its periods first..last were."""
    found: dict[int, list[int]] = defaultdict(list)
    for period in range(first, min(last + 1, len(ran.each.slot))):
        found[period % SLOTS].append(int(ran.each.slot[period]))
    return found


def _in_step(phases: dict[int, list[int]]) -> bool:
    """Whether every slot occurs, each in windows of its own."""
    every = sorted({slot for slots in phases.values() for slot in slots}) == list(range(SLOTS))
    return every and all(len(set(slots)) == 1 for slots in phases.values())


def _rows(
    elf: Path,
    disassembly: str,
    counted: dict[int, dict[int, tuple[int, int]]],
    phases: dict[int, list[int]],
) -> tuple[Row, ...]:
    code = cycles.instructions(disassembly)
    owner = functions_of(elf, {a for addresses in counted.values() for a in addresses})
    periods = sum(len(slots) for slots in phases.values())
    executed: dict[tuple[str, str], float] = defaultdict(float)
    spent: dict[tuple[str, str], float] = defaultdict(float)
    by_slot: dict[tuple[str, str], list[float]] = defaultdict(lambda: [0.0] * SLOTS)
    in_step = _in_step(phases)
    for phase, addresses in counted.items():
        for address, (times, _) in addresses.items():
            executed[owner[address]] += times / periods
            by_slot[owner[address]][phases[phase][0] % SLOTS] += times / len(phases[phase])
        for address, used in cycles.cycles(code, addresses).items():
            spent[owner[address]] += used / periods
    rows = (
        Row(*key, executed[key], spent[key], tuple(by_slot[key]) if in_step else ())
        for key in executed
    )
    return tuple(sorted(rows, key=lambda row: (-row.instructions, row.function)))


def functions_of(elf: Path, addresses: Iterable[int]) -> dict[int, tuple[str, str]]:
    """Address -> function and file: the innermost function of a .c file it was inlined from. The
    small ones in headers count for who uses them."""
    asked = "".join(f"{address:#x}\n" for address in addresses)
    command = ("arm-none-eabi-addr2line", "-a", "-i", "-f", "-s", "-e", str(elf))
    text = subprocess.run(command, input=asked, check=True, capture_output=True, text=True).stdout
    found = {}
    for block in re.split(r"^0x", text, flags=re.MULTILINE)[1:]:
        lines = block.splitlines()
        places = (at.split(":")[0] for at in lines[2::2])
        frames = list(zip(lines[1::2], places, strict=True))
        modules = [frame for frame in frames if frame[1].endswith(".c")]
        found[int(lines[0], 16)] = modules[0] if modules else frames[-1]
    return found
