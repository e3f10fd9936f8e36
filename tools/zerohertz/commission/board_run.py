"""The self-commissioning of a drive at the other end of a line: same firmware, over its link.

What is set for it is put back afterwards; keeping the result is a step of its own.
"""

from __future__ import annotations

import contextlib
import dataclasses
import time
from collections.abc import Callable, Iterator, Mapping

import numpy as np

from zerohertz import terminals
from zerohertz.commission.board import Board
from zerohertz.commission.folder import parameters_of
from zerohertz.commission.plate import Plate, guess, magnetising_A
from zerohertz.commission.run import start_parameters
from zerohertz.commission.solve import Identified
from zerohertz.commission.tuning import CONTINUOUS, MAGNETISE, PEAK, TRIP, limit_A
from zerohertz.drive import Fault, State
from zerohertz.errors import UserError
from zerohertz.link import client as link
from zerohertz.link.client import Client, Commissioning, RefusedError
from zerohertz.motor import Circuit
from zerohertz.sim import Commissioned

# What an image may have been tuned to for its own motor, and no other.
OTHER_MOTOR_S = {
    "observer_gain_enable": 0.0,
    "control_mode": 0.0,
    "economy_flux_min": 0.0,
    "dc_brake_A": 0.0,
    "eps1_mode": 0.0,
    "rs_track_gain": 0.0,
    "steer_min_Hz": 0.0,
}
STAGES = (
    "stator resistance",
    "lowest current",
    "magnetising curve",
    "bias",
    "leakage",
    "rotor",
    "done",
)
RESTING = (State.READY, State.FAULT, State.TORQUE_OFF)
Pause = Callable[[float], None]  # lets that many seconds pass
_POLL_S = 0.05
_VALID_S = 3.0  # of the drive's time: direct current for so long when this process dies
_PATIENCE_S = 10.0
_TOGETHER = 10  # status of a link's answer: refused next to the other values


def commission(
    drive: Client, plate: Plate, say: Callable[[str], None], pause: Pause = time.sleep
) -> tuple[Commissioned, float]:
    """What the drive found, and how long it took. UserError when it cannot, or tripped.

    The drive has to be unlocked: it is told another motor than its own.
    """
    _can(drive, plate, pause)
    start = start_parameters(plate, drive.parameter("i_trip_A").initial)
    with borrowed(drive, _unknown(drive, plate) | start | OTHER_MOTOR_S):
        try:
            seen, seconds = _follow(drive, say, pause)
        finally:
            drive.stop()
            at_rest(drive, pause)
    found = dict(zip(_NAMES, seen.found, strict=True))
    level_A, flux_Wb, error_V = zip(*seen.curve, strict=True)
    done = seen.status == 1
    return Commissioned(
        done=done, refusal=seen.refusal, **found, level_A=level_A, flux_Wb=flux_Wb, error_V=error_V
    ), seconds


_NAMES = ("Rs_ohm", "lost_V", "sigma_Ls_H", "Rr_gamma_ohm", "M_gamma_H", "bias_A")


def keep(drive: Client, found: Identified, plate: Plate, board: Board) -> dict[str, float]:
    """Parameters of the motor found, set and saved; without a table until one of it is flashed."""
    values = values_of(found, plate, board)
    put(drive, values)
    drive.save()
    return values


def values_of(found: Identified, plate: Plate, board: Board) -> dict[str, float]:
    """All parameters that follow from the motor, the gain table's use not among them."""
    return parameters_of(found, plate, board) | _circuit(found.circuit, plate) | OTHER_MOTOR_S


def put(drive: Client, values: Mapping[str, float]) -> None:
    """Sets all of them; one that is refused next to the others' old values waits for the new."""
    have = drive.get(list(values))
    left = {k: v for k, v in values.items() if np.float32(v) != np.float32(have[k])}
    while left:
        refused: dict[str, RefusedError] = {}
        for name, value in left.items():
            try:
                drive.set(name, value)
            except RefusedError as error:
                if error.status != _TOGETHER:
                    raise
                refused[name] = error
        if len(refused) == len(left):
            raise next(iter(refused.values()))
        left = {name: left[name] for name in refused}


@contextlib.contextmanager
def borrowed(drive: Client, values: Mapping[str, float]) -> Iterator[None]:
    """These values for a while, those of before again at the end."""
    before = drive.get(list(values))
    try:
        put(drive, values)
        yield
    finally:
        put(drive, before)


def _can(drive: Client, plate: Plate, pause: Pause) -> None:
    """Whether this drive and board can find this motor at all."""
    try:
        drive.commissioning()
    except RefusedError as error:
        raise UserError(
            f"the drive's firmware cannot report a commissioning result ({error}); flash an "
            "image of these sources"
        ) from None
    most_A = limit_A(plate, drive.parameter("i_trip_A").initial)
    least_A = magnetising_A(plate) / MAGNETISE
    if most_A < least_A:
        raise UserError(
            f"this board trips at {drive.parameter('i_trip_A').initial:.3g} A; to magnetise a "
            f"motor of {plate.current_A:.3g} A rms takes {TRIP * PEAK * least_A:.3g} A"
        )
    at_rest(drive, pause)
    status = drive.status()
    if status.state != State.READY:
        faults = " ".join(f.name or "" for f in Fault if f & status.faults)
        raise UserError(
            f"the drive is not READY but {State(status.state).name} {faults}".rstrip()
            + "; a fault is reset with tools/zh run --reset"
        )


def _unknown(drive: Client, plate: Plate) -> dict[str, float]:
    """Circuit as guessed, limits of the plate."""
    trip_A = TRIP * PEAK * limit_A(plate, drive.parameter("i_trip_A").initial)
    overload_A = min(CONTINUOUS * plate.current_vector_A, trip_A / (TRIP * PEAK))
    limits = {"i_trip_A": trip_A, "overload_motor_A": overload_A}
    return _circuit(guess(plate), plate) | limits


def _circuit(circuit: Circuit, plate: Plate) -> dict[str, float]:
    return dataclasses.asdict(circuit) | {"pole_pairs": float(plate.pole_pairs)}


def _follow(drive: Client, say: Callable[[str], None], pause: Pause) -> tuple[Commissioning, float]:
    """Starts it and waits for its end; the drive ends it by itself when this dies."""
    begun, told, waited_s = 0, "", 0.0
    while True:
        drive.command(link.COMMISSION, valid_s=_VALID_S)
        status, seen = drive.status(), drive.commissioning()
        if status.state == State.COMMISSIONING:
            begun = begun or status.period
            if (now := _stage(seen)) != told:
                say(told := now)
        elif begun:
            break
        else:
            _must_start(status, waited_s)
        pause(_POLL_S)
        waited_s += _POLL_S
    if seen.status == 0:
        faults = " ".join(f.name or "" for f in Fault if f & status.faults)
        raise UserError(f"commissioning ended early: {faults or 'the command was taken away'}")
    return seen, (status.period - begun) * drive.identity.period_s


def _must_start(status: link.Status, waited_s: float) -> None:
    if status.terminal_faults & terminals.Fault.COMMISSION_REFUSED:
        raise UserError(
            "the drive refuses the commissioning (COMMISSION_REFUSED): brake_control is on, and a "
            "hoist would drop its load; commission the motor without load and with brake_control "
            "off"
        )
    if waited_s > _PATIENCE_S:
        raise UserError(f"the drive does not start; it is {State(status.state).name}")


def _stage(seen: Commissioning) -> str:
    name = STAGES[min(seen.stage, len(STAGES) - 1)]
    return f"{name}, level {seen.level + 1} of {len(seen.curve)}" if seen.stage == 2 else name


def at_rest(drive: Client, pause: Pause = time.sleep) -> None:
    """Waits for the gates to be off and nothing going on; UserError when that does not come."""
    waited_s = 0.0
    while (status := drive.status()).state not in RESTING:
        if waited_s > _PATIENCE_S:
            raise UserError(f"the drive does not come to rest: {State(status.state).name}")
        pause(_POLL_S)
        waited_s += _POLL_S
