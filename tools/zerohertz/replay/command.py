"""`zh replay`: the estimator on a recorded log."""

from __future__ import annotations

import dataclasses
import json
import math
import sys
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from zerohertz.errors import UserError
from zerohertz.motor import Motor, load_motor
from zerohertz.replay import plot
from zerohertz.replay.estimate import Estimate, run_estimator
from zerohertz.replay.log import (
    Declaration,
    Log,
    check_scaling,
    load_declaration,
    merge,
    parse_columns,
    read_log,
)
from zerohertz.replay.motor_folder import folder_with_table
from zerohertz.replay.resample import Stream, resample
from zerohertz.replay.statistics import SpeedError, speed_error

METHODS = {"euler": 0, "second": 1}
GAINS = ("table", "zero")
PERIODS_S = (20e-6, 2e-3)  # param_list.def: period_s
HEADROOM = 4.0
FULL_SCALES_A = (0.1, 1e4)  # param_list.def: current_full_scale_A
# A log begins in mid run; the start is wrong by this much on purpose, so that convergence is seen.
INITIAL_PU = 0.8


@dataclasses.dataclass(frozen=True)
class Settings:
    """How the log is run."""

    period_s: float
    method: str
    table: bool
    voltage_delay_s: float
    initial_rad_s: float
    overrides: dict[str, float]


LogArgument = Annotated[Path, typer.Argument(metavar="LOG.csv", help="Recorded log.")]
MotorOption = Annotated[
    Path, typer.Option("--motor", metavar="DIR", help="Folder with the motor.toml.")
]
ColumnsOption = Annotated[
    str,
    typer.Option(
        help="role=name,...; roles t, i_alpha, i_beta (or i_u, i_v), u_alpha, u_beta "
        "(or u_uv, u_vw), omega_e; SI units."
    ),
]
ScalingOption = Annotated[
    str, typer.Option(help="Vectors of the log: amplitude or power (invariant).")
]
PeriodOption = Annotated[
    float | None, typer.Option(help="Control period, s; default: that of motor.toml.")
]
OwnOption = Annotated[bool, typer.Option("--own", help="Run at the log's own period.")]
MethodOption = Annotated[
    str, typer.Option(help="Discretisation: second (order, bias-free) or euler.")
]
GainOption = Annotated[str, typer.Option(help="L: table (of the motor's method) or zero.")]
InitialOption = Annotated[
    float | None, typer.Option(help="First speed estimate, rad/s electrical; default: 20 % wrong.")
]
DelayOption = Annotated[float, typer.Option(help="The logged voltage acted this much later, s.")]
SettleOption = Annotated[float, typer.Option(help="Statistics begin here, s into the log.")]
UntilOption = Annotated[float, typer.Option(help="Statistics end here, s.")]
SetOption = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="NAME=VALUE", help="Parameter of the firmware."),
]
PlotOption = Annotated[
    Path | None, typer.Option("--plot", metavar="FILE", help="Write a .png or .svg.")
]
JsonOption = Annotated[bool, typer.Option("--json", help="One JSON object on stdout.")]


def register(app: typer.Typer) -> None:
    """Add `zh replay`."""
    app.command("replay")(replay)


def replay(
    log_csv: LogArgument,
    motor_dir: MotorOption,
    columns: ColumnsOption = "",
    scaling: ScalingOption = "",
    period: PeriodOption = None,
    own: OwnOption = False,
    method: MethodOption = "second",
    gain: GainOption = "table",
    initial: InitialOption = None,
    voltage_delay: DelayOption = 0.0,
    settle: SettleOption = 0.1,
    until: UntilOption = math.inf,
    override: SetOption = None,
    plot_file: PlotOption = None,
    as_json: JsonOption = False,
) -> None:
    """Run the firmware's observer on a recorded log and compare its speed with the sensor's.

    Columns and scaling may also stand in LOG.toml beside the log; see
    tools/zerohertz/replay/README.md.
    """
    if plot_file is not None:
        plot.check_plot_name(plot_file)
    if scaling:
        check_scaling(scaling, "--scaling")
    motor = load_motor(motor_dir)
    flags = Declaration(scaling or None, parse_columns(columns))
    log = read_log(log_csv, merge(flags, load_declaration(log_csv)))
    settings = Settings(
        period_s=_period_s(period, own, log, motor),
        method=_choice(method, "--method", METHODS),
        table=_choice(gain, "--gain", GAINS) == "table",
        voltage_delay_s=_finite(voltage_delay, "--voltage-delay"),
        initial_rad_s=_initial_rad_s(initial, log),
        overrides=_overrides(override or []),
    )
    stream, estimate = run(log, motor, motor_dir, settings)
    error = speed_error(stream.t_s, estimate.omega_e_rad_s, stream.omega_e_rad_s, settle, until)
    if plot_file is not None:
        title = f"{log_csv.name}, motor {motor.name}, {1e6 * settings.period_s:g} µs"
        plot.write_plot(
            plot_file, title, stream.t_s, estimate.omega_e_rad_s, stream.omega_e_rad_s, error
        )
    settings = dataclasses.replace(settings, table=_uses_table(motor, settings))
    if as_json:
        print(json.dumps(_as_dict(log, motor, settings, error)))
    else:
        _show(log, motor, settings, error)
    if plot_file is not None:
        print(f"plot: {plot_file}", file=sys.stderr)


def run(log: Log, motor: Motor, motor_dir: Path, settings: Settings) -> tuple[Stream, Estimate]:
    """The observer over the log, as the settings say."""
    stream = resample(log, settings.period_s, settings.voltage_delay_s)
    if len(stream.t_s) == 0:
        raise UserError(
            f"{log.file}: too short for a period of {settings.period_s:g} s and a voltage delay "
            f"of {settings.voltage_delay_s:g} s"
        )
    # The observer bounds its states at twice the full scale of a board, which a log does not have:
    # wide enough that a wrong start is not held back.
    full_scale_A = float(np.clip(HEADROOM * np.max(np.abs(log.i_s_A)), *FULL_SCALES_A))
    overrides = {
        "current_full_scale_A": full_scale_A,
        "observer_method": METHODS[settings.method],
        "observer_gain_enable": int(settings.table),
        **settings.overrides,
    }
    folder = folder_with_table(motor, motor_dir)
    return stream, run_estimator(folder, overrides, stream, settings.initial_rad_s)


def _uses_table(motor: Motor, settings: Settings) -> bool:
    """Whether the firmware had an L other than 0: a table may be all zero or be switched off."""
    enabled = settings.overrides.get("observer_gain_enable", float(settings.table))
    return enabled != 0.0 and motor.design.method != "zero"


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


def _as_dict(log: Log, motor: Motor, settings: Settings, error: SpeedError) -> dict[str, Any]:
    return {
        "log": log.file,
        "motor": motor.name,
        "log_period_s": log.period_s,
        "scaling": log.scaling,
        "scaling_declared": log.scaling_declared,
        **dataclasses.asdict(settings),
        "error": dataclasses.asdict(error),
    }


def _show(log: Log, motor: Motor, settings: Settings, error: SpeedError) -> None:
    declared = "" if log.scaling_declared else " (assumed; declare it with --scaling)"
    own = " (the log's own)" if settings.period_s == log.period_s else ""
    # A shaft speed means more to most people than an electrical one.
    rpm = 60.0 / (2.0 * math.pi * motor.nameplate.pole_pairs)
    share = f", {100.0 * error.rms_pu:.2f} % of the speed" if error.rms_pu is not None else ""
    settled = f"from {error.settled_s:.3f} s on" if error.settled_s is not None else "never"
    print(f"log       {log.file}: {len(log.t_s)} rows, {1e6 * log.period_s:g} µs")
    print(f"scaling   {log.scaling} invariant{declared}")
    print(f"motor     {motor.name}; L {motor.design.method if settings.table else 'zero'}")
    print(f"period    {1e6 * settings.period_s:g} µs{own}, method {settings.method}")
    print(f"start     {settings.initial_rad_s:.1f} rad/s el., flux 0")
    print(f"compared  {error.from_s:.4g} s to {error.until_s:.4g} s, {error.samples} periods")
    print(f"rms       {error.rms_rad_s:.2f} rad/s el. ({error.rms_rad_s * rpm:.2f} min⁻¹{share})")
    print(f"mean      {error.mean_rad_s:+.2f} rad/s el. ({error.mean_rad_s * rpm:+.2f} min⁻¹)")
    print(f"largest   {error.max_rad_s:.2f} rad/s el. ({error.max_rad_s * rpm:.2f} min⁻¹)")
    print(f"within 5% {settled}")
