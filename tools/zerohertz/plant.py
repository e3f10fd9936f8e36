"""The simulated rig, period by period, beside a Drive: binding of host_sim/sil_plant.h.

    with Drive(motor_dir, board) as drive, Plant(rig, board) as plant:
        for _ in range(5000):
            out = drive.step(*plant.sample(), speed_ref_rpm=60.0, run=True)
            plant.advance(out.duties, out.gates_on)
        done = plant.run(drive, 5000, speed_ref_rpm=60.0)  # the same in one call, faster

Any controller may take the drive's place: six ADC words in, three duties out.
"""

from __future__ import annotations

import ctypes
from collections.abc import Mapping, Sequence
from ctypes import byref, c_double, c_uint16
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from zerohertz import arguments
from zerohertz.drive import Drive
from zerohertz.errors import UserError
from zerohertz.sil import (
    Handle,
    StrPath,
    check,
    library,
    override_lines,
    raise_last_error,
)
from zerohertz.sil_rows import Recording, inputs, outputs
from zerohertz.sil_types import TRUTH, TRUTH_NAMES, RawTruth, Rows, Truth

__all__ = ["Plant", "PlantSnapshot", "Run", "Truth"]

MAX_PERIODS = 10**8  # of one call, whose arrays take some 300 bytes each


@dataclass(frozen=True)
class Run:
    """Arrays of a run of drive and plant, one row per period."""

    out: Rows  # fields of Output, and the signals asked for
    truth: Rows  # fields of Truth, at the crest where the period begins


class PlantSnapshot(Handle):
    """State of a plant, in this process."""

    _CLOSE = "zh_plant_close"

    def __init__(self, handle: int | None) -> None:
        self._lib = library()
        self._handle = handle
        if not handle:
            raise_last_error()


class Plant(Handle):
    """Motor, shaft, inverter and sensors of a rig, with the delay of the board's timer.

    rig and board are TOML files as in host_sim/rigs and host_sim/boards, or their text; scenario
    may give disturbances and initial values (its commands are not followed); rig_overrides as
    {"motor.Rs_ohm": 1.0}; seed is that of the sensors' noise.
    """

    _CLOSE = "zh_plant_close"

    def __init__(
        self,
        rig: StrPath,
        board: StrPath,
        scenario: StrPath | None = None,
        *,
        rig_overrides: Mapping[str, Any] | None = None,
        seed: int = 1,
    ) -> None:
        """Raise UserError, which names file and key, when the library refuses an input."""
        self._handle = None
        self._lib = library()
        self._words = (c_uint16 * 6)()
        self._truth = RawTruth(struct_size=ctypes.sizeof(RawTruth))
        self._handle = self._lib.zh_plant_open(
            arguments.path("Plant", "rig", rig),
            arguments.path("Plant", "board", board),
            arguments.path("Plant", "scenario", scenario) if scenario is not None else None,
            override_lines(
                {} if rig_overrides is None else rig_overrides, "Plant", "rig_overrides"
            ),
            _seed("Plant", seed),
        )
        if not self._handle:
            raise_last_error()

    def sample(self) -> tuple[int, ...]:
        """The six ADC words at the present crest; once per period, for the noise goes on."""
        check(self._lib.zh_plant_sample(self._open_handle(), self._words))
        return tuple(self._words)

    def advance(self, duties: Sequence[float], gates_on: bool, brake_on: bool = False) -> None:
        """To the next crest. These duties act from there on, gates and brake at once."""
        where = "Plant.advance"
        try:
            if len(duties) != 3:
                raise UserError(f"{where}: duties: are {len(duties)}; give three")
            given = (c_double * 3)(*duties)
        except TypeError:
            arguments.refuse(where, "duties", duties, "three numbers of 0 .. 1")
        gates = arguments.level(where, "gates_on", gates_on)
        brake = arguments.level(where, "brake_on", brake_on)
        check(self._lib.zh_plant_advance(self._open_handle(), given, gates, brake))

    def truth(self) -> Truth:
        """True quantities at the present crest."""
        raw = self._truth
        check(self._lib.zh_plant_look(self._open_handle(), byref(raw)))
        return Truth(bool(raw.diverged), *(getattr(raw, n) for n in TRUTH_NAMES[1:]))

    def disturb(
        self,
        *,
        load_torque_Nm: float | None = None,
        rs_factor: float | None = None,
        rr_factor: float | None = None,
        u_dc_V: float | None = None,
    ) -> None:
        """Set what acts on the rig from now on; the factors are true resistances over the rig's."""
        given = {"load_torque_Nm": load_torque_Nm, "rs_factor": rs_factor}
        given |= {"rr_factor": rr_factor, "u_dc_V": u_dc_V}
        for name, value in given.items():
            if value is not None:
                given_value = arguments.number("Plant.disturb", name, value)
                check(self._lib.zh_plant_set(self._open_handle(), name.encode(), given_value))

    def reseed(self, seed: int) -> None:
        """Continue the sensors' noise from another seed."""
        check(self._lib.zh_plant_reseed(self._open_handle(), _seed("Plant.reseed", seed)))

    def snapshot(self) -> PlantSnapshot:
        """The whole state, time and noise too; for this process only."""
        return PlantSnapshot(self._lib.zh_plant_copy(self._open_handle()))

    def restore(self, snapshot: PlantSnapshot) -> None:
        """Continue from a snapshot, bit for bit.

        It may come from another Plant, if that was opened with the same files and overrides.
        """
        if not isinstance(snapshot, PlantSnapshot):
            raise UserError("Plant.restore: snapshot: give what snapshot() returned")
        check(self._lib.zh_plant_restore(self._open_handle(), snapshot._open_handle()))

    def run(
        self,
        drive: Drive,
        periods: int,
        *,
        speed_ref_rpm: npt.ArrayLike = 0.0,
        torque_ref_Nm: npt.ArrayLike | None = None,
        run: npt.ArrayLike = True,
        fault_reset: npt.ArrayLike = False,
        torque_off: npt.ArrayLike = False,
        commission: npt.ArrayLike = False,
        signals: Sequence[str] = (),
    ) -> Run:
        """Run both for so many periods; references and commands as of Drive.run."""
        where = "Plant.run"
        if not isinstance(drive, Drive):
            arguments.refuse(where, "drive", drive, "a Drive")
        periods = arguments.whole(where, "periods", periods, 0, MAX_PERIODS)
        rows = inputs(where, None, speed_ref_rpm, torque_ref_Nm,
                      run, fault_reset, torque_off, commission, count=periods)  # fmt: skip
        recording = Recording(where, signals, periods)
        out = outputs(periods)
        truth = np.zeros(periods, dtype=TRUTH)
        truth["struct_size"] = TRUTH.itemsize
        status = self._lib.zh_plant_run(
            self._open_handle(),
            drive._open_handle(),
            rows.ctypes.data,
            out.ctypes.data,
            truth.ctypes.data,
            periods,
            recording.pointer,
        )
        check(status)
        if periods > 1 and abs(truth["t_s"][1] - truth["t_s"][0] - drive["period_s"]) > 1e-9:
            raise UserError(
                f"{where}: drive: its period is {drive['period_s']:g} s, the plant's another one; "
                "open both with the same board"
            )
        return Run(recording.joined(out), truth[list(TRUTH_NAMES)])


def _seed(where: str, seed: int) -> int:
    return arguments.whole(where, "seed", seed, 0, 2**64 - 1, "0 .. 2^64 - 1")
