"""A motor found by a drive on its line, taken over into the drive, and run after a power cycle.

The drive's time passes only while it is asked, so every test repeats exactly.
"""

from __future__ import annotations

import dataclasses
import math
import tomllib
from pathlib import Path

import pytest
from typer.testing import CliRunner

from zerohertz.cli import make_app
from zerohertz.commission import board_run, campaign, finding
from zerohertz.commission.folder import rig_file
from zerohertz.commission.plate import read_plate
from zerohertz.errors import UserError
from zerohertz.link import client as link
from zerohertz.link.client import Client, RefusedError
from zerohertz.link.command import sil_job, with_motor
from zerohertz.link.server import DirectLine, LinkedDrive
from zerohertz.link.siphash import DEVELOPMENT_KEY
from zerohertz.motor import load_motor
from zerohertz.terminals import Fault

RIG = "im_4kw_400v"
PLATE = read_plate(rig_file(RIG))


PERIODS = 100  # of the drive, while one answer is waited for


def served(keep: Path | None = None, **faults: object) -> LinkedDrive:
    job = with_motor(sil_job("recommended", "0", []), RIG)
    overrides = {**job.scenario_overrides, **{f"faults.{k}": v for k, v in faults.items()}}
    return LinkedDrive(dataclasses.replace(job, scenario_overrides=overrides, seed=3), keep=keep)


def client_of(drive: LinkedDrive, periods: int = PERIODS) -> Client:
    return Client(DirectLine(drive, periods), timeout_s=10.0)


def pause_of(drive: LinkedDrive) -> board_run.Pause:
    return DirectLine(drive, PERIODS).pause


def silent(_: str) -> None:
    pass


def unlocked(drive: LinkedDrive, periods: int = PERIODS) -> Client:
    drive.run(60_000)  # offsets, and the wait before a challenge is heard
    client = client_of(drive, periods)
    client.unlock(DEVELOPMENT_KEY)
    return client


def test_a_drive_finds_its_motor_keeps_it_and_runs_it_after_a_power_cycle(tmp_path: Path) -> None:
    said: list[str] = []
    with served(tmp_path / "flash") as drive:
        client = unlocked(drive)
        before = client.get(list(client.parameters))
        found = finding.of_drive(client, RIG, PLATE, said.append, pause=pause_of(drive))
        assert found.motor is not None
        assert said[0] == board_run.STAGES[0]
        assert "magnetising curve, level 8 of 8" in said
        true = campaign.true_circuit(rig_file(RIG), found.motor.main_flux_Wb)
        for name, wrong in campaign.errors(found.motor, true).items():
            assert abs(wrong) <= campaign.GOALS[name], (name, wrong)
        # Nothing is kept that nobody asked for.
        assert client.get(list(client.parameters)) == before
        kept = board_run.keep(client, found.motor, found.plate, found.board)
        found.write(tmp_path)
    assert load_motor(tmp_path).circuit.Rs_ohm == pytest.approx(found.motor.circuit.Rs_ohm, 1e-5)
    with served(tmp_path / "flash") as drive:
        client = unlocked(drive)
        assert client.store().found == 1
        assert client.get(list(kept)) == pytest.approx(kept, rel=1e-6)
        half_rpm = 0.5 * PLATE.speed_rpm
        client.set("command_timeout_s", 0.0)  # one command for all of the run
        client.command(link.RUN, half_rpm * math.pi / 30.0)
        drive.run(40_000)
        assert client.status().faults == 0
        assert drive.state.speed_rpm == pytest.approx(half_rpm, abs=0.01 * PLATE.speed_rpm)


def test_what_the_guard_finds_comes_over_the_line_and_everything_is_put_back() -> None:
    with served(open_phase='"v"', open_s=0.0) as drive:
        client = unlocked(drive)
        before = client.get(list(client.parameters))
        with pytest.raises(UserError, match="CURRENT_SENSOR"):
            finding.of_drive(client, RIG, PLATE, silent, pause=pause_of(drive))
        assert client.get(list(client.parameters)) == before
        assert not drive.state.gates_on
        with pytest.raises(UserError, match=r"FAULT CURRENT_SENSOR.*--reset"):
            finding.of_drive(client, RIG, PLATE, silent, pause=pause_of(drive))


def test_a_host_that_gives_up_leaves_the_gates_off_and_the_parameters_as_they_were() -> None:
    def give_up(stage: str) -> None:
        if "level 3" in stage:
            raise KeyboardInterrupt

    with served() as drive:
        client = unlocked(drive)
        before = client.get(list(client.parameters))
        with pytest.raises(KeyboardInterrupt):
            finding.of_drive(client, RIG, PLATE, give_up, pause=pause_of(drive))
        assert not drive.state.gates_on
        assert client.get(list(client.parameters)) == before


def test_a_locked_drive_is_told_so() -> None:
    with served() as drive:
        drive.run(1000)
        client = client_of(drive)
        with pytest.raises(RefusedError, match="--unlock"):
            finding.of_drive(client, RIG, PLATE, silent, pause=pause_of(drive))
        assert not drive.state.gates_on


def test_a_board_too_small_for_the_motor_is_not_even_tried() -> None:
    with served() as drive:
        client = unlocked(drive)
        with pytest.raises(UserError, match="this board trips at"):
            board_run.commission(
                client, read_plate(rig_file("im_75kw_400v")), silent, pause=pause_of(drive)
            )


def test_a_hoist_says_why_it_is_not_commissioned(monkeypatch: pytest.MonkeyPatch) -> None:
    """The image has terminals with a brake: their word stands behind the status."""
    with served() as drive:
        client = unlocked(drive)
        request, refused = Client.request, Fault.COMMISSION_REFUSED.to_bytes(4, "little")

        def told(self: Client, op: int, *rest: object, **names: object) -> bytes:
            if op == link.Op.COMMAND or op == link.Op.SEALED:
                return b""  # nothing starts
            body = request(self, op, *rest, **names)
            return body[:-4] + refused if op == link.Op.STATUS else body

        assert client.status().terminal_faults == 0
        monkeypatch.setattr(Client, "request", told)
        with pytest.raises(UserError, match="COMMISSION_REFUSED"):
            board_run._follow(client, silent, pause_of(drive))


def test_firmware_that_cannot_tell_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def unknown(self: Client) -> None:
        raise RefusedError("telling what commissioning found", 5)

    with served() as drive:
        client = unlocked(drive)
        monkeypatch.setattr(Client, "commissioning", unknown)
        with pytest.raises(UserError, match="firmware cannot report"):
            board_run.commission(client, PLATE, silent, pause=pause_of(drive))


def test_values_that_only_fit_together_are_set_whatever_their_order() -> None:
    with served() as drive:
        client = unlocked(drive)
        # M first would be more than Ls Lr allow.
        larger = {"M_H": 0.25, "Ls_H": 0.27, "Lr_H": 0.27}
        board_run.put(client, larger)
        assert client.get(list(larger)) == pytest.approx(larger)
        with pytest.raises(RefusedError, match=r"has to be below 0\.27 H with Ls_H"):
            board_run.put(client, {"M_H": 0.28})


# A sample every 2 ms. One every 70 ms: the drive's tables take longer than a command holds, and the
# fastest ramp has 8 samples in its middle.
@pytest.mark.parametrize("periods", [10, 350])
def test_a_drive_turns_its_motor_too_and_is_then_as_it_was(periods: int) -> None:
    with served() as drive:
        client = unlocked(drive, periods)
        before = client.get(list(client.parameters))
        found = finding.of_drive(client, RIG, PLATE, silent, rotate=True, pause=pause_of(drive))
        assert client.get(list(client.parameters)) == before
        assert not drive.state.gates_on
    true = tomllib.loads(rig_file(RIG).read_text())["mechanics"]
    assert found.motor is not None
    assert found.mechanics is not None
    wrong = campaign.mechanical_errors(found.mechanics, true, PLATE)
    wrong |= campaign.errors(
        found.motor, campaign.true_circuit(rig_file(RIG), found.motor.main_flux_Wb)
    )
    for name, error in wrong.items():
        assert abs(error) <= campaign.GOALS[name], (name, error)
    assert "per rad/s" in found.text()


@pytest.mark.parametrize(
    ("words", "what"),
    [
        ([], "--rig NAME, or --plate"),
        (["--rig", RIG, "--sil"], "--rig NAME, or --plate"),
        (["--plate", RIG], "--rig NAME, or --plate"),
        (["--sil"], "--rig NAME, or --plate"),
        (["--plate", RIG, "--sil", "--board", "x.toml"], "--board"),
        (["--rig", RIG, "--save"], "--save"),
        (["--plate", "nobody", "--sil"], "known are"),
        (["--plate", RIG, "--port", "/dev/no_such_port"], "no such device; serial ports here: "),
    ],
)
def test_the_command_refuses_what_makes_no_sense(words: list[str], what: str) -> None:
    result = CliRunner().invoke(make_app(), ["commission", *words])
    assert isinstance(result.exception, UserError), result.output
    assert what in str(result.exception)
