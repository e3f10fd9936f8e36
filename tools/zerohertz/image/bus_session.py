"""A master's session, given beforehand: the same frames for the SIL drive and for the image."""

from __future__ import annotations

import dataclasses
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

    from zerohertz.image.loop import PilRun
    from zerohertz.link.server import LinkedDrive

PERIOD_US = 200
NODE, MASTER = 1, 100
_FRAME = struct.Struct("<IHBx8s")  # pil_frame_t of hal/qemu_mps2/pil_protocol.h
_SERIAL_BYTES = 8
TIMEOUT_S, HEARTBEAT_S = 0.4, 0.2
BEATS_END_S = 7.0
SETTINGS = (
    "fieldbus_commands=1",
    f"fieldbus_timeout_s={TIMEOUT_S}",
    "stop_mode=1",
    "ramp_down_rad_s2=100",
)


@dataclass(frozen=True)
class Said:
    """Something on the bus: a CAN frame, or bytes of the Modbus line (identifier 0)."""

    at_s: float
    number: int
    data: bytes


@dataclass(frozen=True)
class Session:
    """What a master says, in order of time, until `end_s`."""

    bus: str  # modbus or can
    said: tuple[Said, ...]
    end_s: float

    @property
    def files(self) -> dict[str, bytes]:
        """For the folder of the emulator."""
        return {f"{self.bus}_heard": b"".join(map(_packed, self.said))}

    def on_the_sil(self) -> list[Said]:
        """What the drive says to it in SIL."""
        with _sil_drive() as drive:
            heard: list[Said] = []
            take = self._modbus if self.bus == "modbus" else self._can
            take(drive)
            for said in self.said:
                heard += self._until(drive, said.at_s)
                if self.bus == "modbus":
                    drive.modbus(said.data)
                else:
                    drive.can_put(said.number, said.data)
            return heard + self._until(drive, self.end_s)

    def _until(self, drive: LinkedDrive, at_s: float) -> list[Said]:
        drive.run(round(at_s * 1e6 / PERIOD_US) - drive.state.periods)
        return (self._modbus if self.bus == "modbus" else self._can)(drive)

    def _modbus(self, drive: LinkedDrive) -> list[Said]:
        data = drive.modbus()
        return [Said(drive.state.time_s, 0, data)] if data else []

    def _can(self, drive: LinkedDrive) -> list[Said]:
        return [Said(drive.state.time_s, *frame) for frame in drive.can_take()]

    def on_the_image(self, elf: Path, machine: str = "mps2-an386") -> tuple[PilRun, list[Said]]:
        """The session on the emulated core, beside the SIL firmware; what the drive says to it."""
        from zerohertz.image import loop
        from zerohertz.link.command import sil_job

        job = dataclasses.replace(
            sil_job("recommended", "0", list(SETTINGS)), decimate=1_000_000, seed=1
        )
        overrides = dict(job.scenario_overrides) | {"scenario.duration_s": self.end_s}
        run = loop.run(
            dataclasses.replace(job, scenario_overrides=overrides),
            elf,
            machine=machine,
            bus_files=self.files,
        )
        return run, list(_unpacked(run.bus_said[f"{self.bus}_said"]))


def _sil_drive() -> LinkedDrive:
    from zerohertz.link.command import sil_job
    from zerohertz.link.server import LinkedDrive

    return LinkedDrive(sil_job("recommended", "0", list(SETTINGS)))


def _packed(said: Said) -> bytes:
    us = round(said.at_s * 1e6)
    parts = range(0, len(said.data), _SERIAL_BYTES)
    chunks = [said.data[k : k + _SERIAL_BYTES] for k in parts]
    return b"".join(_FRAME.pack(us, said.number, len(c), c) for c in chunks)


def _unpacked(data: bytes) -> Iterator[Said]:
    for us, number, n, bytes_ in _FRAME.iter_unpack(data):
        yield Said(us / 1e6, number, bytes_[:n])


def canopen() -> Session:
    """To OPERATION ENABLED and 60 min^-1; the heartbeat is lost; again, then a quick stop."""
    said = [Said(1.2, 0, bytes((1, 0)))]

    def write(at_s: float, index: int, sub: int, value: int) -> None:
        data = struct.pack("<BHBI", 0x23 if index == 0x1016 else 0x2B, index, sub, value)
        said.append(Said(at_s, 0x600 + NODE, data))

    def read(at_s: float, index: int, sub: int = 0) -> None:
        said.append(Said(at_s, 0x600 + NODE, struct.pack("<BHB4x", 0x40, index, sub)))

    def enable(at_s: float) -> None:
        for k, word in enumerate((0x06, 0x07, 0x7F)):
            write(at_s + 0.01 * k, 0x6040, 0, word)
        read(at_s + 0.05, 0x6040)

    write(1.25, 0x1016, 1, MASTER << 16 | round(HEARTBEAT_S * 1000))
    said.append(Said(1.27, 0x600 + NODE, struct.pack("<BHBI", 0x2F, 0x6060, 0, 2)))
    write(1.28, 0x6042, 0, 60)
    read(1.29, 0x1008)
    for k, toggle in enumerate((0x60, 0x70, 0x60, 0x70, 0x60)):
        said.append(Said(1.3 + 0.01 * k, 0x600 + NODE, bytes((toggle, *bytes(7)))))
    enable(1.4)
    said += _beats(1.2, BEATS_END_S)
    read(7.4, 0x603F)
    said += _beats(8.0, 10.0)
    enable(8.1)
    write(9.5, 0x6040, 0, 0x02)
    write(9.8, 0x6040, 0, 0x00)
    return Session("can", tuple(sorted(said, key=lambda s: s.at_s)), 10.2)


def _beats(from_s: float, to_s: float) -> list[Said]:
    n = round((to_s - from_s) / 0.05)
    return [Said(from_s + 0.05 * k, 0x700 + MASTER, b"\x05") for k in range(n)]


def crc16(data: bytes) -> int:
    """Of Modbus RTU."""
    crc = 0xFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0xA001 if crc & 1 else 0)
    return crc


def modbus() -> Session:
    """Runs at 60 min^-1 in both directions; silence ends it; every command register is used."""
    said: list[Said] = []

    def ask(at_s: float, pdu: bytes, address: int = NODE) -> None:
        frame = bytes((address,)) + pdu
        said.append(Said(at_s, 0, frame + crc16(frame).to_bytes(2, "little")))

    ask(1.2, struct.pack(">BHHBHH", 16, 0, 2, 4, 0, 60))
    ask(1.25, struct.pack(">BHH", 4, 5, 1))
    ask(1.3, struct.pack(">BHH", 3, 1200, 20))
    for k in range(55):
        ask(1.4 + 0.1 * k, struct.pack(">BHH", 6, 0, 1))
    ask(7.6, struct.pack(">BHH", 6, 0, 1))  # run has to drop first
    ask(7.7, struct.pack(">BHH", 6, 0, 0), address=0)
    ask(7.75, struct.pack(">BHHBf", 16, 2, 2, 4, -60.0))
    for k in range(15):
        ask(7.8 + 0.1 * k, struct.pack(">BHH", 6, 0, 1))
    ask(9.35, struct.pack(">BHH", 6, 1, 30000))
    ask(9.4, struct.pack(">BHH", 6, 0, 2))
    return Session("modbus", tuple(said), 10.0)


SESSIONS = {"modbus": modbus, "canopen": canopen}
