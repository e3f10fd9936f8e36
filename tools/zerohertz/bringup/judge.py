"""Does what a step measured fit the prediction? Each returns what does not; empty: it fits.

Tolerances: what meters and healthy parts are worth, with room to the smallest fault that is named.
"""

from __future__ import annotations

import cmath
import math

from zerohertz.bringup import wiring
from zerohertz.bringup.bench import fault_text, vector
from zerohertz.bringup.measure import Numbers, reading_vector
from zerohertz.bringup.wiring import Finding, Linear, Turn
from zerohertz.drive import Fault

DC_OFF = 0.04  # drive against meter
RS_OFF = 1.35  # a cold winding against a parameter
STAR_DELTA = (2.3, 3.7)
LOSS_OFF = 0.25
LOSS_FLOOR = 0.0004  # of the dc link: drops that no parameter knows to the volt
SPEED_OFF = 0.06
VOLTAGE_OFF = 1.5
ESTIMATE_OFF = 0.04
ESTIMATE_LEAST = 0.006  # of the largest speed
NOISE_PU = 0.01  # of full scale
OFFSET_PU = 0.01
_BY_OFFSET = (
    Fault.CURRENT_OFFSET
    | Fault.ADC_RANGE
    | Fault.OVER_CURRENT
    | Fault.CURRENT_SUM
    | Fault.EARTH_FAULT
)
_DUTY = 1.0  # voltage_source of a board without line-voltage sensors


def supply(found: Numbers, predicted: Numbers, p: Numbers) -> list[Finding]:
    drive_V, meter_V = found["u_dc_drive_V"], found["u_dc_V"]
    if meter_V < 0.02 * p["dc_link_full_scale_V"]:
        return [Finding("no dc link", f"the meter reads {meter_V:.1f} V", "switch the supply on")]
    ratio = drive_V / meter_V
    if abs(ratio - 1.0) < DC_OFF:
        return []
    if ratio < 0.05:
        return [Finding("dc-link sensor dead", f"reads {drive_V:.1f} V", "check its divider")]
    right_V = p["dc_link_full_scale_V"] / ratio
    return [
        Finding(
            f"dc link scaled by {ratio:.2f}",
            f"the drive reads {drive_V:.1f} V, the meter {meter_V:.1f} V",
            f"correct the divider, or set dc_link_full_scale_V to {right_V:.4g} V",
        )
    ]


def still(found: Numbers, predicted: Numbers, p: Numbers) -> list[Finding]:
    faults, full_A = int(found["faults"]), p["current_full_scale_A"]
    left_A = max(abs(found[f"left_{x}_A"]) for x in "uvw")
    if faults & _BY_OFFSET and left_A > OFFSET_PU * full_A:
        return [_offset(found)]
    if faults:
        text = fault_text(faults)
        return [Finding(f"not READY: {text}", "it stays after a reset", "tools/docs/faults.md")]
    if found["noise_A"] > NOISE_PU * full_A:
        return [
            Finding(
                "current sensors noisy",
                f"{found['noise_A']:.2f} A rms with the gates off",
                "check ground, shield and filter of the current channels",
            )
        ]
    if p["voltage_source"] != _DUTY and found["line_V"] > 0.03 * p["line_voltage_full_scale_V"]:
        return [
            Finding(
                "line-voltage sensors see a voltage",
                f"{found['line_V']:.1f} V with the gates off",
                "is the shaft at rest? Then check both sensors",
            )
        ]
    return []


def _offset(found: Numbers) -> Finding:
    """One channel's offset o leaves 2/3 of it there, -1/3 in the others: no sum is left."""
    left_A = {x: found[f"left_{x}_A"] for x in "uvw"}
    phase = max(left_A, key=lambda x: abs(left_A[x]))
    size_A = 1.5 * left_A[phase]
    return Finding(
        f"current sensor {phase} offset",
        f"channel {phase} reads {size_A:+.2f} A without current",
        "check its supply, reference and connector; set the zero of the port's read_adc",
    )


def trips(found: Numbers, predicted: Numbers, p: Numbers) -> list[Finding]:
    asked = (("over", Fault.DC_OVER_VOLTAGE), ("under", Fault.DC_UNDER_VOLTAGE))
    return [
        Finding(
            f"{way}-voltage trip does not act",
            f"{fault_text(int(found[f'{way}_voltage_faults']))} was seen",
            "do not go on: the protection of the dc link has to work first",
        )
        for way, fault in asked
        if not int(found[f"{way}_voltage_faults"]) & fault
    ]


def turn(found: Numbers, predicted: Numbers, p: Numbers) -> list[Finding]:
    if found["faults"] and found["rows"] <= 16:
        return [_tripped(found)]
    seen = _turn_of(found, predicted)
    size_A = (abs(seen.turning) + abs(seen.mirrored)) * seen.volts
    if size_A < 0.15 * _size_A(predicted):
        return [_no_current(found, size_A)]
    if broken := wiring.broken_power(seen):
        return [broken]
    if found["faults"]:
        return [_tripped(found)]
    return _with_clamp(seen, found)


def _size_A(found: Numbers) -> float:
    size = math.hypot(found["i_turning_alpha"], found["i_turning_beta"])
    return size * found["i_voltage"]


def _with_clamp(seen: Turn, found: Numbers) -> list[Finding]:
    readings = [found[f"clamp_{x}_A"] for x in "uvw"]
    largest_A = max(map(abs, readings))
    if abs(sum(readings)) > 0.15 * largest_A:
        why = "three currents of a motor add up to zero"
        return [Finding("clamp readings do not add up", why, "zero the clamp and read again")]
    if abs(seen.clamp_A) < 0.3 * abs(seen.hold_A):
        why = "the drive measures current, the clamp reads none"
        return [Finding("clamp reads no current", why, "is it a clamp for direct current?")]
    pair, legs = wiring.crossed_gates(seen)
    if pair:
        return [wiring.gates_finding(pair)]
    sensors = wiring.current_sensors(wiring.sensor_matrix(seen, legs))
    return [sensors] if sensors else []


def _turn_of(found: Numbers, predicted: Numbers) -> Turn:
    def number(name: str, of: Numbers = found) -> complex:
        return complex(of[f"{name}_alpha"], of[f"{name}_beta"])

    clamp_A = reading_vector(found) if "clamp_u_A" in found else complex(vector(0.0, 0.0, 0.0))
    return Turn(
        *(number("i_turning"), number("i_mirrored"), number("i_mean"), found["i_voltage"]),
        *(number("hold"), number("hold_u"), clamp_A),
        cmath.phase(number("i_turning", predicted)),
    )


def _no_current(found: Numbers, size_A: float) -> Finding:
    clamped_A = max((abs(found.get(f"clamp_{x}_A", 0.0)) for x in "uvw"), default=0.0)
    if clamped_A > 4.0 * size_A:
        why = f"the clamp reads {clamped_A:.2f} A, the drive {size_A:.2f} A"
        return Finding("all current sensors dead", why, "check their supply and the ADC")
    return Finding(
        "no current flows",
        "the drive switches and measures no current, neither does the clamp",
        "check contactor, motor cable, gate enable and the drivers' supply",
    )


def _tripped(found: Numbers) -> Finding:
    text = fault_text(int(found["faults"]))
    return Finding(f"tripped: {text}", "the drive ended the step itself", "tools/docs/faults.md")


def direct(found: Numbers, predicted: Numbers, p: Numbers) -> list[Finding]:
    if found["faults"]:
        return [_tripped(found)]
    if "Rs_ohm" not in found:
        why = f"{found['i_high_A']:.2f} A at {found['u_high_V']:.1f} V"
        text = "check the nameplate's Rs, and the dead time"
        return [Finding("too little direct current", why, text)]
    half = [-2.0 * found[f"{x}_high_A"] / found["u_high_A"] for x in "vw"]
    if max(abs(x - 1.0) for x in half) > 0.15:
        why = ", ".join("{:.2f} A".format(found[f"{x}_high_A"]) for x in "uvw")
        return [Finding("direct current not in the ratio 1 : -.5 : -.5", why, "repeat the turn")]
    wrong = [_resistance(found, predicted), _dead_time(found, predicted, p)]
    return [finding for finding in wrong if finding]


def _resistance(found: Numbers, predicted: Numbers) -> Finding | None:
    ratio = found["Rs_ohm"] / predicted["Rs_ohm"]
    if 1.0 / RS_OFF < ratio < RS_OFF:
        return None
    text = f"Rs is {found['Rs_ohm']:.4g} ohm, {ratio:.2f} times what the parameters say"
    for wired, told, x in (("star", "delta", ratio), ("delta", "star", 1.0 / ratio)):
        if STAR_DELTA[0] < x < STAR_DELTA[1]:
            return Finding(
                f"motor wired in {wired}, told in {told}",
                text,
                "change the terminal links, or commission with the other line of the nameplate",
            )
    return Finding("stator resistance of another motor", text, "check motor and nameplate")


def _dead_time(found: Numbers, predicted: Numbers, p: Numbers) -> Finding | None:
    lost_V, expected_V = found["leg_loss_V"], predicted["leg_loss_V"]
    allowed_V = LOSS_OFF * expected_V + LOSS_FLOOR * p["u_dc_V"]
    if abs(lost_V - expected_V) <= allowed_V:
        return None
    dead_s = (lost_V - p["device_drop_V"]) * p["period_s"] / p["u_dc_V"]
    return Finding(
        "dead time wrong",
        f"a leg loses {lost_V:.2f} V, {expected_V:.2f} V expected: as with a dead time of "
        f"{1e6 * dead_s:.1f} us",
        "look at both edges with an oscilloscope; correct the timer, or dead_time_s and "
        "device_drop_V",
    )


def first_turn(found: Numbers, predicted: Numbers, p: Numbers) -> list[Finding]:
    if found["faults"]:
        return [_tripped(found)]
    asked_rpm, seen_rpm = found["asked_rpm"], found["speed_rpm"]
    ratio = seen_rpm / asked_rpm
    if abs(ratio) < 0.1:
        why = f"{seen_rpm:.0f} of {asked_rpm:.0f} min^-1"
        return [Finding("shaft does not turn", why, "free the shaft: brake, coupling, bearing")]
    if ratio < 0.0:
        return [_backwards(seen_rpm, p)]
    wrong = []
    if abs(ratio - 1.0) > SPEED_OFF:
        wrong.append(_poles(seen_rpm, asked_rpm, p))
    size = found["i_voltage"] / predicted["i_voltage"]
    if not 1.0 / VOLTAGE_OFF < size < VOLTAGE_OFF:
        why = f"{found['i_voltage']:.1f} V, {predicted['i_voltage']:.1f} V expected"
        wrong.append(Finding("voltage of another motor", why, "check the nameplate"))
    if p["voltage_source"] != _DUTY and (lines := _lines(found, predicted, p)):
        wrong.append(lines)
    return wrong


def _backwards(seen_rpm: float, p: Numbers) -> Finding:
    crossed = "swap_vw is on: switch it off, or " if p["swap_vw"] else "set swap_vw, or "
    return Finding(
        "turns backwards",
        f"{seen_rpm:.0f} min^-1: two motor cables are exchanged, or the other direction is wanted",
        crossed + "exchange two motor cables",
    )


def _poles(seen_rpm: float, asked_rpm: float, p: Numbers) -> Finding:
    pairs = p["pole_pairs"] * asked_rpm / seen_rpm
    why = f"{seen_rpm:.0f} of {asked_rpm:.0f} min^-1"
    if abs(pairs - round(pairs)) < 0.12 and round(pairs) != round(p["pole_pairs"]):
        text = f"set pole_pairs to {round(pairs)}, and check the nameplate's speed"
        return Finding("wrong number of pole pairs", why, text)
    return Finding("wrong speed", why, "is the shaft free? Is the tachometer set right?")


def _lines(found: Numbers, predicted: Numbers, p: Numbers) -> Finding | None:
    """The dead time takes its voltage along the current, which may lag otherwise than predicted."""

    def number(name: str, of: Numbers) -> complex:
        return complex(of[f"{name}_alpha"], of[f"{name}_beta"])

    loss_V = p["dead_time_s"] / p["period_s"] * p["u_dc_V"] + p["device_drop_V"]
    share = 4.0 / math.pi * math.sqrt(1.5) * loss_V / found["line_voltage"]
    turned = [number("i_turning", of) for of in (found, predicted)]
    along = [current / abs(current) for current in turned]
    expected = number("line_turning", predicted) - share * (along[0] - along[1])
    fit = Linear(number("line_turning", found), number("line_mirrored", found))
    return wiring.line_sensors(fit, expected)


def closed_loop(found: Numbers, predicted: Numbers, p: Numbers) -> list[Finding]:
    if found["faults"]:
        return [_tripped(found)]
    off_rpm = found["estimate_rpm"] - found["speed_rpm"]
    largest_rpm = p["speed_max_rad_s"] / p["pole_pairs"] * 30.0 / math.pi
    if abs(off_rpm) <= max(ESTIMATE_OFF * abs(found["speed_rpm"]), ESTIMATE_LEAST * largest_rpm):
        return []
    why = f"estimate {found['estimate_rpm']:.0f}, tachometer {found['speed_rpm']:.0f} min^-1"
    text = "commission the motor (zh commission), and check its nameplate"
    return [Finding("estimate off the tachometer", why, text)]
