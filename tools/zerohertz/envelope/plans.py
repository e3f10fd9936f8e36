"""The five missions: what each asks for, one after the other."""

from __future__ import annotations

import math

from zerohertz.envelope import axes
from zerohertz.envelope.case import Case
from zerohertz.envelope.mission import SETTLE_S, SHARE, Mission, Planner, TorqueWindow

TORQUE_SPEED_PU = 0.6  # at rated torque, of the torque mission


def plan(case: Case, start_s: float) -> Mission:
    """The mission of a run, whose drive is ready at start_s."""
    planner = Planner(case, start_s)
    kinds = {
        axes.CYCLE: _cycle,
        axes.CROSSING: _crossing,
        axes.NEAR_ZERO: _near_zero,
        axes.TORQUE: _torque,
        axes.SAG: _sag,
    }
    kinds[case.word("mission")](planner)
    return planner.done()


def _cycle(p: Planner) -> None:
    """Run-up, load on and off, the opposite load on and off, another speed, reversal."""
    rated, load = p.drive.rated_rpm, p.case.number("load_pu")
    first = p.reachable(
        math.copysign(p.case.number("speed_pu"), p.case.number("second_pu")) * rated
    )
    second = p.reachable(p.case.number("second_pu") * rated)
    p.reference(max(abs(first), abs(second)))
    p.go(first)
    p.hold_after_ramp(1.5)
    for share in (load, 0.0, -load, 0.0):
        p.step_load(p.load_at(share, first), 2.0)
    p.go(second)
    p.hold_after_ramp(2.0)
    p.step_load(p.load_at(load, p.rpm), 2.0, ramp_s=0.5)
    p.go(-0.5 * p.rpm)
    p.hold_after_ramp(2.0)


def _crossing(p: Planner) -> None:
    """Both ways through zero, at the slope, under load."""
    slope = p.case.number("slope_rpm_s") * p.drive.speed_unit
    top = min(150.0 * p.drive.speed_unit, 10.0 * slope)
    p.reference(top)
    p.go(top)
    p.hold_after_ramp(1.0)
    p.step_load(p.load_at(p.case.number("load_pu"), top), 2.0, ramp_s=0.5)
    for target in (-top, top):
        p.go(target, slope)
        p.hold(2.0)


def _near_zero(p: Planner) -> None:
    """A long hold there, with a load that comes and goes."""
    rated = p.drive.rated_rpm
    p.reference(0.0)
    p.go(p.case.number("near_zero_pu") * rated)
    p.hold_after_ramp(1.0)
    load_Nm = p.load_at(p.case.number("load_pu"), p.rpm)
    p.step_load(load_Nm, 12.0, ramp_s=1.0)
    p.step_load(0.5 * load_Nm, 8.0, ramp_s=1.0)
    p.go(-p.case.number("near_zero_pu") * rated)
    p.hold_after_ramp(6.0)


def _torque(p: Planner) -> None:
    """Torque mode on a load in proportion to speed."""
    top = TORQUE_SPEED_PU * p.drive.rated_rpm
    p.mission.law, p.mission.reference_rpm = axes.LINEAR, top
    p.mission.load = [[0.0, p.drive.rated_Nm]]
    p.go(0.3 * top)
    p.hold_after_ramp(1.0)
    p.mission.torque_s = p.t
    rng = p.case.rng("torques")
    for share in rng.uniform(-1.0, 1.0, 5):
        torque_Nm = float(share) * p.drive.rated_Nm
        p.mission.torque += [[p.t, torque_Nm], [p.t + 4.0, torque_Nm]]
        p.mission.torques.append(TorqueWindow(p.t + SETTLE_S, p.t + 4.0, torque_Nm))
        p.t += 4.0


def _sag(p: Planner) -> None:
    """The dc link sags twice under load, at a speed that its voltage still allows."""
    sag = p.case.number("sag_pu")
    most = SHARE * sag * p.drive.rated_rpm
    speed = min(p.case.number("speed_pu") * p.drive.rated_rpm, most)
    first = p.reachable(math.copysign(speed, p.case.number("second_pu")))
    p.reference(first)
    p.go(first)
    p.hold_after_ramp(1.5)
    p.step_load(p.load_at(p.case.number("load_pu"), p.rpm), 2.0)
    full = p.drive.u_dc_V
    for _ in range(2):
        low_s = p.case.number("sag_s")
        p.mission.u_dc += [[p.t, full], [p.t + 0.01, sag * full]]
        p.mission.u_dc += [[p.t + 0.01 + low_s, sag * full], [p.t + 0.02 + low_s, full]]
        p.t += low_s + 0.02
        p.hold(3.0)
