"""What is measured: speed of the simulation, time of a table's design, instructions per period.

Times are CPU time of this process, medians of several runs; they depend on the machine and are
reported, never tested. Instructions are counted by callgrind and repeat exactly for one binary.
"""

from __future__ import annotations

import dataclasses
import re
import statistics
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from zerohertz import sim
from zerohertz.build import ensure_built
from zerohertz.errors import UserError
from zerohertz.paths import ROOT

RUNS = 5
DESIGN_RUNS = 3
MOTOR = ROOT / "gain_tables" / "hasegawa2005"
SCENARIO = ROOT / "host_sim" / "scenarios" / "smoke.toml"
RIG = ROOT / "host_sim" / "rigs" / "hasegawa2005.toml"
BOARD = ROOT / "host_sim" / "boards" / "paper.toml"
DURATION_S = {"averaged": 60.0, "switched": 15.0}
# Counted between these control periods of the scenario: loaded, at 300 min^-1, in state RUN.
COUNT_FROM, COUNT_TO = 11_500, 14_500
COUNTED = "unit_control_period"
TARGET = "zh_control_period_count"

Say = Callable[[str], None]


@dataclasses.dataclass(frozen=True)
class SimSpeed:
    """One inverter model."""

    sim_s_per_cpu_s: float
    controller_ns_per_step: float
    plant_ns_per_step: float


@dataclasses.dataclass(frozen=True)
class DesignTime:
    """One gain table by the LMIs."""

    entries: int
    solves: int  # runs of the solver Clarabel
    cpu_s: float


def simulation_speed(model: str, runs: int = RUNS) -> SimSpeed:
    """Whole closed-loop runs with the rig's noise and dead time, recorded every 10 ms."""
    job = sim.Job(
        scenario=SCENARIO,
        rig=RIG,
        board=BOARD,
        motor_dir=MOTOR,
        scenario_overrides={"scenario.duration_s": DURATION_S[model]},
        rig_overrides={"inverter.model": model},
        decimate=50,
    )
    sim.run(dataclasses.replace(job, max_steps=1000))  # files parsed, library warm
    speeds = []
    for _ in range(runs):
        start_s = time.process_time()
        record = sim.run(job)
        speeds.append(record.steps * record.period_s / (time.process_time() - start_s))
        if record.trip:
            raise UserError(f"{SCENARIO}: the drive trips, so nothing is measured; see zh figures")
    # The split runs the firmware and the plant once more, each alone: on its own, not in the above.
    split = [sim.run(dataclasses.replace(job, time_split=True)) for _ in range(runs)]
    return SimSpeed(
        sim_s_per_cpu_s=statistics.median(speeds),
        controller_ns_per_step=statistics.median(r.controller_ns_per_step for r in split),
        plant_ns_per_step=statistics.median(r.plant_ns_per_step for r in split),
    )


def design_time(runs: int = DESIGN_RUNS) -> DesignTime:
    """The table of Table 1's motor by the two-stage LMI, certificate data included."""
    from zerohertz.gain_design.table import design_table
    from zerohertz.motor import load_motor, with_design

    motor = with_design(load_motor(MOTOR), method="gamma_pr")
    times = []
    for _ in range(runs):
        start_s = time.process_time()
        table = design_table(motor)
        times.append(time.process_time() - start_s)
    return DesignTime(len(table.gain), table.solves, statistics.median(times))


def instructions_per_step() -> float:
    """Instructions executed inside one control period in state RUN, on this host."""
    program = ensure_built(TARGET).folder / "host_sim" / TARGET
    first = _instructions(program, COUNT_FROM)
    return (_instructions(program, COUNT_TO) - first) / (COUNT_TO - COUNT_FROM)


def compiler() -> str:
    """What the count is bound to: the compiler's own line."""
    try:
        done = subprocess.run(("gcc", "--version"), capture_output=True, text=True, check=False)
    except FileNotFoundError:
        return "none"
    return done.stdout.splitlines()[0] if done.stdout else "unknown"


def _instructions(program: Path, steps: int) -> int:
    """Of all control periods together in a run of so many."""
    return collected(program, (SCENARIO, RIG, BOARD, MOTOR, steps), COUNTED)


def collected(program: Path, arguments: tuple[object, ...], toggle: str | None) -> int:
    """Instructions callgrind counts, inside the functions `toggle` or, without it, in all.

    The fifth argument is the number of periods; the program says how many it ran, and any trip.
    """
    with tempfile.TemporaryDirectory() as folder:
        command = (
            *("valgrind", "--tool=callgrind", f"--callgrind-out-file={folder}/out"),
            *((f"--toggle-collect={toggle}",) if toggle else ()),
            *(str(program), *map(str, arguments)),
        )
        try:
            done = subprocess.run(command, capture_output=True, text=True, check=False)
        except FileNotFoundError:
            raise UserError("valgrind: not installed; run tools/zh setup") from None
    if done.returncode != 0:
        # valgrind's own lines begin with its process number.
        said = [line for line in done.stderr.splitlines() if not line.startswith("==")]
        raise UserError(f"{program.name}: {' '.join(said).removeprefix('error: ')}")
    ran, trip = map(int, done.stdout.split())
    if ran != arguments[4] or trip:
        raise UserError(f"{program.name}: ended after {ran} of {arguments[4]} periods, trip {trip}")
    counted = re.search(r"Collected : (\d+)", done.stderr)
    if not counted or int(counted.group(1)) == 0:
        raise UserError(f"{toggle}: callgrind found no such function; build with symbols")
    return int(counted.group(1))
