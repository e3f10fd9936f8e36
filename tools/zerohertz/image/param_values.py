"""The parameters that an image starts with: defaults, motor, board, configuration, in this order.

Python's standard library alone: the build computes them. The rules are those of
host_sim/firmware_setup.cpp, float for float: tests/tools/test_param_header.py compares the two.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

from zerohertz.board import Board
from zerohertz.errors import UserError
from zerohertz.motor import Motor
from zerohertz.param_list import Entry, entries, float32
from zerohertz.param_rules import conflict

Values = dict[str, float]

# Table 1 and the rig of Hasegawa (2005): what the defaults of param_list.def were chosen for.
_PAPER_VOLTAGE_V, _PAPER_FREQUENCY_HZ, _PAPER_CURRENT_A = 200.0, 60.0, 6.2
_PAPER_M_H, _PAPER_J_KG_M2 = 0.102, 0.015


def image_values(motor: Motor, board: Board, given: Mapping[str, float], file: Path) -> Values:
    """Every parameter, in the order of the list; UserError names file and parameter."""
    listed = entries()
    values = {name: float32(p.initial) for name, p in listed.items()}
    factors = _motor_factors(motor) | _board_factors(board) | _speed_factors(motor, board)
    for name, factor in factors.items():
        least, most = listed[name].lowest, listed[name].highest
        values[name] = min(max(float32(factor * values[name]), least), most)
    for name, value in (_measured(motor, board) | dict(given)).items():
        where = file if name in given else Path(motor.file if name in _OF_MOTOR else "board")
        values[name] = _checked(listed, name, value, where)
    if broken := conflict(values):
        raise UserError(f"{file}: {broken}")
    return values


def _motor_factors(motor: Motor) -> Values:
    """Another motor needs other currents and flux: in proportion to the nameplates."""
    plate = motor.nameplate
    current = plate.current_A / _PAPER_CURRENT_A
    flux = (plate.voltage_V / plate.frequency_Hz) / (_PAPER_VOLTAGE_V / _PAPER_FREQUENCY_HZ)
    i_d = flux * _PAPER_M_H / motor.circuit.M_H
    return {
        **dict.fromkeys(("i_q_max_A", "i_max_A", "overload_motor_A"), current),
        **dict.fromkeys(("overload_inverter_A", "com_rated_A"), current),
        **dict.fromkeys(("i_d_A", "i_d_max_A"), i_d),
        "lambda_max_Wb": flux,
        "speed_J_kg_m2": motor.mechanics.J_kg_m2 / _PAPER_J_KG_M2,
    }


def _speed_factors(motor: Motor, board: Board) -> Values:
    """As the rated speed, and so that the motor's own voltage stays below the link's trip."""
    plate = motor.nameplate
    flux = (plate.voltage_V / plate.frequency_Hz) / (_PAPER_VOLTAGE_V / _PAPER_FREQUENCY_HZ)
    dc_scale = board.dc_link_full_scale_V / Board().dc_link_full_scale_V
    speed = min(plate.frequency_Hz / _PAPER_FREQUENCY_HZ, dc_scale / flux)
    return dict.fromkeys(("speed_max_rad_s", "over_speed_rad_s", "torque_speed_max_rad_s"), speed)


def _board_factors(board: Board) -> Values:
    paper = Board()
    current = board.current_full_scale_A / paper.current_full_scale_A
    return {
        "u_dc_max_V": board.dc_link_full_scale_V / paper.dc_link_full_scale_V,
        "u_dc_min_V": board.u_dc_V / paper.u_dc_V,
        "i_trip_A": current,
        "current_sum_max_A": current,
        "voltage_filter_comp_s": _delay_s(board) / _delay_s(paper),
    }


def _delay_s(board: Board) -> float:
    """The filter's group delay at low frequency, 2 D / w_c, seen from the middle of the interval
    that just ended: half a period less.
    """
    cutoff_rad_s = 2.0 * math.pi * board.filter_cutoff_Hz
    return 2.0 * board.filter_damping / cutoff_rad_s - 0.5 * board.period_s


_OF_MOTOR = ("Rs_ohm", "Rr_ohm", "Ls_H", "Lr_H", "M_H", "pole_pairs")
_OF_BOARD = (
    *("adc_bits", "current_full_scale_A", "line_voltage_full_scale_V"),
    *("dc_link_full_scale_V", "period_s"),
)


def _measured(motor: Motor, board: Board) -> Values:
    known = {name: getattr(motor.circuit, name) for name in _OF_MOTOR[:-1]}
    return {
        **known,
        "pole_pairs": motor.nameplate.pole_pairs,
        **{name: getattr(board, name) for name in _OF_BOARD},
    }


def _checked(listed: Mapping[str, Entry], name: str, value: float, where: Path) -> float:
    parameter = listed[name]
    if not parameter.lowest <= float32(value) <= parameter.highest:
        raise UserError(
            f"{where}: {name}: {value:g} is out of range; "
            f"give {parameter.lowest:g} .. {parameter.highest:g}"
        )
    if parameter.whole and not float(value).is_integer():
        raise UserError(f"{where}: {name}: {value:g} is not a whole number")
    return float32(value)
