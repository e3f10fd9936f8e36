"""The terminals of a drive from Python: contacts, analogue reference, sensors, relays.

    with Drive(motor_dir, board, {"stop_mode": "ramp"}) as drive:
        terminals = drive.fit_terminals(start_control="two_wire", full_speed_rad_s=60.0)
        terminals.wire(inputs=Input.START)  # from the next step on
        ...
        terminals.look().outputs & Output.READY

tools/docs/terminals.md has every parameter, fault and wiring.
"""

from __future__ import annotations

import ctypes
from ctypes import Structure, byref, c_double, c_float, c_uint32
from dataclasses import dataclass
from enum import IntEnum, IntFlag

from zerohertz import arguments
from zerohertz.errors import UserError
from zerohertz.sil import Handle, check, library
from zerohertz.terminal_list import terminal_parameters

__all__ = ["Brake", "Fault", "Input", "Output", "Precharge", "Seen", "Terminals"]


class Input(IntFlag):
    """Contacts that are closed."""

    START = 1 << 0
    STOP = 1 << 1  # open stops
    REVERSE = 1 << 2
    RESET = 1 << 3
    BRAKE_RELEASED = 1 << 4
    CONTACTOR_ON = 1 << 5
    CHOPPER_LEADS = 1 << 6


class Output(IntFlag):
    """Outputs that are energised."""

    READY = 1 << 16
    NO_FAULT = 1 << 17
    BRAKE_RELEASE = 1 << 18
    CONTACTOR = 1 << 19
    CHOPPER = 1 << 20


class Brake(IntEnum):
    """Where the sequence of the mechanical brake is."""

    CLOSED = 0
    PROVING = 1
    RELEASING = 2
    RELEASED = 3
    CLOSING = 4


class Precharge(IntEnum):
    """Where the charging of the dc link is."""

    WAITING = 0
    CHARGING = 1
    CLOSING = 2
    CLOSED = 3
    FAILED = 4
    OPENING = 5


class Fault(IntFlag):
    """Fault bits of the terminals, as in terminal_faults.def."""

    REFERENCE_LOST = 1 << 0
    REFERENCE_HELD = 1 << 1
    INPUTS_LOST = 1 << 2
    BRAKE_TORQUE = 1 << 3
    BRAKE_NOT_RELEASED = 1 << 4
    BRAKE_FEEDBACK = 1 << 5
    BRAKE_NOT_CLOSED = 1 << 6
    SINK_SENSOR = 1 << 7
    SINK_HOT = 1 << 8
    MOTOR_SENSOR = 1 << 9
    MOTOR_HOT = 1 << 10
    PRECHARGE = 1 << 11
    CONTACTOR = 1 << 12
    CHOPPER_HOT = 1 << 13
    CHOPPER_SHORT = 1 << 14
    CHOPPER_OPEN = 1 << 15
    LINK_LOW = 1 << 16
    COMMISSION_REFUSED = 1 << 17
    SINK_SHORT = 1 << 18
    MOTOR_SHORT = 1 << 19


class RawTerminalIn(Structure):
    """zh_sil_terminal_in."""

    _fields_ = (
        ("struct_size", c_uint32),
        ("inputs", c_uint32),
        ("analog_V", c_double),
        ("analog_A", c_double),
        ("sink_ohm", c_double),
        ("motor_ohm", c_double),
        ("unreadable", c_uint32),
    )


class RawTerminalOut(Structure):
    """zh_sil_terminal_out."""

    _fields_ = (
        ("struct_size", c_uint32),
        ("outputs", c_uint32),
        ("faults", c_uint32),
        ("brake", c_uint32),
        ("precharge", c_uint32),
        ("reference_pu", c_float),
        ("sink_degC", c_float),
        ("motor_degC", c_float),
        ("current_pu", c_float),
        ("Rs_pu", c_float),
        ("resistor_pu", c_float),
    )


@dataclass(frozen=True, slots=True)
class Seen:
    """What the terminals show; temperatures are NaN before the first measurement."""

    outputs: int  # Output
    faults: int  # Fault
    brake: Brake
    precharge: Precharge
    reference_pu: float
    sink_degC: float
    motor_degC: float
    current_pu: float  # limit of the torque current in force, over its parameter
    Rs_pu: float
    resistor_pu: float


class Terminals:
    """Of one drive; made by Drive.fit_terminals."""

    def __init__(self, drive: Handle, parameters: dict[str, float | str]) -> None:
        """Raise UserError, which names the parameter, when one is refused."""
        self._lib = library()
        self._drive = drive
        self._in = RawTerminalIn(struct_size=ctypes.sizeof(RawTerminalIn))
        lines = "\n".join(f"{name}={_number(name, value)}" for name, value in parameters.items())
        check(self._lib.zh_sil_terminals_fit(drive._open_handle(), lines.encode()))

    def wire(
        self,
        *,
        inputs: int | None = None,
        analog_V: float | None = None,
        analog_A: float | None = None,
        sink_ohm: float | None = None,
        motor_ohm: float | None = None,
        unreadable: bool | None = None,
    ) -> None:
        """Change what is wired, from the next step on; what is not given stays.

        math.inf ohm is an open wire, 0 a short circuit.
        """
        where = "Terminals.wire"
        changed = RawTerminalIn.from_buffer_copy(self._in)
        if inputs is not None:
            changed.inputs = arguments.whole(where, "inputs", inputs, 0, sum(Input))
        if unreadable is not None:
            changed.unreadable = arguments.level(where, "unreadable", unreadable)
        values = {"analog_V": analog_V, "analog_A": analog_A}
        values |= {"sink_ohm": sink_ohm, "motor_ohm": motor_ohm}
        for name, value in values.items():
            if value is not None:
                setattr(changed, name, _wired(where, name, value))
        check(self._lib.zh_sil_terminals_set(self._drive._open_handle(), byref(changed)))
        self._in = changed

    def look(self) -> Seen:
        """After the last step."""
        raw = RawTerminalOut(struct_size=ctypes.sizeof(RawTerminalOut))
        check(self._lib.zh_sil_terminals_look(self._drive._open_handle(), byref(raw)))
        return Seen(
            outputs=raw.outputs,
            faults=raw.faults,
            brake=Brake(raw.brake),
            precharge=Precharge(raw.precharge),
            reference_pu=raw.reference_pu,
            sink_degC=raw.sink_degC,
            motor_degC=raw.motor_degC,
            current_pu=raw.current_pu,
            Rs_pu=raw.Rs_pu,
            resistor_pu=raw.resistor_pu,
        )


def _number(name: str, value: float | str) -> float:
    """A number, or that of a choice."""
    entry = terminal_parameters().get(name)
    if isinstance(value, str):
        choices = entry.choices if entry else ()
        if value not in choices:
            remedy = f"one of {', '.join(choices)}" if choices else "a number"
            raise UserError(f"terminals: {name}: '{value}': give {remedy}")
        return choices.index(value)
    return arguments.number("terminals", name, value)


def _wired(where: str, name: str, value: float) -> float:
    remedy = "a number that is not negative"
    given = arguments.number(where, name, value, remedy)
    if not given >= 0.0:
        arguments.refuse(where, name, value, remedy)
    return given
