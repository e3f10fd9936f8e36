"""The SIL beside motulator, a simulator of drives in Python: same case, same machine, same minute.

motulator runs in a process of its own; tools/zh installs it with the test packages.
"""

from __future__ import annotations

import dataclasses
import json
import os
import statistics
import subprocess
import sys
import time
import tomllib
from pathlib import Path
from typing import Any

from zerohertz import sim
from zerohertz.bench import measure
from zerohertz.bench.measure import BOARD, MOTOR, RIG, SCENARIO, Say
from zerohertz.build import ensure_built
from zerohertz.errors import UserError

PACKAGE, VERSION = "motulator", "0.5.0"
PEER_S = 3.0  # of simulation; its speed does not depend on the length
ROUNDS = 3
DRIVES = 16
COUNT_TARGET = "zh_sil_period_count"
COUNTED_DRIVES = 8
COUNT_FROM, COUNT_TO = 11_500, 13_000
FIRMWARE = "host_port_period*"


@dataclasses.dataclass(frozen=True)
class Round:
    """Simulated seconds per CPU second, measured right after each other."""

    peer: float
    batch: float
    single: float


@dataclasses.dataclass(frozen=True)
class Instructions:
    """Per simulated control period and drive, in a batch; loop and recording are the plant's."""

    firmware: float
    plant: float


def measure_peer(say: Say, rounds: int = ROUNDS) -> dict[str, Any]:
    """Both inverters; every ratio is the median over the rounds."""
    peer: dict[str, Any] = {"package": f"{PACKAGE} {VERSION}"}
    counted: dict[str, Any] = {}
    for model in ("averaged", "switched"):
        say(f"{PACKAGE} and the SIL in turn, {model} inverter")
        done = [_round(model) for _ in range(rounds)]
        for part in ("peer", "batch", "single"):
            speed = statistics.median(getattr(r, part) for r in done)
            peer[f"{model}_{part}_sim_s_per_cpu_s"] = round(speed, 2)
        peer[f"{model}_ratio"] = round(statistics.median(r.batch / r.peer for r in done), 1)
        peer[f"{model}_single_ratio"] = round(statistics.median(r.single / r.peer for r in done), 1)
        say(f"counting instructions, {model} inverter")
        counted[model] = dataclasses.asdict(instructions(model))
    return {"peer": peer, "instructions_per_period": counted}


def peer_case(model: str) -> dict[str, Any]:
    """What motulator is to simulate, out of the files the SIL reads."""
    rig = tomllib.loads(RIG.read_text(encoding="utf-8"))
    board = tomllib.loads(BOARD.read_text(encoding="utf-8"))
    scenario = tomllib.loads(SCENARIO.read_text(encoding="utf-8"))
    names = ("pole_pairs", "Rs_ohm", "Rr_ohm", "Ls_H", "Lr_H", "M_H")
    return {
        "model": model,
        "duration_s": PEER_S,
        "period_s": board["control"]["period_s"],
        "u_dc_V": rig["inverter"]["u_dc_V"],
        "motor": {name: rig["motor"][name] for name in names},
        "J_kg_m2": rig["mechanics"]["J_kg_m2"],
        "viscous_Nms": rig["mechanics"]["viscous_Nms"],
        **scenario["profiles"],
    }


def instructions(model: str) -> Instructions:
    """By callgrind, in the library as it is, between two lengths of the same runs."""
    program = ensure_built(COUNT_TARGET).folder / "host_sim" / COUNT_TARGET

    def count(toggle: str | None) -> float:
        runs = [
            measure.collected(
                program,
                (SCENARIO, RIG, BOARD, MOTOR, steps, COUNTED_DRIVES, f"inverter.model={model}"),
                toggle,
            )
            for steps in (COUNT_FROM, COUNT_TO)
        ]
        return (runs[1] - runs[0]) / (COUNT_TO - COUNT_FROM) / COUNTED_DRIVES

    firmware = count(FIRMWARE)
    return Instructions(firmware=round(firmware, 1), plant=round(count(None) - firmware, 1))


def _round(model: str) -> Round:
    jobs = [
        sim.Job(
            scenario=SCENARIO,
            rig=RIG,
            board=BOARD,
            motor_dir=MOTOR,
            scenario_overrides={"scenario.duration_s": measure.DURATION_S[model]},
            rig_overrides={"inverter.model": model},
            decimate=50,
            seed=seed,
        )
        for seed in range(1, DRIVES + 1)
    ]
    sim.run_batch([dataclasses.replace(job, max_steps=1000) for job in jobs])  # library warm
    peer = _peer_speed(model)
    batch = _speed(lambda: sim.run_batch(jobs))
    return Round(peer=peer, batch=batch, single=_speed(lambda: [sim.run(jobs[0])]))


def _speed(run: Any) -> float:
    start_s = time.process_time()
    records = run()
    cpu_s = time.process_time() - start_s
    if any(record.trip for record in records):
        raise UserError(f"{SCENARIO}: the drive trips, so nothing is measured; see zh figures")
    return sum(record.steps * record.period_s for record in records) / cpu_s


def _peer_speed(model: str) -> float:
    case = peer_case(model)
    program = Path(__file__).with_name("peer_case.py")
    done = _must(sys.executable, str(program), stdin=json.dumps(case))
    told = json.loads(done)
    wanted_rpm = case["speed_ref_rpm"][-1][1]
    if not abs(told["speed_rpm"] - wanted_rpm) < 0.05 * wanted_rpm:
        raise UserError(
            f"{PACKAGE}: ends at {told['speed_rpm']:.0f} min^-1, so nothing is measured"
        )
    return float(told["sim_s_per_cpu_s"])


def _must(*command: str, stdin: str = "") -> str:
    # One thread: the CPU time of idle ones would count.
    environment = os.environ | {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    done = subprocess.run(
        command, input=stdin, capture_output=True, text=True, check=False, env=environment
    )
    if done.returncode != 0:
        raise UserError(f"{' '.join(command[:4])}: {done.stderr.strip()[-400:]}")
    return done.stdout
