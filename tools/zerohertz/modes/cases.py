"""Every mode as runs of the real firmware on the simulated rig, each judged by one predicate.

The configuration is `recommended` plus the mode's own parameters; `ideal` is Table 1's motor
without friction and sensor errors, `atlas` the robustness atlas' bench (.035 kg m2, .4 Nm Coulomb,
noise, offsets) with 2 us of dead time that the firmware does not compensate unless it has measured
it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from zerohertz import sim
from zerohertz.atlas.finding import Finding
from zerohertz.drive import Fault, State
from zerohertz.motor import load_motor
from zerohertz.scenario.setup import load_setup

Points = Sequence[tuple[float, float]]
Array = NDArray[np.float64]

RATED_RPM = 1710.0
RATED_POWER_NM = 1500.0 / (2.0 * RATED_RPM * math.pi / 30.0)  # rated power at twice rated speed
RATED_TORQUE_NM = 8.4
LIMIT_A = 15.8  # i_max_A; a transient may pass it by what the current loop overshoots
OVERSHOOT = 1.1
RIGS: Mapping[str, Mapping[str, float]] = {"ideal": {}, "atlas": {"inverter.dead_time_s": 2e-6}}
INERTIA = {"ideal": 0.015, "atlas": 0.035}
# What range asks of the limits: they follow the largest speed.
WIDE = {
    "weaken_share": 0.93,
    "speed_max_rad_s": 750.0,
    "over_speed_rad_s": 830.0,
    "omega_max_rad_s": 860.0,
}
# Without weakening the motor's own voltage bounds the speed.
NARROW = {"speed_max_rad_s": 530.0, "over_speed_rad_s": 600.0}


def run(
    rig: str,
    duration_s: float,
    speed_rpm: Points,
    load_Nm: Points = ((0.0, 0.0),),
    firmware: Mapping[str, float] | None = None,
    u_dc_V: Points = ((0.0, 283.0),),
    scenario: str = "",
    link: Mapping[str, float] | None = None,
) -> sim.Record:
    """One run; the reference begins at speed_rpm's first point."""
    setup = load_setup("recommended")
    lines = "\n".join(
        f"{name} = {[list(point) for point in points]}"
        for name, points in (
            ("speed_ref_rpm", speed_rpm),
            ("load_torque_Nm", load_Nm),
            ("u_dc_V", u_dc_V),
        )
    )
    text = f'[scenario]\nname = "modes"\nduration_s = {duration_s}\nrun_on_s = 0.01\n{scenario}\n'
    told = {"speed_J_kg_m2": INERTIA[rig], "dead_time_s": 2e-6 if RIGS[rig] else 0.0}
    return sim.run(
        sim.Job(
            scenario=f"{text}[profiles]\n{lines}\n",
            rig=sim.HOST_SIM / "rigs" / f"{rig}.toml",
            board=setup.board,
            motor_dir=setup.motor_dir,
            firmware_config=setup.params,
            firmware=told | dict(firmware or {}),
            rig_overrides=RIGS[rig] | dict(link or {}),
            decimate=5,
        )
    )


def _between(record: sim.Record, begin_s: float, end_s: float) -> slice:
    begin, end = np.searchsorted(record.t_s, (begin_s, end_s))
    return slice(int(begin), int(end))


def _mean(record: sim.Record, name: str, begin_s: float, end_s: float) -> float:
    return float(np.mean(record[name][_between(record, begin_s, end_s)], dtype=np.float64))


def _numbers(record: sim.Record) -> dict[str, float | None]:
    return {"largest_A": float(record["i_abs_A"].max()), "fault": float(record.first_fault)}


def _whole(record: sim.Record) -> bool:
    """No fault, and never more current than the limit and a little overshoot."""
    return record.first_fault == 0 and float(record["i_abs_A"].max()) <= OVERSHOOT * LIMIT_A


def _voltage_share(record: sim.Record, begin_s: float, end_s: float) -> float:
    """Length of the voltage vector over what a circle in the hexagon allows."""
    part = _between(record, begin_s, end_s)
    length = np.hypot(record["u_alpha_V"][part], record["u_beta_V"][part])
    return float(np.mean(length / (record["u_dc_V"][part] / math.sqrt(2.0)), dtype=np.float64))


def weakening(rig: str, direction: float = 1.0, on: bool = True) -> Finding:
    """To twice rated speed in 2 s, a step of rated power, back to standstill in 2 s."""
    top, power = direction * 2.0 * RATED_RPM, direction * RATED_POWER_NM
    record = run(
        rig,
        15.0,
        [(0, 0), (5, 0), (7, top), (11, top), (13, 0)],
        [(0, 0), (8, 0), (8, power), (10, power), (10, 0)],
        WIDE if on else NARROW,
    )
    error = [_mean(record, "speed_rpm", a, b) - top for a, b in ((7.7, 8.0), (9.5, 10.0))]
    measured = {
        "error_unloaded_rpm": error[0],
        "error_loaded_rpm": error[1],
        "dip_rpm": direction
        * float((record["speed_rpm"] * direction)[_between(record, 8, 9)].min()),
        "voltage_share": _voltage_share(record, 9.5, 10.0),
        "flux_Wb": _mean(record, "lambda_Wb", 9.5, 10.0),
        "angle_error_deg": _mean(record, "flux_angle_err_deg", 9.5, 10.0),
        **_numbers(record),
    }
    accurate = max(abs(e) for e in error) <= 0.005 * abs(top)
    stopped = abs(_mean(record, "speed_rpm", 14.0, 15.0)) < 30.0
    met = _whole(record) and accurate and stopped and measured["voltage_share"] < 0.95
    text = f"{top:g} min^-1, {rig}" + ("" if on else ", weakening off")
    return Finding(text, "held" if met else "not held", met, measured)


def slow_stop(rig: str, direction: float = 1.0) -> Finding:
    """From twice rated speed to standstill in 3 s: half of rated torque brakes, a current at rest.

    Judged between 3100 and 2300 min^-1: torque and current are constant on a ramp.
    """
    top = direction * 2.0 * RATED_RPM
    record = run(rig, 13.0, [(0, 0), (5, 0), (7, top), (9, top), (12, 0)], firmware=WIDE)
    part = _between(record, 9.3, 10.0)
    measured = {
        "torque_swing_Nm": float(np.ptp(record["torque_Nm"][part])),
        "angle_error_deg": float(np.abs(record["flux_angle_err_deg"][part]).max()),
        **_numbers(record),
    }
    met = _whole(record) and measured["torque_swing_Nm"] < RATED_TORQUE_NM / 2.0
    text = f"stop in 3 s from {top:g} min^-1, {rig}"
    return Finding(text, "held" if met else "not held", met, measured)


def sag(rig: str) -> Finding:
    """The dc link falls by 30 % for a second at twice rated speed and two thirds of rated power."""
    top = 2.0 * RATED_RPM
    record = run(
        rig,
        13.0,
        [(0, 0), (5, 0), (7, top)],
        [(0, 0), (8, 0), (8, 2.8)],
        WIDE,
        [(0, 283), (10, 283), (10.01, 200), (11, 200), (11.02, 283)],
    )
    measured = {
        "lowest_rpm": float(record["speed_rpm"][_between(record, 10, 12)].min()),
        "voltage_share": _voltage_share(record, 10.7, 11.0),
        "error_after_rpm": _mean(record, "speed_rpm", 12.5, 13.0) - top,
        **_numbers(record),
    }
    met = _whole(record) and abs(measured["error_after_rpm"]) <= 0.005 * top
    return Finding(f"dc link 283 -> 200 V, {rig}", "held" if met else "not held", met, measured)


def flying(rig: str, speed_pu: float, residual: bool, on: bool = True) -> Finding:
    """A shaft that turns, with the flux the voltage allowed or none; the reference is its speed.

    Nothing tells the firmware of the dead time: its check of the voltage sensors would find that.
    """
    speed_rpm = speed_pu * RATED_RPM
    flux_Wb = min(0.5, 185.0 / max(abs(speed_rpm) * math.pi / 15.0, 1.0)) if residual else 0.0
    record = run(
        rig,
        3.5,
        [(0, speed_rpm)],
        firmware=WIDE
        | {"flying_start": float(on), "rs_measure": 0, "dead_time_fraction": 0}
        | {"voltage_check_V": 0},
        scenario=f"initial_speed_rpm = {speed_rpm}\ninitial_flux_Wb = {flux_Wb}\n",
    )
    running = int(np.argmax(record["state"] == State.RUN))
    after = (record["speed_rpm"] - speed_rpm)[running:]
    measured = {
        "speed_when_run_rpm": float(record["speed_rpm"][running]),
        "estimate_off_rpm": float((record["speed_hat_rpm"] - record["speed_rpm"])[running]),
        "error_at_end_rpm": float(after[-1]),
        "largest_A": float(record["i_abs_A"].max()),
        "fault": float(record.first_fault),
    }
    met = _whole(record) and abs(measured["error_at_end_rpm"]) < 20.0
    text = f"{100 * speed_pu:+.0f} %, {'residual flux' if residual else 'no flux'}, {rig}"
    return Finding(text, "caught" if met else "not caught", met, measured)


def brake(current_A: float) -> Finding:
    """Direct current from 300 min^-1 to standstill; then it runs on."""
    record = run(
        "atlas",
        15.0,
        [(0, 0), (5, 0), (6, 300), (8, 300), (8, 0), (12, 0), (12, 600)],
        firmware={"dc_brake_A": current_A, "dc_brake_from_Hz": 20.0, "dc_brake_s": 2.0},
    )
    part = _between(record, 8.0, 12.0)
    moving = np.flatnonzero(np.abs(record["speed_rpm"][part]) > 5.0)
    measured = {
        "stopped_after_s": float(record.t_s[part][moving[-1]] - 8.0) if len(moving) else 0.0,
        "error_after_rpm": _mean(record, "speed_rpm", 14.0, 15.0) - 600.0,
        **_numbers(record),
    }
    met = _whole(record) and measured["stopped_after_s"] < 3.5
    met = met and abs(measured["error_after_rpm"]) < 20.0
    return Finding(f"300 min^-1, {current_A:g} A", "stopped" if met else "turning", met, measured)


def hold() -> Finding:
    """A standing shaft under 25 % load, held by 10 A."""
    record = run(
        "atlas",
        14.0,
        [(0, 0), (5, 0), (6, 300), (8, 300), (8.5, 0)],
        [(0, 0), (10, 0), (10.5, 0.25 * RATED_TORQUE_NM)],
        {"dc_brake_A": 10.0, "dc_brake_from_Hz": 1.0},
    )
    measured = {"creep_rpm": _mean(record, "speed_rpm", 12.0, 14.0), **_numbers(record)}
    met = _whole(record) and abs(measured["creep_rpm"]) < 30.0
    return Finding("10 A, 25 % load", "held" if met else "not held", met, measured)


def open_loop(control: int, speed_rpm: float, load_pu: float) -> Finding:
    """V/f (1) or I-f (2) with 15 A; the load comes 8 s after the start of the ramp."""
    load_Nm = load_pu * RATED_TORQUE_NM
    record = run(
        "atlas",
        17.0,
        [(0, 0), (5, 0), (5, speed_rpm)],
        [(0, 0), (13, 0), (14, load_Nm)],
        {"control_mode": control, "i_f_A": 15.0},
    )
    measured = {"slip_rpm": speed_rpm - _mean(record, "speed_rpm", 16.0, 17.0), **_numbers(record)}
    met = _whole(record) and abs(measured["slip_rpm"]) < 100.0
    text = f"{('V/f', 'I-f')[control - 1]}, {speed_rpm:g} min^-1, load {100 * load_pu:.0f} %"
    return Finding(text, "held" if met else "not held", met, measured)


def copper_loss_W(record: sim.Record, begin_s: float, end_s: float) -> float:
    """Rs |i_s|^2 and the slip's share of the air-gap power, of the true motor."""
    part = _between(record, begin_s, end_s)
    circuit = load_motor(load_setup("recommended").motor_dir).circuit
    slip = 2.0 * math.pi * record["f_s_Hz"][part] - record["speed_rpm"][part] * math.pi / 15.0
    stator = circuit.Rs_ohm * record["i_abs_A"][part].astype(np.float64) ** 2
    return float(np.mean(stator + record["torque_Nm"][part] * slip / 2.0))


def economy(load_pu: float) -> Finding:
    """Copper loss at 1200 min^-1 with and without; then a step to rated torque."""
    load_Nm = load_pu * RATED_TORQUE_NM
    loss, records = [], []
    for share in (0.0, 0.3):
        records.append(
            run(
                "atlas",
                16.0,
                [(0, 0), (5, 0), (6, 1200)],
                [(0, 0), (7, 0), (7, load_Nm), (14, load_Nm), (14, RATED_TORQUE_NM)],
                {"economy_flux_min": share},
            )
        )
        loss.append(copper_loss_W(records[-1], 11.0, 14.0))
    dips = [1200.0 - float(r["speed_rpm"][_between(r, 14, 16)].min()) for r in records]
    measured = {
        "loss_W": loss[0],
        "loss_economy_W": loss[1],
        "saving_percent": 100.0 * (1.0 - loss[1] / loss[0]),
        "dip_rpm": dips[0],
        "dip_economy_rpm": dips[1],
        **_numbers(records[1]),
    }
    error = _mean(records[1], "speed_rpm", 15.5, 16.0) - 1200.0
    # Torque that comes as a step waits for its flux, a rotor time constant and no more.
    quick = dips[1] < 100.0
    # At half load the best flux is the nominal one: nothing to gain, nothing to lose.
    met = _whole(records[1]) and quick and loss[1] <= 1.01 * loss[0] and abs(error) < 15.0
    return Finding(f"{100 * load_pu:.0f} % load", "held" if met else "not held", met, measured)


def restart(count: int) -> Finding:
    """The dc link at 140 V for .3 s: gates off, flying start, running again without a hand.

    With the configuration's own limit of 100 V the drive rides through it.
    """
    record = run(
        "atlas",
        12.0,
        [(0, 0), (5, 0), (6, 1200)],
        [(0, 0), (6.5, 0), (6.5, 0.8)],
        WIDE
        | {"flying_start": 1, "restart_count": count, "restart_delay_s": 0.2}
        | {"u_dc_min_V": 150},
        [(0, 283), (8, 283), (8.01, 140), (8.3, 140), (8.31, 283)],
    )
    after = _between(record, 8.4, 12.0)
    runs = np.flatnonzero(record["state"][after] == State.RUN)
    measured = {
        "run_after_s": float(record.t_s[after][runs[0]] - 8.31) if len(runs) else math.nan,
        "lowest_rpm": float(record["speed_rpm"][_between(record, 8.0, 12.0)].min()),
        "error_at_end_rpm": float(record["speed_rpm"][-1] - 1200.0),
        **_numbers(record),
    }
    met = record.first_fault == Fault.DC_UNDER_VOLTAGE and len(runs) > 0
    met = met and abs(measured["error_at_end_rpm"]) < 15.0 and measured["largest_A"] < 17.4
    text = f"restart_count {count}"
    return Finding(text, "runs" if met else "stands", met, measured)


def mains_lost(back_s: float, on: bool = True) -> Finding:
    """The mains goes at 8 s, 1200 min^-1, and comes back after back_s, or never (0).

    The link is a capacitor. Held is: the link stays near 1.15 mains_lost_V as long as the shaft can
    feed it; then the speed of before, or standstill without a trip of the link while it turned.
    """
    returns = [(8.0 + back_s, 0.0), (8.001 + back_s, 283.0)] if back_s > 0.0 else []
    record = run(
        "atlas",
        18.0,
        [(0, 0), (5, 0), (6, 1200)],
        firmware={"mains_lost_V": 200.0 if on else 0.0, "u_dc_min_V": 150.0},
        u_dc_V=[(0, 283), (8, 283), (8.001, 0), *returns],
        link={"dc_link.capacitance_F": 1e-3},
    )
    trip_s, turning = _first_fault(record, 8.0)
    until = 8.0 + back_s if back_s > 0.0 else trip_s
    measured = {
        "link_lowest_V": float(record["u_dc_V"][_between(record, 8.0, until)].min()),
        "held_s": until - 8.0,
        "speed_when_told_rpm": turning,
        "speed_at_end_rpm": float(record["speed_rpm"][-1]),
        **_numbers(record),
    }
    if back_s > 0.0:
        met = _whole(record) and abs(measured["speed_at_end_rpm"] - 1200.0) < 15.0
    else:
        met = _stopped_in_order(record, turning)
    met = met and measured["link_lowest_V"] > 180.0 and measured["largest_A"] <= OVERSHOOT * LIMIT_A
    text = f"mains back after {back_s:g} s" if back_s > 0.0 else "mains gone for good"
    return Finding(text + ("" if on else ", off"), "held" if met else "not held", met, measured)


def _stopped_in_order(record: sim.Record, turning_rpm: float) -> bool:
    """The fault was told when the shaft had no more to give, and the shaft stands."""
    told = record.first_fault == Fault.MAINS_LOST and turning_rpm < 150.0
    return told and abs(float(record["speed_rpm"][-1])) < 30.0


def _first_fault(record: sim.Record, from_s: float) -> tuple[float, float]:
    """When a fault was told first, and at which speed; from_s and 0 without one."""
    gone = slice(_between(record, from_s, from_s + 10.0).start, len(record.t_s))
    told = np.flatnonzero(record["faults"][gone].astype(np.uint32) != 0)
    if len(told) == 0:
        return from_s, 0.0
    return from_s + told[0] * 1e-3, float(abs(record["speed_rpm"][gone][told[0]]))


FLYING_PU = (-1.2, -1.0, -0.7, -0.4, -0.2, -0.1, -0.05, 0.0, 0.05, 0.1, 0.2, 0.4, 0.7, 1.0, 1.2)

GROUPS: Mapping[str, Sequence[Callable[[], Finding]]] = {
    "weakening": [
        *(lambda r=rig, d=d: weakening(r, d) for rig in RIGS for d in (1.0, -1.0)),
        *(lambda r=rig, d=d: slow_stop(r, d) for rig in RIGS for d in (1.0, -1.0)),
        *(lambda r=rig: sag(r) for rig in RIGS),
    ],
    "flying_start": [
        lambda r=rig, s=speed, f=flux: flying(r, s, f)
        for rig in RIGS
        for flux in (True, False)
        for speed in FLYING_PU
    ],
    "dc_brake": [*(lambda a=a: brake(a) for a in (10.0, 15.0)), hold],
    "open_loop": [
        lambda c=c, s=s, p=p: open_loop(c, s, p)
        for c in (1, 2)
        for s, p in ((300.0, 0.5), (600.0, 0.0), (600.0, 0.5), (-600.0, 0.0), (1200.0, 0.0))
    ],
    "economy": [lambda p=p: economy(p) for p in (0.0, 0.25, 0.5)],
    "restart": [lambda: restart(2)],
    "mains_loss": [*(lambda b=b: mains_lost(b) for b in (0.5, 2.0, 0.0))],
}
