"""zh stability: the one-period map is the firmware's loop, and its verdicts those of time."""

from __future__ import annotations

import math

import numpy as np
import pytest

from zerohertz import sim
from zerohertz.paths import ROOT
from zerohertz.scenario.setup import load_setup
from zerohertz.stability import linear, plane
from zerohertz.stability.equilibrium import solve
from zerohertz.stability.loop import STATES, Bench, Loop, step

TABLE = ROOT / "gain_tables" / "hasegawa2005_recommended"
T_S = 200e-6
# A tuning of its own: another one of the product then moves no expected number. The rig is ideal:
# nothing to compensate. The tests say themselves which means they use.
PLAIN = {
    "adapt_kp": 1.95,
    "adapt_ki": 2468.0,
    "phi_factor": 0.576,
    "speed_bandwidth_rad_s": 20.0,
    "speed_fast_bandwidth_rad_s": 0.0,
    "speed_slow_rad_s": 30.0,
    "speed_ki_factor": 0.25,
    "speed_filter_s": 0.003,
    "current_bandwidth_rad_s": 400.0,
    "i_d_A": 5.3,
    "voltage_source": 0,
    "observer_method": 0,
    "dead_time_fraction": 0.0,
    "dead_time_identify": 0,
    "rs_measure": 0,
    "rs_level_s": 1.5,  # two levels; recommended has four shorter ones
    "rs_bias": 1.015,
    "rs_track_gain": 0.0,
    "steer_min_Hz": 0.0,
    "heat_rise": 0.0,  # heat, M at speed and offsets are slower than what is linearised
    "m_track": 0,
    "offset_track": 0,
    "lost_action": 0,
}
NO_GAIN = {"observer_gain_enable": 0, "phi_factor": 0.0}


def firmware(**changes):
    return plane.firmware_of(load_setup("recommended"), None, PLAIN | changes)


def points(fw, rpm, load_Nm, **truth):
    omega = plane.omega_from_rpm(fw, np.asarray(rpm, dtype=float))
    return plane.points_of(fw, omega, load_Nm, plane.Truth(**truth))


def analyse(rpm, load_Nm, changes=None, **truth):
    fw = firmware(**(changes or {}))
    exact, true = points(fw, rpm, np.asarray(load_Nm, dtype=float), **truth)
    return linear.analyse(Loop(fw, Bench()), exact, true)


def column(x, name):
    """A state by name, pairs as complex numbers."""
    if name in STATES:
        return x[..., STATES.index(name)]
    k = STATES.index(name + ".re")
    return x[..., k] + 1j * x[..., k + 1]


def run_sil(changes, speed_rpm, rs_ratio, load_points, end_s, rs_points=((0.0, 1.0),)):
    """The firmware on the ideal rig with friction; load points after the run-up, which ends at
    5 s."""
    scenario = f"""
[scenario]
name = "stability"
duration_s = {end_s}
run_on_s = 0.12
[profiles]
speed_ref_rpm = [[0.0, 0.0], [4.2, 0.0], [4.9, {speed_rpm}]]
load_torque_Nm = {[[0.0, 0.0], *load_points]}
rs_factor = {[list(point) for point in rs_points]}
"""
    nameplate = {
        "Rs_ohm": 0.93,
        "Rr_ohm": 0.5,
        "Ls_H": 0.11,
        "Lr_H": 0.102,
        "M_H": 0.102,
    }
    mechanics = {"J_kg_m2": 0.035, "coulomb_Nm": 0.4, "static_Nm": 0.4}
    overrides = {f"mechanics.{key}": value for key, value in mechanics.items()}
    return sim.run(
        sim.Job(
            guard_recorded=True,  # what is watched here is a swing that the guard would stop
            scenario=scenario,
            motor_dir=TABLE,
            firmware_config=dict(load_setup("recommended").params) | nameplate,
            firmware=PLAIN | changes,
            board_overrides={"adc.bits": 16},
            rig_overrides=overrides | {"motor.Rs_ohm": 0.93 * rs_ratio},
        )
    )


def test_error_free_equilibrium_is_the_exact_motor():
    """Flux, voltage and torque of the rotating machine, and the firmware believing just that."""
    fw = firmware(observer_method=1)
    rpm, load_Nm = (
        np.array([60.0, 300.0, -120.0, 30.0]),
        np.array([4.0, -8.4, 8.4, 6.0]),
    )
    exact, true = points(fw, rpm, load_Nm)
    loop = Loop(fw, Bench())
    found = solve(loop, exact, true)
    assert found.found.all()
    _, turned = step(loop, true, found.steering, found.x)
    omega_s, omega = turned / T_S, column(found.x, "omega_e")
    c, i, flux = fw.circuit, column(found.x, "i_s"), column(found.x, "lambda_r")
    # M tau i = (tau + j (w_s - w)) lambda;  u = Rs i + j w_s psi_s, in the middle of the interval.
    np.testing.assert_allclose(
        c.M_H * c.tau_per_s * i,
        (c.tau_per_s + 1j * (omega_s - omega)) * flux,
        rtol=2e-4,
    )
    psi_s = c.sigma_Ls_H * i + c.M_H / c.Lr_H * flux
    u = column(found.x, "u_acting") * np.exp(-0.5j * omega_s * T_S)
    np.testing.assert_allclose(u, c.Rs_ohm * i + 1j * omega_s * psi_s, rtol=2e-3)
    torque = 2.0 * np.imag(flux.conj() * i)
    # At the crest; within the interval the held voltage makes it ripple around its mean.
    np.testing.assert_allclose(torque, load_Nm + 0.4 * np.sign(rpm), rtol=1e-4)
    np.testing.assert_allclose(omega, column(found.x, "omega_e_hat"), atol=0.02)
    np.testing.assert_allclose(column(found.x, "lambda_hat"), flux, rtol=1e-3)
    np.testing.assert_allclose(i.real, 5.3, rtol=1e-9)


def test_followers_have_the_eigenvalues_of_their_own_equations():
    """With the voltage from duty nothing reads the 800 Hz filter, and with the steering off nothing
    reads the torque filter: their poles stand among the loop's, the first turned by the frame."""
    fw = firmware(voltage_source=1)
    loop = Loop(fw, Bench())
    exact, true = points(fw, [300.0], np.array([5.0]))
    found = solve(loop, exact, true)
    z = np.linalg.eigvals(linear.jacobians(loop, true, found)[0])
    omega_s = step(loop, true, found.steering, found.x)[1][0] / T_S
    cutoff = 2.0 * math.pi * 800.0
    expected = [1.0 - T_S / (T_S + 0.032)]
    for side in (-1.0, 1.0):
        pole = cutoff * (-1.0 + side * 1j) / math.sqrt(2.0)
        expected += [np.exp((pole - sign * 1j * omega_s) * T_S) for sign in (-1.0, 1.0)]
    for value in expected:
        assert np.abs(z - value).min() < 1e-8
    # The map of a complex vector and its conjugate: real matrix, conjugate eigenvalues.
    assert np.abs(np.poly(z).imag).max() < 1e-6


CASES = {
    "motoring, Rs 10 % low": ({}, 60.0, 4.0, 1.1),
    "L = 0, regenerating at speed": (NO_GAIN, 300.0, -4.0, 0.9),
    "voltage from duty, second order": (
        {"voltage_source": 1, "observer_method": 1},
        120.0,
        3.0,
        1.1,
    ),
    "Rs measured, flux steered, faster at speed": (
        {"rs_measure": 1, "steer_min_Hz": 0.67, "speed_fast_bandwidth_rad_s": 60.0},
        30.0,
        -6.0,
        1.3,
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_map_is_the_firmware(case):
    """A step of the load from the equilibrium: the map, repeated, against the real firmware."""
    changes, rpm, load_Nm, rs_ratio = CASES[case]
    step_s, more_Nm = 13.0, 0.25
    record = run_sil(
        changes,
        rpm,
        rs_ratio,
        [[6.5, 0.0], [7.5, load_Nm], [step_s, load_Nm], [step_s, load_Nm + more_Nm]],
        step_s + 1.5,
    )
    fw = firmware(**changes)
    loop = Loop(fw, Bench())
    # Measured or nameplate: how well it is measured is not asked here.
    truth = {
        "rs_ratio": rs_ratio,
        "rs_hat_pu": record["Rs_hat_ohm"][-1] / (0.93 * rs_ratio),
    }
    exact, before = points(fw, [rpm], np.array([load_Nm]), **truth)
    _, after = points(fw, [rpm], np.array([load_Nm + more_Nm]), **truth)
    found = solve(loop, exact, before)
    assert found.found.all()
    begin, count = round(step_s / T_S), round(1.4 / T_S)
    rows, x = [], found.x
    for _ in range(count):
        rows.append(x[0])
        x, _ = step(loop, after, found.steering, x)
    ours = np.array(rows)
    rpm_per_rad_s = 30.0 / math.pi / 2.0
    for name, state, unit in (
        ("speed_rpm", "omega_e", rpm_per_rad_s),
        ("speed_hat_rpm", "omega_e_hat", rpm_per_rad_s),
        ("x_rad_s", "x_adaptation", 1.0),
        ("lambda_hat_Wb", "lambda_hat", 1.0),
        ("f_s_hat_Hz", "omega_s_hat", 0.5 / math.pi),
    ):
        model = column(ours, state) * unit
        real = record[name][begin : begin + count].astype(float)
        # 2 %: 16 bit leave that much of the small step; the operating point agrees far better.
        assert np.sqrt(np.mean((model - real) ** 2)) < 0.02 * np.ptp(model) + 1e-4 * abs(model[0])
    assert np.ptp(column(ours, "omega_e")) > 0.1


def swing(record, begin_s, least, largest):
    """Growth and frequency of the estimated stator frequency's oscillation while its amplitude lies
    within the bounds, least .. largest Hz."""
    t_s = record.t_s.astype(float)
    value = record["f_s_hat_Hz"].astype(float)
    some = t_s > begin_s
    t_s, value = t_s[some], value[some]
    # A straight line over .4 s is taken out: the operating point drifts with the speed loop.
    slow = np.convolve(value, np.ones(2001) / 2001.0, mode="same")
    value = (value - slow)[1000:-1000]
    t_s = t_s[1000:-1000]
    size = np.abs(value)
    peaks = np.flatnonzero((size[1:-1] > size[:-2]) & (size[1:-1] >= size[2:])) + 1
    # One peak per half period: the largest within 9 ms on either side.
    peaks = np.array([k for k in peaks if size[k] == size[max(k - 45, 0) : k + 46].max()])
    peaks = peaks[(size[peaks] > least) & (size[peaks] < largest)]
    growth, _ = np.polyfit(t_s[peaks], np.log(size[peaks]), 1)
    half_period_s, _ = np.polyfit(np.arange(len(peaks)), t_s[peaks], 1)
    return growth, 0.5 / half_period_s, len(peaks)


def test_growth_rate_is_that_of_the_firmware():
    """L = 0 at 900 min^-1, rated load: Rs falls to .57 within 1 s, slowly enough to excite nothing;
    then the oscillation grows out of the ADC's steps as the eigenvalue says."""
    modes = analyse([900.0], [8.4], NO_GAIN, rs_ratio=0.57)
    assert modes.verdict[0] == linear.UNSTABLE
    falls = ((0.0, 1.0), (9.0, 1.0), (10.0, 0.57))
    record = run_sil(NO_GAIN, 900.0, 1.0, [[5.5, 0.0], [6.5, 8.4]], 12.8, falls)
    growth_per_s, frequency_Hz, peaks = swing(record, 10.3, 0.1, 0.9)
    assert peaks > 30
    assert growth_per_s == pytest.approx(modes.growth_per_s[0], rel=0.04)
    assert frequency_Hz == pytest.approx(modes.frequency_Hz[0], rel=0.01)


def test_decay_rate_is_that_of_the_firmware():
    """Positive-real gains at 300 min^-1, rated load, an adaptation too slow for the speed loop
    (K_I is 1.7 times itself there): Rs jumps to 1.5, the ringing dies away."""
    rings = {"adapt_kp": 0.5, "adapt_ki": 470.0, "speed_bandwidth_rad_s": 60.0}
    modes = analyse([300.0], [8.4], rings, rs_ratio=1.5)
    jumps = ((0.0, 1.0), (9.0, 1.0), (9.0, 1.5))
    record = run_sil(rings, 300.0, 1.0, [[5.5, 0.0], [6.5, 8.4]], 12.0, jumps)
    growth_per_s, frequency_Hz, peaks = swing(record, 9.5, 0.02, 0.8)
    assert peaks > 5
    assert growth_per_s == pytest.approx(modes.growth_per_s[0], rel=0.04)
    assert frequency_Hz == pytest.approx(modes.frequency_Hz[0], rel=0.01)


def test_no_gain_is_unstable_in_the_wedge_and_stable_outside():
    """G1 of L = 0 is negative for 0 < w_s < .633 w: regeneration only. The positive-real gains
    have no such wedge."""
    rpm, load_Nm = [60.0, 75.0, 60.0, 60.0, 300.0], [-8.4, -10.0, 8.4, 0.0, -8.4]
    without = analyse(rpm, load_Nm, NO_GAIN)
    np.testing.assert_array_equal(without.verdict == linear.UNSTABLE, [True, True, *3 * [False]])
    assert (analyse(rpm, load_Nm).verdict == linear.ORIENTED).all()


def test_rs_a_little_low_loses_what_a_little_high_keeps():
    """The fold near zero stator frequency is one-sided: regeneration at + .4 Hz of rated torque."""
    fw = firmware()
    omega = plane.speed_for_frequency(fw, np.array([0.4]), np.array([-8.4]))
    verdicts = []
    for rs_hat in (0.98, 1.0, 1.02):
        truth = plane.Truth(coulomb_Nm=0.0, rs_hat_pu=rs_hat)
        exact, true = plane.points_of(fw, omega, np.array([-8.4]), truth)
        verdicts.append(int(linear.analyse(Loop(fw, Bench()), exact, true).verdict[0]))
    assert verdicts == [linear.NONE, linear.ORIENTED, linear.ORIENTED]


def test_mirror_symmetry():
    """Speed, load and frequency with the other sign: the same modes."""
    rpm, load_Nm = np.array([30.0, 60.0, 0.0, 900.0]), np.array([8.4, -6.0, 4.0, -3.0])
    there = analyse(rpm, load_Nm, rs_ratio=1.1, rr_ratio=0.8, leakage_ratio=1.1)
    back = analyse(-rpm, -load_Nm, rs_ratio=1.1, rr_ratio=0.8, leakage_ratio=1.1)
    np.testing.assert_array_equal(there.verdict, back.verdict)
    np.testing.assert_allclose(there.growth_per_s, back.growth_per_s, rtol=1e-3, atol=1e-3)
    np.testing.assert_allclose(there.angle_err_deg, -back.angle_err_deg, atol=1e-5)


def test_current_and_voltage_limits_are_no_equilibrium():
    modes = analyse([60.0, 60.0, 2400.0], [8.4, 20.0, 2.0])
    assert modes.verdict[0] == linear.ORIENTED
    assert (modes.verdict[1:] == linear.NONE).all()
    assert np.isnan(modes.growth_per_s[1:]).all()


def held_and_oriented(record, speed_rpm, loaded_s):
    """As the atlas judges: last 2 of 5 s."""
    t_s, error_rpm = record.t_s - loaded_s, record["speed_rpm"] - speed_rpm
    late = t_s > 3.0
    if record.first_fault or t_s[-1] < 4.9:
        return False
    flux = np.abs(record["lambda_hat_Wb"] - record["lambda_Wb"]) < 0.25 * record["lambda_Wb"]
    right = flux & (np.abs(record["flux_angle_err_deg"]) < 25.0)
    held = abs(error_rpm[late].mean()) < 30.0 and error_rpm[late].std() < 15.0
    return bool(held and np.abs(error_rpm[t_s > 2.0]).max() < 150.0 and right[late].mean() >= 0.99)


def test_verdicts_are_those_of_the_time_domain():
    """Half a map of the atlas, in two configurations whose start holds; 95 % is the promise."""
    speeds, loads = (
        (0.0, 15.0, 30.0, 60.0, 120.0, 300.0, 900.0),
        np.linspace(-8.4, 8.4, 7),
    )
    grid = [(rpm, load) for rpm in speeds for load in loads]
    rpm, load_Nm = (np.array(values) for values in zip(*grid, strict=True))
    agree, seen = [], []
    for changes, rs_ratio in ((NO_GAIN, 1.25), ({"rs_measure": 1}, 1.5)):
        modes = analyse(rpm, load_Nm, changes, rs_ratio=rs_ratio)
        for k, (speed, load) in enumerate(grid):
            record = run_sil(changes, speed, rs_ratio, [[6.0, 0.0], [7.0, float(load)]], 11.0)
            true = held_and_oriented(record, speed, 6.0)
            agree.append(true == (modes.verdict[k] == linear.ORIENTED))
            seen.append(true)
    assert np.mean(agree) >= 0.95
    assert 0.1 < np.mean(seen) < 0.9
