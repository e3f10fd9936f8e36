"""A master like a PLC's drives random traffic and judges every answer and state. No command is
lost, no state is undefined. Here 60 s of the drive's time on each bus; as a campaign an hour:
`tools/zh campaign fieldbus`.
"""

from __future__ import annotations

import random
import struct
import sys

import pytest

from zerohertz.drive import State
from zerohertz.image.bus_session import crc16
from zerohertz.link.command import sil_job
from zerohertz.link.server import LinkedDrive

SECONDS = 60.0
PERIOD_S, TIMEOUT_S, HEARTBEAT_S = 200e-6, 0.4, 0.2
SETTINGS = ("fieldbus_commands=1", f"fieldbus_timeout_s={TIMEOUT_S}", "stop_mode=1")
RAMPS = ("ramp_down_rad_s2=400", "speed_slew_rad_s2=200", "rs_measure=0", "flying_start=1")
STARTED_S, STOPPED_S, REACHED_S = 3.0, 3.0, 6.0
SPEEDS = range(150, 601, 50)  # min^-1
RUN, COAST, TORQUE_MODE, UNKNOWN = 1, 2, 4, 0x100
DISABLED, READY, ON, ENABLED, QUICK = 0x40, 0x21, 0x23, 0x27, 0x07
# Control word -> from each state, as CiA 402 has it; others stay.
WORDS = {
    0x06: {DISABLED: READY, ON: READY, ENABLED: READY},
    0x07: {READY: ON, ENABLED: ON},
    0x7F: {READY: ENABLED, ON: ENABLED},
    0x02: {READY: DISABLED, ON: DISABLED, ENABLED: QUICK},
    0x00: {READY: DISABLED, ON: DISABLED, ENABLED: DISABLED, QUICK: DISABLED},
}


class Master:
    """What both masters know of their drive: since when it is to run, and how fast."""

    def __init__(self, seed: int) -> None:
        self.drive = LinkedDrive(sil_job("recommended", "0", [*SETTINGS, *RAMPS]))
        self.chance = random.Random(seed)
        self.runs, self.speed = False, 0
        self.changed_s = self.ordered_s = 0.0  # run or not; the speed
        self.judged = self.commands = 0

    @property
    def now_s(self) -> float:
        return self.drive.state.time_s

    def run(self, runs: bool) -> None:
        if runs != self.runs:
            self.runs, self.changed_s, self.ordered_s = runs, self.now_s, self.now_s

    def order(self, speed: int) -> None:
        if speed != self.speed:
            self.speed, self.ordered_s = speed, self.now_s

    def judge(self, state: int) -> None:
        """Of the drive's state machine, against what it was told."""
        self.judged += 1
        true = self.drive.state
        stands = self.now_s - self.changed_s
        assert state in {s.value for s in State} - {State.FAULT, State.COMMISSIONING}, state
        if self.runs and stands > STARTED_S:
            assert state == State.RUN
            assert true.gates_on
        if not self.runs and stands > STOPPED_S:
            assert state in (State.READY, State.TORQUE_OFF)
            assert not true.gates_on
        if (
            state == State.RUN
            and self.runs
            and self.now_s - max(self.ordered_s, self.changed_s + STARTED_S) > REACHED_S
        ):
            assert true.speed_rpm == pytest.approx(self.speed, abs=15.0)


class ModbusMaster(Master):
    """Registers 0 and 1; time-outs, refusals, reads between."""

    def __init__(self, seed: int) -> None:
        super().__init__(seed)
        self.armed, self.control, self.heard_s = False, 0, 0.0
        self.blocked = False  # behind torque-off run has to drop or be low once
        self.drive.modbus(b"")
        self.drive.run(6000)

    def ask(self, pdu: bytes, address: int = 1) -> bytes:
        frame = bytes((address,)) + pdu
        self.drive.modbus(frame + crc16(frame).to_bytes(2, "little"))
        self.drive.run(60)
        said = self.drive.modbus()
        return said[1:-2]

    def expire(self) -> None:
        """What silence has done; not asked in the moment in which it does it."""
        silence_s = self.now_s - self.heard_s
        if abs(silence_s - TIMEOUT_S) < 0.05:
            self.drive.run(round(0.1 / PERIOD_S))
        if self.now_s - self.heard_s > TIMEOUT_S and self.control & RUN:
            self.control &= ~RUN
            self.armed = self.blocked = False
            self.run(False)

    def write(self, address: int, value: int, broadcast: bool) -> None:
        self.expire()
        pdu = struct.pack(">BHH", 6, address, value)
        wrong = self.refusal(address, value)
        said = self.ask(pdu, 0 if broadcast else 1)
        expected = pdu if wrong == 0 else bytes((0x86, wrong))
        assert said == (b"" if broadcast else expected), (address, value)
        if wrong == 0:
            self.commands += 1
            self.armed, self.heard_s = True, self.now_s
            if address == 0:
                coasted = bool((self.control | value) & COAST)
                self.blocked = bool(value & RUN) and (self.blocked or coasted)
                self.control = value
                self.run(bool(value & RUN) and not self.blocked)
            else:
                self.order(value)

    def refusal(self, address: int, value: int) -> int:
        if value == UNKNOWN if address == 0 else value > 10_000:
            return 3
        runs = value if address == 0 else self.control
        return 4 if runs & RUN and not self.armed else 0

    def look(self) -> None:
        self.expire()
        control, speed = struct.unpack(">HH", self.ask(struct.pack(">BHH", 3, 0, 2))[2:])
        assert (control, speed) == (self.control, self.speed)
        gates = {self.drive.state.gates_on}
        words = struct.unpack(">8H", self.ask(struct.pack(">BHH", 4, 0, 8))[2:])
        assert words[6:] == (0, 0)  # faults
        assert bool(words[0] & 2) in gates | {self.drive.state.gates_on}
        if self.control & COAST:
            assert words[5] == State.TORQUE_OFF
        self.judge(words[5])

    def step(self) -> None:
        broadcast = self.chance.random() < 0.1
        match self.chance.randrange(8):
            case 0:
                word = self.chance.choice((0, COAST, RUN | COAST, UNKNOWN, RUN))
                self.write(0, word, broadcast)
            case 1 | 2:
                self.write(0, RUN, broadcast)
            case 3:
                self.write(1, self.chance.choice((*SPEEDS, 30_000)), broadcast)
            case 4:
                self.drive.run(self.chance.randrange(round(2 * TIMEOUT_S / PERIOD_S)))
            case 5:
                for _ in range(self.chance.randrange(60)):
                    self.write(0, self.control, broadcast=False)
                    self.drive.run(round(0.15 / PERIOD_S))
            case _:
                self.drive.modbus(self.chance.randbytes(self.chance.randrange(20)))
                self.drive.run(200)
                self.drive.modbus()
        self.look()


class CanMaster(Master):
    """Control words and speeds by SDO and PDO, a heartbeat that fails at times."""

    def __init__(self, seed: int) -> None:
        super().__init__(seed)
        self.may_be = {DISABLED}
        self.drive.can_take()
        self.drive.run(6000)
        self.put(0, bytes((1, 0)))
        assert self.sdo(0x23, 0x1016, 1, 100 << 16 | round(HEARTBEAT_S * 1000))[0] == 0x60

    def put(self, number: int, data: bytes) -> list[tuple[int, bytes]]:
        self.drive.can_put(number, data)
        self.drive.run(4)
        return self.drive.can_take()

    def sdo(self, head: int, index: int, sub: int, value: int = 0) -> bytes:
        said = self.put(0x601, struct.pack("<BHBI", head, index, sub, value))
        return next(data for number, data in said if number == 0x581)

    def wait(self, s: float, beats: bool = True) -> None:
        for _ in range(max(1, round(s / 0.05))):
            if beats:
                self.drive.can_put(0x700 + 100, b"\x05")
            self.drive.run(round(0.05 / PERIOD_S))
        self.drive.can_take()

    def tell(self, word: int, speed: int) -> None:
        self.commands += 1
        by_pdo = self.chance.random() < 0.5
        if by_pdo:
            self.put(0x201, struct.pack("<HH", word, speed))
        else:
            assert self.sdo(0x2B, 0x6042, 0, speed)[0] == 0x60
            assert self.sdo(0x2B, 0x6040, 0, word)[0] == 0x60
        self.order(speed)
        self.may_be = {WORDS[word].get(state, state) for state in self.may_be}
        self.run(ENABLED in self.may_be)

    def look(self) -> None:
        """The state of CiA 402 is one that the commands lead to, the drive does what it says."""
        status = int.from_bytes(self.sdo(0x40, 0x6041, 0)[4:6], "little")
        state = status & (0x4F if status & 0x48 else 0x6F)
        if QUICK in self.may_be:
            self.may_be.add(DISABLED)  # at standstill
        assert state in self.may_be, (hex(status), self.may_be)
        self.may_be = {state}
        index = 0x3000 + STATE_SIGNAL
        self.judge(int.from_bytes(self.sdo(0x40, index, 0)[4:8], "little"))
        assert int.from_bytes(self.sdo(0x40, 0x603F, 0)[4:6], "little") == 0

    def step(self) -> None:
        match self.chance.randrange(6):
            case 0 | 1:
                for word in (0x00, 0x06, 0x07, 0x7F):
                    self.tell(word, self.chance.choice(SPEEDS))
                    self.wait(0.05)
            case 2 | 3:
                self.tell(self.chance.choice((*WORDS, 0x7F)), self.chance.choice(SPEEDS))
            case 4:
                self.wait(self.chance.uniform(0.05, 9.0))
            case _:
                self.wait(HEARTBEAT_S + 0.1, beats=False)
                if self.may_be == {ENABLED}:
                    self.may_be = {QUICK}
                    self.run(False)
        self.wait(0.05)
        self.look()


def _state_signal() -> int:
    from zerohertz.image.fieldbus_list import signals

    return next(n for n, signal in enumerate(signals()) if signal.name == "state")


STATE_SIGNAL = _state_signal()


def drive_for(kind: type[ModbusMaster | CanMaster], seconds: float, seed: int) -> str:
    """Random traffic for so long of the drive's time; AssertionError at the first wrong answer."""
    master = kind(seed)
    while master.now_s < seconds:
        master.step()
    name = kind.__name__
    return f"{name}: {master.now_s:.0f} s, {master.commands} commands, {master.judged} judged: good"


@pytest.mark.parametrize("kind", [ModbusMaster, CanMaster], ids=["modbus", "canopen"])
def test_random_traffic_loses_no_command(kind: type[ModbusMaster | CanMaster]) -> None:
    print(drive_for(kind, SECONDS, seed=1))


if __name__ == "__main__":
    for master_kind in (ModbusMaster, CanMaster):
        print(drive_for(master_kind, float(sys.argv[1]), int(sys.argv[2])), flush=True)
