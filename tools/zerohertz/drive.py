"""The firmware from Python: binding of host_sim/sil.h.

    with Drive("gain_tables/hasegawa2005", "host_sim/boards/paper.toml") as drive:
        out = drive.step(8192, 8192, 8192, 8192, 8192, 11592, speed_ref_rpm=60.0, run=True)

Each call of `step` runs one control period on six ADC words; `run` takes an array of them. The
caller owns the plant and its clock; `zerohertz.plant.Plant` is one.
Parameters are items of the drive: drive["adapt_kp"] reads one, drive["adapt_kp"] = 5.0 sets it.
`signals` reads what the firmware computes inside, `snapshot` and `restore` take the whole state.
"""

from __future__ import annotations

import ctypes
from collections.abc import Iterator, Mapping, Sequence
from ctypes import byref, c_double, c_float, c_void_p
from struct import Struct
from typing import Any, NoReturn, Protocol

import numpy.typing as npt

from zerohertz import arguments
from zerohertz.errors import UserError
from zerohertz.sil import (
    Handle,
    StrPath,
    check,
    last_error,
    library,
    override_lines,
    raise_last_error,
)
from zerohertz.sil_rows import (
    COMMANDS,
    COMMISSION,
    FAULT_RESET,
    RUN,
    TORQUE_MODE,
    TORQUE_OFF,
    Recording,
    chosen_signals,
    inputs,
    numbers,
    outputs,
    signal_list,
    signal_numbers,
)
from zerohertz.sil_types import (
    FLAGS,
    OUT,
    OUTPUT_NAMES,
    WORDS,
    Access,
    Commissioned,
    Commissioning,
    Confidence,
    Fault,
    Output,
    Parameter,
    RawCommissioning,
    RawIn,
    RawOut,
    RawParameter,
    Reason,
    Refusal,
    Rows,
    Signal,
    State,
    commissioned,
)
from zerohertz.terminals import Terminals

__all__ = [
    "Access",
    "Commissioned",
    "Commissioning",
    "Confidence",
    "Drive",
    "Fault",
    "Handle",
    "Output",
    "Parameter",
    "PlantLike",
    "Reason",
    "Refusal",
    "Rows",
    "Signal",
    "State",
    "StrPath",
    "check",
    "last_error",
    "library",
    "override_lines",
    "parameters",
    "raise_last_error",
    "signal_list",
    "step_many",
]

_OUT_VALUES = Struct(
    "<4x" + "".join("I" if OUT[name].kind == "u" else "f" for name in OUTPUT_NAMES)
)
_LEVELS = frozenset((False, True))
_FLAG_AT = tuple(k for k, name in enumerate(OUTPUT_NAMES) if name in FLAGS)


class PlantLike(Protocol):
    """What `Drive.commission` needs of a plant; zerohertz.plant.Plant has it."""

    def sample(self) -> Sequence[int]:
        """The six ADC words at the present crest."""
        ...

    def advance(self, duties: Sequence[float], gates_on: bool) -> None:
        """To the next crest. The plant keeps the timer's delay of one period."""
        ...


def parameters() -> tuple[Parameter, ...]:
    """Every parameter of the firmware."""
    lib = library()
    found = []
    for index in range(lib.zh_sil_name_count()):
        info = RawParameter(struct_size=ctypes.sizeof(RawParameter))
        check(lib.zh_sil_describe(index, byref(info)))
        found.append(
            Parameter(
                name=lib.zh_sil_name(index).decode(),
                unit=info.unit.decode(),
                text=info.text.decode(),
                minimum=info.minimum,
                maximum=info.maximum,
                initial=info.initial,
                access=Access(info.access),
                whole=bool(info.whole),
                group=info.group.decode(),
                choices=_choices(info),
            )
        )
    return tuple(found)


def _choices(info: RawParameter) -> tuple[str, ...]:
    if not info.choice:
        return ()
    return tuple(info.choice[k].decode() for k in range(int(info.maximum) + 1))


class Drive(Handle):
    """One drive. Any number may exist; each may be used by one thread at a time.

    motor_dir has motor.toml and l_gain.json; board is a TOML file as in host_sim/boards; overrides
    set parameters of firmware/parameters/param_list.def, the protected ones only here.
    """

    _CLOSE = "zh_sil_close"

    def __init__(
        self,
        motor_dir: StrPath,
        board: StrPath,
        overrides: Mapping[str, Any] | None = None,
    ) -> None:
        """Raise UserError, which names file and key, when the library refuses an input."""
        self._handle = None
        self._lib = library()
        self._in = RawIn(struct_size=ctypes.sizeof(RawIn))
        self._out = RawOut(struct_size=ctypes.sizeof(RawOut))
        lines = override_lines({} if overrides is None else overrides, "Drive")
        self._handle = self._lib.zh_sil_open(
            arguments.path("Drive", "motor_dir", motor_dir),
            arguments.path("Drive", "board", board),
            lines,
        )
        if not self._handle:
            raise_last_error()

    def step(
        self,
        i_u: int,
        i_v: int,
        i_w: int,
        u_uv: int,
        u_vw: int,
        u_dc: int,
        *,
        speed_ref_rpm: float = 0.0,
        torque_ref_Nm: float | None = None,
        run: bool = False,
        fault_reset: bool = False,
        torque_off: bool = False,
        commission: bool = False,
    ) -> Output:
        """Run one control period on the ADC words sampled at this carrier crest.

        With a torque reference the drive controls torque instead of speed. The returned duties act
        from the next crest to the one after; gates_on False acts at once. Raise UserError for a
        reference that is not finite; the drive has then tripped.
        """
        words = (i_u, i_v, i_w, u_uv, u_vw, u_dc)
        references = (speed_ref_rpm, 0.0 if torque_ref_Nm is None else torque_ref_Nm)
        commands = (run, fault_reset, torque_off, commission)
        raw = self._in
        try:
            known = 0 <= min(words) and max(words) <= 0xFFFF and _LEVELS.issuperset(commands)
            raw.i_u, raw.i_v, raw.i_w, raw.u_uv, raw.u_vw, raw.u_dc = words
            raw.speed_ref_rpm, raw.torque_ref_Nm = references
            raw.mode = 0 if torque_ref_Nm is None else TORQUE_MODE
            raw.command = (
                RUN * run
                | FAULT_RESET * fault_reset
                | TORQUE_OFF * torque_off
                | COMMISSION * commission
            )
        except (TypeError, ValueError, OverflowError):
            known = False
        if not known:
            _refuse_step(words, references, commands)
        check(self._lib.zh_sil_step(self._open_handle(), byref(raw), byref(self._out)))
        return _output(self._out)

    def run(
        self,
        words: npt.ArrayLike,
        *,
        speed_ref_rpm: npt.ArrayLike = 0.0,
        torque_ref_Nm: npt.ArrayLike | None = None,
        run: npt.ArrayLike = False,
        fault_reset: npt.ArrayLike = False,
        torque_off: npt.ArrayLike = False,
        commission: npt.ArrayLike = False,
        signals: Sequence[str] = (),
    ) -> Rows:
        """Run one control period per row of words, shape (periods, 6); the same as single steps.

        References and commands are numbers or arrays, one value per period. Returns one row per
        period with the fields of Output, and of every signal named (float64). A reference that is
        not finite raises UserError after the last period.
        """
        where = "Drive.run"
        rows = inputs(where, words, speed_ref_rpm, torque_ref_Nm,
                       run, fault_reset, torque_off, commission)  # fmt: skip
        recording = Recording(where, signals, len(rows))
        out = outputs(len(rows))
        status = self._lib.zh_sil_run(
            self._open_handle(), rows.ctypes.data, out.ctypes.data, len(rows), recording.pointer
        )
        check(status)
        return recording.joined(out)

    def telemetry(self) -> Output:
        """What the last step gave; before the first, gates off."""
        check(self._lib.zh_sil_look(self._open_handle(), byref(self._out)))
        return _output(self._out)

    def signals(self, names: Sequence[str] | None = None) -> dict[str, float]:
        """Signals of the last period by name; all of them by default (signal_list())."""
        if names is None:
            chosen = tuple(signal_numbers())
        else:
            chosen = chosen_signals("Drive.signals", "names", names)
        wanted = numbers(chosen)
        values = (c_double * len(chosen))()
        check(self._lib.zh_sil_signals(self._open_handle(), wanted, len(chosen), values))
        return dict(zip(chosen, values, strict=True))

    def reset(self) -> None:
        """As just opened, parameters too."""
        check(self._lib.zh_sil_reset(self._open_handle()))

    def snapshot(self) -> bytes:
        """The whole state, parameters too; of this process or for another one.

        UserError for an estimator in Python: its objects are not in the drive's memory.
        """
        if hasattr(self._lib, "zh_python_bridge_register"):
            raise UserError("Drive.snapshot: an estimator in Python has no snapshot; use one in C")
        buffer = ctypes.create_string_buffer(self._lib.zh_sil_snapshot_bytes())
        check(self._lib.zh_sil_snapshot(self._open_handle(), buffer, len(buffer)))
        return buffer.raw

    def restore(self, snapshot: bytes) -> None:
        """Continue from a snapshot, bit for bit.

        It may come from another Drive, if that was opened with the same motor, board and overrides.
        UserError, and nothing changes, if not, or if it is damaged.
        """
        if not isinstance(snapshot, (bytes, bytearray)):
            raise UserError("Drive.restore: snapshot: is no bytes; give what snapshot() returned")
        raw = bytes(snapshot)
        check(self._lib.zh_sil_restore(self._open_handle(), raw, len(raw)))

    def fit_terminals(self, **parameters: float | str) -> Terminals:
        """Give it a board with terminals (zerohertz.terminals); only with the gates off.

        Parameters as in tools/docs/terminals.md, all off by default. `run` and the references of
        a step are then what a host asks, beside the contacts.
        """
        return Terminals(self, parameters)

    def commissioned(self) -> Commissioned:
        """Result of the last commissioning; zeros until found."""
        raw = RawCommissioning()
        check(self._lib.zh_sil_commissioned(self._open_handle(), byref(raw)))
        return commissioned(raw)

    def commission(self, plant: PlantLike, timeout_s: float = 120.0) -> Commissioned:
        """Identify the motor at standstill on a plant; the gates have to be off.

        A refusal is a result (`refusal`); UserError when the drive trips otherwise or takes longer.
        """
        where = "Drive.commission"
        if not arguments.finite(where, "timeout_s", timeout_s) > 0.0:
            raise UserError(f"{where}: timeout_s: {timeout_s} is not positive")
        if not (hasattr(plant, "sample") and hasattr(plant, "advance")):
            arguments.refuse(where, "plant", plant, "a Plant, or what has sample and advance")
        ready = busy = False
        for _ in range(round(timeout_s / self["period_s"])):
            out = self.step(*plant.sample(), commission=ready)
            plant.advance(out.duties, out.gates_on)
            ready = ready or out.state == State.READY
            busy = busy or out.commissioning == Commissioning.BUSY
            if busy and out.commissioning != Commissioning.BUSY:
                break
            if out.state == State.FAULT:
                raise UserError(f"{where}: plant: the drive tripped: {Fault(out.faults)}")
        else:
            raise UserError(f"{where}: timeout_s: not done after {timeout_s} s")
        out = self.step(*plant.sample())
        plant.advance(out.duties, out.gates_on)
        return self.commissioned()

    def __getitem__(self, name: str) -> float:
        value = c_float()
        wanted = arguments.text("Drive", "name", name)
        check(self._lib.zh_sil_get(self._open_handle(), wanted, byref(value)))
        return value.value

    def __setitem__(self, name: str, value: float) -> None:
        wanted = arguments.text("Drive", "name", name)
        given = arguments.number("Drive", name, value)
        check(self._lib.zh_sil_set(self._open_handle(), wanted, given))

    def __iter__(self) -> Iterator[str]:
        return iter(p.name for p in parameters())


def step_many(
    drives: Sequence[Drive],
    words: npt.ArrayLike,
    *,
    speed_ref_rpm: npt.ArrayLike = 0.0,
    torque_ref_Nm: npt.ArrayLike | None = None,
    run: npt.ArrayLike = False,
    fault_reset: npt.ArrayLike = False,
    torque_off: npt.ArrayLike = False,
) -> Rows:
    """One control period of each drive, one row of words (drives, 6) each; as single steps do."""
    where = "step_many"
    if not isinstance(drives, Sequence) or not all(isinstance(d, Drive) for d in drives):
        arguments.refuse(where, "drives", drives, "a list of drives")
    rows = inputs(where, words, speed_ref_rpm, torque_ref_Nm, run, fault_reset, torque_off, False)
    if len(drives) != len(rows):
        raise UserError(f"{where}: words: has {len(rows)} rows for {len(drives)} drives")
    out = outputs(len(rows))
    handles = (c_void_p * len(drives))(*(drive._open_handle() for drive in drives))
    check(library().zh_sil_step_many(handles, rows.ctypes.data, out.ctypes.data, len(rows)))
    return out[list(OUTPUT_NAMES)]


def _refuse_step(words: tuple[Any, ...], references: tuple[Any, ...], levels: Any) -> NoReturn:
    """Name the argument of a step that cannot be given to the library."""
    where = "Drive.step"
    for name, word in zip(WORDS, words, strict=True):
        arguments.whole(where, name, word, 0, 0xFFFF)
    for name, reference in zip(("speed_ref_rpm", "torque_ref_Nm"), references, strict=True):
        arguments.number(where, name, reference)
    for name, level in zip(COMMANDS, levels, strict=True):
        arguments.level(where, name, level)
    raise UserError(f"{where}: run .. commission: {levels} are not all True or False")


def _output(raw: RawOut) -> Output:
    values: list[Any] = list(_OUT_VALUES.unpack(raw))
    for k in _FLAG_AT:
        values[k] = bool(values[k])
    return Output(*values)
