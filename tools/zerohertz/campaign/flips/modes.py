"""What the drive does when a bit flips, and which plain faults it has to notice afterwards."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Mapping
from typing import Any

from zerohertz import sim
from zerohertz.atlas.simulate import Bench
from zerohertz.campaign.faults import run
from zerohertz.campaign.faults.cases import case_of
from zerohertz.campaign.faults.judge import Limits
from zerohertz.campaign.faults.kinds import NOTHING
from zerohertz.campaign.rig import U_DC_V
from zerohertz.errors import UserError

WINDOW_S = 0.2  # in which a bit flips
QUIET_S = 0.06  # then nothing: the drive's checks of its memory need 50 ms
AFTER_S = 3.0
READY_S, START_S = 0.6, 4.0  # run command of a drive that stands ready; the whole start
RUNNING_S = 0.8  # after the start is over
COMMISSIONING_S = 4.0


@dataclasses.dataclass(frozen=True)
class Span:
    """When a bit flips, when a plain fault follows, when the run is over."""

    first_s: float
    last_s: float
    fault_s: float
    end_s: float


@dataclasses.dataclass(frozen=True)
class Mode:
    """A condition of `zh campaign faults`, and the part of its run in which a bit flips."""

    name: str
    condition: str
    span: Callable[[Bench, run.Times], Span]
    scenario: Mapping[str, Any] = dataclasses.field(default_factory=dict)

    def job(self, bench: Bench) -> sim.Job:
        """The run with nothing broken."""
        made = run.job(bench, case_of(f"{NOTHING}@{self.condition}"))
        changed = {**made.scenario_overrides, **self.scenario}
        return dataclasses.replace(made, scenario_overrides=changed)

    def limits(self, bench: Bench) -> Limits:
        return run.limits_of(bench, case_of(f"{NOTHING}@{self.condition}"), self.job(bench))

    def when(self, bench: Bench) -> Span:
        return self.span(bench, run.times_of(bench, case_of(f"{NOTHING}@{self.condition}")))


def _loaded(_bench: Bench, times: run.Times) -> Span:
    first_s = times.fault_s - WINDOW_S - QUIET_S
    last_s = first_s + WINDOW_S
    return Span(first_s, last_s, times.fault_s, last_s + AFTER_S)


def _start(bench: Bench, _times: run.Times) -> Span:
    """From the run command to RUN."""
    last_s = bench.run_s - 0.1
    fault_s = bench.run_s + RUNNING_S
    return Span(0.05, last_s, fault_s, fault_s + AFTER_S)


def _ready(bench: Bench, _times: run.Times) -> Span:
    last_s = READY_S - QUIET_S
    fault_s = bench.run_s + READY_S + RUNNING_S
    return Span(last_s - WINDOW_S, last_s, fault_s, fault_s + AFTER_S)


def _commissioning(_bench: Bench, _times: run.Times) -> Span:
    first_s = run.COMMISSION_S + 0.05
    last_s = first_s + COMMISSIONING_S
    return Span(first_s, last_s, last_s + QUIET_S, run.LONGEST_COMMISSION_S)


MODES: Mapping[str, Mode] = {
    mode.name: mode
    for mode in (
        Mode("run_900", "running,900,+0.5,la2,averaged,sensors", _loaded),
        Mode("run_60", "running,60,+0.5,la2,averaged,sensors", _loaded),
        Mode("i_f", "i_f,300,+0.5,la0,averaged,sensors", _loaded),
        Mode("v_f", "v_f,900,+0.5,la0,averaged,sensors", _loaded),
        Mode("start", "starting,300,+0.5,la2,averaged,sensors", _start),
        Mode("commissioning", "commissioning,0,+0,la0,averaged,sensors", _commissioning),
        Mode(
            "ready",
            "starting,300,+0.5,la2,averaged,sensors",
            _ready,
            {"scenario.run_on_s": READY_S},
        ),
    )
}


def mode_of(name: str) -> Mode:
    if name not in MODES:
        raise UserError(f"--case: {name}: no such mode; there are {', '.join(MODES)}")
    return MODES[name]


def _over_voltage(at_s: float) -> dict[str, Any]:
    return {"profiles.u_dc_V": [[0.0, U_DC_V], [at_s, U_DC_V], [at_s + 0.02, 1.7 * U_DC_V]]}


def _top(word: str) -> Callable[[float], dict[str, Any]]:
    return lambda at_s: {
        "faults.sensor": word,
        "faults.kind": "fixed",
        "faults.severity": 1.0,
        "faults.start_s": at_s,
    }


# Each trips a drive that is well; one that does not trip in a mode is not asked for there.
PLAIN: Mapping[str, Callable[[float], dict[str, Any]]] = {
    "short": lambda at_s: {"faults.short_s": at_s},
    "over_voltage": _over_voltage,
    "i_u_at_its_end": _top("i_u"),
    "u_dc_at_its_end": _top("u_dc"),
    "open_phase": lambda at_s: {"faults.open_phase": "u", "faults.open_s": at_s},
    "locked_rotor": lambda at_s: {"faults.jam_s": at_s},
}


@functools.cache
def bench() -> Bench:
    """Once per process."""
    return run.bench_of_campaign()
