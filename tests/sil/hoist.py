"""A hoist around the drive: a hanging load, a mechanical brake with its switch, terminals.

The brake is a stiff spring that slips at its torque: closed, it holds the shaft to a fraction of a
degree. The shaft, its travel and the load are the plant's, not the drive's.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from zerohertz.drive import Drive, Output
from zerohertz.plant import Plant
from zerohertz.scenario.setup import load_setup
from zerohertz.terminals import Brake, Input, Seen
from zerohertz.terminals import Output as Relay

LOAD_NM = 5.0  # hanging: it turns the shaft backwards
BRAKE_NM = 20.0
STIFFNESS_NM = 2000.0  # per rad
DAMPING_NMS = 8.0
DELAY_S = 0.08  # of the magnet, either way
SETTINGS = {
    "start_control": "two_wire",
    "full_speed_rad_s": 30.0,
    "brake_control": "on",
    "brake_feedback": "on",
    "brake_torque_Nm": LOAD_NM,
    "brake_close_rad_s": 2.0,
}


@dataclass
class MechanicalBrake:
    """Closed without current, after its delay; `stuck` keeps it where it is."""

    open_pu: float = 0.0
    stuck: bool = False
    lining: bool = True
    twist_rad: float = 0.0

    def step(self, energised: bool, omega_rad_s: float, dt_s: float) -> float:
        """Torque on the shaft, against its speed."""
        if not self.stuck:
            change = dt_s / DELAY_S * (1.0 if energised else -1.0)
            self.open_pu = min(1.0, max(0.0, self.open_pu + change))
        if self.open_pu > 0.5 or not self.lining:
            self.twist_rad = 0.0
            return 0.0
        self.twist_rad += omega_rad_s * dt_s
        limit_rad = BRAKE_NM / STIFFNESS_NM
        self.twist_rad = min(limit_rad, max(-limit_rad, self.twist_rad))
        torque = STIFFNESS_NM * self.twist_rad + DAMPING_NMS * omega_rad_s
        return min(BRAKE_NM, max(-BRAKE_NM, torque))

    @property
    def released(self) -> bool:
        return self.open_pu > 0.5


class Hoist:
    """Drive, plant, brake and the contacts of its operator."""

    def __init__(
        self,
        load_Nm: float = LOAD_NM,
        i_q_max_A: float | None = None,
        rs_measure: bool = True,
        **parameters: float | str,
    ) -> None:
        setup = load_setup("recommended")
        limit = {"i_q_max_A": i_q_max_A} if i_q_max_A is not None else {}
        overrides = setup.parameters() | {"stop_mode": 1} | limit
        overrides |= {} if rs_measure else {"rs_measure": 0}
        self.drive = Drive(setup.motor_dir, setup.board, overrides)
        self.plant = Plant(setup.rig, setup.board)
        self.terminals = self.drive.fit_terminals(**(SETTINGS | parameters))
        self.brake = MechanicalBrake()
        self.load_Nm = load_Nm
        self.contacts = Input(0)
        self.feedback_wire = True
        self.step_options: dict[str, bool] = {}
        self.dt_s = self.drive["period_s"]
        self.travel_rad = self.lowest_rad = self.highest_rad = 0.0
        self.was_energised = False

    def seen(self) -> Seen:
        return self.terminals.look()

    def step(self) -> Output:
        released = self.brake.released and self.feedback_wire
        self.terminals.wire(inputs=self.contacts | (Input.BRAKE_RELEASED if released else 0))
        out = self.drive.step(*self.plant.sample(), **self.step_options)
        omega_rad_s = self.plant.truth().speed_rpm * math.pi / 30.0
        energised = bool(self.seen().outputs & Relay.BRAKE_RELEASE)
        self.was_energised |= energised
        brake_Nm = self.brake.step(energised, omega_rad_s, self.dt_s)
        self.plant.disturb(load_torque_Nm=self.load_Nm + brake_Nm)
        self.plant.advance(out.duties, out.gates_on)
        self.travel_rad += omega_rad_s * self.dt_s
        self.lowest_rad = min(self.lowest_rad, self.travel_rad)
        self.highest_rad = max(self.highest_rad, self.travel_rad)
        self.out = out
        return out

    def run(self, duration_s: float) -> Output:
        for _ in range(round(duration_s / self.dt_s)):
            out = self.step()
        return out

    def until(self, brake: Brake, longest_s: float = 6.0) -> None:
        """The sequence is there."""
        for _ in range(round(longest_s / self.dt_s)):
            self.step()
            if self.seen().brake == brake:
                return
        raise AssertionError(f"never {brake.name}: {self.seen()}")

    def lift(self) -> None:
        """Until the brake has released; travel counts from where it begins to."""
        self.run(0.2)
        self.contacts = Input.START
        self.until(Brake.RELEASING)
        self.mark()
        self.until(Brake.RELEASED)

    def mark(self) -> None:
        """Travel counts from here."""
        self.travel_rad = self.lowest_rad = self.highest_rad = 0.0

    @property
    def dropped_deg(self) -> float:
        return -math.degrees(self.lowest_rad)
