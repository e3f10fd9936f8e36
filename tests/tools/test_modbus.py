"""pymodbus, somebody else's master, against the firmware's own slave in SIL.

The drive's time passes only while it answers, or when a test lets it pass: every test repeats
exactly, on a loaded machine too.
"""

from __future__ import annotations

import contextlib
import re
import struct
import threading
from collections.abc import Iterator

import pytest
from pymodbus import FramerType
from pymodbus.client import ModbusSerialClient, ModbusTcpClient

from zerohertz import param_list
from zerohertz.drive import State
from zerohertz.errors import UserError
from zerohertz.image import modbus_page
from zerohertz.image.fieldbus_list import grouped, signals, writable
from zerohertz.link.client import Client
from zerohertz.link.command import sil_job
from zerohertz.link.line import DEFAULT_BAUD
from zerohertz.link.modbus_end import TcpEnd, modbus_end
from zerohertz.link.server import DirectLine, LinkedDrive, PtyEnd
from zerohertz.paths import ROOT

CONTROL, SPEED, SPEED_FLOAT, TORQUE_FLOAT = 0, 1, 2, 4
STATUS, ACTUAL_SPEED, STATE_WORD = 0, 1, 5
RUN, COAST, TORQUE_MODE, RESET = 1, 2, 4, 128
EXPIRED, READY, REMOTE = 128, 1, 32
ILLEGAL_ADDRESS, ILLEGAL_VALUE, FAILURE = 2, 3, 4
PERIOD_S = 200e-6
TIMEOUT_S = 0.5
QUICK = {
    "fieldbus_commands": 1,
    "fieldbus_timeout_s": TIMEOUT_S,
}
NOT_FINITE = 0x7FC00000


class Bus:
    """A served drive, and the thread in which its time passes."""

    def __init__(self, end: TcpEnd | PtyEnd, **firmware: float) -> None:
        given = [f"{name}={value}" for name, value in (QUICK | firmware).items()]
        self.drive = LinkedDrive(sil_job("recommended", "0", given))
        self._end, self._lock, self._on = end, threading.Lock(), True
        self.seconds(1.2)  # offsets, and the time without a challenge
        self._thread = threading.Thread(target=self._serve)
        self._thread.start()

    def seconds(self, s: float) -> None:
        with self._lock:
            self.drive.run(round(s / PERIOD_S))

    def close(self) -> None:
        self._on = False
        self._thread.join()
        self.drive.close()

    def _serve(self) -> None:
        said = b""
        while self._on:
            asked = self._end.exchange(said, 0.02)
            said = b""
            if asked:
                with self._lock:
                    self.drive.modbus(asked)
                    self.drive.run(150)  # 30 ms: the longest frame
                    said = self.drive.modbus()


@contextlib.contextmanager
def served(**firmware: float) -> Iterator[tuple[Bus, ModbusTcpClient]]:
    with contextlib.closing(TcpEnd(0)) as end, contextlib.closing(Bus(end, **firmware)) as bus:
        port = int(end.name.rpartition(":")[2])
        with ModbusTcpClient("127.0.0.1", port=port, framer=FramerType.RTU, timeout=30) as master:
            assert master.connect()
            yield bus, master


@pytest.fixture(scope="module")
def drive() -> Iterator[tuple[Bus, ModbusTcpClient]]:
    """At rest, as every test that takes it leaves it."""
    with served() as both:
        yield both


def words(bits: int) -> list[int]:
    return [bits >> 16, bits & 0xFFFF]


def bits_of(value: float) -> int:
    return struct.unpack(">I", struct.pack(">f", value))[0]


def read(master: ModbusTcpClient, address: int, count: int, *, inputs: bool = False) -> list[int]:
    ask = master.read_input_registers if inputs else master.read_holding_registers
    answer = ask(address, count=count, device_id=1)
    assert not answer.isError(), (address, answer)
    return answer.registers


def long_at(master: ModbusTcpClient, address: int, *, inputs: bool = False) -> int:
    high, low = read(master, address, 2, inputs=inputs)
    return high << 16 | low


def write(master: ModbusTcpClient, address: int, values: list[int]) -> int:
    """0, or the exception."""
    if len(values) == 1:
        answer = master.write_register(address, values[0], device_id=1)
    else:
        answer = master.write_registers(address, values, device_id=1)
    return answer.exception_code if answer.isError() else 0


def host(bus: Bus) -> Client:
    return Client(DirectLine(bus.drive, 5), timeout_s=60.0)


def test_every_parameter_reads_as_over_the_host_link(drive: tuple[Bus, ModbusTcpClient]) -> None:
    bus, master = drive
    values = host(bus).get([entry.name for _, _, entry in grouped()])
    for group, k, entry in grouped():
        bits = long_at(master, modbus_page.address(group, k))
        value = bits if entry.whole else struct.unpack(">f", struct.pack(">I", bits))[0]
        assert value == values[entry.name], entry.name


def test_every_signal_reads_as_over_the_host_link(drive: tuple[Bus, ModbusTcpClient]) -> None:
    bus, master = drive
    linked = host(bus)
    assert [s.name for s in signals()] == list(linked.signals)
    for n, signal in enumerate(signals()):
        assert linked.signal(signal.name).whole != signal.is_float
        assert len(read(master, 1000 + 2 * n, 2, inputs=True)) == 2
    state = [s.name for s in signals()].index("state")
    assert long_at(master, 1000 + 2 * state, inputs=True) == State.READY


def test_a_group_is_read_at_once(drive: tuple[Bus, ModbusTcpClient]) -> None:
    _, master = drive
    sizes: dict[int, int] = {}
    for group, k, _ in grouped():
        sizes[group] = k + 1
    for group, size in sizes.items():
        assert len(read(master, modbus_page.address(group, 0), 2 * size)) == 2 * size
        beyond = master.read_holding_registers(
            modbus_page.address(group, 0), count=2 * size + 1, device_id=1
        )
        assert beyond.exception_code == ILLEGAL_ADDRESS


def out_of_range(entry: param_list.Entry) -> list[int]:
    if entry.whole:
        return [int(entry.highest) + 1, 2**32 - 1]
    wide = max(abs(entry.lowest), abs(entry.highest), 1.0)
    return [bits_of(entry.highest + wide), bits_of(entry.lowest - wide), NOT_FINITE]


def test_every_parameter_is_written_or_refused_for_the_right_reason(
    drive: tuple[Bus, ModbusTcpClient],
) -> None:
    _, master = drive
    for group, k, entry in grouped():
        address = modbus_page.address(group, k)
        before = long_at(master, address)
        may = entry.name in writable()
        for bits in out_of_range(entry):
            expected = ILLEGAL_VALUE if may else ILLEGAL_ADDRESS
            assert write(master, address, words(bits)) == expected, entry.name
        assert write(master, address, [0]) == ILLEGAL_ADDRESS
        assert write(master, address + 1, words(before)) == ILLEGAL_ADDRESS
        assert write(master, address, words(before)) == (0 if may else ILLEGAL_ADDRESS), entry.name
        assert long_at(master, address) == before


def test_a_writable_parameter_takes_a_new_value(drive: tuple[Bus, ModbusTcpClient]) -> None:
    bus, master = drive
    place = {entry.name: modbus_page.address(group, k) for group, k, entry in grouped()}
    assert write(master, place["premagnetise_s"], words(bits_of(0.625))) == 0
    assert host(bus).get(["premagnetise_s"]) == {"premagnetise_s": 0.625}
    assert write(master, place["economy_flux_min"], words(bits_of(0.05))) == FAILURE  # a rule
    assert write(master, place["premagnetise_s"], words(bits_of(0.5))) == 0


def test_every_command_register_is_written_and_read(drive: tuple[Bus, ModbusTcpClient]) -> None:
    _, master = drive
    assert write(master, CONTROL, [0]) == 0
    assert write(master, SPEED, [0x10000 - 120]) == 0
    assert read(master, SPEED, 1) == [0x10000 - 120]
    assert write(master, SPEED_FLOAT, words(bits_of(60.5))) == 0
    again = struct.unpack(">f", struct.pack(">I", long_at(master, SPEED_FLOAT)))[0]
    assert again == pytest.approx(60.5, rel=1e-6)
    assert write(master, TORQUE_FLOAT, words(bits_of(-1.25))) == 0
    assert long_at(master, TORQUE_FLOAT) == bits_of(-1.25)
    assert write(master, CONTROL, [TORQUE_MODE]) == 0
    assert read(master, CONTROL, 1) == [TORQUE_MODE]
    for bit in range(16):
        known = 1 << bit in (RUN, COAST, TORQUE_MODE, RESET)
        expected = 0 if known else ILLEGAL_VALUE
        if bit != 0:  # a start is another test
            assert write(master, CONTROL, [1 << bit]) == expected
    for address, values in (
        (SPEED, [32767]),
        (SPEED, [32768]),
        (SPEED_FLOAT, words(bits_of(1e9))),
        (SPEED_FLOAT, words(NOT_FINITE)),
        (TORQUE_FLOAT, words(NOT_FINITE)),
    ):
        assert write(master, address, values) == ILLEGAL_VALUE
    assert write(master, CONTROL, [0]) == 0
    assert write(master, SPEED, [0]) == 0


def test_no_register_stands_between_the_blocks(drive: tuple[Bus, ModbusTcpClient]) -> None:
    _, master = drive
    for address in (6, 999, 65535):
        assert master.read_holding_registers(address, count=1, device_id=1).exception_code == 2
        assert write(master, address, [0]) == ILLEGAL_ADDRESS
    for address in (16, 999, 1000 + 2 * len(signals())):
        assert master.read_input_registers(address, count=1, device_id=1).exception_code == 2


def turning(bus: Bus, master: ModbusTcpClient) -> None:
    """At 60 min^-1, its master writing every 100 ms."""
    assert write(master, CONTROL, [0, 60]) == 0
    for _ in range(50):
        assert write(master, CONTROL, [RUN]) == 0
        bus.seconds(0.1)
    # The estimate of this rig's drive is 1 to 2 min^-1 off here, over the host link as well.
    assert bus.drive.state.speed_rpm == pytest.approx(60.0, abs=3.0)


def test_it_runs_at_60_per_minute_and_silence_stops_it() -> None:
    with served(ramp_down_rad_s2=100.0) as (bus, master):
        turning(bus, master)
        status, speed, _, _, _, state = read(master, STATUS, 6, inputs=True)
        assert state == State.RUN
        assert speed == pytest.approx(60, abs=1)
        assert status & (REMOTE | EXPIRED) == REMOTE
        bus.seconds(TIMEOUT_S - 0.2)  # the last command was some 100 ms ago
        assert bus.drive.state.gates_on
        for _ in range(10):  # reading keeps nothing alive
            read(master, STATUS, 1, inputs=True)
            bus.seconds(0.02)
        assert read(master, STATUS, 1, inputs=True)[0] & EXPIRED
        assert read(master, STATE_WORD, 1, inputs=True) != [State.RUN]
        bus.seconds(1.5)
        assert not bus.drive.state.gates_on
        assert write(master, CONTROL, [RUN]) == FAILURE  # run has to drop first
        bus.seconds(0.2)
        assert not bus.drive.state.gates_on
        turning(bus, master)
        assert write(master, CONTROL, [0]) == 0
        bus.seconds(1.5)
        assert not bus.drive.state.gates_on


def test_coast_opens_the_gates_at_once() -> None:
    with served() as (bus, master):
        turning(bus, master)
        assert write(master, CONTROL, [RUN | COAST]) == 0
        assert not bus.drive.state.gates_on


def test_the_host_takes_the_drive_from_the_bus() -> None:
    with served() as (bus, master):
        turning(bus, master)
        host(bus).stop()
        bus.seconds(1.5)
        assert not bus.drive.state.gates_on
        assert write(master, CONTROL, [RUN]) == FAILURE


def test_a_disabled_bus_reads_and_changes_nothing() -> None:
    with served(fieldbus_commands=0) as (bus, master):
        assert read(master, STATUS, 1, inputs=True)[0] & (READY | REMOTE) == READY
        assert write(master, CONTROL, [0]) == FAILURE
        assert write(master, CONTROL, [RUN]) == FAILURE
        assert write(master, modbus_page.address(7, 1), words(bits_of(0.5))) in (2, 3, 4)
        bus.seconds(0.5)
        assert not bus.drive.state.gates_on


def test_a_terminal_serves_a_serial_master() -> None:
    with (
        contextlib.closing(modbus_end("pty")) as end,
        contextlib.closing(Bus(end)),
        ModbusSerialClient(end.name, baudrate=DEFAULT_BAUD, timeout=30) as master,
    ):
        assert master.connect()
        assert read(master, STATE_WORD, 1, inputs=True) == [State.READY]
        echo = master.diag_query_data(b"\x12\x34", device_id=1)
        assert not echo.isError()


def test_where_to_serve_is_a_port_or_a_terminal() -> None:
    for wrong in ("here", "70000", "-1"):
        with pytest.raises(UserError, match="give a TCP port or pty"):
            modbus_end(wrong)
    with contextlib.closing(TcpEnd(0)) as taken:
        port = taken.name.rpartition(":")[2]
        with pytest.raises(UserError, match="cannot be used"):
            TcpEnd(int(port))


def test_what_a_bus_may_write_is_what_only_worsens_control() -> None:
    page = (ROOT / "SECURITY.md").read_text(encoding="utf-8")
    row = re.search(r"^\| 5\. worse control \|(.*)\|$", page, re.MULTILINE)
    assert row is not None
    assert writable() == frozenset(re.findall(r"`(\w+)`", row[1]))


def test_the_page_is_that_of_the_lists() -> None:
    assert not modbus_page.stale()
