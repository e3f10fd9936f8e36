"""Combined faults at the terminals of a hoist, at random moments.

Judged by the plant: the brake's coil is energised only against torque and never stays so without
gates; the contactor's coil drops only without gates and current; nothing is commissioned.
"""

from __future__ import annotations

import random

import pytest
from hoist import LOAD_NM, Hoist

from zerohertz.drive import State
from zerohertz.terminals import Input
from zerohertz.terminals import Output as Relay

RATED_V = 283.0
LEAST_NM = 0.75 * LOAD_NM  # of the plant; .9 of the estimate are proven
NO_CURRENT_A = 0.6
LATE_S = 2.5e-3  # two looks of the terminals
DURATIONS_S = (0.001, 0.003, 0.006, 0.02, 0.1, 0.5)


class Attacked(Hoist):
    """With contactor, and what may never happen."""

    def __init__(self, seed: int) -> None:
        self.chance = random.Random(seed)
        supply = {"precharge": "on", "precharge_ready_V": 200.0, "contactor_feedback": "on"}
        load_Nm = LOAD_NM * self.chance.choice((0.0, 0.5, 1.0, 1.3))
        super().__init__(load_Nm, rs_measure=False, **supply)
        self.auxiliary_wire = True
        self.closed_pu = self.without_gates_s = 0.0
        self.releases = self.openings = 0

    def watch(self, duration_s: float) -> None:
        for _ in range(round(duration_s / self.dt_s)):
            self._period()

    def _period(self) -> None:
        relays, before = self.seen().outputs, self.plant.truth()
        self.closed_pu += self.dt_s / 0.03 * (1.0 if relays & Relay.CONTACTOR else -1.0)
        self.closed_pu = min(1.0, max(0.0, self.closed_pu))
        closed = self.closed_pu > 0.5 and self.auxiliary_wire
        self.contacts &= ~Input.CONTACTOR_ON
        self.contacts |= Input.CONTACTOR_ON if closed else Input(0)
        gates_on = self.out.gates_on if hasattr(self, "out") else False
        out = self.step()
        rising, falling = self.seen().outputs & ~relays, relays & ~self.seen().outputs
        if rising & Relay.BRAKE_RELEASE:
            self.releases += 1
            assert gates_on
            assert before.torque_Nm > LEAST_NM
        if falling & Relay.CONTACTOR:
            self.openings += 1
            assert not gates_on
            assert before.i_peak_A < NO_CURRENT_A
        self.without_gates_s = 0.0 if out.gates_on else self.without_gates_s + self.dt_s
        assert self.without_gates_s < LATE_S or not self.seen().outputs & Relay.BRAKE_RELEASE
        assert out.state != State.COMMISSIONING

    def hurt(self) -> None:
        """One thing goes wrong, and most of them pass."""
        duration_s = self.chance.choice(DURATIONS_S)
        kind = self.chance.randrange(9)
        if kind < 2:
            self.contacts &= ~Input.START
        elif kind == 2:
            self.plant.disturb(u_dc_V=self.chance.uniform(20.0, 200.0))
        elif kind == 3:
            self.brake.stuck = True
        else:
            self.feedback_wire = kind != 4
            self.auxiliary_wire = kind != 5
            options = {6: "torque_off", 7: "commission", 8: "fault_reset"}
            self.step_options = {options[kind]: True} if kind in options else {}
        self.watch(duration_s)
        self.plant.disturb(u_dc_V=RATED_V)
        self.brake.stuck = False
        self.feedback_wire = self.auxiliary_wire = True
        self.step_options = {}

    def lift_and_suffer(self) -> None:
        self.contacts = Input.RESET
        self.watch(0.05)
        self.contacts = Input(0)
        self.watch(self.chance.choice((0.1, 0.4)))
        self.contacts |= Input.START
        self.watch(self.chance.choice((0.3, 1.6, 1.6)) * self.chance.random())
        self.hurt()
        self.watch(0.15 * self.chance.random())
        self.hurt()
        self.watch(self.chance.choice((0.1, 0.4)))


@pytest.mark.parametrize("seed", range(4))
def test_no_brake_releases_without_torque_and_no_contactor_opens_under_load(seed: int) -> None:
    hoist = Attacked(seed)
    for _ in range(7):
        hoist.lift_and_suffer()
    assert hoist.releases + hoist.openings > 0
