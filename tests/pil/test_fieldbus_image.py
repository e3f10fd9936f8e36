"""Fieldbuses of the image on the emulated core: the drive runs as the SIL's, bit for bit, and
answers its master as the SIL's does."""

from __future__ import annotations

import numpy as np
import pytest

from zerohertz.build import build_image
from zerohertz.drive import State
from zerohertz.image.bus_session import (
    BEATS_END_S,
    HEARTBEAT_S,
    PERIOD_US,
    SESSIONS,
    TIMEOUT_S,
    Said,
)
from zerohertz.image.loop import End

LAST_RUN_S = {"modbus": 6.8, "canopen": BEATS_END_S - 0.05}  # before the silence
PATIENCE_S = {"modbus": TIMEOUT_S, "canopen": HEARTBEAT_S}
# What does not depend on the moment: not the PDOs, which carry the speed.
ANSWERS = {"modbus": {0}, "canopen": {0x581, 0x701, 0x81}}


@pytest.mark.parametrize("bus", SESSIONS)
def test_a_master_commands_the_image_and_no_bit_differs(bus: str) -> None:
    session = SESSIONS[bus]()
    run, said = session.on_the_image(build_image("qemu_mps2_fieldbus"))
    assert (run.end, run.differing_bits) == (End.EQUAL, 0)
    assert run.periods == round(session.end_s * 1e6 / PERIOD_US)
    assert (run.late_periods, run.warned, run.gates_on) == (0, 0, False)

    def answers(heard: list[Said]) -> list[tuple[int, bytes]]:
        return [(s.number, s.data) for s in heard if s.number in ANSWERS[bus]]

    assert joined(answers(said)) == joined(answers(session.on_the_sil()))
    running = np.flatnonzero(run.each.state == State.RUN)
    assert len(running) > 4000
    # Silence ends the run within its time and some rounds of the background.
    stopped_s = (running[-1] + 1) * PERIOD_US * 1e-6
    late_s = stopped_s - LAST_RUN_S[bus] - PATIENCE_S[bus]
    assert -0.5e-6 * PERIOD_US < late_s < 0.02


def joined(answers: list[tuple[int, bytes]]) -> list[tuple[int, bytes]]:
    """The Modbus line has no frames of its own: what it carried in one."""
    line = b"".join(data for number, data in answers if number == 0)
    return [(0, line)] if line else answers


def test_an_image_with_fieldbuses_runs_as_the_sil_without_a_master() -> None:
    from zerohertz.image.command import Experiment, job_of
    from zerohertz.image.loop import run

    found = run(
        job_of(Experiment("fig17", "recommended"), 30_000), build_image("qemu_mps2_fieldbus")
    )
    assert (found.end, found.differing_bits, found.periods) == (End.EQUAL, 0, 30_000)
