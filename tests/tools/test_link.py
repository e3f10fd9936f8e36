"""The host link against the SIL drive: parameters, commands, trace and faults, as a user meets
them. The drive's time passes only while it is asked, so every test repeats exactly."""

from __future__ import annotations

import contextlib
import csv
import dataclasses
import json
import re
import struct
import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from zerohertz import sim
from zerohertz.cli import make_app
from zerohertz.drive import Fault
from zerohertz.errors import UserError
from zerohertz.link import client as link
from zerohertz.link import command, run_command
from zerohertz.link.client import Client, RefusedError
from zerohertz.link.line import SerialLine, TcpLine
from zerohertz.link.live import picture
from zerohertz.link.parameters import Parameter, record_lines
from zerohertz.link.ports import BrokerEnd
from zerohertz.link.recording import recording, unit_of, write
from zerohertz.link.server import LinkedDrive, PtyEnd, serve
from zerohertz.link.siphash import DEVELOPMENT_KEY, load_key, siphash_2_4
from zerohertz.paths import ROOT

QUICK = {
    "offset_calibration_s": 0.02,
    "premagnetise_s": 0.5,
    "observer_gain_enable": 1,
    "command_timeout_s": 0.0,  # these drives' time runs faster than who commands them
}
PERIOD_S = 200e-6
IDEAL_J_KG_M2 = 0.015  # host_sim/rigs/ideal.toml


class SilLine:
    """A line whose other end lives only while somebody waits at this one."""

    def __init__(self, drive: LinkedDrive, lose: int = 0) -> None:
        self.drive, self.lose = drive, lose
        self._waiting = b""

    def send(self, data: bytes) -> None:
        self._waiting += data

    def receive(self, timeout_s: float) -> bytes:
        taken, said = self.drive.run(5, self._waiting)
        self._waiting = self._waiting[taken:]
        if said and self.lose > 0:
            self.lose -= 1
            return b""
        return said

    def close(self) -> None:
        pass


@pytest.fixture
def sil() -> Iterator[LinkedDrive]:
    with LinkedDrive(job()) as drive:
        drive.run(5300)  # offsets, and the time without a challenge
        yield drive


def job(**more: object) -> sim.Job:
    flat = {"profiles.load_torque_Nm": [[0.0, 0.0]]}
    return sim.Job(firmware=QUICK, scenario_overrides=flat, seed=1, **more)


@pytest.fixture
def drive(sil: LinkedDrive) -> Client:
    return Client(SilLine(sil), timeout_s=60.0)


def seconds(sil: LinkedDrive, s: float) -> None:
    sil.run(round(s / PERIOD_S))


def test_says_who_it_is_and_lists_what_it_has(drive: Client) -> None:
    from zerohertz.drive import parameters

    assert drive.identity.text.startswith("ZeroHertz port=sil motor=")
    assert drive.identity.period_s == pytest.approx(PERIOD_S)
    # The default is what applies where nothing was saved: that of this image.
    expected = {
        p.name: (p.unit, p.minimum, p.maximum, pytest.approx(QUICK.get(p.name, p.initial)), p.whole)
        for p in parameters()
    }
    told = {
        p.name: (p.unit, p.minimum, p.maximum, p.initial, p.whole)
        for p in drive.parameters.values()
    }
    assert told == expected
    assert drive.signal("duty_u").number == 0
    assert drive.signal("faults").whole


def test_reads_all_parameters_and_changes_one(drive: Client) -> None:
    values = drive.get(list(drive.parameters))
    assert values["premagnetise_s"] == pytest.approx(0.5)
    drive.set("i_d_A", 3.5)
    assert drive.get(["i_d_A"]) == {"i_d_A": 3.5}


@pytest.mark.parametrize(
    ("name", "value", "status"),
    [("i_d_A", 1e9, 2), ("i_d_A", float("nan"), 1), ("eps1_mode", 0.5, 3), ("Rs_ohm", 1.0, 9)],
)
def test_a_refusal_says_why(drive: Client, name: str, value: float, status: int) -> None:
    before = drive.get([name])
    with pytest.raises(RefusedError, match=name) as refused:
        drive.set(name, value)
    assert refused.value.status == status
    assert drive.get([name]) == before


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("i_d_A", 500.0, "i_d_A = 500 A has to be at most 8 A with i_d_max_A = 8 A"),
        ("i_d_max_A", 2.0, "i_d_A = 4.5 A has to be at most 2 A with i_d_max_A = 2 A"),
        ("i_d_A", 1e9, "is out of range; give 0.01 .. 10000 A"),
        ("eps1_mode", 3.0, "is out of range; give one of off, always, near_zero"),
        ("economy_flux_min", 0.05, "economy_flux_min = 0.05 has to be at least 0.1"),
    ],
)
def test_a_refused_value_names_what_is_allowed(
    drive: Client, name: str, value: float, words: str
) -> None:
    with pytest.raises(RefusedError, match=re.escape(words)):
        drive.set(name, value)
    assert drive.store().conflict == ""


def test_groups_and_choices_come_from_the_drive(drive: Client) -> None:
    action = drive.parameter("lost_action")
    assert (action.group, action.choices) == ("orientation", ("warn", "fault", "i_f"))
    assert drive.parameter("i_d_A").choices == ()
    assert (action.number("i_f"), action.number("1")) == (2.0, 1.0)
    with pytest.raises(UserError, match="lost_action: 'trip': give one of warn, fault, i_f"):
        action.number("trip")
    # A drive of before them ends its answer at the unit.
    body = struct.pack("<BBfff", 0, 1, 0.0, 2.0, 1.0) + b"\x03abc\x01A"
    old = Parameter.from_answer(7, body)
    assert (old.name, old.unit, old.group, old.choices) == ("abc", "A", "", ())


def former_record(kept: Path) -> None:
    """The record of commit 54f5414 (tests/unit/record_54f5414.h) in the first slot of the file."""
    text = (ROOT / "tests" / "unit" / "record_54f5414.h").read_text()
    words = [int(word, 16) for word in re.findall(r"0x([0-9a-f]{8})u", text)]
    record = struct.pack(f"<{len(words)}I", *words)
    content = bytearray(kept.read_bytes())
    at = content.index(struct.pack("<I", words[0]))
    content[at : at + len(record)] = record
    kept.write_bytes(content)


def test_what_became_of_a_record_of_former_names_is_told(tmp_path: Path) -> None:
    kept = tmp_path / "drive.zh"
    tables = {"motor_dir": ROOT / "gain_tables" / "hasegawa2005_recommended"}
    with LinkedDrive(job(**tables), keep=kept) as sil:
        sil.run(5300)
        Client(SilLine(sil), timeout_s=0.1).save()
    former_record(kept)
    with LinkedDrive(job(**tables), keep=kept) as sil:
        drive = Client(SilLine(sil), timeout_s=0.1)
        sil.run(300)
        store = drive.store()
        assert (store.found, store.taken, store.renamed, store.unknown) == (1, 99, 3, 37)
        assert "3 renamed, 37 in the record, not known any more" in command.store_text(store)
        assert drive.get(["i_f_A", "i_d_A"]) == {"i_f_A": 14.0, "i_d_A": 5.0}
        lines = record_lines(drive.record(), drive.parameters)
        assert len(lines) == 40
        assert "impressed_A = 14 is i_f_A now: taken" in lines
        assert "rs_track_low = 0.95 is a constant now, 0.98" in lines
        assert "rs_track_high = 1.5 is a constant now, 1.5: the same" in lines
        assert "rs_low_A = 4.5 is derived now: 0.625 rs_high_A" in lines
        # The image's table has a number that the simulation's has not: saved anew with the key.
        # It holds a pair of values, too, that made a trip toothless.
        assert "over_speed_rad_s" in drive.store().conflict
        assert command.fault_names(drive.status().faults) == "CONFIG"
        seconds(sil, 10.5)
        drive.unlock(DEVELOPMENT_KEY)
        assert not drive.save().failed
        assert record_lines(drive.record(), drive.parameters) == []


def test_names_that_do_not_exist_are_told_before_anything_is_sent(drive: Client) -> None:
    with pytest.raises(UserError, match="impressed_A: is called i_f_A now"):
        drive.set("impressed_A", 1.0)
    with pytest.raises(UserError, match="no such parameter"):
        drive.set("speed", 1.0)
    with pytest.raises(UserError, match="no such signal"):
        drive.sample(["speed"])


def test_runs_to_a_speed_changes_a_parameter_while_running_and_stops(
    sil: LinkedDrive, drive: Client
) -> None:
    drive.command(link.RUN, 300.0 / command.RPM_PER_RAD_S)
    seconds(sil, 3.0)
    status = drive.status()
    assert command.state_name(status.state) == "RUN"
    assert status.faults == 0
    assert sil.state.speed_rpm == pytest.approx(300.0, abs=15.0)
    with pytest.raises(RefusedError, match="gates off"):
        drive.set("swap_vw", 1.0)
    drive.set("i_d_A", 5.0)
    seconds(sil, 1.0)
    assert drive.status().i_d_A == pytest.approx(5.0, abs=0.3)
    drive.stop()
    seconds(sil, 0.01)
    assert not sil.state.gates_on


@pytest.mark.parametrize("torque_Nm", [2.0, -2.0])
def test_gives_a_torque_instead_of_a_speed(
    sil: LinkedDrive, drive: Client, torque_Nm: float
) -> None:
    drive.command(link.RUN, torque_Nm=0.0)
    seconds(sil, 2.0)
    assert command.state_name(drive.status().state) == "RUN"
    drive.command(link.RUN, torque_Nm=torque_Nm)
    seconds(sil, 0.3)  # at standstill the estimated speed lags, and the field with it
    begin_rpm = sil.state.speed_rpm
    seconds(sil, 0.2)
    # Without load and friction the torque is what the rotor's inertia takes.
    rise_rad_s = (sil.state.speed_rpm - begin_rpm) / command.RPM_PER_RAD_S
    assert rise_rad_s / 0.2 * IDEAL_J_KG_M2 == pytest.approx(torque_Nm, rel=0.05)
    status = drive.status()
    assert status.command == link.RUN | link.TORQUE_MODE
    line = command.status_line(status)
    assert f" of {status.i_q_ref_A:.2f} A" in line
    assert " min^-1" in line
    assert " of 0.0 min^-1" not in line


def test_a_host_that_dies_stops_the_drive(sil: LinkedDrive, drive: Client) -> None:
    drive.command(link.RUN, 10.0, valid_s=0.2)
    seconds(sil, 0.19)
    assert sil.state.gates_on
    seconds(sil, 0.03)
    assert not sil.state.gates_on
    assert drive.status().command_ran_out == 1


def test_who_comes_later_takes_over(sil: LinkedDrive, drive: Client) -> None:
    drive.command(link.RUN, 10.0)
    second = Client(SilLine(sil), timeout_s=60.0)
    second.command(0)
    with pytest.raises(RefusedError, match="taken over"):
        drive.command(link.RUN, 10.0)
    assert drive.status().command == 0


def test_a_lost_answer_is_asked_for_again(sil: LinkedDrive) -> None:
    patient = Client(SilLine(sil, lose=2), timeout_s=0.3)
    assert patient.status().good_frames == 1  # two answers lost: the first is told once more
    assert patient.status().good_frames == 4


def test_silence_is_told(sil: LinkedDrive) -> None:
    with pytest.raises(UserError, match="no answer to status"):
        Client(SilLine(sil, lose=10**9), timeout_s=0.01).status()


def start_trace(sil: LinkedDrive, drive: Client) -> tuple[link.TraceState, list[tuple[int, ...]]]:
    drive.arm(
        ["state", "i_s_alpha_A", "u_dc_V"],
        **command.parse_trigger("state>3", "state"),
        before=0.25,
        decimation=2,
        rows=400,
    )
    drive.command(link.RUN, 0.0)
    seconds(sil, 0.5)
    state = drive.trace_state()
    return state, drive.trace_words(state)


def test_a_trace_round_the_start_shows_the_current_rise(sil: LinkedDrive, drive: Client) -> None:
    seconds(sil, 0.2)
    drive.arm(
        ["state", "i_s_alpha_A", "u_dc_V"],
        **command.parse_trigger("state>3", "state"),
        before=0.25,
        decimation=2,
        rows=400,
    )
    seconds(sil, 0.2)
    drive.command(link.RUN, 0.0)
    seconds(sil, 0.5)
    state = drive.trace_state()
    assert (state.state, state.rows, state.trigger_row) == (3, 400, 100)
    record = recording(drive, drive.trace_words(state), state.signals, state.trigger_row, 2)
    assert record.t_s[100] == 0.0
    assert np.allclose(np.diff(record.t_s), 2 * PERIOD_S)
    assert set(record.columns["state"][:100]) == {2}
    assert set(record.columns["state"][100:]) == {3}
    assert abs(record.columns["i_s_alpha_A"][:100]).max() < 0.1
    assert record.columns["i_s_alpha_A"][-1] > 2.0
    assert record.columns["u_dc_V"] == pytest.approx(283.0, abs=2.0)


def test_a_trace_as_csv_and_as_mdf4_holds_the_same_numbers(
    sil: LinkedDrive, drive: Client, tmp_path: Path
) -> None:
    asammdf = pytest.importorskip("asammdf")
    state, words = start_trace(sil, drive)
    record = recording(drive, words, state.signals, state.trigger_row, state.decimation)
    write(tmp_path / "t.csv", record)
    write(tmp_path / "t.mf4", record)
    with (tmp_path / "t.csv").open() as file:
        rows = list(csv.DictReader(file))
    with asammdf.MDF(tmp_path / "t.mf4") as file:
        for name, column in record.columns.items():
            signal = file.get(name)
            assert np.array_equal(signal.samples, column)
            assert np.array_equal(signal.timestamps, record.t_s)
            assert signal.unit == unit_of(name)
            assert [np.float32(row[name]) for row in rows] == list(column.astype(np.float32))
    assert [float(row["t_s"]) for row in rows] == pytest.approx(list(record.t_s))


def test_another_ending_is_refused(drive: Client, tmp_path: Path) -> None:
    record = recording(drive, [(0,)], (4,), 0, 1)
    with pytest.raises(UserError, match=r"\.csv or \.mf4"):
        write(tmp_path / "t.xls", record)


def test_a_trigger_that_does_not_come_is_told(drive: Client) -> None:
    never = command.parse_trigger("u_dc_V>1000", "u_dc_V")
    with pytest.raises(UserError, match="no trigger within 0 s"):
        command.take(drive, ["u_dc_V"], never, before=0.5, every=1, rows=10, wait_s=0.0)
    assert drive.trace_state().state == 0


@pytest.mark.parametrize("text", ["state", "state>", "state>>3", ">3", "state>1e", "state>nan"])
def test_a_trigger_that_says_nothing_is_refused(text: str) -> None:
    with pytest.raises(UserError, match="--trigger"):
        command.parse_trigger(text, "state")


def test_units_end_the_names() -> None:
    assert unit_of("omega_e_hat_rad_s") == "rad/s"
    assert unit_of("i_s_alpha_A") == "A"
    assert unit_of("l1_re_per_s") == "1/s"
    assert unit_of("duty_u") == ""


def test_a_fault_is_listed_recorded_and_written(tmp_path: Path) -> None:
    dip = {"profiles.u_dc_V": [[0.0, 283.0], [2.1, 283.0], [2.101, 100.0], [2.3, 100.0]]}
    base = job()
    broken = sim.Job(firmware=QUICK, scenario_overrides={**base.scenario_overrides, **dip}, seed=1)
    with LinkedDrive(broken) as sil:
        drive = Client(SilLine(sil), timeout_s=60.0)
        assert drive.faults() == (0, [])
        assert drive.fault_record() is None
        seconds(sil, 1.2)
        drive.command(link.RUN, 0.0)
        seconds(sil, 1.1)
        assert not sil.state.gates_on
        ever, entries = drive.faults()
        assert ever >= 1
        assert command.fault_names(entries[-1].faults) == "DC_UNDER_VOLTAGE"
        kept = drive.fault_record()
        assert kept is not None
        head, words = kept
        record = recording(drive, words, head.signals, head.fault_row, 1)
        u_dc_V = record.columns["u_dc_V"]
        assert len(u_dc_V) == 48
        assert record.t_s[32] == 0.0
        assert u_dc_V[32] < 150.0 <= u_dc_V[31]
        write(tmp_path / "fault.csv", record)
        drive.clear_faults()
        assert drive.fault_record() is None


def test_the_picture_of_the_live_plot_names_its_curves() -> None:
    text = picture([0.0, 0.1, 0.2], {"i_d_A": [0.0, 1.0, 2.0]}, (60, 15))
    assert "i_d_A" in text
    assert len(text.splitlines()) >= 10


@contextlib.contextmanager
def served(end: BrokerEnd | PtyEnd) -> Iterator[None]:
    """The drive in a thread, as fast as it goes."""
    stop = threading.Event()
    with LinkedDrive(job()) as drive:
        arguments = (drive, end, 0.0, lambda: not stop.is_set())
        thread = threading.Thread(target=serve, args=arguments, daemon=True)
        thread.start()
        try:
            yield
        finally:
            stop.set()
            thread.join(10.0)
            end.close()


def test_the_commands_over_tcp(tmp_path: Path) -> None:
    end = BrokerEnd(0)
    app, runner = make_app(), CliRunner()

    def zh(*words: str) -> str:
        result = runner.invoke(app, [*words, "--sil", "--tcp", str(end.port)])
        assert result.exit_code == 0, (result.output, result.exception)
        return result.output

    with served(end):
        assert json.loads(zh("connect", "--json"))["status"]["state"] in (0, 1, 2)
        assert "i_d_A = 4.25 A" in zh("set", "i_d_A", "4.25")
        assert json.loads(zh("get", "i_d_A", "--json")) == {"i_d_A": 4.25}
        listed = zh("get")
        assert "premagnetise_s" in listed
        assert listed.index("\nmotor") < listed.index("Rs_ohm") < listed.index("\nboard")
        assert "lost_action = fault" in zh("set", "lost_action", "fault")
        assert json.loads(zh("get", "lost_action", "--json")) == {"lost_action": 1.0}
        assert "lost_action = warn" in zh("set", "lost_action", "0")
        assert "flying_start = on" in zh("set", "flying_start", "on")  # the shaft turns on
        zh("run", "--rpm", "60", "--seconds", "0.5", "--valid", "0")
        zh("run", "--torque-Nm", "0.5", "--seconds", "0.5", "--valid", "0")
        out = tmp_path / "t.csv"
        zh("trace", "--signals", "duty_u,state", "--rows", "20", "--out", str(out))
        assert len(out.read_text().splitlines()) == 21
        assert json.loads(zh("faults", "--json"))["record"] is None
        assert "READY" in zh("run", "--stop")
        assert "READY" in zh("run", "--reset")
        zh("run", "--reset", "--torque-Nm", "0", "--seconds", "0.1", "--valid", "0")


class Scripted:
    """A client whose drive says what the test says."""

    def __init__(self, drive: Client, faults: list[int]) -> None:
        self.drive, self.faults, self.asked = drive, faults, 0

    def status(self) -> link.Status:
        faults = self.faults[min(self.asked, len(self.faults) - 1)]
        self.asked += 1
        return dataclasses.replace(self.drive.status(), faults=faults)

    def __getattr__(self, name: str) -> object:
        return getattr(self.drive, name)


def test_a_run_ends_with_a_fault_and_goes_on_after_a_warning(
    drive: Client, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(run_command, "KEEP_ALIVE_S", 0.0)
    late, derated, stall = Fault.PERIOD_LATE, Fault.DERATED, Fault.STALL
    assert run_command.stopping(late | derated | Fault.REGENERATION) == 0
    assert run_command.stopping(late | stall) == stall
    assert run_command.stopping(1 << 31) == 1 << 31  # of a newer firmware: better stop

    scripted = Scripted(drive, [0, late, late, late | derated, late | derated | stall])
    run_command._run_until(scripted, 0.0, None, 60.0, 1.0)
    assert scripted.asked == 5
    said = capsys.readouterr().err
    assert said.count("warning: PERIOD_LATE: one control period ended after the next") == 1
    assert said.count("warning: DERATED: the current is limited") == 1
    assert "warning: STALL" not in said
    assert drive.status().command == 0  # stopped on the way out


def test_the_commands_refuse_what_makes_no_sense() -> None:
    app, runner = make_app(), CliRunner()
    for words, what in (
        (["connect"], "which drive"),
        (["connect", "--sil", "--port", "x"], "which drive"),
        (["run", "--sil"], "--rpm"),
        (["run", "--sil", "--rpm", "1", "--torque-Nm", "1"], "--torque-Nm"),
        (["run", "--sil", "--torque-Nm", "nan"], "finite"),
        (["run", "--sil", "--stop", "--rpm", "1"], "--rpm"),
        (["trace", "--sil", "--signals", ",", "--out", "x.csv"], "one to eight"),
        (["trace", "--sil", "--signals", "state"], "--out"),
        (["connect", "--port", "/dev/no_such_port"], "no such device; serial ports here: "),
        (["connect", "--sil", "--tcp", "1"], "no connection"),
        (["serve", "--set", "i_d_A"], "NAME=NUMBER"),
        (["serve", "--pty", "--tcp", "7405"], "--tcp: --pty serves on a terminal"),
    ):
        result = runner.invoke(app, words)
        assert isinstance(result.exception, UserError), (words, result.output)
        assert what in str(result.exception)


def test_studio_refuses_what_another_drive_would_not_hear() -> None:
    app, runner = make_app(), CliRunner()
    board = ["studio", "--port", "/dev/no_such_port"]
    for words, what in (
        ([*board, "--rig", "im_1kw5_200v"], "--rig: --port names a board"),
        ([*board, "my_pump"], "NAME: --port names a board"),
        ([*board, "--load", "1"], "--load: --port names a board"),
        ([*board, "--speed", "1"], "--speed: --port names a board"),
        ([*board, "--tcp", "7405"], "--tcp: --port names a board"),
        (["studio", "--sil", "--set", "i_d_A=1"], "--set: the drive of --sil has what"),
        (["studio", "--sil", "--keep", "x"], "--keep: the drive of --sil has what"),
        (["studio", "--sil", "--baud", "9600"], "--baud: only with --port"),
    ):
        result = runner.invoke(app, words)
        assert isinstance(result.exception, UserError), (words, result.output)
        assert what in str(result.exception)


def test_a_terminal_device_serves_the_same_bytes() -> None:
    end = PtyEnd()
    with served(end), Client(SerialLine(end.name)) as drive:
        assert drive.identity.text.startswith("ZeroHertz")
        assert drive.status().u_dc_V == pytest.approx(283.0, abs=3.0)


def test_a_line_that_closes_is_told() -> None:
    end = BrokerEnd(0)
    line = TcpLine(end.port)
    end.close()
    with pytest.raises(UserError, match="the other end has closed"):
        any(line.receive(1.0) for _ in range(20))  # whoever accepted it has to notice first


def test_the_same_run_with_and_without_talk_has_the_same_duties() -> None:
    scenario = sim.HOST_SIM / "scenarios" / "smoke.toml"
    quiet_job = sim.Job(scenario=scenario, firmware=QUICK, seed=1)
    with (
        LinkedDrive(quiet_job, commands_from_link=False) as quiet,
        LinkedDrive(quiet_job, commands_from_link=False) as talked,
    ):
        client = Client(SilLine(talked), timeout_s=60.0)
        client.command(link.TORQUE_OFF)  # this drive's commands come from elsewhere
        client.arm(["duty_u"], trigger="duty_u", edge=0, level=0, before=0, decimation=1, rows=0)
        client.get(list(client.parameters))
        talked.run(10000 - talked.state.periods)
        quiet.run(10000)
        assert talked.state.gates_on
        assert talked.state == quiet.state


def test_siphash_is_that_of_its_paper() -> None:
    """Appendix A of Aumasson and Bernstein (2012)."""
    assert siphash_2_4(bytes(range(16)), bytes(range(15))) == 0xA129CA6149BE45E5


def test_a_key_file_is_read_or_refused(tmp_path: Path) -> None:
    path = tmp_path / "key"
    path.write_text("00112233445566778899aabbccddeeff\n")
    assert load_key(path) == bytes(range(0, 256, 17))
    assert load_key(None) == DEVELOPMENT_KEY
    for text in ("0011", "zz" * 16):
        path.write_text(text)
        with pytest.raises(UserError, match="--key"):
            load_key(path)


def test_saved_parameters_and_the_fault_record_outlive_the_power(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What `zh serve --keep` does: unlocked, set, saved, tripped; then switched off and on."""
    kept = tmp_path / "drive.zh"
    with LinkedDrive(job(), keep=kept) as sil:
        sil.run(300)
        drive = Client(SilLine(sil), timeout_s=60.0)
        assert drive.store().found == 0
        with monkeypatch.context() as hasty:
            hasty.setattr(link, "_LOCKED_OUT_S", 0.0)
            with pytest.raises(RefusedError) as early:
                drive.unlock(DEVELOPMENT_KEY)
        assert early.value.status == 8
        seconds(sil, 10.5)
        with pytest.raises(UserError, match="key"):
            drive.unlock(bytes(16))
        drive.unlock(DEVELOPMENT_KEY)
        drive.set("Rs_ohm", 1.25)
        drive.set("i_d_A", 3.5)
        assert not drive.save().failed
        for name in ("i_d_A", "i_d_max_A", "i_q_max_A", "i_max_A"):
            drive.set(name, 2.44)
        drive.set("current_sum_max_A", 0.6)
        drive.set("i_trip_A", 2.0)  # not saved: to trip
        drive.command(link.RUN, 1.0)
        seconds(sil, 0.5)
        assert "OVER_CURRENT" in command.fault_names(drive.status().faults)
        number = drive.fault_record()[0].number
    with LinkedDrive(job(), keep=kept) as sil:
        drive = Client(SilLine(sil), timeout_s=60.0)
        sil.run(300)
        assert drive.get(["Rs_ohm", "i_d_A"]) == {"Rs_ohm": 1.25, "i_d_A": 3.5}
        assert drive.get(["i_trip_A"])["i_trip_A"] > 2.0
        assert drive.store().found == 1
        head = drive.fault_record()[0]
        assert (head.number, head.from_before_reset) == (number, True)
        assert drive.status().faults == 0
    kept.write_bytes(kept.read_bytes()[:100])
    with pytest.raises(UserError, match="delete it"):
        LinkedDrive(job(), keep=kept)


def test_what_can_hurt_is_refused_without_the_key(drive: Client, sil: LinkedDrive) -> None:
    """Session number and all, but no counter and MAC."""
    index = drive.parameter("speed_filter_s").index
    for op, body in (
        (link.Op.COMMAND, struct.pack("<IIfH", drive.session, link.RUN, 5.0, 0)),
        (link.Op.SET, struct.pack("<IHf", drive.session, index, 1.0)),
        (link.Op.SAVE, struct.pack("<I", drive.session)),
        (link.Op.FAULT_CLEAR, struct.pack("<I", drive.session)),
    ):
        with pytest.raises(RefusedError, match="needs the key") as refused:
            drive.request(op, body)
        assert refused.value.status == 11
    stranger = Client(SilLine(sil), timeout_s=60.0, key=bytes(range(16)))
    with pytest.raises(UserError, match="not this drive's"):
        stranger.command(link.RUN, 5.0)
    stranger.stop()
    assert drive.status().command == 0


def test_a_sealed_request_heard_on_the_line_is_of_no_use(drive: Client) -> None:
    sent: list[bytes] = []
    request = drive.request

    def listen(op: link.Op, body: bytes = b"", what: str = "") -> bytes:
        sent.append(body)
        return request(op, body, what)

    drive.request = listen  # type: ignore[method-assign]
    drive.set("i_d_A", 3.5)
    heard = sent[-1]
    drive.set("i_d_A", 4.0)
    changed = bytes((*heard[:10], heard[10] ^ 1, *heard[11:]))
    for body in (heard, changed, heard[:-1] + b"\0"):
        with pytest.raises(RefusedError):
            request(link.Op.SEALED, body)
    assert drive.get(["i_d_A"]) == {"i_d_A": 4.0}


def test_a_session_that_ended_by_itself_is_opened_again(drive: Client) -> None:
    drive.set("i_d_A", 3.5)
    drive.request(link.Op.CHALLENGE, struct.pack("<I", drive.session))  # ends it at once
    drive.set("i_d_A", 4.0)
    assert drive.get(["i_d_A"]) == {"i_d_A": 4.0}


def test_parameters_of_another_table_do_not_run(tmp_path: Path) -> None:
    kept = tmp_path / "drive.zh"
    tables = ROOT / "gain_tables"
    with LinkedDrive(job(motor_dir=tables / "hasegawa2005"), keep=kept) as sil:
        sil.run(5300)
        Client(SilLine(sil), timeout_s=60.0).save()
    with LinkedDrive(job(motor_dir=tables / "hasegawa2005_paper"), keep=kept) as sil:
        sil.run(5300)
        drive = Client(SilLine(sil), timeout_s=60.0)
        drive.command(link.RUN, 1.0)
        sil.run(300)
        assert command.fault_names(drive.status().faults) == "STORE"
        assert not sil.state.gates_on
        drive.stop()
        with pytest.raises(RefusedError, match="protected"):
            drive.save()
