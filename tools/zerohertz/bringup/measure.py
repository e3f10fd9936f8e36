"""What the drive does in each step, and what it measures: numbers by name.

The same functions run on the board and on its model in SIL, which gives the prediction. `meter`
asks for a reading while the drive keeps doing what it does.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from zerohertz.bringup.bench import VOLTAGE_ONLY, Bench, Rows, Vectors, phases, vector
from zerohertz.commission.board_run import borrowed
from zerohertz.drive import State

Numbers = dict[str, float]
Meter = Callable[[str], float]

TURN_HZ = 0.5  # of the field in the slow turn
HOLD_RAD = math.pi / 6.0  # u and w carry the same, v nothing: the dead time bends no angle here
RATED_SHARE = 0.2  # current of the first tests
TRIP_SHARE = 0.16  # three sensors with one wrong: their sum stays below .3 of the trip
SLOW_SPEED_SHARE = 0.1  # of speed_max_rad_s
FIRST_TURN_SLEW = 0.2  # of that speed in a second: steeper, a large inertia falls out of step
_SAMPLES = 20
_TRIPPED_S = 0.3
_HOLD_SHARE = 0.93  # less reactance and dead time than in the turn
_WITH_LINK = ("regen_start_V", "chopper_on_V", "mains_lost_V", "mains_V")
_WITH_SPEED = (
    *("speed_max_rad_s", "over_speed_rad_s", "torque_speed_max_rad_s"),
    "speed_deviation_rad_s",
)
_COAST_S = 4.0  # until the shaft stands


def target_A(bench: Bench) -> float:
    """Length of the current vector of the first tests."""
    p = bench.drive.get(["com_rated_A", "i_trip_A"])
    return min(RATED_SHARE * p["com_rated_A"], TRIP_SHARE * p["i_trip_A"])


def leg_loss_V(bench: Bench) -> float:
    """What a leg loses, by the parameters."""
    p = bench.drive.get(["dead_time_s", "device_drop_V"])
    return p["dead_time_s"] / bench.drive.identity.period_s * bench.u_dc_V + p["device_drop_V"]


def bench_limits(bench: Bench) -> Numbers:
    """For a supply far below what the drive is set for."""
    return {"u_dc_min_V": min(bench.parameter("u_dc_min_V"), 0.7 * bench.u_dc_V)}


def slow_rad_s(bench: Bench) -> float:
    """Electrical speed of the first turn: a tenth of the largest, or what the dc link reaches."""
    p = bench.drive.get(["speed_max_rad_s", "Ls_H", "i_d_A"])
    flux_Wb = p["Ls_H"] * p["i_d_A"]
    reached_rad_s = 0.4 * bench.u_dc_V / math.sqrt(2.0) / flux_Wb
    return min(SLOW_SPEED_SHARE * p["speed_max_rad_s"], reached_rad_s)


def supply(bench: Bench, meter: Meter) -> Numbers:
    """Gates off: the dc link, by the drive and by a meter."""
    read = [bench.drive.status().u_dc_V for _ in range(_SAMPLES)]
    return {"u_dc_drive_V": float(np.mean(read)), "u_dc_V": meter("u_dc_V")}


def still(bench: Bench, meter: Meter) -> Numbers:
    """Gates off, shaft at rest: offsets, and what is left when they are taken out."""
    faults = bench.ready()
    names = ["i_s_alpha_A", "i_s_beta_A", "u_line_alpha_V", "u_line_beta_V"]
    read = np.array([bench.drive.sample(names)[1] for _ in range(_SAMPLES)])
    offsets = bench.drive.sample(["offset_u_A", "offset_v_A", "offset_w_A"])[1]
    mean = read.mean(axis=0)
    left_A = phases(complex(mean[0], mean[1]))
    found = {f"offset_{x}_A": o for x, o in zip("uvw", offsets, strict=True)}
    found |= {f"left_{x}_A": i for x, i in zip("uvw", left_A, strict=True)}
    noise_A = float(np.hypot(*read[:, :2].std(axis=0)))
    line_V = math.hypot(mean[2], mean[3])
    return found | {"noise_A": noise_A, "line_V": line_V, "faults": float(faults)}


def trips(bench: Bench, meter: Meter) -> Numbers:
    """Gates off: both trips of the dc link, provoked by their limits."""
    p = bench.drive.get([*_WITH_LINK, *_WITH_SPEED, "u_dc_max_V", "u_dc_min_V"])
    over_V, under_V = 0.97 * bench.u_dc_V, 1.03 * bench.u_dc_V
    # A low limit of the link allows less speed, and none of what acts below it.
    low = {name: p[name] * min(1.0, 0.8 * over_V / p["u_dc_max_V"]) for name in _WITH_SPEED}
    low |= dict.fromkeys(_WITH_LINK, 0.0)
    low["u_dc_max_V"] = over_V
    found = {"over_voltage_faults": _provoked(bench, low)}
    high = {"u_dc_min_V": under_V, "u_dc_max_V": max(p["u_dc_max_V"], 1.1 * under_V)}
    return found | {"under_voltage_faults": _provoked(bench, high | {"mains_lost_V": 0.0})}


def _provoked(bench: Bench, values: Numbers) -> float:
    with borrowed(bench.drive, values):
        bench.rest(_TRIPPED_S)
        seen = bench.drive.status().faults
    bench.ready()
    return float(seen)


def turn(bench: Bench, meter: Meter) -> Numbers:
    """Voltage alone, no current control: the field turns once and stops. Clamp on all three cables.

    i = c + A u + B conj(u): B is what no right wiring has, c what no whole inverter has.
    """
    aim_A, loss_V = target_A(bench), 1.63 * leg_loss_V(bench)
    Rs_ohm = bench.parameter("Rs_ohm")
    start_V, most_V = 0.5 * loss_V, 1.6 * loss_V + 4.0 * Rs_ohm * aim_A
    test = VOLTAGE_ONLY | {"swap_vw": 0.0, "vf_boost_V": start_V}
    test["current_sum_max_A"] = 0.29 * bench.parameter("i_trip_A")
    step_V = 0.12 * Rs_ohm * aim_A + 0.02 * loss_V
    speed_rad_s = 2.0 * math.pi * TURN_HZ / bench.parameter("pole_pairs")
    with bench.running(test, speed_rad_s):
        bench.raise_voltage(aim_A, step_V, most_V, 0.5)  # a quarter turn: a wrong sensor shows it
        bench.wait(0.5)
        seen = bench.rows(1.0 / TURN_HZ)
        found = _field(seen.i_A, seen) if len(seen.i_A) > 16 else {}
        stopped = _stop_at(bench, HOLD_RAD)
        if "i_voltage" in found:
            bench.drive.set("vf_boost_V", _HOLD_SHARE * found["i_voltage"])
        bench.wait(1.0)
        found |= _complex("hold", bench.current_A(_SAMPLES)) | _complex("hold_u", bench.voltage_V())
        found |= {"rows": float(len(seen.i_A)), "faults": float(bench.faults)}
        if stopped and not found["faults"]:
            found |= {f"clamp_{x}_A": meter(f"clamp_{x}_A") for x in "uvw"}
    return found


def _stop_at(bench: Bench, angle_rad: float) -> bool:
    """Stops the field a little before this angle, so that it ends there; False when it does not."""
    slew_rad_s2 = bench.parameter("open_loop_slew_rad_s2")
    omega_rad_s = 2.0 * math.pi * TURN_HZ
    lead_rad = 0.5 * omega_rad_s**2 / slew_rad_s2
    for _ in range(4000):
        if bench.faults:
            return False
        off_rad = float(np.angle(bench.voltage_V() * np.exp(-1j * (angle_rad - lead_rad))))
        if 0.0 <= off_rad < 0.2:
            bench.turn_at(0.0)
            return True
        to_go_s = (-off_rad % (2.0 * math.pi)) / omega_rad_s
        bench.keep_alive()
        bench.pause(min(max(0.5 * to_go_s, 2e-3), 0.2))
    return False


def _complex(name: str, value: complex) -> Numbers:
    return {f"{name}_alpha": value.real, f"{name}_beta": value.imag}


def _field(y: Vectors, rows: Rows, name: str = "i") -> Numbers:
    """Least squares y = c + A u + B conj(u)."""
    columns = np.column_stack([np.ones_like(rows.u_V), rows.u_V, rows.u_V.conj()])
    c, A, B = np.linalg.lstsq(columns, y, rcond=None)[0]
    found = _complex(f"{name}_mean", complex(c)) | _complex(f"{name}_turning", complex(A))
    found |= _complex(f"{name}_mirrored", complex(B))
    return found | {f"{name}_voltage": float(np.mean(np.abs(rows.u_V)))}


def direct(bench: Bench, meter: Meter) -> Numbers:
    """Direct current along u at two levels: ratio of the phases, Rs, and what a leg loses."""
    aim_A, loss_V = target_A(bench), 1.63 * leg_loss_V(bench)
    Rs_ohm = bench.parameter("Rs_ohm")
    step_V, most_V = 0.2 * Rs_ohm * aim_A + 0.02 * loss_V, 1.6 * loss_V + 12.0 * Rs_ohm * aim_A
    found: Numbers = {}
    with bench.running(VOLTAGE_ONLY | {"vf_boost_V": 0.5 * loss_V}):
        for level, share in (("low", 1.0), ("high", 2.0)):
            bench.raise_voltage(share * aim_A, step_V, most_V, 0.25)
            bench.wait(_settled_s(bench))
            i_A, u_V = bench.current_A(_SAMPLES), bench.voltage_V()
            found |= {f"i_{level}_A": i_A.real, f"u_{level}_V": u_V.real}
            found |= {f"{x}_{level}_A": i for x, i in zip("uvw", phases(i_A), strict=True)}
        found["faults"] = float(bench.faults)
    rise_A = found["i_high_A"] - found["i_low_A"]
    if rise_A > 0.3 * aim_A:
        Rs = (found["u_high_V"] - found["u_low_V"]) / rise_A
        lost_V = (found["u_high_V"] - Rs * found["i_high_A"]) / (2.0 * math.sqrt(2.0 / 3.0))
        found |= {"Rs_ohm": Rs, "leg_loss_V": lost_V}
    return found


def _settled_s(bench: Bench) -> float:
    """Several time constants of the rotor."""
    p = bench.drive.get(["Lr_H", "Rr_ohm"])
    return min(max(6.0 * p["Lr_H"] / p["Rr_ohm"], 0.5), 5.0)


def first_turn(bench: Bench, meter: Meter) -> Numbers:
    """A rotating current (I-f) at a tenth of the largest speed: direction, speed, voltages.

    V/f would do without the current sensors, but a large motor without load hunts with it.
    """
    p = bench.drive.get(["pole_pairs", "i_d_A"])
    omega_rad_s = slow_rad_s(bench)
    values = VOLTAGE_ONLY | {"control_mode": 2.0, "i_f_A": p["i_d_A"]}
    slew_rad_s2 = FIRST_TURN_SLEW * omega_rad_s  # I-f keeps to the smaller of the two
    values |= {"open_loop_slew_rad_s2": slew_rad_s2, "speed_slew_rad_s2": slew_rad_s2}
    values |= {"stop_mode": 1.0, "ramp_down_rad_s2": 0.5 * omega_rad_s, "ramp_down_s": 5.0}
    with bench.running(values, omega_rad_s / p["pole_pairs"]):
        bench.wait(1.0 / FIRST_TURN_SLEW + 4.0)
        seen = bench.rows(0.5)
        found = {"faults": float(bench.faults), "rows": float(len(seen.i_A))}
        if found["rows"] > 16:
            found |= _field(seen.line_V, seen, "line") | _field(seen.i_A, seen)
            found["current_A"] = float(np.mean(np.abs(seen.i_A)))
        found["asked_rpm"] = omega_rad_s / p["pole_pairs"] * 30.0 / math.pi
        if not found["faults"]:
            found["speed_rpm"] = meter("speed_rpm")
    return found


def closed_loop(bench: Bench, meter: Meter) -> Numbers:
    """Vector control at the same speed: the estimate against the tachometer; then the stop."""
    p = bench.drive.get(["pole_pairs", "i_d_A", "i_max_A"])
    omega_rad_s = slow_rad_s(bench)
    limit_A = min(p["i_max_A"], 1.6 * p["i_d_A"])
    values = {"control_mode": 0.0, "stop_mode": 1.0, "speed_slew_rad_s2": 0.5 * omega_rad_s}
    values |= {"i_q_max_A": min(bench.parameter("i_q_max_A"), 0.8 * limit_A)}
    bench.rest(_COAST_S)
    with bench.running(values, omega_rad_s / p["pole_pairs"]):
        _until_run(bench)
        bench.wait(5.0)
        read = [bench.drive.status().speed_hat_rad_s for _ in range(_SAMPLES)]
        found = {"faults": float(bench.faults), "estimate_rpm": 30.0 / math.pi * _mean(read)}
        found["current_A"] = abs(bench.current_A(_SAMPLES))
        if not found["faults"]:
            found["speed_rpm"] = meter("speed_rpm")
    found["u_dc_after_V"] = bench.drive.status().u_dc_V
    return found


def _until_run(bench: Bench) -> None:
    """Past the measurement of Rs and the build-up of the flux; or tripped."""
    most_s = bench.parameter("premagnetise_s") + 3.0 * bench.parameter("rs_level_s") + 5.0
    while bench.drive.status().state != State.RUN and not bench.faults and most_s > 0.0:
        bench.wait(0.2)
        most_s -= 0.2


def _mean(values: list[float]) -> float:
    return float(np.mean(values))


def reading_vector(found: Numbers) -> complex:
    """Of the clamp on the three cables."""
    return complex(vector(*(found[f"clamp_{x}_A"] for x in "uvw")))
