"""The boot loader on the emulated core: an update over its line, then the image it started."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import struct
import subprocess
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from zerohertz import sim
from zerohertz.build import build_image
from zerohertz.drive import State
from zerohertz.errors import UserError
from zerohertz.image import loop, sizes
from zerohertz.image.emulator import FROM_IMAGE, LINK, TO_IMAGE, emulator, save_memory
from zerohertz.image.loop import End
from zerohertz.link.client import Client
from zerohertz.link.line import UnixLine
from zerohertz.link.siphash import DEVELOPMENT_KEY
from zerohertz.scenario.setup import load_setup
from zerohertz.update import image as images
from zerohertz.update import restart
from zerohertz.update.image import DEVELOPMENT_SEED, Image
from zerohertz.update.loader import Loader, RefusedError, send

RUN_AT, COUNTER_AT = 0x00420000, 0x00410000
PATIENCE_S = 300.0
PERIODS = 2000
RAM_AT, STACK_BYTES = 0x20000000, 6144


@pytest.fixture(scope="module")
def loader() -> Path:
    return build_image("qemu_mps2", "zh_boot")


@pytest.fixture(scope="module")
def application() -> bytes:
    return build_image("qemu_mps2", "zh_above").with_suffix(".bin").read_bytes()


def signed(application: bytes, version: int, board: str = "qemu_mps2") -> Image:
    return images.make(application, board, version, DEVELOPMENT_SEED)


def job() -> sim.Job:
    setup = load_setup("recommended")
    return sim.Job(
        motor_dir=setup.motor_dir,
        board=setup.board,
        rig=setup.rig,
        firmware_config=setup.params,
        scenario_overrides={"scenario.duration_s": PERIODS * 200e-6},
        decimate=1_000_000,
    )


def client(socket: Path) -> Loader:
    return Loader(UnixLine(socket), answer_s=PATIENCE_S, slow_s=PATIENCE_S)


def test_an_update_over_the_line_runs_bit_for_bit(loader: Path, application: bytes) -> None:
    found: dict[str, Any] = {}

    def update(socket: Path) -> None:
        talk = client(socket)
        found["before"] = talk.find(PATIENCE_S, lambda _: None)
        found["after"] = send(talk, signed(application, 7), PATIENCE_S)

    run = loop.run(job(), loader, beside=update)
    assert (found["before"].running, found["before"].counter) == (0, 0)
    assert (found["after"].running, found["after"].counter) == (7, 7)
    assert (run.end, run.differing_bits, run.periods) == (End.EQUAL, 0, PERIODS)
    assert "port=qemu_mps2" in run.text


def test_what_was_programmed_into_the_slot_runs_bit_for_bit(
    loader: Path, application: bytes
) -> None:
    run = loop.run(job(), loader, kept=(RUN_AT, signed(application, 3).slot))
    assert (run.end, run.differing_bits, run.periods) == (End.EQUAL, 0, PERIODS)


def talk_to(
    loader: Path, kept: tuple[int, bytes] | None, talk: Callable[[Loader, Path], None]
) -> None:
    with emulator(loader, kept=kept) as board:
        line = UnixLine(board.folder / LINK)
        with contextlib.closing(line):
            talk(Loader(line, answer_s=PATIENCE_S, slow_s=PATIENCE_S), board.folder)


def test_a_changed_or_forged_image_is_not_started(loader: Path, application: bytes) -> None:
    """One bit of the application, one of the header, and a signature of somebody else's."""
    good = signed(application, 3).slot
    other = images.make(application, "qemu_mps2", 3, bytes(32)).slot
    for at, slot in ((512 + 5000, good), (8, good), (None, other)):
        torn = bytearray(slot)
        if at is not None:
            torn[at] ^= 1

        def talk(loader: Loader, _: Path) -> None:
            assert loader.find(PATIENCE_S, lambda _: None).running == 0

        talk_to(loader, (RUN_AT, bytes(torn)), talk)


def test_refusals_are_the_loaders_own_and_erase_nothing(loader: Path, application: bytes) -> None:
    kept = signed(application, 5).slot

    def talk(loader: Loader, folder: Path) -> None:
        assert loader.find(PATIENCE_S, lambda _: None).running == 5
        forged = images.make(application, "qemu_mps2", 6, bytes(32))
        for image, status in (
            (signed(application, 6, "stm32f405"), 2),
            (signed(application, 5), 3),
            (signed(application, 4), 3),
            (forged, 4),
        ):
            with pytest.raises(RefusedError) as refused:
                loader.update(image, lambda _: None)
            assert refused.value.status == status
        assert save_memory(folder, RUN_AT, len(kept)) == kept
        counter = save_memory(folder, COUNTER_AT, 32)
        assert struct.unpack("<8I", counter) == (*(5, 0xFFFFFFFA) * 3, 0xFFFFFFFF, 0xFFFFFFFF)[:8]
        # The stack lies lowest; what it never reached is as the emulator made it.
        stack = save_memory(folder, RAM_AT, STACK_BYTES)
        assert len(stack) - len(stack.lstrip(b"\0")) >= 1024
        with pytest.raises(UserError, match="this drive takes 6 or higher"):
            send(loader, signed(application, 5), PATIENCE_S)

    talk_to(loader, (RUN_AT, kept), talk)


class StandingMotor(threading.Thread):
    """In place of the plant: the same words in every period, to whatever image asks."""

    HELLO, START_WORDS, OUT_WORDS, IN = struct.Struct("<6I"), 4, 8, struct.Struct("<I2fI8H")
    MAGIC = 0x5A48504C

    def __init__(self, folder: Path) -> None:
        super().__init__(daemon=True)
        self._folder = folder
        self.images = 0  # that began
        self.periods = 0

    def wait(self, images: int) -> None:
        until_s = time.monotonic() + PATIENCE_S
        while self.images < images:
            assert time.monotonic() < until_s
            time.sleep(0.05)

    def run(self) -> None:
        sample = self.IN.pack(0, 0.0, 0.0, 0, *[8192] * 5, 11592, 0, 0)
        to = (self._folder / TO_IMAGE).open("wb", buffering=0)
        told = (self._folder / FROM_IMAGE).open("rb")
        waiting = out_bytes = 0  # bytes of a sample that a reset image never took
        with contextlib.suppress(BrokenPipeError), to, told:
            while first := told.read(4):
                if first != struct.pack("<I", self.MAGIC):
                    told.read(out_bytes - 4)
                    self.periods += 1
                else:
                    _, params, signals, *_ = self.HELLO.unpack(first + told.read(20))
                    out_bytes = 4 * (self.OUT_WORDS + signals)
                    # All zero but for what follows use_params = 0: the image's own parameters.
                    to.write(bytes(4 * self.START_WORDS + params - waiting))
                    told.read(4)
                    self.images += 1
                to.write(sample)
                waiting = len(sample)


def test_an_application_restarts_into_its_loader_for_an_update(
    loader: Path, application: bytes
) -> None:
    """The line is cut in the middle at first; then the same again, and an older version."""
    three, four = signed(application, 3), signed(application, 4)
    with emulator(loader, kept=(RUN_AT, three.slot), on_reset="reset") as board:
        motor = StandingMotor(board.folder)
        motor.start()

        def update(image: Image, progress: Callable[[int], None] = lambda _: None) -> str:
            line = UnixLine(board.folder / LINK)
            with contextlib.closing(line):
                call = functools.partial(restart.into_loader, line, DEVELOPMENT_KEY, PATIENCE_S)
                talk = Loader(line, answer_s=PATIENCE_S, slow_s=PATIENCE_S)
                state = send(talk, image, PATIENCE_S, progress, call=call)
                return restart.application(line, state.running, 5.0)

        def cut(count: int) -> None:
            if count > len(application) // 2:
                raise UserError("the line is gone")

        motor.wait(1)
        with pytest.raises(UserError, match=r"gone\. The update is not complete: give the same"):
            update(four, cut)
        motor.wait(2)  # nobody asks any more: version 3 again
        assert "port=qemu_mps2" in update(four)
        assert motor.images == 3
        with pytest.raises(UserError, match="is version 4; this drive takes 5 or higher"):
            update(four)


def test_an_application_stays_where_it_must(loader: Path, application: bytes) -> None:
    """With its gates on, for a wrong key, and without a loader below it."""
    found: list[str] = []

    def ask(socket: Path, key: bytes = DEVELOPMENT_KEY) -> None:
        with contextlib.closing(UnixLine(socket)) as line, pytest.raises(UserError) as refused:
            restart.into_loader(line, key, PATIENCE_S)
        found.append(str(refused.value))

    def running(socket: Path) -> None:
        with contextlib.closing(UnixLine(socket)) as line:
            restart.application(line, 3, 5.0)
        with Client(UnixLine(socket), timeout_s=PATIENCE_S) as drive:
            while drive.status().state != State.RUN:
                pass
        ask(socket)
        ask(socket, bytes(16))

    # The scenario's load comes while the drive still starts.
    unloaded = {"scenario.duration_s": 25.0, "profiles.load_torque_Nm": [[0.0, 0.0]]}
    long = dataclasses.replace(job(), scenario_overrides=unloaded)
    run = loop.run(long, loader, beside=running, kept=(RUN_AT, signed(application, 3).slot))
    assert (run.end, run.differing_bits, run.gates_on) == (End.EQUAL, 0, True)
    run = loop.run(long, build_image("qemu_mps2"), beside=ask)
    assert (run.end, run.differing_bits) == (End.EQUAL, 0)
    assert ["stop it" in found[0], "key is not this drive's" in found[1]] == [True, True]
    assert "has no boot loader below it" in found[2]


def said_by_the_f405(loader: Path, folder: Path, slot: bytes, until: bytes) -> bytes:
    """The third serial port of QEMU's STM32F405, whose flash can be read but not written."""
    (folder / "slot").write_bytes(slot)
    (folder / "counter").write_bytes(struct.pack("<2I", 7, 0xFFFFFFF8) * 3 + b"\xff" * 1000)
    command = (
        *("qemu-system-arm", "-M", "netduinoplus2", "-nographic", "-monitor", "none"),
        *("-serial", "null", "-serial", "null", "-serial", "stdio", "-kernel", str(loader)),
        *("-device", f"loader,file={folder}/slot,addr=0x08060000,force-raw=on"),
        *("-device", f"loader,file={folder}/counter,addr=0x08008000,force-raw=on"),
    )
    text = b""
    with subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE) as core:
        assert core.stdout is not None
        alarm = threading.Timer(PATIENCE_S, core.kill)
        alarm.start()
        while until not in text and (more := core.stdout.read1(4096)):
            text += more
        alarm.cancel()
        core.kill()
    return text


def test_the_loader_of_the_stm32f405_starts_what_is_proven(tmp_path: Path) -> None:
    loader = build_image("stm32f405", "zh_boot")
    application = build_image("stm32f405", "zh_above").with_suffix(".bin").read_bytes()
    image = signed(application, 7, "stm32f405")
    text = said_by_the_f405(loader, tmp_path, image.slot, b"drive off")
    assert text.startswith(b"ZeroHertz loader\r\nZeroHertz ")
    assert b"port=stm32f405" in text
    changed = bytearray(image.slot)
    changed[-1] ^= 1
    waits = b"ZeroHertz loader: waits for an update\r\n"
    assert said_by_the_f405(loader, tmp_path, changed, waits) == waits
    older = signed(application, 6, "stm32f405").slot
    assert said_by_the_f405(loader, tmp_path, older, waits) == waits


@pytest.mark.parametrize("preset", ["stm32f405", "stm32g431_esc", "stm32g431_ihm08m1"])
def test_there_is_room_for_the_application_above_the_loader(preset: str) -> None:
    """It has 512 bytes of header more than one without a loader; the linker refuses what is too
    large. Once nobody linked it on the smaller part, and it had outgrown its pages by 680 bytes."""
    application = build_image(preset, "zh_above").with_suffix(".bin").read_bytes()
    board = preset if preset == "stm32f405" else preset.removeprefix("stm32")
    assert len(signed(application, 7, board).slot) > len(application) > 80_000


@pytest.mark.parametrize("preset", ["stm32f405", "stm32g431_esc", "stm32g431_ihm08m1"])
def test_a_loader_leaves_alone_what_survives_a_reset(preset: str) -> None:
    """The fault record lies above all RAM that the loader uses."""
    end = sizes._symbols(build_image(preset, "zh_boot"))["boot_bss_end"][0]
    assert RAM_AT < end <= sizes._symbols(build_image(preset))["fault_memory"][0]
