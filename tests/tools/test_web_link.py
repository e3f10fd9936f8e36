"""The browser's link client (tools/web/src/link), in node: frames, seals and a served drive."""

from __future__ import annotations

import json
import os
import random
import shutil
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from test_broker import BrokerEnd, joined, serving

from zerohertz.link import client as link
from zerohertz.link.frame import Frame, Reader, encode
from zerohertz.link.frames import random_frames
from zerohertz.link.siphash import Seal, response
from zerohertz.paths import ROOT

WEB = ROOT / "tools" / "web"
KEY = bytes(range(0, 256, 17))
NONCE = 0xFEDCBA9876543210

pytestmark = pytest.mark.skipif(shutil.which("node") is None, reason="needs node")


@pytest.fixture
def port() -> Iterator[int]:
    end = BrokerEnd(0)
    with serving(end):
        yield end.port


def node(test: str, **environment: str) -> None:
    command = ("node", "--test", str(WEB / "test" / test))
    done = subprocess.run(
        command, env=os.environ | environment, capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, done.stdout[-4000:] + done.stderr[-1000:]


def frames_of_a_session(port: int) -> list[Frame]:
    """What the Python client sends and hears while it does one of everything."""
    heard: list[Frame] = []
    with joined(port, "recorder") as drive:
        ask: Callable[..., bytes] = drive.request

        def listen(op: link.Op, body: bytes = b"", what: str = "") -> bytes:
            answer = ask(op, body, what)
            heard.append(Frame(drive._sequence, op, body))
            heard.append(Frame(drive._sequence, op | link.ANSWER, b"\0" + answer))
            return answer

        drive.request = listen  # type: ignore[method-assign]
        drive.set("i_d_A", 4.0)
        drive.get(list(drive.parameters)[:20])
        drive.command(link.RUN, 10.0, valid_s=1.0)
        drive.status()
        drive.sample(["u_dc_V", "i_d_A"])
        drive.stop()
        drive.faults()
    return heard


def test_frames_and_seals_are_those_of_python(port: int, tmp_path: Path) -> None:
    rng = random.Random(3)
    frames = frames_of_a_session(port)
    frames += [Frame(n % 256, 0x21, rng.randbytes(n)) for n in range(245)]
    # The fuzz campaign's own: noise, damaged and whole frames.
    stream = b"ZeroHertz\r\n" + random_frames(2000, 2005, 0x12345678)
    seal = Seal(KEY, NONCE)
    requests = [rng.randbytes(n) for n in (1, 7, 14, 200)]
    record = {
        "frames": [
            {"sequence": f.sequence, "op": f.op, "body": f.body.hex(), "wire": encode(f).hex()}
            for f in frames
        ],
        "garbage": {
            "stream": stream.hex(),
            "frames": [[f.sequence, f.op, f.body.hex()] for f in Reader().feed(stream)],
        },
        "seal": {
            "key": KEY.hex(),
            "nonce": str(NONCE),
            "opened": response(KEY, NONCE, False).to_bytes(8, "little").hex(),
            "unlocked": response(KEY, NONCE, True).to_bytes(8, "little").hex(),
            "requests": [{"request": r.hex(), "sealed": seal.of(r).hex()} for r in requests],
        },
    }
    assert len(record["garbage"]["frames"]) > 100
    path = tmp_path / "record.json"
    path.write_text(json.dumps(record))
    node("frames.test.mjs", ZH_LINK_RECORD=str(path))


def test_the_client_runs_a_served_drive(port: int) -> None:
    node("drive.test.mjs", ZH_LINK_PORT=str(port))
