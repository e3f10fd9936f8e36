"""Random frames on the CAN line of a drive in closed loop: no duty may differ from the same run
without them. They are frames that python-canopen's dictionary, as reference, takes for no legal
write, and any frames while the bus is disabled. As a campaign: `tools/zh campaign fieldbus`.
"""

from __future__ import annotations

import math
import random
import struct
import sys
from collections.abc import Callable, Iterator

import canopen
import pytest
from canopen.objectdictionary import ODArray, ODRecord, ODVariable

from zerohertz.image import canopen_eds
from zerohertz.link.client import RUN, Client
from zerohertz.link.command import sil_job
from zerohertz.link.server import DirectLine, LinkedDrive

FRAMES = 60_000
NODE = 1
BLOCK = 2500  # periods, .5 s, in which the master speaks once
SETTINGS = ("fieldbus_timeout_s=2.5", "command_timeout_s=0")
SDO, COMMANDS, PDOS = 0x600 + NODE, (1, 2, 128, 129, 130), (0x200 + NODE, 0x300 + NODE)
_EDS = canopen.import_od(str(canopen_eds.PAGE), NODE)
Frame = tuple[int, bytes]


def entry(index: int, sub: int) -> ODVariable | None:
    """Of the reference's dictionary."""
    found = _EDS.get(index)
    if isinstance(found, ODRecord | ODArray):
        found = found.subindices.get(sub)
    elif sub != 0:
        return None
    return found


def legal_write(frame: Frame) -> bool:
    """What the reference takes for something that could change the drive."""
    number, data = frame
    if number == 0:
        return len(data) >= 2 and data[0] in COMMANDS and data[1] in (0, NODE)
    if number in PDOS:
        return True
    if number != SDO or len(data) != 8 or data[0] >> 5 != 1:
        return False
    index, sub = struct.unpack_from("<HB", data, 1)
    found = entry(index, sub)
    if found is None or not found.writable:
        return False
    size = 4 - (data[0] >> 2 & 3) if data[0] & 1 else 4
    # In segments the value comes later: such a download is not begun here.
    return not data[0] & 2 or size == len(found) // 8


def transmissions(seed: int) -> Iterator[Frame]:
    """Noise, frames of other nodes, and requests of all kinds."""
    chance = random.Random(seed)
    makers = (_noise, _noise, _sdo, _sdo, _sdo, _network, _short, _elsewhere)
    while True:
        yield chance.choice(makers)(chance)


def _noise(chance: random.Random) -> Frame:
    return chance.randrange(0x800), chance.randbytes(chance.randrange(9))


def _sdo(chance: random.Random) -> Frame:
    known = chance.choice(_INDICES) if chance.random() < 0.7 else chance.randrange(0x10000)
    sub = chance.choice((0, 0, 1, 2, chance.randrange(256)))
    head = chance.choice((0x40, 0x60, 0x2F, 0x2B, 0x23, 0x20, 0x80, chance.randrange(256)))
    return SDO, struct.pack("<BHB", head, known, sub) + chance.randbytes(4)


def _network(chance: random.Random) -> Frame:
    return 0, bytes((chance.randrange(256), chance.randrange(128)))[: chance.randrange(1, 3)]


def _short(chance: random.Random) -> Frame:
    number, data = _sdo(chance)
    return number, data[: chance.randrange(8)]


def _elsewhere(chance: random.Random) -> Frame:
    base = chance.choice((0x80, 0x180, 0x200, 0x580, 0x600, 0x700))
    return base + chance.randrange(2, 128), chance.randbytes(8)


_INDICES = sorted(_EDS)


def say(drive: LinkedDrive, number: int, data: bytes) -> None:
    drive.can_put(number, data)
    drive.run(2)


def block(drive: LinkedDrive, frames: Iterator[Frame] | None, any_frame: bool) -> int:
    """So many periods, with a frame in each while they last; how many."""
    if frames is None:
        drive.run(BLOCK)
        return 0
    count = 0
    while count < BLOCK:
        frame = next(frames)
        if any_frame or not legal_write(frame):
            drive.can_put(*frame)
            count += 1
    drive.run(BLOCK)
    drive.can_take()
    return count


def run_on_bus(blocks: int, frames: Iterator[Frame] | None) -> tuple[LinkedDrive, int]:
    """A master holds 60 min^-1 by its PDO, which it repeats every half second."""
    drive = LinkedDrive(sil_job("recommended", "0", ["fieldbus_commands=1", *SETTINGS]))
    drive.can_take()
    drive.run(6000)
    say(drive, 0, bytes((1, 0)))
    for word in (0x06, 0x07):
        say(drive, PDOS[0], struct.pack("<Hh", word, 60))
    count = 0
    for _ in range(blocks):
        say(drive, PDOS[0], struct.pack("<Hh", 0x7F, 60))
        count += block(drive, frames, any_frame=False)
    return drive, count


def run_on_host(blocks: int, frames: Iterator[Frame] | None) -> tuple[LinkedDrive, int]:
    """The host holds 60 min^-1; the bus is disabled."""
    drive = LinkedDrive(sil_job("recommended", "0", SETTINGS))
    drive.can_take()
    drive.run(6000)
    Client(DirectLine(drive, 5), timeout_s=60.0).command(RUN, 60.0 * math.pi / 30.0)
    return drive, sum(block(drive, frames, any_frame=True) for _ in range(blocks))


Run = Callable[[int, Iterator[Frame] | None], tuple[LinkedDrive, int]]


def compare(run: Run, count: int, seed: int) -> str:
    """At least `count` frames; AssertionError when a duty differs."""
    blocks = max(12, math.ceil(count / BLOCK))
    talked, sent = run(blocks, transmissions(seed))
    quiet, none = run(blocks, None)
    assert none == 0
    assert sent >= count
    assert talked.state == quiet.state
    assert talked.state.gates_on
    assert talked.state.speed_rpm == pytest.approx(60.0, abs=3.0)
    return f"{run.__name__}: {sent} frames, {talked.state.periods} periods: the same duties"


@pytest.mark.parametrize("run", [run_on_bus, run_on_host], ids=["rejected", "disabled"])
def test_random_frames_change_no_duty(run: Run) -> None:
    print(compare(run, FRAMES // 2, seed=1))


def test_a_legal_write_is_noticed() -> None:
    """The comparison is worth something: one PDO with another speed, and the runs differ."""
    written = (PDOS[0], struct.pack("<Hh", 0x7F, 70))
    assert legal_write(written)
    drives = [run_on_bus(12, None)[0] for _ in range(2)]
    drives[0].can_put(*written)
    for drive in drives:
        drive.run(BLOCK)
    assert drives[0].state.digest != drives[1].state.digest


def test_the_reference_tells_what_is_a_legal_write() -> None:
    legal = (
        (0, bytes((1, 0))),
        (SDO, struct.pack("<BHBI", 0x2B, 0x6040, 0, 6)),
        (SDO, struct.pack("<BHBI", 0x21, 0x6042, 0, 2)),
        (PDOS[1], b""),
    )
    illegal = (
        (0, bytes((1, 2))),
        (SDO, struct.pack("<BHBI", 0x40, 0x6040, 0, 6)),
        (SDO, struct.pack("<BHBI", 0x23, 0x6040, 0, 6)),
        (SDO, struct.pack("<BHBI", 0x2B, 0x6041, 0, 6)),
        (SDO, struct.pack("<BHB", 0x2B, 0x6040, 0)),
        (0x602, struct.pack("<BHBI", 0x2B, 0x6040, 0, 6)),
    )
    assert all(map(legal_write, legal))
    assert not any(map(legal_write, illegal))


if __name__ == "__main__":
    for way in (run_on_bus, run_on_host):
        print(compare(way, int(sys.argv[1]) // 2, int(sys.argv[2])), flush=True)
