"""zh replay: reading logs, resampling, and the observer on a log whose truth is known."""

from __future__ import annotations

import dataclasses
import json
import math
from pathlib import Path

import numpy as np
import pytest
import synthetic_log
import typer
from typer.testing import CliRunner

from zerohertz.errors import UserError
from zerohertz.motor import load_motor
from zerohertz.paths import ROOT
from zerohertz.replay import command
from zerohertz.replay.lag import static_gain_Wb_A_s
from zerohertz.replay.log import Declaration, parse_columns, read_log
from zerohertz.replay.resample import resample
from zerohertz.replay.run import Replay, Settings, Voltage
from zerohertz.replay.statistics import speed_error
from zerohertz.replay.tuning import rotor_flux_Wb

TABLE_1 = ROOT / "gain_tables" / "hasegawa2005"
IM_BENCH = Path(__file__).parent / "data" / "im_bench"
RECORDED = ROOT.parent / "shared" / "data" / "im_bench"
HEADER = ",".join(synthetic_log.COLUMNS)


def invoke(*words: str | Path):
    """The command line; the message of a UserError stands in for stderr."""
    app = typer.Typer()
    command.register(app)
    app.command("other")(lambda: None)  # one command alone would lose its name
    return CliRunner().invoke(app, ["replay", *map(str, words)])


def run_json(*words: str | Path, fit: bool = False) -> dict:
    result = invoke(*words, "--json", "--fit" if fit else "--no-fit")
    assert result.exit_code == 0, result.exception
    return json.loads(result.stdout)


@pytest.fixture(scope="module")
def recording() -> synthetic_log.Recording:
    return synthetic_log.record()


@pytest.fixture
def log_file(tmp_path: Path, recording: synthetic_log.Recording) -> Path:
    return synthetic_log.write_csv(tmp_path / "log.csv", recording)


def rows(count: int, step_s: float = 1e-3) -> list[str]:
    return [f"{k * step_s:.6g},1,2,3,4,5" for k in range(count)]


def write(path: Path, lines: list[str]) -> Path:
    path.write_text("\n".join(lines) + "\n")
    return path


# ---- the file ---------------------------------------------------------------------------------


def test_vectors_come_out_power_invariant_from_either_scaling(tmp_path: Path, recording) -> None:
    for scaling in ("amplitude", "power"):
        file = synthetic_log.write_csv(tmp_path / f"{scaling}.csv", recording, scaling)
        log = read_log(file, Declaration(scaling))
        assert log.scaling_declared
        np.testing.assert_allclose(log.i_s_A, recording.i_s_A, rtol=1e-7)
        np.testing.assert_allclose(log.u_s_V, recording.u_s_V, rtol=1e-7)


def test_phase_and_line_quantities_give_the_same_vectors(tmp_path: Path, recording) -> None:
    # The inverse of Clarke, by components: x_u = sqrt(2/3) Re x, x_v at 120 degrees behind.
    turn = np.exp(-2j * np.pi / 3)
    i_u, i_v = (math.sqrt(2 / 3) * (recording.i_s_A * k).real for k in (1.0, turn))
    u = [math.sqrt(2 / 3) * (recording.u_s_V * k).real for k in (1.0, turn, turn**2)]
    table = np.column_stack(
        [recording.t_s, i_u, i_v, u[0] - u[1], u[1] - u[2], recording.omega_e_rad_s]
    )
    file = tmp_path / "phases.csv"
    np.savetxt(file, table, fmt="%.9g", delimiter=",", header="t,a,b,ab,bc,w", comments="")
    columns = parse_columns("t=t, i_u=a, i_v=b, u_uv=ab, u_vw=bc, omega_e=w")
    log = read_log(file, Declaration(None, columns))
    np.testing.assert_allclose(log.i_s_A, recording.i_s_A, rtol=1e-6)
    np.testing.assert_allclose(log.u_s_V, recording.u_s_V, rtol=1e-6)


def test_a_sidecar_declares_scaling_and_columns_and_flags_win(log_file: Path) -> None:
    log_file.with_suffix(".toml").write_text('[log]\nscaling = "power"\n[columns]\nt = "t_s"\n')
    assert run_json(log_file, "--motor", TABLE_1)["scaling"] == "power"
    flagged = run_json(log_file, "--motor", TABLE_1, "--scaling", "amplitude")
    assert flagged["scaling"] == "amplitude"
    assert flagged["scaling_declared"]


@pytest.mark.parametrize(
    ("lines", "complaint"),
    [
        ([], "the file is empty"),
        ([HEADER], "0 rows; at least 20"),
        ([HEADER, *rows(19)], "19 rows; at least 20"),
        (["t_s,ialpha_A,ibeta_A,valpha_V,omega_el_meas_rad_s"], ":1: no column 'vbeta_V'"),
        ([HEADER + ",t_s"], ":1: column 't_s' stands there twice"),
        ([HEADER, *rows(3), "0.003,1,nan,3,4,5"], ":5: ibeta_A: is nan"),
        ([HEADER, *rows(3), "0.003,1,2,inf,4,5"], ":5: valpha_V: is inf"),
        ([HEADER, *rows(3), "0.003,1,2,x3,4,5"], ":5: valpha_V: 'x3' is not a number"),
        ([HEADER, *rows(3), "0.003,1,2,,4,5"], ":5: valpha_V: '' is not a number"),
        ([HEADER, *rows(3), "0.003,1,2"], ":5: 3 fields, the header has 6"),
        ([HEADER, *rows(30), *rows(1)], ":32: time does not increase"),
        ([HEADER, *rows(30)[:9], *rows(30)[10:]], ":11: uneven time: a step of 0.002 s"),
    ],
)
def test_a_bad_file_is_refused_with_line_and_column(
    tmp_path: Path, lines: list[str], complaint: str
) -> None:
    file = write(tmp_path / "bad.csv", lines)
    with pytest.raises(UserError) as error:
        read_log(file)
    assert complaint in str(error.value)
    assert str(error.value).startswith(str(file))


def test_a_missing_or_binary_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="no such file"):
        read_log(tmp_path / "none.csv")
    binary = tmp_path / "binary.csv"
    binary.write_bytes(bytes(range(256)))
    with pytest.raises(UserError, match="not a CSV text file"):
        read_log(binary)


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["--columns", "i_x=a"], "no role 'i_x'"),
        (["--columns", "t"], "is not role=name"),
        (["--columns", "i_u=ialpha_A"], "i_v is needed too"),
        (["--scaling", "peak"], "write amplitude or power"),
        (["--own", "--period", "1e-4"], "give one of them"),
        (["--period", "1"], "the firmware runs at"),
        (["--method", "heun"], "known are euler, second"),
        (["--gain", "high"], "known are design, table, zero"),
        (["--voltage-gain", "0"], "a number above 0"),
        (["--corner", "-1"], "0 or a number above 0"),
        (["--initial", "inf"], "a finite number"),
        (["--settle", "99"], "no sample between"),
        (["--set", "adapt_kp"], "is not NAME=VALUE"),
        (["--set", "adapt_nix=1"], "no such parameter"),
        (["--plot", "picture.pdf"], "must end in .png or .svg"),
    ],
)
def test_a_senseless_option_is_refused(log_file: Path, words: list[str], complaint: str) -> None:
    result = invoke(log_file, "--motor", TABLE_1, *words)
    assert isinstance(result.exception, UserError)
    assert complaint in str(result.exception)


# ---- resampling -------------------------------------------------------------------------------


def test_resampling_keeps_a_fundamental_in_size_and_phase(tmp_path: Path, recording) -> None:
    log = read_log(synthetic_log.write_csv(tmp_path / "log.csv", recording))
    omega_rad_s = float(np.angle(log.u_s_V[1] / log.u_s_V[0])) / log.period_s
    for period_s in (50e-6, 200e-6, 330e-6):
        stream = resample(log, period_s)
        kept = stream.t_s < 0.5  # one constant speed
        turned = np.exp(1j * omega_rad_s * stream.t_s)
        # Linear interpolation of a rotation falls short by at most (w T)^2/8 = 2e-4.
        np.testing.assert_allclose(stream.i_s_A[kept], (log.i_s_A[0] * turned)[kept], rtol=3e-4)
        # Mean of a rotating vector over the period that ends at t: sinc, and half a period back.
        x = 0.5 * omega_rad_s * period_s
        wanted_u = log.u_s_V[0] * turned * np.sinc(x / np.pi)
        np.testing.assert_allclose(stream.u_s_V[kept], wanted_u[kept] * np.exp(-1j * x), rtol=3e-4)


def test_a_voltage_delay_turns_the_voltage_back(tmp_path: Path, recording) -> None:
    log = read_log(synthetic_log.write_csv(tmp_path / "log.csv", recording))
    omega_rad_s = float(np.angle(log.u_s_V[1] / log.u_s_V[0])) / log.period_s
    delay_s = 400e-6
    plain, late = resample(log, 200e-6), resample(log, 200e-6, delay_s)
    shift = round(delay_s / 200e-6)
    turn = late.u_s_V[:100] / plain.u_s_V[shift : shift + 100]
    np.testing.assert_allclose(np.angle(turn), -omega_rad_s * delay_s, atol=1e-3)


# ---- the observer -----------------------------------------------------------------------------


@pytest.mark.parametrize("gain", ["table", "zero"])
def test_the_observer_finds_the_speed_of_a_known_machine(log_file: Path, gain: str) -> None:
    # Before and after the move of 15 rad/s; with L = 0 the start rings for half a second.
    for settle, until in ((0.6, 0.74), (1.2, 1.5)):
        words = ("--gain", gain, "--settle", settle, "--until", until)
        error = run_json(log_file, "--motor", TABLE_1, *words)["error"]
        # Exact parameters, no noise: what is left is the second-order step (w_s T = .037) and the
        # interpolation of the log, .03 % of the speed together.
        assert error["rms_rad_s"] < 0.1
        assert error["settled_s"] < 0.4


def test_the_json_says_table_only_for_a_gain_other_than_zero(log_file: Path) -> None:
    assert run_json(log_file, "--motor", TABLE_1)["table"] is True
    assert run_json(log_file, "--motor", TABLE_1, "--gain", "zero")["table"] is False
    off = ("--set", "observer_gain_enable=0")
    assert run_json(log_file, "--motor", TABLE_1, *off)["table"] is False


def test_the_start_is_wrong_by_a_fifth_unless_told(log_file: Path, recording) -> None:
    found = run_json(log_file, "--motor", TABLE_1)
    assert found["initial_rad_s"] == pytest.approx(0.8 * recording.omega_e_rad_s[0])
    exact = run_json(log_file, "--motor", TABLE_1, "--initial", "180", "--settle", "0")
    assert (
        exact["error"]["rms_rad_s"]
        < run_json(log_file, "--motor", TABLE_1, "--settle", "0")["error"]["rms_rad_s"]
    )


def test_running_at_the_logs_own_period(tmp_path: Path) -> None:
    slow = synthetic_log.record(duration_s=1.0, period_s=500e-6)
    file = synthetic_log.write_csv(tmp_path / "slow.csv", slow)
    found = run_json(file, "--motor", TABLE_1, "--own", "--settle", "0.4")
    assert found["period_s"] == pytest.approx(500e-6)
    assert found["error"]["samples"] == 1201
    assert found["error"]["rms_pu"] < 0.01


def test_the_wrong_scaling_is_no_disaster_but_the_wrong_motor_is(log_file: Path) -> None:
    # A common factor of current and voltage leaves the speed alone: the observer is linear.
    right = run_json(log_file, "--motor", TABLE_1, "--settle", "0.6")
    other = run_json(log_file, "--motor", TABLE_1, "--settle", "0.6", "--scaling", "power")
    assert other["error"]["mean_rad_s"] == pytest.approx(right["error"]["mean_rad_s"], abs=0.3)
    wrong = run_json(log_file, "--motor", IM_BENCH, "--settle", "0.6")
    assert wrong["error"]["rms_pu"] > 5.0 * right["error"]["rms_pu"]


@pytest.mark.parametrize("value", ["0", "1e30", "-1e30"])
def test_a_senseless_recording_gives_numbers_and_no_crash(tmp_path: Path, value: str) -> None:
    lines = [HEADER, *(f"{k * 2e-4:.6g}," + ",".join([value] * 4) + ",0" for k in range(2000))]
    error = run_json(write(tmp_path / "log.csv", lines), "--motor", TABLE_1)["error"]
    assert error["rms_pu"] is None
    assert 0.0 <= error["max_rad_s"] <= 628.0 * (1.0 + 1e-6)  # omega_max_rad_s holds the estimate


def test_a_plot_is_written(log_file: Path, tmp_path: Path) -> None:
    for name, magic in (("a.png", b"\x89PNG"), ("b.svg", b"<svg")):
        file = tmp_path / "new" / name
        result = invoke(log_file, "--motor", TABLE_1, "--no-fit", "--plot", file)
        assert result.exit_code == 0, result.exception
        assert file.read_bytes().startswith(magic)
        assert "rms" in result.stdout


def test_statistics_of_a_known_error() -> None:
    t_s = np.arange(10) * 0.1
    measured = np.full(10, 100.0)
    estimate = measured + np.array([-50.0, -20.0, 3.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0, 1.0])
    error = speed_error(t_s, estimate, measured, 0.3, 0.8)
    assert (error.samples, error.rms_rad_s, error.max_rad_s) == (6, 1.0, 1.0)
    assert error.mean_rad_s == pytest.approx(0.0)
    assert error.rms_pu == pytest.approx(0.01)
    assert error.settled_s == pytest.approx(0.2)
    lost = speed_error(t_s, measured + 6.0, measured, 0.0, 1.0)
    assert lost.settled_s is None


# ---- the lag on ramps -------------------------------------------------------------------------

RAMP_S = 0.25
RAMP_RAD_S = (2.0 * math.pi * 30.0, 2.0 * math.pi * 70.0)


@pytest.fixture(scope="module")
def ramp(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The low-voltage machine from 30 to 70 Hz, .6 to .85 s into the log."""
    recording = synthetic_log.record(
        synthetic_log.IM_BENCH,
        duration_s=1.2,
        period_s=500e-6,
        omega_e_rad_s=RAMP_RAD_S,
        move_s=RAMP_S,
        slip_rad_s=6.0,
        flux_Wb=0.042,
    )
    return synthetic_log.write_csv(tmp_path_factory.mktemp("ramp") / "ramp.csv", recording)


def errors(log: Path, *words: str | Path) -> dict:
    return run_json(log, "--motor", IM_BENCH, "--scaling", "amplitude", *words)["error"]


@pytest.mark.parametrize("period", [("--period", "200e-6"), ("--own",)], ids=["200us", "500us"])
def test_a_ramp_is_followed(ramp: Path, period: tuple[str, ...]) -> None:
    # Before: 16 rad/s behind, 6.6 to 7.6 rms. What is left is the ramp's two corners.
    before, now = errors(ramp, *period, "--gain", "zero"), errors(ramp, *period)
    assert now["rms_rad_s"] < 0.5 * before["rms_rad_s"]
    assert now["max_rad_s"] < 0.7 * before["max_rad_s"]
    end = ("--settle", "0.75", "--until", "0.85")  # of the ramp
    assert abs(errors(ramp, *period, *end)["mean_rad_s"]) < 4.5
    assert errors(ramp, *period, *end, "--corner", "0")["mean_rad_s"] < -12.0


def test_without_the_correction_the_lag_is_acceleration_over_velocity_gain(ramp: Path) -> None:
    motor, log = load_motor(IM_BENCH), read_log(ramp, Declaration("amplitude"))
    settings = Settings(2e-4, "second", "design", 188.0, {}, corner_rad_s=0.0)
    replay = Replay.of(log, motor, IM_BENCH, settings)
    stream, speed = replay.run(Voltage())
    k = int(np.searchsorted(stream.t_s, 0.84))
    at = np.array([stream.omega_e_rad_s[k]])
    static = static_gain_Wb_A_s(replay.tables, at, at, rotor_flux_Wb(log, motor.circuit))[0]
    velocity_gain_per_s = replay.tuning.overrides["adapt_ki"] * static
    acceleration = (RAMP_RAD_S[1] - RAMP_RAD_S[0]) / RAMP_S
    lag_rad_s = stream.omega_e_rad_s[k] - speed[k]
    assert lag_rad_s == pytest.approx(acceleration / velocity_gain_per_s, rel=0.15)


def test_the_flux_is_found_in_the_log(tmp_path: Path, recording) -> None:
    log = read_log(synthetic_log.write_csv(tmp_path / "log.csv", recording))
    i_d_A = np.abs(log.i_s_A).max()
    found_Wb = rotor_flux_Wb(log, load_motor(TABLE_1).circuit)
    assert found_Wb == pytest.approx(0.47, rel=0.05)
    assert found_Wb < 0.102 * i_d_A


def test_a_voltage_that_does_not_turn_has_no_flux(tmp_path: Path) -> None:
    log = write(tmp_path / "log.csv", [HEADER, *(f"{k * 2e-4:.6g},1,0,3,0,0" for k in range(100))])
    result = invoke(log, "--motor", IM_BENCH)
    assert isinstance(result.exception, UserError)
    assert "does not turn" in str(result.exception)


@pytest.fixture(scope="module")
def loaded() -> synthetic_log.Recording:
    """One speed, three times the rated slip: the voltage's size and angle matter."""
    return synthetic_log.record(duration_s=1.0, omega_e_rad_s=(180.0, 180.0), slip_rad_s=20.0)


def test_a_voltage_of_wrong_size_is_fitted_and_told_beside_the_plain_error(
    tmp_path: Path, loaded
) -> None:
    wrong = dataclasses.replace(loaded, u_s_V=loaded.u_s_V / 0.92)
    file = synthetic_log.write_csv(tmp_path / "log.csv", wrong)
    words = (file, "--motor", TABLE_1, "--settle", "0.4")
    found = run_json(*words, fit=True)
    fitted = found["fitted"]
    assert (found["voltage_gain"], found["voltage_delay_s"]) == (1.0, 0.0)
    assert fitted["voltage_gain"] == pytest.approx(0.92, abs=0.02)
    assert fitted["error"]["rms_rad_s"] < 0.2 * found["error"]["rms_rad_s"]
    right = run_json(*words, "--voltage-gain", "0.92")
    assert right["fitted"] is None
    assert right["error"]["rms_rad_s"] < 0.05 * found["error"]["rms_rad_s"]
    assert "fitted    voltage x " in invoke(*words).stdout


def test_a_right_voltage_stays(tmp_path: Path, loaded) -> None:
    file = synthetic_log.write_csv(tmp_path / "log.csv", loaded)
    fitted = run_json(file, "--motor", TABLE_1, "--settle", "0.4", fit=True)["fitted"]
    assert fitted["voltage_gain"] == pytest.approx(1.0, abs=0.01)
    assert abs(fitted["voltage_delay_s"]) < 5e-5


@pytest.mark.skipif(not RECORDED.is_dir(), reason="no recordings beside the checkout")
def test_a_recorded_load_step_is_followed_within_one_percent() -> None:
    # With L = 0 3.26 and 1.96 rad/s. The data's own bias (voltage known to 5 %) is in the figures.
    log = RECORDED / "load_step_50Hz.csv"
    assert errors(log)["rms_rad_s"] < 2.4
    assert errors(log, "--own")["rms_rad_s"] < 1.96
    assert errors(log, "--gain", "zero")["rms_rad_s"] < 3.27


@pytest.mark.skipif(not RECORDED.is_dir(), reason="no recordings beside the checkout")
def test_a_recorded_fault_does_not_hurt_the_observer() -> None:
    log = RECORDED / "open_switch_50Hz.csv"
    healthy = run_json(log, "--motor", IM_BENCH, "--own", "--settle", "0.06", "--until", "0.088")
    assert healthy["error"]["rms_pu"] < 0.05
    whole = run_json(log, "--motor", IM_BENCH, "--own")
    assert math.isfinite(whole["error"]["max_rad_s"])
