"""The drive's model in SIL: the same firmware and parameters, on the motor and board they describe.

It gives the prediction of every step. Its rig has no fault, its sensors no error; friction is a
guess, as no parameter knows it.
"""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path

from zerohertz import sim
from zerohertz.bringup.bench import Bench
from zerohertz.bringup.measure import Meter
from zerohertz.commission.run import write_folder
from zerohertz.errors import UserError
from zerohertz.link.client import Client
from zerohertz.link.server import DirectLine, LinkedDrive
from zerohertz.link.siphash import DEVELOPMENT_KEY
from zerohertz.motor import Circuit, Design, Mechanics, Motor, Nameplate

PERIODS = 5  # of the drive, while one answer is waited for
_START_S = 2.0  # offsets, and the wait before a challenge is heard
_THRESHOLD_SHARE = 0.02  # of rated current: where the dead time's error begins to fall
_FRICTION_SHARE = 0.01  # of what the rated current gives as torque
_SLICES = 25
_NOT_SET = ("period_s", "observer_gain_enable", "eps1_mode")

RIG = """\
[rig]
name = "model"
[motor]
Rs_ohm = {Rs_ohm!r}
Rr_ohm = {Rr_ohm!r}
Ls_H = {Ls_H!r}
Lr_H = {Lr_H!r}
M_H = {M_H!r}
pole_pairs = {pole_pairs:.0f}
[mechanics]
J_kg_m2 = {speed_J_kg_m2!r}
coulomb_Nm = {coulomb_Nm!r}
[inverter]
model = "averaged"
u_dc_V = {u_dc_V!r}
carrier_Hz = {carrier_Hz!r}
dead_time_s = {dead_time_s!r}
i_threshold_A = {threshold_A!r}
drop_V = {device_drop_V!r}
[sensors] # one bit of noise
current_noise_A = {current_bit_A!r}
voltage_noise_V = {line_bit_V!r}
dc_noise_V = {dc_bit_V!r}
"""
BOARD = """\
[board]
name = "model"
[adc]
bits = {adc_bits:.0f}
[full_scale]
current_A = {current_full_scale_A!r}
line_voltage_V = {line_voltage_full_scale_V!r}
dc_link_V = {dc_link_full_scale_V!r}
[filter]
voltage_cutoff_Hz = 800.0
order = 2
[control]
period_s = {period_s!r}
[inverter]
u_dc_V = {u_dc_V!r}
"""


def circuit_of(p: Mapping[str, float]) -> Circuit:
    return Circuit(p["Rs_ohm"], p["Rr_ohm"], p["Ls_H"], p["Lr_H"], p["M_H"])


def _motor(p: Mapping[str, float], period_s: float) -> Motor:
    current_A, omega = p["com_rated_A"], p["speed_max_rad_s"]
    pairs = round(p["pole_pairs"])
    torque_Nm = pairs * p["M_H"] / p["Lr_H"] * p["M_H"] * p["i_d_A"] * current_A
    plate = Nameplate(
        power_W=torque_Nm * omega / pairs,
        speed_rpm=omega / pairs * 9.5493,
        voltage_V=0.6 * p["u_dc_max_V"],
        current_A=current_A / 3.0**0.5,
        frequency_Hz=omega / 6.2832,
        pole_pairs=pairs,
        torque_Nm=torque_Nm,
    )
    nothing = Design(
        method="zero", dw0_rad_s=1.0, radius_per_s=1500.0, decay_per_s=0.0, relax=1.05,
        period_s=period_s, table_end_elec_per_min=2,
    )  # fmt: skip
    return Motor("model", "parameters of a drive", plate, circuit_of(p),
                 Mechanics(J_kg_m2=p["speed_J_kg_m2"]), nothing)  # fmt: skip


def _job(p: Mapping[str, float], period_s: float, u_dc_V: float, folder: Path) -> sim.Job:
    motor = _motor(p, period_s)
    write_folder(motor, folder)
    known = {name: float(f"{value:.7g}") for name, value in p.items()}
    sigma_H = motor.circuit.sigma_Ls_H
    dead_V = p["dead_time_s"] / period_s * u_dc_V + p["device_drop_V"]
    # No steeper than the plant's step allows.
    threshold_A = max(_THRESHOLD_SHARE * p["com_rated_A"], dead_V * period_s / sigma_H)
    bit = 2.0 ** -round(p["adc_bits"])
    known |= {
        "current_bit_A": 2.0 * bit * p["current_full_scale_A"],
        "line_bit_V": 2.0 * bit * p["line_voltage_full_scale_V"],
        "dc_bit_V": bit * p["dc_link_full_scale_V"],
        "u_dc_V": float(f"{u_dc_V:.7g}"),
        "carrier_Hz": 1.0 / period_s,
        "period_s": period_s,
        "coulomb_Nm": _FRICTION_SHARE * motor.nameplate.torque_Nm,
        "threshold_A": threshold_A,
    }
    firmware = {name: value for name, value in p.items() if name not in _NOT_SET}
    return sim.Job(
        scenario_overrides={"profiles.load_torque_Nm": "[[0.0, 0.0]]"},
        rig=RIG.format(**known),
        board=BOARD.format(**known),
        motor_dir=folder,
        firmware=firmware | {"observer_gain_enable": 0.0, "eps1_mode": 0.0},
        seed=1,
    )


def ready_bench(drive: LinkedDrive, u_dc_V: float) -> Bench:
    """A drive in this program, unlocked."""
    periods = drive.state.periods
    drive.run(max(round(_START_S / 200e-6) - periods, 1))
    line = DirectLine(drive, PERIODS)
    client = Client(line, timeout_s=10.0)
    client.unlock(DEVELOPMENT_KEY)
    return Bench(client, line.pause, u_dc_V)


@contextlib.contextmanager
def model_of(bench: Bench) -> Iterator[tuple[Bench, Meter]]:
    """The model of the drive on this bench, and a meter that reads the plant."""
    values = bench.drive.get(list(bench.drive.parameters))
    period_s = float(f"{bench.drive.identity.period_s:.7g}")
    with tempfile.TemporaryDirectory() as folder:
        try:
            drive = LinkedDrive(_job(values, period_s, bench.u_dc_V, Path(folder)))
        except UserError as error:
            raise UserError(f"the parameters of this drive describe no motor: {error}") from None
        with drive:
            yield ready_bench(drive, bench.u_dc_V), meter_of(drive)


def meter_of(drive: LinkedDrive, error_pu: float = 0.0) -> Meter:
    """Multimeter, clamp and tachometer at a simulated drive; all read this share too much."""

    def read(name: str) -> float:
        state = drive.state
        if name.startswith("clamp_"):
            return float(getattr(state, f"i_{name[6]}_A")) * (1.0 + error_pu)
        if name == "speed_rpm":
            return _mean_speed_rpm(drive) * (1.0 + error_pu)
        return float(getattr(state, name)) * (1.0 + error_pu)

    return read


def _mean_speed_rpm(drive: LinkedDrive) -> float:
    """A tachometer needs half a second; the command stands that long."""
    periods = round(0.5 / _SLICES * drive.state.periods / drive.state.time_s)
    total_rpm = 0.0
    for _ in range(_SLICES):
        drive.run(periods)
        total_rpm += drive.state.speed_rpm
    return total_rpm / _SLICES
