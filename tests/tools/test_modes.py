"""`zh modes`: a sample of the runs, controls that must fail, and L beyond the end of its table."""

from __future__ import annotations

import json

import numpy as np
import pytest

from zerohertz.drive import Fault
from zerohertz.modes import cases
from zerohertz.modes.command import TEXT, page, table
from zerohertz.motor import load_motor
from zerohertz.paths import ROOT


@pytest.mark.parametrize("rig", cases.RIGS)
def test_twice_rated_speed_is_held(rig):
    found = cases.weakening(rig)
    assert found.met, found
    assert found.measured["flux_Wb"] < 0.25  # half the flux at twice the speed


def test_without_weakening_it_is_not():
    assert not cases.weakening("ideal", on=False).met


def test_a_slow_stop_from_twice_rated_speed_does_not_swing():
    found = cases.slow_stop("atlas", -1.0)
    assert found.met, found


def test_a_sagging_dc_link_is_ridden_out_at_twice_rated_speed():
    found = cases.sag("atlas")
    assert found.met, found


@pytest.mark.parametrize(
    ("rig", "speed_pu", "residual"),
    [
        ("ideal", 1.2, True),
        ("atlas", -1.2, False),
        ("atlas", -0.4, True),
        ("ideal", 0.05, True),
        ("atlas", 0.2, False),
        ("atlas", 0.0, False),
        ("atlas", 0.0, True),
    ],
)
def test_a_turning_shaft_is_caught(rig, speed_pu, residual):
    found = cases.flying(rig, speed_pu, residual)
    assert found.met, found


@pytest.mark.parametrize("speed_pu", [-1.0, 1.0])
def test_without_flying_start_it_is_not(speed_pu):
    assert not cases.flying("atlas", speed_pu, True, on=False).met


@pytest.mark.parametrize("control", [1, 2])
def test_open_loop_turns_the_loaded_motor(control):
    found = cases.open_loop(control, 300.0, 0.5)
    assert found.met, found


def test_direct_current_brakes_and_holds():
    assert cases.brake(10.0).met
    assert cases.hold().met


@pytest.mark.parametrize("load_pu", [0.0, 0.25])
def test_economy_saves_at_part_load_and_finds_its_flux_again(load_pu):
    found = cases.economy(load_pu)
    assert found.met, found
    assert found.measured["saving_percent"] > 5.0


def test_a_dip_is_followed_by_a_restart_only_when_asked_for():
    assert cases.restart(2).met
    stands = cases.restart(0)
    assert not stands.met
    assert int(stands.measured["fault"]) == Fault.DC_UNDER_VOLTAGE


def test_the_shaft_holds_the_link_up_when_the_mains_goes():
    assert cases.mains_lost(2.0).met
    assert not cases.mains_lost(2.0, on=False).met
    assert cases.mains_lost(0.0).met


@pytest.mark.parametrize("name", ["hasegawa2005", "hasegawa2005_paper", "hasegawa2005_recommended"])
def test_the_last_gain_is_stable_up_to_twice_rated_speed(name):
    """Beyond the table's end L turns with the speed: the sampled observer's poles, second order."""
    folder = ROOT / "gain_tables" / name
    stored = json.loads((folder / "l_gain.json").read_text())
    l1_re, l1_im, l2_re, l2_im = stored["entries"][-1]["L"]
    circuit = load_motor(folder).circuit
    end_rad_s = 3600.0 * np.pi / 30.0
    T = 200e-6
    for omega in np.linspace(end_rad_s, 760.0, 40):  # twice 1710 min^-1 and 6 % more
        q = circuit.tau_per_s - 1j * omega
        A = np.array(
            [[-circuit.a11_per_s, q / circuit.eps_H], [circuit.M_H * circuit.tau_per_s, -q]]
        )
        turn = 1j * omega / end_rad_s
        L = np.array([[l1_re + turn * l1_im, 0.0], [l2_re + turn * l2_im, 0.0]])
        poles = np.linalg.eigvals(np.eye(2) + T * (A + 0.5 * T * A @ A + L))
        decay_per_s = -np.log(np.abs(poles)) / T
        assert decay_per_s.min() > 20.0, omega


def test_the_page_has_every_group_and_row():
    rows = [
        {"case": "a", "verdict": "held", "met": True, "x_rpm": 1.23456},
        {"case": "b", "verdict": "not held", "met": False, "y_A": None},
    ]
    assert table(rows).splitlines() == [
        "| case | x rpm | y A | ended |",
        "|---|---|---|---|",
        "| a | 1.235 |  | held |",
        "| b |  |  | not held |",
    ]
    text = page(dict.fromkeys(TEXT, rows))
    assert text.count("not held") == len(TEXT) == len(cases.GROUPS)
    assert f"{len(TEXT)} of {2 * len(TEXT)} cases" in text
