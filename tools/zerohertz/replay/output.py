"""What `zh replay` says: text and JSON."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

from zerohertz.replay.nuisance import Fit
from zerohertz.replay.run import Replay, Voltage
from zerohertz.replay.statistics import SpeedError


@dataclasses.dataclass(frozen=True)
class Result:
    """A run, its error, and the error with the voltage fitted to the sensor."""

    replay: Replay
    voltage: Voltage
    error: SpeedError
    fit: Fit | None


def as_dict(result: Result) -> dict[str, Any]:
    replay = result.replay
    log, settings = replay.log, replay.settings
    return {
        "log": log.file,
        "motor": replay.motor.name,
        "log_period_s": log.period_s,
        "scaling": log.scaling,
        "scaling_declared": log.scaling_declared,
        "period_s": settings.period_s,
        "method": settings.method,
        "gain": settings.gain,
        "table": _uses_table(replay),
        "voltage_gain": result.voltage.gain,
        "voltage_delay_s": result.voltage.delay_s,
        "initial_rad_s": settings.initial_rad_s,
        "corner_rad_s": replay.corner_rad_s,
        "overrides": {**replay.tuning.overrides, **settings.overrides},
        "error": dataclasses.asdict(result.error),
        "fitted": None if result.fit is None else dataclasses.asdict(result.fit),
    }


def _uses_table(replay: Replay) -> bool:
    """Whether the firmware had an L other than 0: a table may be all zero or be switched off."""
    enabled = replay.parameters()["observer_gain_enable"] != 0.0
    return enabled and bool(replay.tables.gain.any())


def show(result: Result) -> None:
    replay, error = result.replay, result.error
    log, settings = replay.log, replay.settings
    declared = "" if log.scaling_declared else " (assumed; declare it with --scaling)"
    own = " (the log's own)" if settings.period_s == log.period_s else ""
    correction = f", lag correction {replay.corner_rad_s:.3g} rad/s" if replay.corner_rad_s else ""
    # A shaft speed means more to most people than an electrical one.
    rpm = 60.0 / (2.0 * math.pi * replay.motor.nameplate.pole_pairs)
    settled = f"from {error.settled_s:.3f} s on" if error.settled_s is not None else "never"
    print(f"log       {log.file}: {len(log.t_s)} rows, {1e6 * log.period_s:g} µs")
    print(f"scaling   {log.scaling} invariant{declared}")
    used = f"L {settings.gain}" if _uses_table(replay) else "L zero"
    print(f"motor     {replay.motor.name}; {used}{correction}")
    print(f"period    {1e6 * settings.period_s:g} µs{own}, method {settings.method}")
    print(f"start     {settings.initial_rad_s:.1f} rad/s el., flux 0")
    print(f"compared  {error.from_s:.4g} s to {error.until_s:.4g} s, {error.samples} periods")
    rms_rpm = error.rms_rad_s * rpm
    print(f"rms       {error.rms_rad_s:.2f} rad/s el. ({rms_rpm:.2f} min⁻¹{_share(error)})")
    print(f"mean      {error.mean_rad_s:+.2f} rad/s el. ({error.mean_rad_s * rpm:+.2f} min⁻¹)")
    print(f"largest   {error.max_rad_s:.2f} rad/s el. ({error.max_rad_s * rpm:.2f} min⁻¹)")
    print(f"within 5% {settled}")
    if result.fit is not None:
        _show_fit(result.fit)


def _show_fit(fit: Fit) -> None:
    print(
        f"fitted    voltage x {fit.voltage_gain:.3f}, {1e6 * fit.voltage_delay_s:+.0f} µs: rms "
        f"{fit.error.rms_rad_s:.2f} rad/s el.{_share(fit.error)}, mean {fit.error.mean_rad_s:+.2f}"
    )


def _share(error: SpeedError) -> str:
    return f", {100.0 * error.rms_pu:.2f} % of the speed" if error.rms_pu is not None else ""
