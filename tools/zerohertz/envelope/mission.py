"""What is asked of the drive over time: references, loads, dc link, and where it is judged."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from zerohertz.atlas.simulate import RPM_PER_S
from zerohertz.envelope import axes, feasible
from zerohertz.envelope.case import Case
from zerohertz.envelope.feasible import Demand, Limits
from zerohertz.envelope.motors import Drive, drive_for
from zerohertz.envelope.plant import friction_Nm, inertia_kg_m2, rig_overrides, true_motor

Points = list[list[float]]
RPM = math.pi / 30.0
SETTLE_S = 1.5  # from the end of a change to the window that is judged
LONGEST_RAMP_S = 40.0  # a speed that takes longer to reach is not asked for
ACCELERATION = 0.3  # of rated torque at most: below the slew limit that a told inertia gives
SHARE = 0.8  # of the torque there is, load, friction and acceleration together
SPEED_LIMIT = 0.97  # of the drive's largest reference
LEAST_REFERENCE = 0.03  # of rated speed
PULSE_RPM = 10.0  # a pulsating load swings the free shaft by so much at most


@dataclasses.dataclass(frozen=True)
class Hold:
    """A window in which the speed has to be held."""

    begin_s: float
    end_s: float
    rpm: float


@dataclasses.dataclass(frozen=True)
class Change:
    """A load step, or the end of a ramp of the speed (ramp_rpm: its height)."""

    begin_s: float
    end_s: float
    rpm: float
    ramp_rpm: float = 0.0


@dataclasses.dataclass(frozen=True)
class TorqueWindow:
    """Torque mode with a constant reference."""

    begin_s: float
    end_s: float
    torque_Nm: float


@dataclasses.dataclass
class Mission:
    """Times are the run's own."""

    end_s: float = 0.0
    speed: Points = dataclasses.field(default_factory=list)
    load: Points = dataclasses.field(default_factory=list)
    u_dc: Points = dataclasses.field(default_factory=list)
    torque: Points = dataclasses.field(default_factory=list)
    torque_s: float = math.inf  # torque mode from here on
    law: str = "constant"  # of the load, with its torque reached at reference_rpm
    reference_rpm: float = 1.0
    pulse_pu: float = 0.0
    pulse_Hz: float = 0.0
    holds: list[Hold] = dataclasses.field(default_factory=list)
    load_steps: list[Change] = dataclasses.field(default_factory=list)
    ramps: list[Change] = dataclasses.field(default_factory=list)
    torques: list[TorqueWindow] = dataclasses.field(default_factory=list)


def limits_of(case: Case) -> Limits:
    """Of this run's motor on this drive."""
    drive, rig = drive_for(case), rig_overrides(case)
    dead_V = rig["inverter.dead_time_s"] / drive.period_s * drive.u_dc_V
    motor = true_motor(case)
    warm = (1.0 + case.number("Rs_heating")) * motor.circuit.Rs_ohm + rig["inverter.on_ohm"]
    return Limits(
        motor=dataclasses.replace(motor, circuit=dataclasses.replace(motor.circuit, Rs_ohm=warm)),
        i_max_A=float(drive.known["i_max_A"]),
        flux_Wb=drive.flux_Wb,
        lost_V=feasible.lost_V(dead_V, rig["inverter.drop_V"]),
        iron_ohm=rig["motor.iron_loss_ohm"],
        # Above this voltage the drive takes less torque than it is asked for.
        brake_W=float(drive.known["regen_start_V"]) ** 2 / rig["dc_link.chopper_ohm"],
    )


class Planner:
    """Builds a mission piece by piece; the clock goes on with each."""

    def __init__(self, case: Case, start_s: float) -> None:
        self.case, self.drive = case, drive_for(case)
        # Missions are planned without regard to the brake resistor: it bounds one direction only.
        self.limits = dataclasses.replace(limits_of(case), brake_W=math.inf)
        self.J, self.friction = inertia_kg_m2(case), friction_Nm(case)
        self.mission = Mission()
        self.t, self.rpm, self.load_Nm = start_s, 0.0, 0.0
        self.u_dc = self.drive.u_dc_V
        self.mission.speed += [[0.0, 0.0], [start_s, 0.0]]
        self.mission.load += [[0.0, 0.0]]
        self.mission.u_dc += [[0.0, self.u_dc]]

    def torque_Nm(self, rpm: float) -> float:
        """What can be asked for at a speed, either way."""
        low, high = feasible.torque_range_Nm(self.limits, abs(rpm) * RPM, self.u_dc)
        return SHARE * min(-low, high)

    def rate_rpm_s(self, *speeds: float) -> float:
        """Acceleration that motor and load leave room for, at the speeds of a ramp."""
        room = min(self.torque_Nm(rpm) for rpm in speeds) - abs(self.load_Nm) - self.friction
        room = min(max(room, 0.05 * self.drive.rated_Nm), ACCELERATION * self.drive.rated_Nm)
        return min(room / self.J / RPM, RPM_PER_S * self.drive.speed_unit)

    def reachable(self, rpm: float) -> float:
        """The speed itself, or as much of it as reference limit and inertia allow."""
        known = self.drive.known
        most = SPEED_LIMIT * float(known["speed_max_rad_s"]) / self.drive.pole_pairs / RPM
        most = min(most, LONGEST_RAMP_S * self.rate_rpm_s(min(abs(rpm), most)))
        return math.copysign(min(abs(rpm), most), rpm)

    def load_at(self, pu: float, rpm: float) -> float:
        """So much of rated torque, or of what is left of it at this speed.

        Passive: the friction is the load. In proportion to speed or its square: it never drives.
        """
        if self.case.word("load") == axes.PASSIVE:
            return 0.0
        most = self.torque_Nm(rpm) - self.friction
        wanted = pu * self.drive.rated_Nm
        size = min(abs(wanted), max(most, 0.0))
        return size if self.follows_speed else math.copysign(size, wanted)

    @property
    def follows_speed(self) -> bool:
        return self.case.word("load") in (axes.LINEAR, axes.SQUARE)

    def reference(self, rpm: float) -> None:
        """The largest speed of the mission: there a load that follows the speed is complete."""
        if self.follows_speed:
            self.mission.law = self.case.word("load")
        least = LEAST_REFERENCE * self.drive.rated_rpm
        self.mission.reference_rpm = max(abs(rpm), least)

    def go(self, rpm: float, rate_rpm_s: float | None = None) -> None:
        rate = rate_rpm_s or self.rate_rpm_s(self.rpm, rpm)
        height = rpm - self.rpm
        self.mission.speed.append([self.t, self.rpm])
        self.t += max(abs(height) / rate, 0.05)
        self.rpm = rpm
        self.mission.speed.append([self.t, rpm])
        self._ramp = Change(self.t, self.t, rpm, height)

    def hold(self, seconds: float) -> None:
        """First the end of what came before, then the window."""
        begin, end = self.t + SETTLE_S, self.t + SETTLE_S + seconds
        self.mission.holds.append(Hold(begin, end, self.rpm))
        self.t = end

    def hold_after_ramp(self, seconds: float) -> None:
        self.hold(seconds)
        self.mission.ramps.append(dataclasses.replace(self._ramp, end_s=self.t))

    def step_load(self, load_Nm: float, seconds: float, ramp_s: float = 0.0) -> None:
        at_s = self.t
        self.mission.load += [[self.t, self.load_Nm], [self.t + ramp_s, load_Nm]]
        changed = abs(load_Nm - self.load_Nm) > 0.05 * self.drive.rated_Nm
        self.load_Nm = load_Nm
        self.t += ramp_s
        self.hold(seconds)
        if changed and ramp_s == 0.0:
            self.mission.load_steps.append(Change(at_s, self.t, self.rpm))

    def done(self) -> Mission:
        self.mission.end_s = self.t
        largest_Nm = max(abs(torque) for _, torque in self.mission.load)
        if self.case.word("pulse") == axes.PULSATING and largest_Nm > 0.0:
            f = self.mission.pulse_Hz = self.case.number("pulse_Hz")
            swing = self.J * 2.0 * math.pi * f * PULSE_RPM * self.drive.speed_unit * RPM
            self.mission.pulse_pu = min(self.case.number("pulse_pu"), swing / largest_Nm)
        return self.mission


def demand(case: Case, mission: Mission, drive: Drive) -> Demand:
    """On a grid of 20 ms, from the first moment on; the torque mission asks for a torque."""
    t = np.arange(0.0, mission.end_s, 0.02)
    rpm = _at(mission.speed, t)
    speed = rpm * RPM
    acceleration = np.gradient(speed, t)
    opposing = np.sign(np.where(np.abs(rpm) > 1e-6, rpm, acceleration)) * friction_Nm(case)
    torque = inertia_kg_m2(case) * acceleration + _load_Nm(mission, t, rpm) + opposing
    inside = t >= mission.torque_s
    if inside.any():
        asked = _at(mission.torque, t)
        torque = np.where(inside, asked, torque)
        speed = np.where(inside, asked / drive.rated_Nm * mission.reference_rpm * RPM, speed)
    return Demand(speed, torque, _at(mission.u_dc, t))


def _load_Nm(mission: Mission, t: np.ndarray, rpm: np.ndarray) -> np.ndarray:
    """The mean; what pulsates around it is small and over before it asks for anything."""
    share = rpm / mission.reference_rpm
    law = {axes.LINEAR: share, axes.SQUARE: share * np.abs(share)}
    return _at(mission.load, t) * law.get(mission.law, 1.0)


def _at(points: Points, t: np.ndarray) -> np.ndarray:
    times, values = np.array(points, dtype=float).T
    return np.interp(t, times, values)
