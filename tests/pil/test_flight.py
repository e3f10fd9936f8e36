"""The flight recorder on the emulated image: what it recorded, run again on the host.

The image drives the plant. Every signal of every period, as the image said it, is compared with the
replay of what its recorder gave over the link.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from zerohertz import sim
from zerohertz.build import build_image
from zerohertz.drive import Fault, State
from zerohertz.flight.file import Ending, Flight, FlightWriter
from zerohertz.flight.last_seconds import LastSeconds
from zerohertz.flight.record import Progress, Recorded, Recording, start
from zerohertz.flight.replay import replay, signal_numbers
from zerohertz.image import loop
from zerohertz.image.emulator import StepLine
from zerohertz.image.loop import Inject
from zerohertz.link.client import Client
from zerohertz.link.flight import ROW_BYTES
from zerohertz.scenario.setup import SCENARIOS, load_setup

PERIOD_S = 200e-6
RUN_ON_S, FAULT_S, DURATION_S = 2.4, 3.6, 12.0
LOCKED_S = 1.05  # from power-up, as against whoever tries keys
NEVER = 2**32 - 1
KEEP_S = 0.5
ANSWER_BYTES = 20 * ROW_BYTES


def failing_job() -> sim.Job:
    """Runs up, is loaded, and loses a current sensor."""
    setup = load_setup("recommended")
    return sim.Job(
        scenario=SCENARIOS / "smoke.toml",
        scenario_overrides={
            "scenario.duration_s": DURATION_S,
            "scenario.run_on_s": RUN_ON_S,
            "profiles.speed_ref_rpm": [[0.0, 0.0], [2.8, 0.0], [3.1, 300.0]],
            "profiles.load_torque_Nm": [[0.0, 0.0], [3.2, 0.0], [3.3, 2.0]],
            "faults.sensor": "i_u",
            "faults.kind": "fixed",
            "faults.severity": 1.0,
            "faults.start_s": FAULT_S,
        },
        rig=setup.rig,
        board=setup.board,
        motor_dir=setup.motor_dir,
        firmware_config=setup.params,
        firmware={"rs_measure": 0.0, "premagnetise_s": 0.3},
        decimate=1_000_000,
    )


class Flown:
    """A run of the image, what its recorder gave, and what it said itself."""

    def __init__(self, folder: Path) -> None:
        self.file, words = folder / "image.flight", folder / "words"
        self.recorded: Recorded | None = None
        self.error = ""
        # A recorder starts the drive anew, which the SIL beside the image does not do. An injection
        # that never comes lets the two go their own ways.
        self.run = loop.run(
            failing_job(),
            build_image("qemu_mps2"),
            beside=self._record,
            link_frames=None,
            inject=Inject.TRACE,
            inject_at=NEVER,
            words=words,
        )
        said = np.fromfile(words, np.uint32).reshape(-1, len(signal_numbers()))
        state = said[:, signal_numbers()["state"]]
        # In the period that starts the drive anew it says BOOT: the recording begins behind it.
        anew = np.flatnonzero((state[1:] == State.BOOT) & (state[:-1] == State.READY)) + 2
        self.first = int(anew[0]) if len(anew) else len(said)
        self.said = said[self.first :]

    def _record(self, socket: Path) -> None:
        try:
            with Client(StepLine(socket.parent), timeout_s=300.0) as drive:
                while drive.status().period < LOCKED_S / PERIOD_S:
                    pass
                head, first = start(drive, 60.0, print)
                recording = Recording(drive, FlightWriter(self.file, head), head, first)
                self.recorded = recording.run(self._going_on, 0.05)
        except Exception as error:
            self.error = repr(error)

    def _going_on(self, progress: Progress) -> bool:
        return progress.periods * PERIOD_S < DURATION_S


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> Flown:
    return Flown(tmp_path_factory.mktemp("flight"))


def test_the_replay_of_the_images_flight_has_no_differing_bit(flown: Flown) -> None:
    assert flown.error == ""
    flight = Flight.read(flown.file)
    assert flight.ending is Ending.FAULT
    assert flown.first < RUN_ON_S / PERIOD_S
    assert flown.first + flight.periods > FAULT_S / PERIOD_S
    again = replay(flight)
    assert (again.ended, again.periods) == ("", flight.periods)
    words = np.column_stack([column.view(np.uint32) for column in again.signals.values()])
    differing = words ^ flown.said[: len(words)]
    assert int(np.bitwise_count(differing).sum()) == 0
    assert set(np.unique(again.signals["state"])) >= {State.RUN, State.FAULT}
    assert again.first_fault & (Fault.OVER_CURRENT | Fault.CURRENT_SENSOR | Fault.CURRENT_SUM)
    print(f"{words.size * 32} bits of {again.periods} periods compared")


def test_the_last_seconds_of_the_images_flight_have_no_differing_bit(
    flown: Flown, tmp_path: Path
) -> None:
    """As they would have been kept: the rows in the portions of the link."""
    whole, file = Flight.read(flown.file), tmp_path / "last.flight"
    kept = LastSeconds(file, whole.head, KEEP_S)
    rows = whole.rows.tobytes()
    for at in range(0, len(rows), ANSWER_BYTES):
        kept.put(rows[at : at + ANSWER_BYTES])
    kept.close(Ending.FAULT, 0)
    assert kept.objection == ""
    last = Flight.read(file)
    assert last.head.middle is not None
    first = last.head.middle.dropped_periods
    assert first + last.periods == whole.periods
    again = replay(last)
    assert (again.ended, again.differs) == ("", False)
    assert KEEP_S <= (again.fault_period + 1) * PERIOD_S <= 1.5 * KEEP_S
    words = np.column_stack([column.view(np.uint32) for column in again.signals.values()])
    differing = words ^ flown.said[first : first + len(words)]
    assert int(np.bitwise_count(differing).sum()) == 0
    print(f"{words.size * 32} bits of the last {again.periods} periods compared")


def test_the_digests_in_the_flight_agree_with_the_replay(flown: Flown) -> None:
    again = replay(Flight.read(flown.file), [])
    assert not again.differs
    assert again.checks == again.periods // 256 > 0
    assert again.equal_periods == again.checks * 256


def test_no_period_of_the_recording_is_late(flown: Flown) -> None:
    assert flown.run.late_periods == 0
