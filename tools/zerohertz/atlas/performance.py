"""Performance at nominal parameters: what a data sheet of the drive would state, measured.

Speeds and torques are the true ones of the bench, never the firmware's estimates.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from zerohertz import sim
from zerohertz.atlas import bench_run
from zerohertz.atlas.bench_run import (
    RATED_SPEED_RPM,
    RATED_TORQUE_NM,
    Experiment,
    Verdict,
    error_rpm,
    judge,
    window,
)
from zerohertz.atlas.classes import FAR_RPM, START_ERROR_RPM
from zerohertz.atlas.finding import Finding
from zerohertz.scenario.setup import Setup

Array = NDArray[np.float64]

RANGE_RPM = 9.0  # 1800 min^-1 / 200
RANGE_ERROR_PU = 0.1
RANGE_STD_RPM = 15.0  # as on the map
ACCURACY_RPM = 0.005 * RATED_SPEED_RPM
ACCURACY_SPEEDS_RPM = (0.0, 15.0, 30.0, 60.0, 120.0, 300.0, 900.0, 1500.0)
ACCURACY_LOADS_PU = (-1.0, -0.5, 0.0, 0.5, 1.0)
RISE_MAX_S = 5e-3
RISE_STEPS = ((60.0, 600.0), (300.0, 600.0), (300.0, -600.0), (900.0, 600.0), (900.0, -600.0))
# The plateau of the torque: the current has settled, the speed has hardly moved.
RISE_PLATEAU_S = (0.015, 0.025)
RISE_LEAST_NM = 1.0  # less is no step
BANDWIDTH_MIN_HZ = {60.0: 5.0, 150.0: 20.0, 450.0: 20.0, 900.0: 20.0}
BANDWIDTH_LOADS_PU = (0.0, 0.5)
BANDWIDTH_PEAK = math.sqrt(2.0)  # more is a resonance, and no bandwidth
# 2.8 Nm for the bench's inertia at 20 Hz: far from the current limit.
BANDWIDTH_AMPLITUDE_RPM = 6.0
SWEEP_HZ = (1.0, 2.0, 3.0, 4.0, 5.0, 6.5, 8.0, 10.0, 13.0, 16.0, 20.0, 25.0, 32.0, 40.0)
START_TORQUE_PU = 1.45
START_S = 3.0
START_RPM = 60.0

GOALS: Mapping[str, str] = {
    "speed_range": f"1:200 with rated torque: {RANGE_RPM:g} min^-1 within 10 % in the mean, "
    f"standard deviation below {RANGE_STD_RPM:g} min^-1",
    "static_accuracy": f"mean speed within .5 % of rated speed ({ACCURACY_RPM:.2f} min^-1)",
    "torque_rise": "true torque from 10 to 90 % within 5 ms above 60 min^-1",
    "speed_bandwidth": "true speed over reference above -3 dB up to 20 Hz from 150 min^-1, 5 Hz "
    "below, and nowhere above +3 dB",
    "starting_torque": "145 % of rated torque for 3 s from standstill, never backwards by more "
    "than 30 min^-1, then at its reference",
}


def cases(name: str, setup: Setup) -> list[Callable[[], Finding]]:
    """The cases of one of GOALS."""
    part = functools.partial
    table: dict[str, list[Callable[[], Finding]]] = {
        "speed_range": [part(speed_range, setup, load_pu) for load_pu in (-1.0, 1.0)],
        "static_accuracy": [
            part(static_accuracy, setup, speed_rpm, load_pu)
            for speed_rpm in ACCURACY_SPEEDS_RPM
            for load_pu in ACCURACY_LOADS_PU
        ],
        "torque_rise": [part(torque_rise, setup, *step) for step in RISE_STEPS],
        "speed_bandwidth": [
            part(speed_bandwidth, setup, speed_rpm, load_pu)
            for speed_rpm in BANDWIDTH_MIN_HZ
            for load_pu in BANDWIDTH_LOADS_PU
        ],
        "starting_torque": [part(starting_torque, setup)],
    }
    return table[name]


def _steady(setup: Setup, speed_rpm: float, load_pu: float, duration_s: float, last_s: float):
    """Judged run at one operating point, and the speed error of its last seconds."""
    what = Experiment(
        duration_s=duration_s,
        speed_rpm=[(0.0, speed_rpm)],
        load_Nm=[(0.0, 0.0), (1.0, load_pu * RATED_TORQUE_NM)],
        decimate=10,
    )
    record = bench_run.run(setup, what)
    judged = judge(record, duration_s, FAR_RPM)
    return judged, error_rpm(record)[window(record, duration_s - last_s)]


def speed_range(setup: Setup, load_pu: float) -> Finding:
    judged, error = _steady(setup, RANGE_RPM, load_pu, 20.0, 10.0)
    kept = judged.verdict is Verdict.HELD
    mean_rpm, std_rpm = _mean_std(error)
    met = kept and abs(mean_rpm) <= RANGE_ERROR_PU * RANGE_RPM and std_rpm < RANGE_STD_RPM
    measured = {"mean_error_rpm": mean_rpm, "std_rpm": std_rpm, "worst_rpm": judged.worst_rpm}
    text = f"{RANGE_RPM:g} min^-1, load {100 * load_pu:+.0f} %"
    return Finding(text, judged.verdict, met, measured)


def static_accuracy(setup: Setup, speed_rpm: float, load_pu: float) -> Finding:
    judged, error = _steady(setup, speed_rpm, load_pu, 8.0, 2.0)
    mean_rpm, std_rpm = _mean_std(error)
    met = judged.verdict is Verdict.HELD and abs(mean_rpm) <= ACCURACY_RPM
    measured = {"mean_error_rpm": mean_rpm, "std_rpm": std_rpm}
    text = f"{speed_rpm:g} min^-1, load {100 * load_pu:+.0f} %"
    return Finding(text, judged.verdict, met, measured)


def _mean_std(values: Array) -> tuple[float, float]:
    return (float(values.mean()), float(values.std())) if len(values) else (math.nan, math.nan)


def torque_rise(setup: Setup, speed_rpm: float, step_rpm: float) -> Finding:
    """A step of the reference so large that i_q goes to its limit: the fastest torque there is."""
    at_s = 1.0
    what = Experiment(
        duration_s=at_s + 0.1,
        speed_rpm=[(0.0, speed_rpm), (at_s, speed_rpm), (at_s, speed_rpm + step_rpm)],
        decimate=1,
    )
    record = bench_run.run(setup, what)
    rise_s, change_Nm = rise(record, at_s)
    met = bench_run.started(record) and rise_s <= RISE_MAX_S and abs(change_Nm) > RATED_TORQUE_NM
    measured = {"rise_ms": 1e3 * rise_s, "torque_change_Nm": change_Nm}
    return Finding(f"{speed_rpm:g} min^-1, step {step_rpm:+g}", "measured", met, measured)


def rise(record: sim.Record, at_s: float) -> tuple[float, float]:
    """10-90 % time of the true torque after at_s, and the change it was part of."""
    torque_Nm = record["torque_Nm"].astype(np.float64)
    before_Nm = torque_Nm[window(record, at_s - 0.1, at_s)].mean()
    start_s, end_s = RISE_PLATEAU_S
    change_Nm = torque_Nm[window(record, at_s + start_s, at_s + end_s)].mean() - before_Nm
    if not abs(change_Nm) > RISE_LEAST_NM:
        return math.inf, float(change_Nm)
    after = window(record, at_s)
    share = (torque_Nm[after] - before_Nm) / change_Nm
    t_s = record.t_s[after].astype(np.float64)
    return _crossing(t_s, share, 0.9) - _crossing(t_s, share, 0.1), float(change_Nm)


def _crossing(x: Array, y: Array, level: float) -> float:
    """The first x at which y reaches the level, between the samples."""
    above = np.flatnonzero(y >= level)
    if len(above) == 0:
        return math.inf
    k = int(above[0])
    if k == 0:
        return float(x[0])
    return float(x[k - 1] + (x[k] - x[k - 1]) * (level - y[k - 1]) / (y[k] - y[k - 1]))


def speed_bandwidth(
    setup: Setup, speed_rpm: float, load_pu: float, sweep_Hz: Sequence[float] = SWEEP_HZ
) -> Finding:
    """Small sines on the reference; the frequency where the true speed has fallen to -3 dB."""
    gains = np.array([sine_gain(setup, speed_rpm, load_pu, f_Hz) for f_Hz in sweep_Hz])
    bandwidth_Hz = minus_3_dB_Hz(np.array(sweep_Hz), gains)
    goal_Hz = BANDWIDTH_MIN_HZ[speed_rpm]
    # NaN (a run that was lost) meets nothing.
    met = bool(bandwidth_Hz >= goal_Hz and gains.max() <= BANDWIDTH_PEAK)
    measured = {"bandwidth_Hz": bandwidth_Hz, "goal_Hz": goal_Hz, "peak_gain": float(gains.max())}
    text = f"{speed_rpm:g} min^-1, load {100 * load_pu:+.0f} %"
    return Finding(text, "measured", met, measured)


def minus_3_dB_Hz(sweep_Hz: Array, gains: Array) -> float:
    """Where the gain first falls below 1/sqrt2, on logarithmic scales; the sweep's end if never."""
    if not np.all(np.isfinite(gains)):
        return math.nan
    level = -0.5 * math.log(2.0)
    log_gain = np.log(np.maximum(gains, 1e-9))
    below = np.flatnonzero(log_gain < level)
    if len(below) == 0:
        return float(sweep_Hz[-1])
    k = int(below[0])
    if k == 0:
        return 0.0
    share = (level - log_gain[k - 1]) / (log_gain[k] - log_gain[k - 1])
    return float(sweep_Hz[k - 1] * (sweep_Hz[k] / sweep_Hz[k - 1]) ** share)


def sine_gain(setup: Setup, speed_rpm: float, load_pu: float, f_Hz: float) -> float:
    """|true speed / reference| at one frequency, over whole periods once it has settled."""
    settle_s = 3.0  # the load's second, then the transient
    periods = max(4, math.ceil(2.0 * f_Hz))
    duration_s = settle_s + periods / f_Hz
    points_per_period = 40  # a polyline: 2e-3 of the fundamental
    count = round(duration_s * f_Hz * points_per_period)
    t_s = np.arange(count + 1) / (f_Hz * points_per_period)
    ref_rpm = speed_rpm + BANDWIDTH_AMPLITUDE_RPM * np.sin(2.0 * np.pi * f_Hz * t_s)
    what = Experiment(
        duration_s=duration_s,
        speed_rpm=list(zip(t_s.tolist(), ref_rpm.tolist(), strict=True)),
        load_Nm=[(0.0, 0.0), (1.0, load_pu * RATED_TORQUE_NM)],
        decimate=5,
    )
    record = bench_run.run(setup, what)
    if judge(record, duration_s, FAR_RPM).verdict is not Verdict.HELD:
        return math.nan
    part = window(record, settle_s)
    turn = np.exp(-2j * np.pi * f_Hz * (record.t_s[part].astype(np.float64)))
    # Least squares with mean and drift beside the sine: those of the bench are not the loop's.
    slow = np.linspace(-1.0, 1.0, int(part.sum()))
    basis = np.column_stack([turn.real, turn.imag, np.ones_like(slow), slow])
    sine = [
        np.linalg.lstsq(basis, record[name][part].astype(np.float64), rcond=None)[0][:2]
        for name in ("speed_rpm", "speed_ref_rpm")
    ]
    return float(np.linalg.norm(sine[0]) / np.linalg.norm(sine[1]))


def starting_torque(setup: Setup) -> Finding:
    """145 % on the shaft at standstill, then a slow start against it."""
    load_Nm = START_TORQUE_PU * RATED_TORQUE_NM
    on_s = 1.0  # the load grows for a second, as on the map, while the drive holds zero
    end_s = on_s + START_S
    what = Experiment(
        duration_s=end_s + 1.0,
        speed_rpm=[(0.0, 0.0), (on_s, 0.0), (end_s, START_RPM)],
        load_Nm=[(0.0, 0.0), (on_s, load_Nm)],
        decimate=5,
    )
    record = bench_run.run(setup, what)
    judged = judge(record, what.duration_s, FAR_RPM)
    part = window(record, on_s, end_s)
    torque_Nm = float(record["torque_Nm"][part].mean()) if part.any() else math.nan
    backwards_rpm = float(-record["speed_rpm"][window(record, 0.0)].min(initial=0.0))
    final_rpm = _mean_std(error_rpm(record)[window(record, end_s + 0.5)])[0]
    met = (
        judged.verdict in (Verdict.HELD, Verdict.TAKEOVER)
        and torque_Nm >= load_Nm - bench_run.COULOMB_NM
        and backwards_rpm <= START_ERROR_RPM
        and abs(final_rpm) <= START_ERROR_RPM
    )
    measured = {
        "mean_torque_pu": torque_Nm / RATED_TORQUE_NM,
        "backwards_rpm": backwards_rpm,
        "final_error_rpm": final_rpm,
    }
    return Finding("0 -> 60 min^-1 in 3 s", judged.verdict, met, measured)
