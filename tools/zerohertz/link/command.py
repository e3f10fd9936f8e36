"""`zh serve`, and what talks to a drive: `zh connect`, `get`, `set`, `save`, `trace`, `faults`."""

from __future__ import annotations

import contextlib
import dataclasses
import json
import math
import os
import re
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.live import Live
from rich.table import Table
from rich.text import Text

from zerohertz.drive import Fault, State
from zerohertz.errors import UserError
from zerohertz.link import client as link
from zerohertz.link.client import Client, RefusedError
from zerohertz.link.line import DEFAULT_BAUD, DEFAULT_TCP_PORT, SerialLine, TcpLine
from zerohertz.link.modbus_end import modbus_end
from zerohertz.link.parameters import record_lines
from zerohertz.link.ports import BrokerEnd, line_to
from zerohertz.link.recording import Recording, recording, write
from zerohertz.link.siphash import load_key
from zerohertz.options import Json, refuse_given

RPM_PER_RAD_S = 30.0 / math.pi
EDGES = {"now": 0, "rising": 1, "falling": 2, "either": 3}
CONFIDENCE = {0: "closed loop", 1: "degraded", 2: "I-f operation"}
POLL_S = 0.05
_LOADED = 1  # found at start

PortOption = Annotated[
    str | None, typer.Option("--port", metavar="DEVICE", help="Serial port of the drive.")
]
BaudOption = Annotated[int, typer.Option(min=1, help="Baud rate of the serial port.")]
SilOption = Annotated[bool, typer.Option("--sil", help="Use the drive of `zh serve`.")]
TcpOption = Annotated[int, typer.Option(min=0, max=65535, help="TCP port of `zh serve`.")]
UnlockOption = Annotated[
    bool, typer.Option("--unlock", help="Unlock protected parameters with the development key.")
]
KeyOption = Annotated[
    Path | None,
    typer.Option(
        "--key", metavar="FILE", help="Unlock with the key in this file: 32 hexadecimal digits."
    ),
]
NameArgument = Annotated[
    str | None,
    typer.Argument(
        metavar="[NAME]",
        help="Configuration: a folder of zh new, or a name in host_sim/configs; default: "
        "recommended.",
    ),
]
SealKeyOption = Annotated[
    Path | None,
    typer.Option("--key", metavar="FILE", help="File with the drive's key: 32 hexadecimal digits."),
]


def register(app: typer.Typer) -> None:
    """Add the commands of the link."""
    for command in (serve, connect, get, set_, save, trace, faults):
        app.command(command.__name__.rstrip("_"))(command)


@contextlib.contextmanager
def open_client(
    port: str | None,
    baud: int,
    sil: bool,
    tcp: int,
    key: Path | None = None,
    *,
    share: bool = False,
) -> Iterator[Client]:
    """The drive that the options name; what can hurt is asked for with that key.

    A broker that owns the drive's port is found. share: this command becomes one, for as long as
    it runs, so that others can watch.
    """
    if (port is not None) == sil:
        raise UserError("which drive? give --port DEVICE, or --sil for the one of tools/zh serve")
    secret = load_key(key)
    line, hub = line_to(port, baud, secret, share) if port is not None else (TcpLine(tcp), None)
    with hub or contextlib.nullcontext(), Client(line, key=secret) as drive:
        if not isinstance(line, SerialLine):
            drive.introduce(f"zh {' '.join(sys.argv[1:2])} ({os.getpid()})")
        yield drive


def serve(
    context: typer.Context,
    name: NameArgument = None,
    config: Annotated[str | None, typer.Option(help="The same as NAME.")] = None,
    rig: Annotated[
        str | None,
        typer.Option(help="Motor to connect, in host_sim/rigs/motors, on a board that fits it."),
    ] = None,
    load_Nm: Annotated[
        str, typer.Option("--load", help="Load torque in Nm, or as [[s, Nm], ...] over time.")
    ] = "0",
    set_params: Annotated[
        list[str] | None, typer.Option("--set", metavar="NAME=VALUE", help="Firmware parameter.")
    ] = None,
    speed: Annotated[
        float,
        typer.Option(
            min=0.0,
            help="Simulated seconds per second; 0: as fast as possible. Above 8, `zh run` is too "
            "slow for command_timeout_s.",
        ),
    ] = 1.0,
    tcp: TcpOption = DEFAULT_TCP_PORT,
    pty: Annotated[
        bool, typer.Option("--pty", help="Serve on a pseudo-terminal instead of TCP.")
    ] = False,
    modbus: Annotated[
        str | None,
        typer.Option(
            metavar="PORT|pty",
            help="Serve the Modbus slave as well: RTU frames on this TCP port, or a terminal.",
        ),
    ] = None,
    keep: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Flash file: keeps parameters and fault record between runs."
        ),
    ] = None,
) -> None:
    """Run the firmware on a simulated rig and serve its host link until interrupted."""
    from zerohertz.link import server

    if pty:
        refuse_given(context, {"tcp": "--tcp"}, "--pty serves on a terminal, not on TCP")
    job = sil_job(one_configuration(name, config), load_Nm, set_params or [], rig)
    end = server.PtyEnd() if pty else BrokerEnd(tcp)
    with contextlib.ExitStack() as open_ends:
        open_ends.enter_context(contextlib.closing(end))
        bus = modbus_end(modbus) if modbus is not None else None
        if bus is not None:
            open_ends.enter_context(contextlib.closing(bus))
            print(f"zh: Modbus RTU on {bus.name}", file=sys.stderr)
        drive = open_ends.enter_context(server.LinkedDrive(job, keep=keep))
        where = f"--port {end.name}" if pty else None
        print(serving_note(end.name, tcp, where), file=sys.stderr)
        server.serve(drive, end, speed, modbus=bus)


def serving_note(name: str, tcp: int, where: str | None = None) -> str:
    """Where a served drive is, and how another command finds it."""
    if where is None:
        where = "--sil" if tcp == DEFAULT_TCP_PORT else f"--sil --tcp {tcp}"
    return f"zh: serving on {name}; try: tools/zh connect {where}"


def one_configuration(name: str | None, config: str | None) -> str:
    """Of the argument and the option that say the same."""
    if name is not None and config is not None:
        raise UserError(f"--config {config}: NAME is {name}; leave one of them out")
    return name or config or "recommended"


def sil_job(config: str, load_Nm: str, assignments: list[str], rig: str | None = None) -> Any:
    """A rig at rest with a load torque, its drive waiting for commands.

    rig: another motor, on a board of its size, or on that of the folder of zh new.
    """
    job = _configured_job(config, load_Nm, assignments)
    if rig is None:
        return job
    from zerohertz.commission.folder import rig_file
    from zerohertz.configuration.files import is_configuration

    if is_configuration(config):
        return dataclasses.replace(job, rig=rig_file(rig))
    return with_motor(job, rig)


def _configured_job(config: str, load_Nm: str, assignments: list[str]) -> Any:
    from zerohertz import sim
    from zerohertz.scenario.setup import SCENARIOS, load_setup

    setup = load_setup(config)
    # Points over time else; what is wrong with them the library says.
    with contextlib.suppress(ValueError):
        load_Nm = f"[[0.0, {float(load_Nm)}]]"
    firmware = {}
    for text in assignments:
        name, _, value = text.partition("=")
        try:
            firmware[name] = float(value)
        except ValueError:
            raise UserError(f"--set {text}: is not NAME=NUMBER") from None
    return sim.Job(
        scenario=SCENARIOS / "smoke.toml",
        scenario_overrides={"profiles.load_torque_Nm": load_Nm},
        rig=setup.rig,
        board=setup.board,
        motor_dir=setup.motor_dir,
        firmware_config=setup.params,
        firmware=firmware,
    )


def with_motor(job: Any, rig: str) -> Any:
    """Another motor than the drive knows, on a board of its size and not of the configuration."""
    from zerohertz.commission.board import Board
    from zerohertz.commission.folder import rig_file
    from zerohertz.commission.plate import read_plate

    path = rig_file(rig)
    board = Board.of_plate(read_plate(path)).toml
    return dataclasses.replace(job, rig=path, board=board, firmware_config={})


def connect(
    port: PortOption = None,
    baud: BaudOption = DEFAULT_BAUD,
    sil: SilOption = False,
    tcp: TcpOption = DEFAULT_TCP_PORT,
    as_json: Json = False,
) -> None:
    """Identify the drive and show its state."""
    with open_client(port, baud, sil, tcp) as drive:
        who, status, store = drive.identity, drive.status(), drive.store()
        if as_json:
            _print_json(
                {"identity": dataclasses.asdict(who), "status": status.as_json()}
                | {"store": dataclasses.asdict(store)}
            )
            return
        console = Console(highlight=False)
        console.print(who.text)
        console.print(
            f"motor {who.motor_id:08x}, gain table {who.table_crc32c:08x}, control period "
            f"{who.period_s * 1e6:.0f} us, {who.parameters} parameters, {who.signals} signals, "
            f"trace of {who.trace_words // 8} rows of 8"
        )
        console.print(f"parameters {store_text(store)}")
        if store.found == _LOADED and (store.renamed or store.unknown or store.refused):
            for line in record_lines(drive.record(), drive.parameters):
                console.print(Text(f"  {line}"))
        if store.conflict:
            console.print(Text(f"refused: {store.conflict}"))
        console.print(status_line(status))


def get(
    names: Annotated[
        list[str] | None, typer.Argument(help="Names of parameters; default: all.")
    ] = None,
    port: PortOption = None,
    baud: BaudOption = DEFAULT_BAUD,
    sil: SilOption = False,
    tcp: TcpOption = DEFAULT_TCP_PORT,
    as_json: Json = False,
) -> None:
    """Show parameters of the drive, by group."""
    with open_client(port, baud, sil, tcp) as drive:
        values = drive.get(names or list(drive.parameters))
        if as_json:
            _print_json({name: _short(value) for name, value in values.items()})
            return
        Console().print(_parameter_table(drive, values))


def _parameter_table(drive: Client, values: dict[str, float]) -> Table:
    """A headline per group, a row per parameter."""
    table = Table(box=None, pad_edge=False)
    for name in ("name", "value", "unit", "range", "access"):
        kept = name in ("name", "value", "access")
        table.add_column(name, justify="right" if name == "value" else "left", no_wrap=kept)
    group = ""
    for name, value in values.items():
        p = drive.parameter(name)
        if p.group != group:
            group = p.group
            table.add_row(Text(group, style="bold"))
        span = ", ".join(p.choices) or f"{p.minimum:.7g} .. {p.maximum:.7g}"
        table.add_row(*map(Text, (name, p.show(value, unit=False), p.unit, span, p.access)))
    return table


def set_(
    name: Annotated[str, typer.Argument(help="Name of the parameter.")],
    value: Annotated[
        str, typer.Argument(help="Value in the parameter's unit, or the name of a choice.")
    ],
    unlock: UnlockOption = False,
    key: KeyOption = None,
    port: PortOption = None,
    baud: BaudOption = DEFAULT_BAUD,
    sil: SilOption = False,
    tcp: TcpOption = DEFAULT_TCP_PORT,
) -> None:
    """Set a parameter of the drive; it acts from the next control period."""
    with open_client(port, baud, sil, tcp, key) as drive:
        unlock_drive(drive, unlock, key)
        parameter = drive.parameter(name)
        drive.set(name, parameter.number(value))
        print(f"{name} = {parameter.show(drive.get([name])[name])}")


def save(
    unlock: UnlockOption = False,
    key: KeyOption = None,
    port: PortOption = None,
    baud: BaudOption = DEFAULT_BAUD,
    sil: SilOption = False,
    tcp: TcpOption = DEFAULT_TCP_PORT,
) -> None:
    """Save the parameters in use for the next power-up. The gates must be off."""
    with open_client(port, baud, sil, tcp, key) as drive:
        unlock_drive(drive, unlock, key)
        drive.save()
        print("saved")


def unlock_drive(drive: Client, wanted: bool, key: Path | None) -> None:
    """With that key, or the development key."""
    if wanted or key is not None:
        drive.unlock(load_key(key))
        if key is None:
            print("zh: unlocked with the development key, which everybody knows", file=sys.stderr)


def store_text(s: link.StoreState) -> str:
    """Where the parameters in use come from."""
    parts = [link.FOUND.get(s.found, f"store {s.found}")]
    for count, what in (
        (s.missing, "not in the record: default"),
        (s.renamed, "renamed"),
        (s.unknown, "in the record, not known any more"),
        (s.refused, "out of range today: default"),
    ):
        if count and s.found == _LOADED:
            parts.append(f"{count} {what}")
    return ", ".join(parts + ["saving"] * bool(s.saving) + ["last save FAILED"] * bool(s.failed))


_TRIGGER = re.compile(r"^(?P<signal>\w+)\s*(?P<how><|>|=)\s*(?P<level>[-+.\deE]+)$")


def trace(
    signals: Annotated[str, typer.Option(help="Up to eight signals, separated by commas.")],
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE", help="File to write, .csv or .mf4.")
    ] = None,
    trigger: Annotated[
        str | None,
        typer.Option(help="'SIGNAL>LEVEL' rising, '<' falling, '=' either edge; default: now."),
    ] = None,
    before: Annotated[
        float, typer.Option(min=0.0, max=1.0, help="Share of the rows before the trigger.")
    ] = 0.25,
    every: Annotated[int, typer.Option(min=1, help="Control periods per row.")] = 1,
    rows: Annotated[int, typer.Option(min=0, help="Number of rows; 0: as many as fit.")] = 0,
    wait_s: Annotated[
        float, typer.Option("--wait", min=0.0, help="Longest wait for the trigger, s.")
    ] = 60.0,
    live: Annotated[
        bool, typer.Option("--live", help="Plot live until interrupted instead.")
    ] = False,
    port: PortOption = None,
    baud: BaudOption = DEFAULT_BAUD,
    sil: SilOption = False,
    tcp: TcpOption = DEFAULT_TCP_PORT,
) -> None:
    """Record signals of the control law, period by period, around a trigger."""
    names = [name.strip() for name in signals.split(",") if name.strip()]
    if not 1 <= len(names) <= 8:
        raise UserError(f"--signals: {len(names)} names; give one to eight")
    if not live and out is None:
        raise UserError("give --out FILE.csv or FILE.mf4, or --live")
    with open_client(port, baud, sil, tcp) as drive:
        if live:
            _live(drive, names)
            return
        how = parse_trigger(trigger, names[0])
        share = before if trigger is not None else 0.0
        record = take(drive, names, how, before=share, every=every, rows=rows, wait_s=wait_s)
        write(out, record)
        print(f"{out}: {len(record.t_s)} rows, {record.t_s[0]:g} .. {record.t_s[-1]:g} s")


def parse_trigger(text: str | None, first: str) -> dict[str, Any]:
    """Signal, edge and level."""
    if text is None:
        return {"trigger": first, "edge": EDGES["now"], "level": 0.0}
    found = _TRIGGER.match(text)
    try:
        level = float(found["level"]) if found else math.nan
    except ValueError:
        level = math.nan
    if found is None or not math.isfinite(level):
        raise UserError(f"--trigger '{text}': give SIGNAL>LEVEL, SIGNAL<LEVEL or SIGNAL=LEVEL")
    edge = {">": "rising", "<": "falling", "=": "either"}[found["how"]]
    return {"trigger": found["signal"], "edge": EDGES[edge], "level": level}


def take(
    drive: Client,
    names: list[str],
    trigger: dict[str, Any],
    *,
    before: float,
    every: int,
    rows: int,
    wait_s: float,
) -> Recording:
    """Arms, waits, reads; UserError when the trigger does not come."""
    until_s = time.monotonic() + wait_s
    while True:
        try:
            drive.arm(names, **trigger, before=before, decimation=every, rows=rows)
            break
        except RefusedError as refused:
            # One trace at a time: whoever has it is done soon.
            if refused.status != link.TAKEN or time.monotonic() > until_s:
                raise
            time.sleep(POLL_S)
    while (state := drive.trace_state()).state != 3:
        if time.monotonic() > until_s:
            drive.stop_trace()
            raise UserError(f"no trigger within {wait_s:g} s; look at the signal with --live")
        time.sleep(POLL_S)
    words = drive.trace_words(state)
    return recording(drive, words, state.signals, state.trigger_row, state.decimation)


def _live(drive: Client, names: list[str]) -> None:
    from zerohertz.link.live import live_plot

    console = Console()
    size = (console.size.width, max(console.size.height - 2, 10))
    try:
        with Live(console=console, auto_refresh=False, screen=True) as screen:
            live_plot(drive, names, lambda t: screen.update(Text.from_ansi(t), refresh=True), size)
    except KeyboardInterrupt:
        pass


def faults(
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="FILE", help="Write the fault record, .csv or .mf4."),
    ] = None,
    clear: Annotated[
        bool, typer.Option("--clear", help="Delete the fault list and the record.")
    ] = False,
    key: SealKeyOption = None,
    port: PortOption = None,
    baud: BaudOption = DEFAULT_BAUD,
    sil: SilOption = False,
    tcp: TcpOption = DEFAULT_TCP_PORT,
    as_json: Json = False,
) -> None:
    """List the drive's faults, and read the record of the last one that opened the gates."""
    with open_client(port, baud, sil, tcp, key) as drive:
        ever, entries = drive.faults()
        kept = drive.fault_record()
        if as_json:
            head = dataclasses.asdict(kept[0]) if kept else None
            listed = [dataclasses.asdict(e) for e in entries]
            _print_json({"faults": ever, "last": listed, "record": head})
        else:
            _show_faults(drive, ever, entries, kept[0] if kept else None)
        if out is not None:
            if kept is None:
                raise UserError(f"{out}: there is no record; no fault has opened the gates yet")
            head, words = kept
            write(out, recording(drive, words, head.signals, head.fault_row, 1))
        if clear:
            drive.clear_faults()


def _show_faults(
    drive: Client, ever: int, entries: list[link.FaultEntry], record: link.FaultRecord | None
) -> None:
    console = Console(highlight=False)
    console.print(f"{ever} faults" if ever != 1 else "1 fault")
    period_s = drive.identity.period_s
    for entry in entries:
        console.print(
            f"  {entry.number:4d}  {entry.period * period_s:10.4f} s after start  "
            f"{state_name(entry.state)}  {fault_names(entry.faults)}"
        )
    if record is not None:
        origin = ", from before the last reset" if record.from_before_reset else ""
        console.print(
            f"record of {record.rows} periods round {record.period * period_s:.4f} s{origin}"
        )


def status_line(s: link.Status) -> str:
    """What the drive is doing, on one line."""
    speed_rpm, reference_rpm = s.speed_hat_rad_s * RPM_PER_RAD_S, s.speed_ref_rad_s * RPM_PER_RAD_S
    torque_mode = s.command & link.TORQUE_MODE != 0
    parts = [
        state_name(s.state),
        (" unknown" if s.speed_unknown else f"{speed_rpm:8.1f}")
        + ("" if torque_mode else f" of {reference_rpm:.1f}")
        + " min^-1",
        f"i_d {s.i_d_A:.2f} A",
        f"i_q {s.i_q_A:.2f}" + (f" of {s.i_q_ref_A:.2f}" if torque_mode else "") + " A",
        f"f_s {s.stator_frequency_Hz:.2f} Hz",
        f"dc {s.u_dc_V:.0f} V",
    ]
    if s.confidence:
        parts.append(CONFIDENCE.get(s.confidence, f"confidence {s.confidence}"))
    if s.command_ran_out:
        parts.append("run command ran out")
    if s.faults:
        parts.append(fault_names(s.faults))
    return "  ".join(parts)


def state_name(number: int) -> str:
    return State(number).name if number in State._value2member_map_ else f"state {number}"


def fault_names(bits: int) -> str:
    names = []
    for k in range(32):
        if bits & (1 << k):
            known = (1 << k) in Fault._value2member_map_
            names.append(str(Fault(1 << k).name) if known else f"bit {k}")
    return " ".join(names)


def _short(value: float) -> float:
    """The shortest number that is the same float32."""
    return float(f"{value:.7g}")


def _print_json(value: dict[str, Any]) -> None:
    print(json.dumps(value, indent=2))
