"""The emulated core: qemu-system-arm with the flash image, and a folder with its two FIFOs."""

from __future__ import annotations

import contextlib
import os
import socket
import subprocess
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from zerohertz.errors import UserError
from zerohertz.link.line import UnixLine

LINK = "link"  # socket of the image's host link, in its folder
MONITOR = "monitor"  # and the emulator's own
# hal/qemu_mps2/pil_protocol.h
TO_IMAGE, FROM_IMAGE, LINK_FILE = "to_image", "from_image", "link_frames"
EXIT_DONE = 50  # hal/qemu_mps2/main.c

# One instruction is 64 ns of the emulated clock, so that timers count instructions exactly.
NS_PER_INSTRUCTION = 64
_ICOUNT = ("-icount", "shift=6,sleep=off")
_PATIENCE_S = 300.0  # a hung emulator, not a loaded machine


@dataclass
class Emulator:
    """A running image. `exit_code` and `text` are there once it has ended."""

    folder: Path
    process: subprocess.Popen[bytes]
    exit_code: int | None = None
    text: str = ""

    def wait(self) -> int:
        """Its exit code: EXIT_DONE, or the code of what stopped it (hal/cortex_m/cm_fault.h)."""
        if self.exit_code is None:
            try:
                out, _ = self.process.communicate(timeout=_PATIENCE_S)
                self.text = out.decode(errors="replace")
            except subprocess.TimeoutExpired:
                self.process.kill()
                self.process.communicate()
                raise UserError("emulator: did not end by itself; it was killed") from None
            self.exit_code = self.process.returncode
        return self.exit_code


def save_memory(folder: Path, address: int, size: int) -> bytes:
    """RAM of the image that runs in `folder`, while it runs."""
    with socket.socket(socket.AF_UNIX) as monitor:
        monitor.settimeout(_PATIENCE_S)
        monitor.connect(str(folder / MONITOR))
        prompts = 0
        monitor.sendall(f'pmemsave {address:#x} {size} "saved"\n'.encode())
        while prompts < 2:  # before the command and behind it
            prompts += monitor.recv(4096).count(b"(qemu) ")
    return (folder / "saved").read_bytes()


class StepLine:
    """The host's end of an image that was given no `link_frames`: each time something is sent the
    image lives on for some slices of its background, and no longer. Closed, it runs free."""

    _SLICES = 3
    _SLICE_BYTES = 64  # that the firmware takes of the line at a time; zeros are no frame

    def __init__(self, folder: Path) -> None:
        # The image opens its end first, and its serial port is there before that.
        self._said = (folder / LINK_FILE).open("wb", buffering=0)
        self._heard = UnixLine(folder / LINK)

    def send(self, data: bytes) -> None:
        self._said.write(data + bytes(self._SLICES * self._SLICE_BYTES))

    def receive(self, timeout_s: float) -> bytes:
        return self._heard.receive(timeout_s)

    def close(self) -> None:
        self._said.close()
        self._heard.close()


@contextlib.contextmanager
def emulator(
    elf: Path,
    machine: str = "mps2-an386",
    link_frames: bytes | None = b"",
    kept: tuple[int, bytes] | None = None,
    plugin: str | None = None,
    files: dict[str, bytes] | None = None,
    on_reset: str = "shutdown",
) -> Iterator[Emulator]:
    """The image, started in a folder of its own; killed when the block is left early.

    `link_frames` is what its host link hears first; None: what somebody writes into LINK_FILE, and
    it waits for that whenever it has time to listen (StepLine); `kept` an address in RAM and what
    stands there from before the reset; `plugin` the emulator's argument of that name; `files` lie
    in its folder. A reset of its own ends the emulator; with `on_reset` "reset" the image begins
    anew, with RAM as it was, and flash and `kept` as at first.
    """
    with tempfile.TemporaryDirectory(prefix="zh-pil-") as name:
        folder = Path(name)
        for fifo in (TO_IMAGE, FROM_IMAGE):
            os.mkfifo(folder / fifo)
        if link_frames is None:
            os.mkfifo(folder / LINK_FILE)
        elif link_frames:
            (folder / LINK_FILE).write_bytes(link_frames)
        for file, data in (files or {}).items():
            (folder / file).write_bytes(data)
        before: tuple[str, ...] = ()
        kernel = elf
        if kept is not None:
            (folder / "kept").write_bytes(kept[1])
            # An ELF would clear all that its headers name; flash alone leaves RAM to the image.
            kernel = elf.with_suffix(".bin")
            before = ("-device", f"loader,file=kept,addr={kept[0]:#x},force-raw=on")
        command = (
            *("qemu-system-arm", "-M", machine, "-nographic"),
            *("-monitor", f"unix:{MONITOR},server=on,wait=off", *before),
            *("-chardev", f"socket,id=link,path={LINK},server=on,wait=off"),
            *("-serial", "chardev:link", "-action", f"reboot={on_reset}", *_ICOUNT),
            *("-semihosting-config", "enable=on,target=native", "-kernel", str(kernel.resolve())),
            *(("-plugin", plugin) if plugin else ()),
        )
        try:
            process = subprocess.Popen(
                command,
                cwd=folder,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
            )
        except FileNotFoundError:
            raise UserError("qemu-system-arm: not installed; run tools/zh setup") from None
        try:
            yield Emulator(folder, process)
        finally:
            if process.poll() is None:
                process.kill()
            process.wait()
            if process.stdout is not None:
                process.stdout.close()
