"""The drive on its bench: what every step of a bring-up does with it, over its link.

Nothing stays set: a step borrows parameters and puts them back. While the gates are on, `wait`
keeps the run command alive; the drive stops by itself within seconds when this program dies.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from zerohertz.commission.board_run import RESTING, at_rest, borrowed
from zerohertz.drive import Fault, State
from zerohertz.link import client as link
from zerohertz.link.client import Client

VALID_S = 2.0
SLICE_S = 0.05  # between two commands
ROWS = 128  # of a trace of eight signals: what the smallest board keeps
SEEN = (
    *("i_s_alpha_A", "i_s_beta_A", "duty_u", "duty_v", "duty_w"),
    *("u_line_alpha_V", "u_line_beta_V", "gates_on"),
)
# Open loop, and nothing that measures or acts by itself before or beside it.
VOLTAGE_ONLY = {
    "control_mode": 1.0,
    "rs_measure": 0.0,
    "dead_time_identify": 0.0,
    "premagnetise_s": 0.0,
    "dead_time_fraction": 0.0,
    "flying_start": 0.0,
    "dc_brake_A": 0.0,
    "min_pulse_s": 0.0,
    "stop_mode": 0.0,
    "coast_s": 0.0,
}
_READY_S = 15.0
_TRACE_DONE = 3
_LOOKS = 10

Vectors = npt.NDArray[np.complex128]


@dataclass(frozen=True)
class Rows:
    """Of a time with the gates on: measured current, voltage of the duties, line voltage."""

    i_A: Vectors
    u_V: Vectors
    line_V: Vectors


def vector(u: npt.ArrayLike, v: npt.ArrayLike, w: npt.ArrayLike) -> Vectors:
    """Power-invariant vector of three phases, alpha + j beta."""
    a, b, c = (np.asarray(x, dtype=float) for x in (u, v, w))
    return math.sqrt(2.0 / 3.0) * (a - 0.5 * b - 0.5 * c) + 1j * math.sqrt(0.5) * (b - c)


def phases(i_A: complex) -> tuple[float, float, float]:
    """Of a vector, when their sum is zero."""
    turn = np.exp(-2j * np.pi / 3.0 * np.arange(3))
    u, v, w = math.sqrt(2.0 / 3.0) * np.real(i_A * turn)
    return float(u), float(v), float(w)


@dataclass
class Bench:
    """pause: lets so many seconds of the drive's time pass. watch: called between two commands."""

    drive: Client
    pause: Callable[[float], None]
    u_dc_V: float = 0.0  # as the meter says, once it was asked
    watch: Callable[[], None] = lambda: None
    _speed_rad_s: float = field(default=0.0, init=False)
    _running: bool = field(default=False, init=False)

    def parameter(self, name: str) -> float:
        return self.drive.get([name])[name]

    # --- states -------------------------------------------------------------------------------

    def ready(self) -> int:
        """Resets what is latched; the fault bits that come back at once, 0 when READY."""
        self.drive.command(0)
        at_rest(self.drive, self.rest)
        self.drive.command(link.RESET)
        self.pause(SLICE_S)
        self.drive.command(0)
        waited_s = 0.0
        while (status := self.drive.status()).state != State.READY and waited_s < _READY_S:
            if status.state == State.FAULT and waited_s > 2.0 * SLICE_S:
                break
            self.pause(SLICE_S)
            waited_s += SLICE_S
        return 0 if status.state == State.READY else status.faults or 1 << 31

    @contextlib.contextmanager
    def running(self, values: Mapping[str, float], speed_rad_s: float = 0.0) -> Iterator[None]:
        """With these parameters and the gates on; stopped and put back at the end."""
        with borrowed(self.drive, values):
            try:
                self._speed_rad_s, self._running = speed_rad_s, True
                self.wait(SLICE_S)
                yield
            finally:
                self._running = False
                self.drive.stop()
                at_rest(self.drive, self.rest)

    def turn_at(self, speed_rad_s: float) -> None:
        """Another reference, mechanical."""
        self._speed_rad_s = speed_rad_s
        self.keep_alive()

    def keep_alive(self) -> None:
        """Does nothing with the gates off."""
        if self._running:
            self.drive.command(link.RUN, self._speed_rad_s, valid_s=VALID_S)
        self.watch()

    def rest(self, seconds: float) -> None:
        """No command."""
        while seconds > 0.0:
            self.watch()
            self.pause(min(SLICE_S, seconds))
            seconds -= SLICE_S

    def wait(self, seconds: float) -> None:
        left_s = seconds
        while left_s > 0.0:
            self.keep_alive()
            self.pause(min(SLICE_S, left_s))
            left_s -= SLICE_S

    @property
    def faults(self) -> int:
        """Latched ones that stopped the drive; 0 while it runs."""
        status = self.drive.status()
        return status.faults or 1 << 31 if status.state in RESTING else 0

    # --- what it measures ---------------------------------------------------------------------

    def current_A(self, samples: int = 4) -> complex:
        """Mean of the measured vector."""
        names = ["i_s_alpha_A", "i_s_beta_A"]
        read = [complex(*self.drive.sample(names)[1]) for _ in range(samples)]
        return complex(np.mean(read))

    def voltage_V(self) -> complex:
        """Of the duties, by the meter's dc link."""
        duty = self.drive.sample(["duty_u", "duty_v", "duty_w"])[1]
        return complex(vector(*duty)) * self.u_dc_V

    def rows(self, seconds: float) -> Rows:
        """Recorded over so many seconds, beginning now; fewer when the drive trips."""
        period_s = self.drive.identity.period_s
        decimation = max(round(seconds / ROWS / period_s), 1)
        how = {"trigger": "state", "edge": 0, "level": 0.0, "before": 0.0}
        self.drive.arm(list(SEEN), decimation=decimation, rows=ROWS, **how)  # type: ignore[arg-type]
        self.wait(seconds + SLICE_S)
        while (state := self.drive.trace_state()).state != _TRACE_DONE:
            self.wait(SLICE_S)
        kinds = list(self.drive.signals.values())
        chosen = [kinds[number] for number in state.signals]
        words = self.drive.trace_words(state)
        table = [[k.value(w) for k, w in zip(chosen, row, strict=True)] for row in words]
        read = np.array(table, dtype=float).reshape(-1, len(SEEN))
        on = read[read[:, 7] > 0.0]
        u_V = vector(*on[:, 2:5].T) * self.u_dc_V
        return Rows(on[:, 0] + 1j * on[:, 1], u_V, on[:, 5] + 1j * on[:, 6])

    def raise_voltage(
        self, target_A: float, step_V: float, most_V: float, settle_s: float
    ) -> float:
        """V/f voltage at which the measured current reaches the target; stops at most_V or a trip.

        A wrong sensor shows little of a current in its direction: the largest that was seen counts.
        """
        volts, seen_A = self.parameter("vf_boost_V"), abs(self.current_A())
        while seen_A < target_A and volts < most_V and not self.faults:
            volts = min(volts + step_V, most_V)
            self.drive.set("vf_boost_V", volts)
            for _ in range(_LOOKS):
                self.wait(settle_s / _LOOKS)
                seen_A = max(seen_A, abs(self.current_A()))
        return volts


def fault_text(bits: int) -> str:
    """Names of fault bits."""
    names = [f.name or "" for f in Fault if f & bits]
    return " ".join(names) or "no fault, but it does not run"
