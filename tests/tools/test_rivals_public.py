"""Rivals beside public implementations of the same method, on the same signals.

The other rivals: motulator's observers (test_rivals_signals.py, test_rivals_classic.py) and the
paper's figures (test_figures.py). A board adds noise, offset, dead time and 2 % of Rs.
"""

from __future__ import annotations

import numpy as np
import public_observers as public
import pytest
from driven_motor import RPM, T_S, Record, drive
from test_rivals_signals import Errors, errors, estimated

from zerohertz import param_list

TOLD = {"i_d_A": 5.1, "lambda_max_Wb": 2.0}
RAMP = [(0.0, 300.0, 0.0), (0.2, 300.0, 0.0), (0.5, 300.0, 4.0), (1.0, 300.0, 4.0)]
RAMP += [(1.8, 1500.0, 4.0), (2.2, 1500.0, 8.1)]
LOW = [(0.0, 60.0, 0.0), (0.2, 60.0, 0.0), (0.4, 60.0, 4.0), (1.2, 60.0, 4.0), (1.6, 60.0, 8.1)]
EXACT, BOARD = 0, 1


def driven(sign: float, profile: list[tuple[float, float, float]]) -> tuple[Record, ...]:
    """Exact, and on a board; sign -1: the motor generates."""
    truth = drive([(t_s, rpm, sign * i_A) for t_s, rpm, i_A in profile])
    return truth, truth.measured(1, 0.02)


@pytest.fixture(scope="module")
def ramp() -> tuple[Record, ...]:
    return driven(1.0, RAMP)


@pytest.fixture(scope="module")
def low() -> tuple[Record, ...]:
    return driven(1.0, LOW)


@pytest.fixture(scope="module")
def generating() -> tuple[Record, ...]:
    return driven(-1.0, LOW)


def both(name: str, law: type, records: tuple[Record, ...], kind: int) -> tuple[Errors, Errors]:
    """Ours and theirs."""
    record, truth = records[kind], records[EXACT]
    ours = errors(estimated(name, record, TOLD), truth)
    return ours, errors(public.run(law(record), record), truth)


class FastTi(public.TiHybrid):
    """With our filter of the speed."""

    speed_Hz = 30.0


def test_the_hybrid_is_as_good_as_texas_instruments(ramp, low):
    """TI's gains; measured on ramps: their low-pass of 3 Hz 51 min^-1 off, ours 5. With our
    low-pass theirs has 9 % less on a board, where ours has the better angle."""
    for records in (ramp, low):
        for kind in (EXACT, BOARD):
            ours, theirs = both("hybrid_crossover", FastTi, records, kind)
            assert ours.speed_rpm < 1.12 * theirs.speed_rpm
            assert ours.angle_deg < theirs.angle_deg
    ours, theirs = both("hybrid_crossover", public.TiHybrid, ramp, BOARD)
    assert ours.speed_rpm < 0.2 * theirs.speed_rpm


def test_the_mras_holds_a_generating_motor_where_nxps_loses_it(ramp, low, generating):
    """Theirs has a hybrid's flux as reference: on a board half our speed error while motoring (3.4
    of 7.5 min^-1 on ramps, 1.9 of 3.3 at 60 min^-1), and none of the flux while generating."""
    for records in (ramp, low):
        ours, theirs = both("schauder_mras", public.NxpMras, records, EXACT)
        assert ours.speed_rpm < 1.05 * theirs.speed_rpm
        assert ours.angle_deg < theirs.angle_deg
        ours, theirs = both("schauder_mras", public.NxpMras, records, BOARD)
        assert ours.speed_rpm < 2.4 * theirs.speed_rpm
        assert ours.angle_deg < 2.2 * theirs.angle_deg
    ours, theirs = both("schauder_mras", public.NxpMras, generating, BOARD)
    assert ours.speed_rpm < 0.5 * theirs.speed_rpm
    assert ours.angle_deg < 15.0 < 60.0 < theirs.angle_deg


def test_the_compensated_voltage_model_is_as_good_as_emachinerys(ramp, low, generating):
    """Theirs filters the stator flux, ours the rotor's, and its lambda is 2: ours 1. Generating at
    60 min^-1 on a board theirs has 21 % less error of the speed, ours 15 % less of the flux."""
    for records in (ramp, low, generating):
        for kind in (EXACT, BOARD):
            ours, theirs = both("compensated_voltage_model", public.Harnefors2003, records, kind)
            if records is generating and kind == BOARD:
                assert ours.speed_rpm < 1.3 * theirs.speed_rpm
                assert ours.flux_pu < theirs.flux_pu
            else:
                assert ours.speed_rpm < 1.05 * theirs.speed_rpm


@pytest.fixture(scope="module")
def noisy() -> tuple[Record, Record]:
    truth = drive([(0, 60, 0), (0.2, 60, 0), (0.4, 60, 4), (0.7, 60, 4), (1.1, 900, 4)])
    return truth, truth.noisy(1, noise_V=0.5)


def covariances(record: Record) -> tuple[np.ndarray, float, np.ndarray]:
    """Q, R and P at the start, by the rules of firmware/law/estimator/ekf."""
    m, told = record.machine, param_list.defaults() | TOLD
    flux_Wb, coupling, tau = m.M_H * told["i_d_A"], m.M_H / m.Lr_H, m.Rr_ohm / m.Lr_H
    noise_V = 2.5e-3 * told["line_voltage_full_scale_V"]
    R = (1e-3 * told["current_full_scale_A"]) ** 2
    torque_Nm = told["pole_pairs"] * coupling * flux_Wb * told["i_q_max_A"]
    step = told["pole_pairs"] * torque_Nm / told["speed_J_kg_m2"] * T_S
    of_current = (T_S * noise_V / (m.Ls_H - coupling * m.M_H)) ** 2
    Q = np.array([of_current, of_current, *[(T_S * noise_V) ** 2] * 2, step**2])
    return Q, R, np.array([R, R, *[(0.1 * flux_Wb) ** 2] * 2, tau**2])


def test_the_kalman_filter_is_filterpys(noisy):
    """5500 periods in float and in blocks: measured 8e-7 Wb and 4e-4 min^-1 from filterpy's, which
    has full matrices in double precision and Joseph's form."""
    record = noisy[BOARD]
    flux, omega = estimated("ekf", record, TOLD)
    law = public.Kalman(record, *covariances(record), second=True)
    their_flux, their_omega = public.run_kalman(law, record)
    assert np.abs(flux - their_flux).max() < 4e-6
    assert RPM * np.abs(omega - their_omega).max() < 2e-3


# Of a grid of eight on a longer record the best were 10 and 12 min^-1 off, ours 4.
@pytest.mark.parametrize("Q_speed", [1.0, 100.0])
def test_the_kalman_filter_beats_a_diagonal_that_is_tried_out(noisy, Q_speed):
    """As published drives choose it, with forward Euler: filterpy with the two best of a grid."""
    truth, record = noisy
    _, R, P = covariances(record)
    Q = np.array([1e-4, 1e-4, 1e-6, 1e-6, Q_speed])
    theirs = errors(public.run_kalman(public.Kalman(record, Q, R, P, False), record), truth)
    ours = errors(estimated("ekf", record, TOLD), truth)
    assert ours.speed_rpm < 0.7 * theirs.speed_rpm
    assert ours.angle_deg < 0.6 * theirs.angle_deg
    assert ours.flux_pu < theirs.flux_pu
