"""What contradicts what in a configuration: refused with both values and the remedy."""

from __future__ import annotations

import math
from dataclasses import replace

from zerohertz import param_list
from zerohertz.commission.plate import Plate, warnings
from zerohertz.commission.run import inertia_kg_m2
from zerohertz.commission.solve import Identified
from zerohertz.commission.tuning import MAGNETISE, TRIP, limit_A
from zerohertz.configuration.files import APPLICATION, BOARD, MOTOR, Configuration
from zerohertz.motor import J_RATIO, J_RATIO_COUPLED, POWER_TOLERANCE, usual_J_kg_m2
from zerohertz.param_list import float32

LOAD_TOLERANCE = 1.02
LINK_TOLERANCE = 1.02
LINK_MOST = 1.5  # times the peak of the motor's voltage: the winding is made for no more


def require_consistent(c: Configuration) -> None:
    """UserError for the first contradiction that needs no circuit."""
    _plate(c)
    _inertia(c)
    _period(c)
    _sensors(c)
    _current(c)
    _link(c)
    _speed(c)
    _load(c)


def require_possible(c: Configuration, found: Identified) -> None:
    """UserError for what this motor cannot do with these currents."""
    plate, most_A = c.motor.plate, most_vector_A(c)
    period_s, decay_s = c.board.scaling.period_s, 1.0 / found.circuit.a11_per_s
    if period_s >= decay_s:
        raise c.wrong(
            BOARD,
            "control.period_s",
            f"is {1e6 * period_s:g} us, and the motor's current settles in {1e6 * decay_s:.0f} us; "
            "neither the observer nor its table holds that: shorten the period",
        )
    if found.i_d_A > MAGNETISE * most_A:
        raise c.wrong(
            *_current_key(c),
            f"{_rms(most_A):.3g} A rms leave no torque: rated flux alone takes "
            f"{_rms(found.i_d_A):.3g} A; raise it, or take a board for more current",
        )
    torque_A = math.sqrt(most_A**2 - found.i_d_A**2)
    share = found.circuit.M_H / found.circuit.Lr_H
    most_Nm = plate.pole_pairs * share * found.rotor_flux_Wb * torque_A
    if load_Nm(c) > most_Nm:
        raise c.wrong(
            APPLICATION,
            "load.torque_Nm",
            f"is {load_Nm(c):.3g} Nm, and {_rms(most_A):.3g} A rms make {most_Nm:.3g} Nm; lower "
            "it, or raise limits.current_A",
        )
    up = c.application.up_rpm_per_s
    if up is None:
        return
    needed_Nm = inertia_kg_m2(total_plate(c)) * up * math.pi / 30.0
    if needed_Nm > most_Nm:
        raise c.wrong(
            APPLICATION,
            "ramps.up_rpm_per_s",
            f"{up:g} takes {needed_Nm:.3g} Nm for the inertia alone, and the current limit makes "
            f"{most_Nm:.3g} Nm; lower it to {0.7 * up * most_Nm / needed_Nm:.3g}",
        )


def speed_rpm(c: Configuration) -> float:
    return c.application.speed_rpm or c.motor.plate.speed_rpm


def load_Nm(c: Configuration) -> float:
    """Rated torque, where the application says nothing else."""
    return c.application.torque_Nm or c.motor.plate.torque_Nm


def total_plate(c: Configuration) -> Plate:
    """With the inertia of motor and load."""
    own = inertia_kg_m2(c.motor.plate)
    return replace(c.motor.plate, J_kg_m2=own + c.application.load_J_kg_m2)


def trip_A(c: Configuration) -> float:
    """The largest over-current trip, phase current: of the board, or as the application asks."""
    wanted = c.application.current_A
    if wanted is None:
        return c.board.i_trip_A
    return min(c.board.i_trip_A, TRIP * math.sqrt(2.0) * wanted)


def most_vector_A(c: Configuration) -> float:
    return limit_A(c.motor.plate, trip_A(c))


def _rms(vector_A: float) -> float:
    return vector_A / math.sqrt(3.0)


def _current_key(c: Configuration) -> tuple[str, str]:
    if c.application.current_A is not None:
        return APPLICATION, "limits.current_A"
    return BOARD, "limits.i_trip_A"


def _plate(c: Configuration) -> None:
    plate, told_Nm = c.motor.plate, c.motor.torque_Nm
    if told_Nm is not None and abs(told_Nm / plate.torque_Nm - 1.0) > POWER_TOLERANCE:
        raise c.wrong(
            MOTOR,
            "nameplate.torque_Nm",
            f"is {told_Nm:g} Nm, and power_kW = {plate.power_kW:g} at speed_rpm = "
            f"{plate.speed_rpm:g} is {plate.torque_Nm:.4g} Nm; correct the one that is wrong",
        )
    for doubt in warnings(plate):
        if doubt.startswith("efficiency"):
            raise c.wrong(
                MOTOR,
                "nameplate.power_kW",
                f"is {plate.power_kW:g}, with voltage_V = {plate.voltage_V:g}, current_A = "
                f"{plate.current_A:g}, connection = {plate.connection}: {doubt}",
            )


def _inertia(c: Configuration) -> None:
    plate = c.motor.plate
    usual = usual_J_kg_m2(plate.torque_Nm)
    if plate.J_kg_m2 is None:
        return
    most = usual * (J_RATIO_COUPLED if c.motor.turned else J_RATIO)
    if not usual / J_RATIO < plate.J_kg_m2 < most:
        raise c.wrong(
            MOTOR,
            "mechanics.J_kg_m2" if c.motor.turned else "nameplate.J_kg_m2",
            f"is {plate.J_kg_m2:g} kg m2; a motor of {plate.torque_Nm:.3g} Nm has about "
            f"{usual:.2g}: correct it, leave it out, or give the load's in {APPLICATION}, "
            "load.J_kg_m2",
        )


def _period(c: Configuration) -> None:
    period = param_list.entries()["period_s"]
    if not period.lowest <= float32(c.board.scaling.period_s) <= period.highest:
        raise c.wrong(
            BOARD,
            "control.period_s",
            f"is {c.board.scaling.period_s:g} s; the firmware takes {period.lowest:g} .. "
            f"{period.highest:g}",
        )


def _sensors(c: Configuration) -> None:
    board = c.board
    if board.i_trip_A >= board.scaling.current_full_scale_A:
        raise c.wrong(
            BOARD,
            "limits.i_trip_A",
            f"is {board.i_trip_A:g} A, and the sensors end at full_scale.current_A = "
            f"{board.scaling.current_full_scale_A:g} A; lower the trip",
        )
    for key, value in (("u_dc_max_V", board.u_dc_max_V), ("u_dc_min_V", board.u_dc_min_V)):
        if value is not None and value >= board.scaling.dc_link_full_scale_V:
            raise c.wrong(
                BOARD,
                f"limits.{key}",
                f"is {value:g} V, and the sensor ends at full_scale.dc_link_V = "
                f"{board.scaling.dc_link_full_scale_V:g} V; lower the trip",
            )
        low = key == "u_dc_min_V"
        if value is not None and (value >= board.scaling.u_dc_V) == low:
            raise c.wrong(
                BOARD,
                f"limits.{key}",
                f"is {value:g} V, and inverter.u_dc_V = {board.scaling.u_dc_V:g} V: it would "
                f"trip at once; {'lower' if low else 'raise'} the trip",
            )


def _current(c: Configuration) -> None:
    board_A, plate, asked = c.board.i_trip_A, c.motor.plate, c.application.current_A
    needed = TRIP * math.sqrt(2.0) * (asked or plate.current_A)
    room_A = board_A / TRIP / math.sqrt(2.0)
    if needed <= board_A:
        return
    if asked is not None:
        raise c.wrong(
            APPLICATION,
            "limits.current_A",
            f"{asked:g} A rms need a trip of {needed:.3g} A at the peak, and the board's is "
            f"{board_A:.3g} A (limits.i_trip_A of {BOARD}, or .95 of the sensors' range); "
            f"{room_A:.3g} A rms are possible",
        )
    raise c.wrong(
        MOTOR,
        "nameplate.current_A",
        f"{plate.current_A:g} A rms need a trip of {needed:.3g} A at the peak, and the board's is "
        f"{board_A:.3g} A; give limits.current_A = {math.floor(10.0 * room_A) / 10.0:g} in "
        f"{APPLICATION} and a load that this drives, or take a board for more current",
    )


def _link(c: Configuration) -> None:
    """The voltage that rated flux needs at the largest speed, up to rated voltage."""
    plate, u_dc_V = c.motor.plate, c.board.scaling.u_dc_V
    peak_V = math.sqrt(2.0) * plate.voltage_V
    if u_dc_V > LINK_MOST * peak_V:
        raise c.wrong(
            BOARD,
            "inverter.u_dc_V",
            f"is {u_dc_V:g} V, and nameplate.voltage_V = {plate.voltage_V:g} V has a peak of "
            f"{peak_V:.3g} V: the winding is not made for it; correct the connection "
            f"({plate.connection}) or the voltage",
        )
    synchronous_rpm = 60.0 * plate.frequency_Hz / plate.pole_pairs
    share = min(speed_rpm(c) / synchronous_rpm, 1.0)
    if share * peak_V > LINK_TOLERANCE * u_dc_V:
        raise c.wrong(
            APPLICATION,
            "limits.speed_rpm",
            f"{speed_rpm(c):g} min^-1 take a dc link of {share * peak_V:.3g} V, and {BOARD} has "
            f"inverter.u_dc_V = {u_dc_V:g} V; {synchronous_rpm * u_dc_V / peak_V:.0f} are "
            "possible, or raise the link",
        )


def _load(c: Configuration) -> None:
    """Rated torque takes rated current; part of it magnetises, so this is the least that can be
    said before the circuit is known."""
    plate = c.motor.plate
    share = most_vector_A(c) / plate.current_vector_A
    if load_Nm(c) > LOAD_TOLERANCE * share * plate.torque_Nm:
        raise c.wrong(
            APPLICATION,
            "load.torque_Nm",
            f"is {load_Nm(c):.3g} Nm, and {_rms(most_vector_A(c)):.3g} A rms make less than "
            f"{share * plate.torque_Nm:.3g} Nm; lower it, or raise limits.current_A",
        )


def _speed(c: Configuration) -> None:
    slowest, fastest = c.application.slowest_rpm, speed_rpm(c)
    if slowest >= fastest:
        raise c.wrong(
            APPLICATION,
            "load.slowest_rpm",
            f"is {slowest:g}, and limits.speed_rpm = {fastest:g}; lower it",
        )
    if fastest > 2.0 * c.motor.plate.speed_rpm:
        raise c.wrong(
            APPLICATION,
            "limits.speed_rpm",
            f"is {fastest:g}, more than twice nameplate.speed_rpm = {c.motor.plate.speed_rpm:g}; "
            "lower it",
        )
