"""The host link of the running image: answers as the SIL's, and no duty changed by noise."""

from __future__ import annotations

import contextlib
import dataclasses
import json
import subprocess
from pathlib import Path
from typing import Any

from zerohertz import sim
from zerohertz.build import build_image
from zerohertz.drive import Fault
from zerohertz.errors import UserError
from zerohertz.image import loop
from zerohertz.image.emulator import save_memory
from zerohertz.image.loop import End
from zerohertz.link.client import Client
from zerohertz.link.frame import decode
from zerohertz.link.frames import frames_into_image, random_frames
from zerohertz.link.line import UnixLine
from zerohertz.link.siphash import DEVELOPMENT_KEY
from zerohertz.scenario.setup import load_setup

FRAMES, PERIODS = 3000, 40_000


def long_job(**scenario: float | str) -> sim.Job:
    """Long enough to be asked everything."""
    setup = load_setup("recommended")
    return sim.Job(
        motor_dir=setup.motor_dir,
        board=setup.board,
        rig=setup.rig,
        firmware_config=setup.params,
        scenario_overrides={"scenario.duration_s": 30.0} | scenario,
        decimate=1_000_000,
    )


def test_random_frames_into_the_running_image_change_no_bit() -> None:
    run, talk = frames_into_image(FRAMES, 1, PERIODS)
    assert (run.end, run.differing_bits, run.periods) == (End.EQUAL, 0, PERIODS)
    assert run.gates_on
    assert run.late_periods == 0
    chunks = [c for c in random_frames(FRAMES, 1, 0).split(b"\0") if c]
    good = sum(decode(chunk) is not None for chunk in chunks)
    assert good > FRAMES // 4
    # Every frame was met: two of the good ones are the questions behind them.
    assert (talk.good_frames, talk.bad_frames) == (good + 2, len(chunks) - good)


def test_the_image_answers_as_the_sil_does() -> None:
    from zerohertz.drive import parameters

    found: dict[str, Any] = {}

    def ask(socket: Path) -> None:
        with Client(UnixLine(socket), timeout_s=300.0) as drive:
            found["text"] = drive.identity.text
            found["table"] = drive.identity.table_crc32c
            found["parameters"] = {p.name: (p.unit, p.initial) for p in drive.parameters.values()}
            found["signals"] = [s.name for s in drive.signals.values()]
            now = {"trigger": "state", "edge": 0, "level": 0.0}
            drive.arm(["state"], **now, before=0.0, decimation=1, rows=20)
            while drive.trace_state().state != 3:
                pass
            found["trace"] = drive.trace_words(drive.trace_state())
            found["faults"] = drive.faults()[0]

    table = load_setup("recommended").motor_dir / "l_gain.json"
    run = loop.run(long_job(), build_image("qemu_mps2"), beside=ask)
    assert (run.end, run.differing_bits) == (End.EQUAL, 0)
    assert "port=qemu_mps2" in str(found["text"])
    assert found["table"] == int(json.loads(table.read_text())["crc32c"], 16)
    # The image's defaults are those of its configuration; it has no fieldbus.
    assert {n: unit for n, (unit, _) in found["parameters"].items()} == {
        p.name: p.unit for p in parameters() if p.group != "fieldbus"
    }
    assert found["parameters"]["rs_measure"] == ("", 1.0)
    assert found["signals"][:3] == ["duty_u", "duty_v", "duty_w"]
    assert len(found["trace"]) == 20
    assert isinstance(found["faults"], int)


def test_the_image_saves_and_guards_its_parameters() -> None:
    found: dict[str, Any] = {}

    def ask(socket: Path) -> None:
        with Client(UnixLine(socket), timeout_s=300.0) as drive:
            found["before"] = drive.store().found
            with contextlib.suppress(UserError):
                drive.set("Rs_ohm", 1.5)
            found["locked"] = drive.get(["Rs_ohm"])["Rs_ohm"]
            while drive.status().period < 52_000:  # the lock-out of every power-up: 10 s
                pass
            drive.unlock(DEVELOPMENT_KEY)
            found["saved"] = drive.save().failed
            found["unlocked"] = drive.store().unlocked

    run = loop.run(long_job(**{"scenario.run_on_s": 29.0}), build_image("qemu_mps2"), beside=ask)
    assert (run.end, run.differing_bits) == (End.EQUAL, 0)
    assert found.pop("locked") != 1.5
    assert found == {"before": 0, "saved": 0, "unlocked": 1}


def test_the_fault_record_survives_a_reset() -> None:
    """The RAM of a drive that tripped, under the start-up code of the next one."""
    elf = build_image("qemu_mps2")
    symbols = subprocess.run(
        ["arm-none-eabi-nm", "-S", elf], capture_output=True, text=True, check=True
    ).stdout
    address, size = next(
        (int(line.split()[0], 16), int(line.split()[1], 16))
        for line in symbols.splitlines()
        if line.endswith(" fault_memory")
    )
    found: dict[str, Any] = {}

    def trip(socket: Path) -> None:
        with Client(UnixLine(socket), timeout_s=300.0) as drive:
            while (record := drive.fault_record()) is None:
                pass
            found["first"] = record
            found["ram"] = save_memory(socket.parent, address, size)

    def ask(socket: Path) -> None:
        with Client(UnixLine(socket), timeout_s=300.0) as drive:
            found["second"] = drive.fault_record()

    broken = {"faults.sensor": "i_u", "faults.kind": "fixed", "faults.severity": 1.0}
    job = long_job(**broken, **{"faults.start_s": 1.0, "scenario.duration_s": 10.0})
    run = loop.run(job, elf, beside=trip)
    assert (run.end, run.faults & Fault.OVER_CURRENT) == (End.EQUAL, Fault.OVER_CURRENT)
    quiet = long_job(**{"scenario.duration_s": 10.0, "scenario.run_on_s": 9.0})
    assert loop.run(quiet, elf, beside=ask, kept=(address, found["ram"])).end is End.EQUAL
    head, rows = found["first"]
    assert found["second"] == (dataclasses.replace(head, from_before_reset=True), rows)
    # Of a cell that changed meanwhile nothing is believed.
    torn = bytes([*found["ram"][:-2000], found["ram"][-2000] ^ 1, *found["ram"][-1999:]])
    assert loop.run(quiet, elf, beside=ask, kept=(address, torn)).end is End.EQUAL
    assert found["second"] is None
