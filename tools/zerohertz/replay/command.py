"""`zh replay`: the estimator on a recorded log."""

from __future__ import annotations

import dataclasses
import json
import math
import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from zerohertz.errors import UserError
from zerohertz.flight.command import replay_flight
from zerohertz.motor import Motor, load_motor
from zerohertz.options import Json
from zerohertz.replay import plot
from zerohertz.replay.log import (
    Declaration,
    Log,
    check_scaling,
    load_declaration,
    merge,
    parse_columns,
    read_log,
)
from zerohertz.replay.nuisance import fit_voltage
from zerohertz.replay.output import Result, as_dict, show
from zerohertz.replay.run import METHODS, Replay, Settings, Voltage
from zerohertz.replay.statistics import speed_error
from zerohertz.replay.tuning import own_table

GAINS = ("design", "table", "zero")
PERIODS_S = (20e-6, 2e-3)  # param_list.def: period_s
# A log begins in mid run; the start is wrong by this much on purpose, so that convergence is seen.
INITIAL_PU = 0.8

LogArgument = Annotated[Path | None, typer.Argument(metavar="LOG.csv", help="Recorded log.")]
MotorOption = Annotated[
    Path | None, typer.Option("--motor", metavar="DIR", help="Folder with the motor.toml.")
]
ColumnsOption = Annotated[
    str,
    typer.Option(
        help="Columns as ROLE=NAME,... Roles: t, i_alpha, i_beta (or i_u, i_v), u_alpha, u_beta "
        "(or u_uv, u_vw), omega_e. SI units."
    ),
]
ScalingOption = Annotated[
    str,
    typer.Option(help="Scaling of the log's vectors: amplitude (invariant) or power (invariant)."),
]
PeriodOption = Annotated[
    float | None, typer.Option(help="Control period, s. Default: as in motor.toml.")
]
OwnOption = Annotated[
    bool, typer.Option("--own", help="Use the log's sampling period as control period.")
]
MethodOption = Annotated[
    str, typer.Option(help="Discretisation: second (second order, free of bias) or euler.")
]
GainOption = Annotated[
    str,
    typer.Option(
        help="Observer gain L: table (of the motor folder), zero, or design (for this log, with "
        "K_I and lag correction). Default: table if DIR has one, else design."
    ),
]
InitialOption = Annotated[
    float | None,
    typer.Option(help="Initial speed estimate, rad/s electrical. Default: 20 % wrong."),
]
DelayOption = Annotated[
    float, typer.Option(help="Delay from the logged voltage to the acting one, s.")
]
VoltageGainOption = Annotated[float, typer.Option(help="Acting voltage over logged voltage.")]
CornerOption = Annotated[
    float | None,
    typer.Option(help="Corner of the lag correction, rad/s; 0: none, as in the drive."),
]
FitOption = Annotated[
    bool, typer.Option(help="Also report the error after fitting the voltage to the sensor.")
]
SettleOption = Annotated[float, typer.Option(help="Start of the statistics, s into the log.")]
UntilOption = Annotated[float, typer.Option(help="End of the statistics, s.")]
SetOption = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="NAME=VALUE", help="Firmware parameter."),
]
PlotOption = Annotated[
    Path | None, typer.Option("--plot", metavar="FILE", help="Plot to write, .png or .svg.")
]
FlightOption = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="Of `zh record`, instead of a log: the whole firmware."),
]
OutOption = Annotated[
    Path | None,
    typer.Option("--out", metavar="FILE", help="With --flight: write the signals, .csv or .mf4."),
]
SignalsOption = Annotated[
    str, typer.Option(help="With --flight: names with commas; none: every signal.")
]


def register(app: typer.Typer) -> None:
    """Add `zh replay`."""
    app.command("replay")(replay)


def replay(
    log_csv: LogArgument = None,
    motor_dir: MotorOption = None,
    flight: FlightOption = None,
    out: OutOption = None,
    signals: SignalsOption = "",
    columns: ColumnsOption = "",
    scaling: ScalingOption = "",
    period: PeriodOption = None,
    own: OwnOption = False,
    method: MethodOption = "second",
    gain: GainOption = "",
    initial: InitialOption = None,
    voltage_delay: DelayOption = 0.0,
    voltage_gain: VoltageGainOption = 1.0,
    corner: CornerOption = None,
    fit: FitOption = True,
    settle: SettleOption = 0.1,
    until: UntilOption = math.inf,
    override: SetOption = None,
    plot_file: PlotOption = None,
    as_json: Json = False,
) -> None:
    """Run the firmware's observer on a recorded log and compare its speed with the sensor's.

    A file LOG.toml beside the log may also give columns and scaling; see
    tools/zerohertz/replay/README.md.

    With --flight: run the whole firmware on what a drive was given, as `zh record` wrote it; --set
    says what would have happened with another parameter. See tools/docs/flight.md.
    """
    overrides = _overrides(override or [])
    if flight is not None:
        replay_flight(flight, overrides, out, signals, motor_dir, as_json)
    log_csv, motor_dir = _log_and_motor(log_csv, motor_dir)
    if plot_file is not None:
        plot.check_plot_name(plot_file)
    motor, log = load_motor(motor_dir), _log(log_csv, columns, scaling)
    settings = Settings(
        period_s=_period_s(period, own, log, motor),
        method=_choice(method, "--method", METHODS),
        gain=_choice(gain or ("table" if own_table(motor_dir) else "design"), "--gain", GAINS),
        initial_rad_s=_initial_rad_s(initial, log),
        overrides=overrides,
        corner_rad_s=None if corner is None else _corner_rad_s(corner),
    )
    voltage = Voltage(
        gain=_positive(voltage_gain, "--voltage-gain"),
        delay_s=_finite(voltage_delay, "--voltage-delay"),
    )
    replayed = Replay.of(log, motor, motor_dir, settings)
    stream, speed = replayed.run(voltage)
    error = speed_error(stream.t_s, speed, stream.omega_e_rad_s, settle, until)
    result = Result(replayed, voltage, error, None)
    if fit:
        result = dataclasses.replace(result, fit=fit_voltage(replayed, voltage, settle, until))
    if plot_file is not None:
        title = f"{log_csv.name}, motor {motor.name}, {1e6 * settings.period_s:g} µs"
        plot.write_plot(plot_file, title, stream.t_s, speed, stream.omega_e_rad_s, error)
    _tell(result, as_json, plot_file)


def _tell(result: Result, as_json: bool, plot_file: Path | None) -> None:
    if as_json:
        print(json.dumps(as_dict(result)))
    else:
        show(result)
    if plot_file is not None:
        print(f"plot: {plot_file}", file=sys.stderr)


def _log_and_motor(log_csv: Path | None, motor_dir: Path | None) -> tuple[Path, Path]:
    if log_csv is None or motor_dir is None:
        raise UserError("give LOG.csv and --motor DIR, or --flight FILE")
    return log_csv, motor_dir


def _log(log_csv: Path, columns: str, scaling: str) -> Log:
    if scaling:
        check_scaling(scaling, "--scaling")
    flags = Declaration(scaling or None, parse_columns(columns))
    return read_log(log_csv, merge(flags, load_declaration(log_csv)))


def _period_s(period: float | None, own: bool, log: Log, motor: Motor) -> float:
    if own and period is not None:
        raise UserError("--own, --period: give one of them")
    chosen_s = motor.design.period_s if period is None else period
    if own:
        chosen_s = log.period_s
    if not PERIODS_S[0] <= chosen_s <= PERIODS_S[1]:
        raise UserError(
            f"{'--own' if own else '--period'}: {chosen_s:g} s; the firmware runs at "
            f"{PERIODS_S[0]:g} to {PERIODS_S[1]:g} s"
        )
    return chosen_s


def _choice(value: str, option: str, known: Any) -> str:
    if value not in known:
        raise UserError(f"{option}: '{value}'; known are {', '.join(known)}")
    return value


def _finite(value: float, option: str) -> float:
    if not math.isfinite(value):
        raise UserError(f"{option}: is {value}; a finite number is needed")
    return value


def _positive(value: float, option: str) -> float:
    if not (math.isfinite(value) and value > 0.0):
        raise UserError(f"{option}: is {value}; a number above 0 is needed")
    return value


def _corner_rad_s(value: float) -> float:
    if not (math.isfinite(value) and value >= 0.0):
        raise UserError(f"--corner: is {value}; 0 or a number above 0 is needed")
    return value


def _initial_rad_s(initial: float | None, log: Log) -> float:
    if initial is None:
        return INITIAL_PU * float(log.omega_e_rad_s[0])
    return _finite(initial, "--initial")


def _overrides(assignments: list[str]) -> dict[str, float]:
    """NAME=VALUE texts; which names there are, the firmware knows."""
    overrides = {}
    for text in assignments:
        name, _, value = (part.strip() for part in text.partition("="))
        try:
            overrides[name] = float(value)
        except ValueError:
            raise UserError(f"--set: '{text}' is not NAME=VALUE with a number") from None
    return overrides
