"""zerohertz.sim: closed-loop runs, their record, their timing and their complaints."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from zerohertz.drive import State
from zerohertz.errors import UserError
from zerohertz.gain_design.stored import read_table_json
from zerohertz.gain_design.table import gains_of
from zerohertz.paths import ROOT
from zerohertz.sim import HOST_SIM, Job, Trip, column_texts, run, run_batch

SCENARIO = """
[scenario]
name = "test"
duration_s = 1.6
run_on_s = 0.12
[profiles]
speed_ref_rpm = [[0.0, 0.0], [1.2, 0.0], [1.4, 100.0]]
"""


def test_smoke_runs_up_and_follows_under_load():
    record = run(Job())
    assert record.trip == Trip(0)
    assert record.first_fault == 0
    assert record.first_fault_s is None
    assert record["state"][-1] == State.RUN
    settled = (record.t_s > 1.9) & (record.t_s < 2.0)
    assert np.abs(record["speed_rpm"][settled] - 300.0).max() < 10.0
    late = record.t_s > 2.8
    assert np.abs(record["speed_rpm"][late] - 300.0).max() < 10.0
    assert record["load_Nm"][-1] == pytest.approx(2.0)
    # Torque makes the load: ideal rig, no friction.
    assert record["torque_Nm"][late].mean() == pytest.approx(2.0, abs=0.1)
    assert record["lambda_hat_Wb"][-1] == pytest.approx(float(record["lambda_Wb"][-1]), rel=0.03)
    assert abs(record["flux_angle_err_deg"][-1]) < 3.0


def test_record_columns_are_documented_and_decimated():
    every = run(Job(scenario=SCENARIO))
    tenth = run(Job(scenario=SCENARIO, decimate=10))
    assert list(every.columns) == list(column_texts())
    assert every.steps == tenth.steps == 8000
    assert len(every.t_s) == 8000
    for name, column in every.columns.items():
        np.testing.assert_array_equal(column[::10], tenth[name], err_msg=name)
    assert every.t_s[5] == pytest.approx(5 * every.period_s)
    for name in "t_s speed_ref_rpm speed_rpm speed_hat_rpm i_q_ref_A f_s_Hz e1_abs_A".split():
        assert column_texts()[name]


def test_duty_of_step_k_acts_from_crest_k1_to_k2():
    """Ideal inverter: the mean voltage over [t_(k+1), t_(k+2)) is that of the duties of k."""
    record = run(Job(scenario=SCENARIO))
    a = np.exp(2j * np.pi / 3)
    duty = np.sqrt(2 / 3) * (
        record["duty_u"] + a * record["duty_v"] + a**2 * record["duty_w"]
    ).astype(complex)
    from_duty_V = duty * record["u_dc_V"]
    acted_V = record["u_alpha_V"] + 1j * record["u_beta_V"]
    running = np.flatnonzero(record["gates_on"] > 0)[:-3]
    right = np.abs(acted_V[running + 2] - from_duty_V[running]).max()
    early = np.abs(acted_V[running + 1] - from_duty_V[running]).max()
    late = np.abs(acted_V[running + 3] - from_duty_V[running]).max()
    assert right < 1e-3
    assert min(early, late) > 1.0


def test_a_board_may_take_two_periods():
    record = run(Job(scenario=SCENARIO, board_overrides={"control.delay_periods": 2}))
    a = np.exp(2j * np.pi / 3)
    duty = np.sqrt(2 / 3) * (record["duty_u"] + a * record["duty_v"] + a**2 * record["duty_w"])
    acted_V = record["u_alpha_V"] + 1j * record["u_beta_V"]
    running = np.flatnonzero(record["gates_on"] > 0)[:-4]
    from_duty_V = (duty * record["u_dc_V"])[running]
    assert np.abs(acted_V[running + 3] - from_duty_V).max() < 1e-3
    assert np.abs(acted_V[running + 2] - from_duty_V).max() > 1.0


def test_gates_off_acts_at_once():
    record = run(Job(scenario=SCENARIO, scenario_overrides={"scenario.torque_off_s": 1.0}))
    off = int(np.flatnonzero((record.t_s > 0.5) & (record["gates_on"] == 0))[0])
    assert record.t_s[off] == pytest.approx(1.0)
    assert record["state"][off] == State.TORQUE_OFF
    # The rotor flux's 4.5 A are driven into the diodes within half a millisecond.
    assert record["i_abs_A"][off] > 4.0
    assert record["i_abs_A"][off + 5] < 0.01


def test_true_flux_frequency_is_that_of_the_angle():
    record = run(Job())
    late = record.t_s > 2.5
    angle = np.unwrap(record["flux_angle_rad"][late].astype(float))
    t = record.t_s[late].astype(float)
    mean_Hz = (angle[-1] - angle[0]) / (t[-1] - t[0]) / (2 * np.pi)
    assert record["f_s_Hz"][late].mean() == pytest.approx(mean_Hz, rel=1e-3)


def test_firmware_overrides_config_then_scenario_then_job():
    scenario = SCENARIO + "[firmware]\ni_d_A = 3.5\n"
    config = {"i_d_A": 3.0}

    def i_d(**job) -> float:
        return float(run(Job(scenario_overrides={"scenario.duration_s": 1.1}, **job))["i_d_A"][-1])

    assert i_d(scenario=SCENARIO) == pytest.approx(4.5, abs=0.05)
    assert i_d(scenario=SCENARIO, firmware_config=config) == pytest.approx(3.0, abs=0.05)
    assert i_d(scenario=scenario, firmware_config=config) == pytest.approx(3.5, abs=0.05)
    assert i_d(scenario=scenario, firmware_config=config, firmware={"i_d_A": 4.0}) == pytest.approx(
        4.0, abs=0.05
    )


def test_controller_motor_scales_what_the_firmware_is_given():
    """A wrong Rs in the observer shows in e1 while the flux is built up at dc."""
    right = run(Job(scenario=SCENARIO, max_steps=5000))
    wrong = run(
        Job(
            scenario=SCENARIO + "[controller_motor]\nRs_factor = 0.6667\n",
            firmware={"Rs_ohm": 0.93},  # the factor scales this, too
            max_steps=5000,
        )
    )
    assert right["e1_abs_A"][-1] < 0.02
    assert wrong["e1_abs_A"][-1] > 0.1


def test_true_resistance_follows_its_profile():
    record = run(Job(scenario=SCENARIO + "rs_factor = [[0.0, 1.0], [1.0, 1.2]]\n", decimate=5000))
    np.testing.assert_allclose(record["Rs_true_ohm"], [0.93, 0.93 * 1.2], rtol=1e-6)


# A magnetising current at its trip: the first overshoot is beyond.
TRIPS = {
    "i_trip_A": 2.0,
    **dict.fromkeys(("i_max_A", "i_q_max_A", "i_d_max_A", "i_d_A"), 2.44),
    "current_sum_max_A": 0.6,
}


def test_a_fault_ends_nothing_but_the_torque():
    record = run(Job(scenario=SCENARIO, firmware=TRIPS))
    assert record.trip == Trip.FIRMWARE
    assert record.first_fault == 1
    assert 0.12 < record.first_fault_s < 0.2
    assert record.trip_s == record.first_fault_s
    assert record.steps == 8000
    after = record.t_s > record.first_fault_s
    assert record["gates_on"][after].max() == 0
    stopped = run(Job(scenario=SCENARIO, firmware=TRIPS, stop_at_trip=True))
    assert stopped.steps == len(stopped.t_s) < 2000
    np.testing.assert_array_equal(stopped.t_s, record.t_s[: stopped.steps])


def test_a_runaway_of_the_rig_is_a_trip():
    """A driving load far beyond the motor: the shaft runs away whatever the firmware does."""
    job = Job(
        scenario=SCENARIO,
        scenario_overrides={"profiles.load_torque_Nm": [[0.0, -60.0], [1.0, -60.0]]},
    )
    assert Trip.SPEED in run(job).trip


def test_seed_decides_the_noise_and_nothing_else_does():
    job = {"scenario": SCENARIO, "rig_overrides": {"sensors.current_noise_A": 0.02}}
    first = run(Job(**job, seed=7))
    again = run(Job(**job, seed=7))
    other = run(Job(**job, seed=8))
    np.testing.assert_array_equal(first["i_q_A"], again["i_q_A"])
    assert np.any(first["i_q_A"] != other["i_q_A"])


def test_runs_in_threads_are_those_of_one_thread():
    jobs = [
        Job(scenario=SCENARIO, seed=k + 1, rig_overrides={"sensors.current_noise_A": 0.02})
        for k in range(6)
    ]
    serial = [run(job) for job in jobs]
    with ThreadPoolExecutor(2) as pool:
        parallel = list(pool.map(run, jobs))
    for a, b in zip(serial, parallel, strict=True):
        for name in a.columns:
            np.testing.assert_array_equal(a[name], b[name])


def test_gain_from_memory_is_the_table_of_the_file():
    gain = gains_of(read_table_json(ROOT / "gain_tables" / "hasegawa2005" / "l_gain.json"))
    from_file = run(Job(scenario=SCENARIO))
    np.testing.assert_array_equal(
        run(Job(scenario=SCENARIO, gain=gain))["i_q_A"], from_file["i_q_A"]
    )
    zero = run(Job(scenario=SCENARIO, gain=np.zeros_like(gain)))
    off = run(Job(scenario=SCENARIO, firmware={"observer_gain_enable": 0}))
    np.testing.assert_array_equal(zero["i_q_A"], off["i_q_A"])
    assert np.any(zero["i_q_A"] != from_file["i_q_A"])


def test_switched_inverter_runs_too():
    record = run(Job(rig_overrides={"inverter.model": "switched"}))
    assert record.trip == Trip(0)
    assert record["speed_rpm"][-1] == pytest.approx(300.0, abs=15.0)


def test_second_motor_on_its_rig_and_board():
    """The nameplate scales flux and current limits: nothing but the files is given."""
    record = run(
        Job(
            rig=ROOT / "host_sim" / "rigs" / "im_4kw_400v.toml",
            board=ROOT / "host_sim" / "boards" / "board_540V.toml",
            motor_dir=ROOT / "gain_tables" / "im_4kw_400v",
        )
    )
    assert record.trip == Trip(0)
    late = record.t_s > 2.7
    assert np.abs(record["speed_rpm"][late] - 300.0).max() < 15.0


def test_time_split_times_both_halves():
    record = run(Job(scenario=SCENARIO, time_split=True, decimate=1000))
    assert 0.0 < record.controller_ns_per_step < record.loop_ns_per_step * 2
    assert 0.0 < record.plant_ns_per_step < record.loop_ns_per_step * 2
    assert run(Job(scenario=SCENARIO)).controller_ns_per_step == 0.0


@pytest.mark.parametrize(
    ("job", "text"),
    [
        ({"scenario": "/nowhere.toml"}, "/nowhere.toml: cannot be read"),
        ({"scenario": "[scenario]\nname = 3\n"}, "scenario.name"),
        ({"scenario": "\n\x00"}, "scenario"),
        ({"scenario_overrides": {"scenario.nothing": 1}}, "nothing"),
        ({"rig_overrides": {"motor.Rs_ohm": -1}}, "motor.Rs_ohm"),
        ({"rig_overrides": {"motor.Rs_ohm": float("nan")}}, "motor.Rs_ohm"),
        ({"board_overrides": {"adc.bits": 99}}, "adc.bits"),
        ({"rig": "/nowhere.toml"}, "/nowhere.toml"),
        ({"board": "/nowhere.toml"}, "/nowhere.toml"),
        ({"motor_dir": "/nowhere"}, "/nowhere/motor.toml"),
        ({"firmware": {"no_such": 1}}, "firmware: no_such"),
        ({"firmware_config": {"no_such": 1}}, "firmware_config: no_such"),
        ({"scenario": SCENARIO + "[firmware]\nno_such = 1\n"}, "no_such"),
        ({"firmware": {"adapt_kp": 1e9}}, "out of range"),
        ({"decimate": 0}, "decimate"),
        ({"max_steps": 0}, "max_steps"),
        ({"seed": 0}, "seed"),
        ({"gain": np.zeros((3, 3))}, "gain"),
        ({"gain": np.full((3, 4), np.nan)}, "gain"),
        ({"rig_overrides": {"inverter.carrier_Hz": 4000}}, "carrier_Hz"),
    ],
)
def test_senseless_jobs_are_refused_by_name(job, text):
    with pytest.raises(UserError, match=text):
        run(Job(**job))


def mixed_jobs() -> list[Job]:
    """More than run at once, of unequal length; some of them no lane can take."""
    rig = HOST_SIM / "rigs" / "hasegawa2005.toml"
    changes = ({}, {"motor.saturation.flux_knee_Wb": 0.6}, {"dc_link.capacitance_F": 1e-3})
    jobs = [
        Job(rig=rig, rig_overrides={"inverter.model": model} | change, seed=seed)
        for model in ("averaged", "switched")
        for change in changes
        for seed in (1, 2)
    ]
    jobs.append(Job(scenario=SCENARIO, decimate=7, max_steps=6000))
    # Into the limits of the voltage, and into a trip.
    fast = {"profiles.speed_ref_rpm": [[0.0, 0.0], [1.0, 0.0], [1.2, 1500.0]]}
    low = {"inverter.u_dc_V": 150.0, "inverter.model": "switched"}
    jobs.append(Job(rig=rig, scenario_overrides=fast, rig_overrides=low))
    jobs.append(Job(rig=rig, firmware=TRIPS, stop_at_trip=True))
    return jobs


def test_a_batch_gives_the_bits_of_single_runs():
    jobs = mixed_jobs()
    batch = run_batch(jobs)
    assert len(batch) == len(jobs)
    for job, together in zip(jobs, batch, strict=True):
        alone = run(job)
        assert together.steps == alone.steps
        assert (together.trip, together.trip_s) == (alone.trip, alone.trip_s)
        assert (together.first_fault, together.first_fault_s) == (
            alone.first_fault,
            alone.first_fault_s,
        )
        for name, column in alone.columns.items():
            assert together[name].tobytes() == column.tobytes(), f"{name} of {job}"


def test_a_batch_names_the_job_it_refuses():
    with pytest.raises(UserError, match=r"job 1: .*no_such"):
        run_batch([Job(), Job(rig="no_such.toml")])


def test_an_empty_batch_is_no_run():
    assert run_batch([]) == []
