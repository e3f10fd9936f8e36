"""The host link of the running image: answers as the SIL's, and no duty changed by noise."""

from __future__ import annotations

import json
from pathlib import Path

from zerohertz import sim
from zerohertz.build import build_image
from zerohertz.image import loop
from zerohertz.image.loop import End
from zerohertz.link.client import Client
from zerohertz.link.frame import decode
from zerohertz.link.frames import frames_into_image, random_frames
from zerohertz.link.line import UnixLine
from zerohertz.scenario.setup import load_setup

FRAMES, PERIODS = 3000, 40_000


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

    found: dict[str, object] = {}

    def ask(socket: Path) -> None:
        with Client(UnixLine(socket), timeout_s=10.0) as drive:
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

    setup = load_setup("recommended")
    table = setup.motor_dir / "l_gain.json"
    job = sim.Job(
        motor_dir=setup.motor_dir,
        board=setup.board,
        rig=setup.rig,
        firmware_config=setup.params,
        scenario_overrides={"scenario.duration_s": 30.0},
        decimate=1_000_000,
    )
    run = loop.run(job, build_image("qemu_mps2"), beside=ask)
    assert (run.end, run.differing_bits) == (End.EQUAL, 0)
    assert "port=qemu_mps2" in str(found["text"])
    assert found["table"] == int(json.loads(table.read_text())["crc32c"], 16)
    assert found["parameters"] == {p.name: (p.unit, p.initial) for p in parameters()}
    assert found["signals"][:3] == ["duty_u", "duty_v", "duty_w"]  # type: ignore[index]
    assert len(found["trace"]) == 20  # type: ignore[arg-type]
    assert isinstance(found["faults"], int)
