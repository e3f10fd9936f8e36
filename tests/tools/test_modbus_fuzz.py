"""Random frames on the Modbus line of a drive in closed loop; not one duty may differ from the same
run without them: frames that pymodbus, as reference, does not take for a legal write, and any
frames while the bus is disabled. As a campaign: `tools/zh campaign fieldbus`.
"""

from __future__ import annotations

import logging
import math
import random
import struct
import sys
from collections.abc import Iterator

import pytest
from pymodbus.framer.rtu import FramerRTU
from pymodbus.pdu import DecodePDU
from pymodbus.pdu.register_message import (
    WriteMultipleRegistersRequest,
    WriteSingleRegisterRequest,
)

from zerohertz.link.client import RUN, Client
from zerohertz.link.command import sil_job
from zerohertz.link.server import DirectLine, LinkedDrive

FRAMES = 100_000
BLOCK = 5000  # periods from one command of the master to the next, 1 s
CHARACTER_PERIODS = 96e-6 / 200e-6  # 115 200 baud
SILENCE_PERIODS = 12
RPM_MOST = 5000.0  # beyond speed_max_rad_s of any drive
READ_ONLY = range(1000, 1200)  # motor and board
_DECODER = DecodePDU(True)
logging.getLogger("pymodbus.logging").setLevel(logging.CRITICAL)
SETTINGS = ("fieldbus_timeout_s=2.5", "command_timeout_s=0")


def crc(data: bytes) -> bytes:
    return FramerRTU.compute_CRC(data).to_bytes(2, "big")


def framed(pdu: bytes, address: int = 1) -> bytes:
    return bytes((address,)) + pdu + crc(bytes((address,)) + pdu)


def legal_write(frame: bytes) -> bool:
    """What the reference takes for a write that could change something."""
    if not 4 <= len(frame) <= 256 or frame[0] > 1 or crc(frame[:-2]) != frame[-2:]:
        return False
    pdu = frame[1:-2]
    try:
        request = _DECODER.decode(pdu)
    except Exception:  # the reference rejects it, however it says so
        return False
    if isinstance(request, WriteSingleRegisterRequest):
        return len(pdu) == 5 and _changes(request.address, request.registers)
    if isinstance(request, WriteMultipleRegistersRequest):
        whole = len(pdu) == 6 + 2 * len(request.registers) == 6 + pdu[5]
        return whole and len(request.registers) == request.count and _changes_any(request)
    return False


def _changes_any(request: WriteMultipleRegistersRequest) -> bool:
    return bool(request.registers) and _changes(request.address, request.registers)


def _changes(address: int, values: list[int]) -> bool:
    """Unless it is surely refused."""
    if address >= 6:
        return 1200 <= address < 3000
    if address == 0 and values[0] & ~0x87:
        return False
    if address == 1 and abs(struct.unpack(">h", struct.pack(">H", values[0]))[0]) > RPM_MOST:
        return False
    return address + len(values) <= 6


def transmissions(seed: int) -> Iterator[bytes]:
    """Noise, damaged and cut frames, other addresses, reads, and writes of all kinds."""
    chance = random.Random(seed)
    makers = (_noise, _request, _request, _write, _write, _damaged, _cut, _elsewhere)
    while True:
        yield chance.choice(makers)(chance)


def _noise(chance: random.Random) -> bytes:
    return chance.randbytes(chance.choice((1, 3, 8, 20, 60, 300)))


def _request(chance: random.Random) -> bytes:
    function = chance.choice((3, 4, 3, 4, 8, chance.randrange(256)))
    address = chance.choice((0, 1000, chance.randrange(2300), chance.randrange(65536)))
    count = chance.choice((1, 2, 16, chance.randrange(1, 126), chance.randrange(65536)))
    return framed(struct.pack(">BHH", function, address, count), chance.randrange(2))


def _write(chance: random.Random) -> bytes:
    address = chance.choice((0, 1, 2, 4, chance.randrange(8), chance.choice(READ_ONLY)))
    if chance.random() < 0.5:
        pdu = struct.pack(">BHH", 6, address, chance.choice((0, 1, 7, chance.randrange(65536))))
    else:
        n = chance.choice((1, 2, 2, 6, chance.randrange(124)))
        size = chance.choice((2 * n, 2 * n, chance.randrange(256)))
        pdu = struct.pack(">BHHB", 16, address, n, size) + chance.randbytes(2 * n)
    return framed(pdu[:250], chance.randrange(2))


def _damaged(chance: random.Random) -> bytes:
    frame = bytearray(_write(chance))
    for _ in range(chance.randrange(1, 4)):
        frame[chance.randrange(len(frame))] ^= 1 << chance.randrange(8)
    return bytes(frame)


def _cut(chance: random.Random) -> bytes:
    frame = _write(chance)
    at = chance.randrange(1, len(frame))
    return frame[:at] if chance.random() < 0.5 else frame[at:]


def _elsewhere(chance: random.Random) -> bytes:
    return framed(_write(chance)[1:-2], chance.randrange(2, 256))


def periods_of(frame: bytes) -> int:
    return math.ceil(len(frame) * CHARACTER_PERIODS) + SILENCE_PERIODS


def block(drive: LinkedDrive, frames: Iterator[bytes] | None, any_frame: bool) -> int:
    """So many periods, as full of frames as they get; how many."""
    left, count = BLOCK, 0
    while frames is not None and left > 200:
        frame = next(frames)
        if any_frame or not legal_write(frame):
            drive.modbus(frame)
            drive.run(periods_of(frame))
            left -= periods_of(frame)
            count += 1
    drive.run(left)
    return count


def run_on_bus(blocks: int, frames: Iterator[bytes] | None) -> tuple[LinkedDrive, int]:
    """A master holds 60 min^-1 and says so every second."""
    drive = LinkedDrive(sil_job("recommended", "0", ["fieldbus_commands=1", *SETTINGS]))
    drive.run(8000)
    count = 0
    for k in range(blocks):
        for pdu in (struct.pack(">BHH", 6, 1, 60), struct.pack(">BHH", 6, 0, int(k > 0))):
            drive.modbus(framed(pdu))
            drive.run(60)
            assert drive.modbus().endswith(framed(pdu))
        count += block(drive, frames, any_frame=False)
    return drive, count


def run_on_host(blocks: int, frames: Iterator[bytes] | None) -> tuple[LinkedDrive, int]:
    """The host holds 60 min^-1; the bus is disabled."""
    drive = LinkedDrive(sil_job("recommended", "0", SETTINGS))
    drive.run(6000)
    Client(DirectLine(drive, 5), timeout_s=60.0).command(RUN, 60.0 * math.pi / 30.0)
    return drive, sum(block(drive, frames, any_frame=True) for _ in range(blocks))


def compare(run: object, count: int, seed: int) -> str:
    """Frames until there are `count`; AssertionError when a duty differs."""
    assert callable(run)
    frames, blocks = transmissions(seed), 3 + math.ceil(count / 150)
    talked, sent = run(blocks, frames)
    quiet, none = run(blocks, None)
    assert none == 0
    assert sent >= count
    assert talked.state == quiet.state
    assert talked.state.gates_on
    assert talked.state.speed_rpm == pytest.approx(60.0, abs=3.0)
    return f"{run.__name__}: {sent} frames, {talked.state.periods} periods: the same duties"


@pytest.mark.parametrize("run", [run_on_bus, run_on_host], ids=["rejected", "disabled"])
def test_random_frames_change_no_duty(run: object) -> None:
    print(compare(run, FRAMES // 2, seed=1))


def test_a_legal_write_is_noticed() -> None:
    """The comparison is worth something: one write of the speed, and the runs differ."""
    written = framed(struct.pack(">BHH", 6, 1, 70))
    assert legal_write(written)
    drives = [run_on_bus(6, None)[0] for _ in range(2)]
    drives[0].modbus(written)
    for drive in drives:
        drive.run(BLOCK)
    assert drives[0].state.digest != drives[1].state.digest


def test_the_reference_tells_what_is_a_legal_write() -> None:
    legal = (struct.pack(">BHH", 6, 0, 1), struct.pack(">BHHBHH", 16, 2, 2, 4, 0, 0))
    illegal = (
        struct.pack(">BHH", 3, 0, 1),
        struct.pack(">BHH", 6, 0, 0x100),
        struct.pack(">BHH", 6, 1, 30000),
        struct.pack(">BHH", 6, 1000, 1),
        struct.pack(">BHHBH", 16, 0, 2, 4, 0),
    )
    assert all(legal_write(framed(pdu)) for pdu in legal)
    assert not any(legal_write(framed(pdu)) for pdu in illegal)
    assert not any(legal_write(framed(pdu, 2)) for pdu in legal)
    assert not any(legal_write(framed(pdu)[:-1]) for pdu in legal)


if __name__ == "__main__":
    for way in (run_on_bus, run_on_host):
        print(compare(way, int(sys.argv[1]) // 2, int(sys.argv[2])))
