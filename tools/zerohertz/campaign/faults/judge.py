"""The judge: was there harm, and did the drive say a word in time? By the plant's true numbers.

Harm begins when its rule is met:
  current    the largest true leg current beyond 1.125 i_trip_A in two periods in a row
  overspeed  the shaft beyond 1.15 x maximum speed
  deviation  the shaft away from what was asked and the torque limit allows by more than
             30 min^-1 or 5 % of the motor's rated speed, the larger, for 1 s
  direction  as far on the other side of standstill than everything asked in the last second, for
             100 ms: a sound drive gives way to a step of twice rated torque for 46 ms
What was asked and what the torque limit allows are two speeds: the reference behind its slew limit,
and an ideal drive of the same torque on the true shaft. In between nothing is wrong.

A word is a fault bit; for the speed also a warning that the torque is limited (DERATED,
REGENERATION), or "speed unknown" at that time. It counts until 100 ms after the harm began. A
warning counts when it is given after the fault, or in the second before the harm: it stays latched,
and an older one is about something else.
"""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import numpy.typing as npt

from zerohertz import sim
from zerohertz.atlas.detection import stretches
from zerohertz.drive import Fault, State
from zerohertz.sil_types import WARNINGS

Array = npt.NDArray[np.float64]

CURRENT, OVERSPEED, DEVIATION, DIRECTION = "current", "overspeed", "deviation", "direction"
HARMS = (CURRENT, OVERSPEED, DEVIATION, DIRECTION)
OVER_PERIODS = 2
OVERSPEED_PU = 1.15
RATED_RPM = 1710.0  # of Table 1's motor
LEAST_RPM, LIMIT_PU = 30.0, 0.05
LIMIT_RPM = max(LEAST_RPM, LIMIT_PU * RATED_RPM)
DEVIATION_S = 1.0
DIRECTION_S = 0.1
GRACE_S = 0.1
STEP_S = 1e-3  # of the speed rules
_STILL_RPM = 1e-6
# They say that torque is missing, so they name a speed that is off.
NAMES_SPEED = int(Fault.DERATED | Fault.REGENERATION)
UNDECLARED, AFTER, BEFORE, HARMLESS = "undeclared", "declared_after", "declared_before", "harmless"
EXCEPTED = "excepted"  # given by excepted.py alone
VERDICTS = (HARMLESS, BEFORE, AFTER, UNDECLARED, EXCEPTED)
RPM = math.pi / 30.0


@dataclasses.dataclass(frozen=True)
class Limits:
    """What is true of the shaft and what the drive may do."""

    over_A: float  # of a phase
    maximum_rpm: float
    torque_Nm: float
    slew_rpm_s: float
    J_kg_m2: float
    friction_Nm: float
    jam_s: float = math.inf
    jam_Nm: float = 0.0
    slip_rpm: float = 0.0  # V/f is asked for a frequency: the slip comes on top
    rated_rpm: float = RATED_RPM

    @property
    def off_rpm(self) -> float:
        """So far off is harm."""
        return max(LEAST_RPM, LIMIT_PU * self.rated_rpm)


@dataclasses.dataclass(frozen=True)
class Words:
    """When the drive spoke; inf: never."""

    fault_s: float
    bits: int  # of its first fault
    warning_s: float  # the first after the fault of the case
    warnings_s: Array  # each, in the whole run
    unknown: npt.NDArray[np.bool_]


def speed_unknown(record: sim.Record) -> npt.NDArray[np.bool_]:
    """The drive says that it does not know its speed. The only place that reads it."""
    said = record.columns.get("speed_unknown")
    return np.zeros(len(record.t_s), bool) if said is None else said > 0


def judge(
    record: sim.Record, limits: Limits, fault_s: float, since_s: float = math.inf
) -> dict[str, Any]:
    """The row of a run whose first fault began at fault_s.

    A warning that was there before fault_s and before since_s is about something else.
    """
    t_s = record.t_s.astype(np.float64)
    words = words_of(record, t_s, min(fault_s, since_s))
    off_rpm, harms = _speed_harms(record, limits)
    harms[CURRENT] = _current_s(record, limits, t_s)
    return {
        **_of_harms(harms, words, t_s, fault_s, sim.Trip.DIVERGED in record.trip),
        "word_ms": _ms(words.fault_s - fault_s),
        "bits": words.bits,
        "over_current": bool(math.isfinite(harms[CURRENT])),
        "peak_A": float(record["i_peak_A"].max()),
        "off_rpm": float(off_rpm),
        "top_rpm": float(np.abs(record["speed_rpm"]).max()),
        "started": bool(np.any(_started(record) & (t_s >= fault_s))) or words.bits != 0,
    }


def _of_harms(
    harms: dict[str, float], words: Words, t_s: Array, fault_s: float, diverged: bool
) -> dict[str, Any]:
    """The verdict, and the first harm: of those undeclared, if there are any."""
    ends_s = t_s[-1] - (0.0 if diverged else GRACE_S)
    begun = {name: harms[name] for name in HARMS if harms[name] <= ends_s}
    late = {name: _late_s(name, at_s, words, t_s) for name, at_s in begun.items()}
    open_ = [name for name in begun if late[name] > GRACE_S]
    first = min(open_ or begun, key=lambda name: begun[name], default=None)
    return {
        "verdict": _verdict(late, words),
        "harm": first or "",
        "harms": " ".join(begun),
        "undeclared": " ".join(open_),
        "harm_s": None if first is None else begun[first] - fault_s,
        "late_ms": _ms(max(late.values(), default=math.inf)),
    }


def words_of(record: sim.Record, t_s: Array, since_s: float) -> Words:
    bits = record["faults"].astype(np.int64)
    faults = np.flatnonzero(bits & ~WARNINGS)
    before = int(np.searchsorted(t_s, since_s - 0.5 * record.period_s))
    known = int(bits[before - 1]) if before > 0 else 0
    warned = np.flatnonzero((bits & NAMES_SPEED & ~known != 0) & (t_s >= since_s))
    given = np.flatnonzero(np.diff(bits & NAMES_SPEED, prepend=0) > 0)
    return Words(
        fault_s=float(t_s[faults[0]]) if len(faults) else math.inf,
        bits=int(bits[faults[0]] & ~WARNINGS) if len(faults) else 0,
        warning_s=float(t_s[warned[0]]) if len(warned) else math.inf,
        warnings_s=t_s[given].astype(np.float64),
        unknown=speed_unknown(record),
    )


def _late_s(harm: str, harm_s: float, words: Words, t_s: Array) -> float:
    """From the beginning of the harm to the first word that counts; negative: before it."""
    spoken_s = words.fault_s
    if harm != CURRENT:
        first_s, last_s = harm_s - DEVIATION_S, harm_s + GRACE_S
        about = words.warnings_s[(words.warnings_s >= first_s) & (words.warnings_s <= last_s)]
        spoken_s = min(spoken_s, words.warning_s, *about)
        near = (t_s >= first_s) & (t_s <= last_s) & words.unknown
        if near.any():
            spoken_s = min(spoken_s, float(t_s[np.argmax(near)]))
    return spoken_s - harm_s


def _verdict(late: dict[str, float], words: Words) -> str:
    if any(late_s > GRACE_S for late_s in late.values()):
        return UNDECLARED
    if any(late_s > 0.0 for late_s in late.values()):
        return AFTER
    return BEFORE if late or words.bits else HARMLESS


def _current_s(record: sim.Record, limits: Limits, t_s: Array) -> float:
    for first, end in stretches(record["i_peak_A"] > limits.over_A):
        if end - first >= OVER_PERIODS:
            return float(t_s[first + OVER_PERIODS - 1])
    return math.inf


def _speed_harms(record: sim.Record, limits: Limits) -> tuple[float, dict[str, float]]:
    """The largest distance from what is allowed, and when which harm began."""
    every = max(1, round(STEP_S / record.period_s))
    t_s = record.t_s[::every].astype(np.float64)
    speed_rpm = record["speed_rpm"][::every].astype(np.float64)
    low_rpm, high_rpm, asked = allowed_rpm(record, limits, every)
    off_rpm = np.where(asked, np.maximum(low_rpm - speed_rpm, speed_rpm - high_rpm), 0.0)
    far = off_rpm > limits.off_rpm + limits.slip_rpm
    step_s = every * record.period_s
    harms = dict.fromkeys(HARMS, math.inf)
    fast = np.flatnonzero(np.abs(speed_rpm) > OVERSPEED_PU * limits.maximum_rpm)
    allowed = [np.where(asked, rpm, 0.0) for rpm in (low_rpm, high_rpm)]
    wrong = far & _wrong_way(speed_rpm, *allowed, limits.off_rpm, step_s)
    harms[OVERSPEED] = float(t_s[fast[0]]) if len(fast) else math.inf
    harms[DIRECTION] = _lasting_s(wrong, DIRECTION_S, t_s, step_s)
    harms[DEVIATION] = _lasting_s(far, DEVIATION_S, t_s, step_s)
    return float(off_rpm.max(initial=0.0)), harms


def _lasting_s(flags: npt.NDArray[np.bool_], length_s: float, t_s: Array, step_s: float) -> float:
    """When the flags had been set for so long without a break; inf: never."""
    needed = round(length_s / step_s)
    for first, end in stretches(flags):
        if end - first > needed:
            return float(t_s[first + needed])
    return math.inf


def _wrong_way(
    speed_rpm: Array, low_rpm: Array, high_rpm: Array, limit_rpm: float, step_s: float
) -> npt.NDArray[np.bool_]:
    """Against everything that was allowed within the last second."""
    window = round(DEVIATION_S / step_s)
    lowest = _rolling(low_rpm, window, np.minimum)
    highest = _rolling(high_rpm, window, np.maximum)
    return ((lowest > 0.0) & (speed_rpm < -limit_rpm)) | ((highest < 0.0) & (speed_rpm > limit_rpm))


def _rolling(values: Array, window: int, pick: np.ufunc) -> Array:
    """The extreme of the last `window` values, by doubling the span."""
    out, span = values.copy(), 1
    while span < window:
        shift = min(span, window - span)
        out[shift:] = pick(out[shift:], out[:-shift].copy())
        span += shift
    return out


def allowed_rpm(
    record: sim.Record, limits: Limits, every: int
) -> tuple[Array, Array, npt.NDArray[np.bool_]]:
    """Lowest and highest speed at which nothing is wrong, and whether anything is asked yet."""
    on = np.maximum.accumulate(record["gates_on"][::every] > 0)
    running = np.maximum.accumulate(_started(record)[::every])
    wanted = np.where(running, record["speed_ref_rpm"][::every], 0.0).astype(np.float64)
    asked_rpm = _slewed(wanted, limits.slew_rpm_s * every * record.period_s)
    load_Nm = record["load_Nm"][::every].astype(np.float64)
    start = int(np.argmax(on)) if on.any() else len(on)
    ideal_rpm = asked_rpm.copy()
    t_s = record.t_s[::every][start:]
    ideal_rpm[start:] = _ideal_rpm(
        asked_rpm[start:],
        load_Nm[start:],
        t_s.astype(np.float64) >= limits.jam_s,
        float(record["speed_rpm"][::every][start]) if start < len(on) else 0.0,
        limits,
        every * record.period_s,
    )
    return np.minimum(asked_rpm, ideal_rpm), np.maximum(asked_rpm, ideal_rpm), on


def _started(record: sim.Record) -> npt.NDArray[np.bool_]:
    return (record["state"] == State.RUN) | (record["state"] == State.COMMISSIONING)


def _slewed(wanted: Array, most: float) -> Array:
    """What the reference is behind a limit of its slope."""
    if most >= float(np.abs(np.diff(wanted)).max(initial=0.0)):
        return wanted
    value = float(wanted[0])
    out: list[float] = []
    for target in wanted.tolist():
        change = target - value
        change = -most if change < -most else change
        value += most if change > most else change
        out.append(value)
    return np.array(out, dtype=wanted.dtype)


def _ideal_rpm(
    asked_rpm: Array,
    load_Nm: Array,
    jammed: npt.NDArray[np.bool_],
    speed_rpm: float,
    limits: Limits,
    step_s: float,
) -> Array:
    """The speed of a drive that knows everything and has the torque limit."""
    per_Nm = step_s / (limits.J_kg_m2 * RPM)
    friction = np.where(jammed, limits.friction_Nm + limits.jam_Nm, limits.friction_Nm)
    follows = _follows(asked_rpm, load_Nm, friction, limits.torque_Nm, per_Nm)
    hard = np.flatnonzero(~follows)
    asked, load, drag = asked_rpm.tolist(), load_Nm.tolist(), friction.tolist()
    out, w, k = asked_rpm.copy(), speed_rpm, 0
    while k < len(asked):
        if k > 0 and w == asked[k - 1] and follows[k]:
            after = int(np.searchsorted(hard, k))
            k = int(hard[after]) if after < len(hard) else len(asked)
            w = asked[k - 1]
            continue
        w = _next_rpm(w, asked[k], load[k], drag[k], limits.torque_Nm, per_Nm)
        out[k] = w
        k += 1
    return out


def _follows(
    asked_rpm: Array, load_Nm: Array, friction_Nm: Array, most_Nm: float, per_Nm: float
) -> npt.NDArray[np.bool_]:
    """Where a shaft that had the speed asked for a step before has the one asked for now."""
    before_rpm = np.concatenate((asked_rpm[:1], asked_rpm[:-1]))
    way = np.where(before_rpm < 0.0, -1.0, 1.0)
    needed_Nm = (asked_rpm - before_rpm) / per_Nm + load_Nm + way * friction_Nm
    rests = (before_rpm == 0.0) & (asked_rpm == 0.0)
    turns = (before_rpm * asked_rpm > 0.0) & (np.abs(before_rpm) > _STILL_RPM)
    return (np.abs(needed_Nm) <= most_Nm) & (rests | turns)


def _next_rpm(
    w: float, asked: float, load_Nm: float, drag_Nm: float, most_Nm: float, per_Nm: float
) -> float:
    """A step of the shaft, whose friction stops it and does not turn it back."""
    turns = abs(w) > _STILL_RPM
    way = math.copysign(1.0, w if turns else asked - w)
    needed_Nm = (asked - w) / per_Nm + load_Nm + way * drag_Nm
    net_Nm = min(max(needed_Nm, -most_Nm), most_Nm) - load_Nm
    held = abs(net_Nm) <= drag_Nm
    if held and not turns:
        return 0.0
    way = math.copysign(1.0, w if turns else net_Nm)
    after = w + (net_Nm - way * drag_Nm) * per_Nm
    if held and after * way < 0.0:
        return 0.0
    # The same number as asked for, not only nearly: then what follows is quick.
    return asked if abs(after - asked) < 1e-9 else after


def _ms(seconds: float) -> float | None:
    return round(1e3 * seconds, 1) if math.isfinite(seconds) else None
