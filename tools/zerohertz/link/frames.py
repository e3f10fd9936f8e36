"""Random frames into a running image (tests/fuzz/random_frames.h): none may change a duty."""

from __future__ import annotations

import contextlib
import subprocess
from dataclasses import dataclass
from pathlib import Path

from zerohertz import sim
from zerohertz.build import build_image, configure_tests, ensure_built
from zerohertz.errors import UserError
from zerohertz.image import loop
from zerohertz.link.client import Client
from zerohertz.link.line import UnixLine

_PATIENCE_S = 900.0  # 1e5 frames beside other load
_TRIES = 3  # on a busy machine the image may leave before anybody has asked it


@dataclass
class Talk:
    """What the image made of the frames."""

    good_frames: int = 0
    bad_frames: int = 0
    session_after: int = 0  # it still answers


def random_frames(count: int, seed: int, session: int) -> bytes:
    """Bytes on the wire, from the same generator as the SIL's."""
    configure_tests()
    folder = ensure_built("print_frames").folder
    command = (folder / "tests" / "fuzz" / "print_frames", str(count), str(seed), str(session))
    return subprocess.run(command, check=True, capture_output=True).stdout


def frames_into_image(count: int, seed: int, periods: int) -> tuple[loop.PilRun, Talk]:
    """A run of the image, compared with the SIL's in every bit, while `count` frames arrive."""
    talk = Talk()

    def beside(socket: Path) -> None:
        # The image hears this once it is through with the frames; it leaves after its periods.
        with contextlib.suppress(UserError):
            client = Client(UnixLine(socket), timeout_s=_PATIENCE_S)
            # A session first: no random frame asks for one, so that the answer is to this.
            talk.session_after = client.session
            status = client.status()
            talk.good_frames, talk.bad_frames = status.good_frames, status.bad_frames

    from zerohertz.scenario.setup import SCENARIOS, load_setup

    setup = load_setup("recommended")
    job = sim.Job(
        scenario=SCENARIOS / "smoke.toml",
        # The scenario's load comes while the drive still starts.
        scenario_overrides={
            "scenario.duration_s": 200e-6 * periods,
            "profiles.load_torque_Nm": [[0.0, 0.0]],
        },
        rig=setup.rig,
        board=setup.board,
        motor_dir=setup.motor_dir,
        firmware_config=setup.params,
        seed=1,
        decimate=1_000_000,
        max_steps=periods,
    )
    frames = random_frames(count, seed, 0)
    for _ in range(_TRIES):
        run = loop.run(job, build_image("qemu_mps2"), beside=beside, link_frames=frames)
        if talk.session_after != 0:
            break
    return run, talk
