"""`zh campaign fuzz`: what a host can say, in numbers that leave little unsaid.

libFuzzer under both sanitizers on the parser alone and on the whole link; random frames into the
SIL drive in closed loop and into the running image, not one duty of which may change.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

from zerohertz.build import configure_tests, ensure_built
from zerohertz.errors import UserError
from zerohertz.image.loop import End
from zerohertz.link.frames import frames_into_image
from zerohertz.paths import BUILD, ROOT

# The parser is done with short inputs soon; long ones meet its limits.
_SHORT_BYTES, _LONG_BYTES, _LONG_SHARE = 48, 600, 0.02
_PERIODS_PER_FRAME = 16  # of the image, background slices being what they are
_DONE = re.compile(r"Done (\d+) runs")


@dataclass(frozen=True)
class Part:
    """One of the runs."""

    name: str
    wanted: int
    done: int
    good: bool
    seconds: float
    note: str


def run_all(parser: int, link: int, sil: int, image: int, seed: int) -> Iterator[Part]:
    """Each part that was asked for (0: none), as it ends."""
    long = round(parser * _LONG_SHARE)
    if parser:
        yield _libfuzzer("fuzz_command", parser - long, _SHORT_BYTES, seed)
        yield _libfuzzer("fuzz_command", long, _LONG_BYTES, seed)
    if link:
        yield _libfuzzer("fuzz_link", link, _LONG_BYTES // 2, seed)
    if sil:
        yield _sil(sil, seed)
    if image:
        yield _image(image, seed)


def as_json(seed: int, parts: list[Part]) -> str:
    rows = [asdict(p) | {"seconds": round(p.seconds)} for p in parts]
    return json.dumps({"seed": seed, "parts": rows}, indent=2)


def _libfuzzer(target: str, runs: int, max_bytes: int, seed: int) -> Part:
    for command in (("cmake", "--preset", "fuzz"), ("cmake", "--build", "--preset", "fuzz")):
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
        if done.returncode != 0:
            print(done.stdout + done.stderr, file=sys.stderr)
            raise UserError("preset fuzz: the build failed; clang needs libclang-rt-dev")
    start_s = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="zh-fuzz-") as corpus:
        command = (
            BUILD / "fuzz" / "tests" / "fuzz" / target,
            *(f"-runs={runs}", f"-max_len={max_bytes}", f"-seed={seed}"),
            *(
                "-print_final_stats=0",
                "-verbosity=1",
                f"-artifact_prefix={BUILD}/{target}-",
                corpus,
            ),
        )
        done = subprocess.run(command, capture_output=True, text=True, errors="replace")
    found = _DONE.search(done.stderr)
    count = int(found[1]) if found else 0
    good = done.returncode == 0 and count >= runs
    note = "" if good else done.stderr[-2000:]
    name = f"{target}, inputs to {max_bytes} bytes"
    return Part(name, runs, count, good, time.monotonic() - start_s, note)


def _sil(frames: int, seed: int) -> Part:
    configure_tests()
    folder = ensure_built("link_frames").folder
    start_s = time.monotonic()
    command = (folder / "tests" / "fuzz" / "link_frames", str(frames), str(seed))
    done = subprocess.run(command, capture_output=True, text=True)
    good = done.returncode == 0
    note = (done.stdout + done.stderr).strip()
    return Part(
        *("frames into the SIL drive", frames, frames if good else 0, good),
        *(time.monotonic() - start_s, note),
    )


def _image(frames: int, seed: int) -> Part:
    start_s = time.monotonic()
    run, talk = frames_into_image(frames, seed, max(_PERIODS_PER_FRAME * frames, 20_000))
    met = talk.good_frames + talk.bad_frames
    good = run.end is End.EQUAL and run.differing_bits == 0 and talk.session_after != 0
    note = (
        f"{run.periods} periods compared, {run.differing_bits} differing bits, "
        f"{talk.good_frames} frames good, {talk.bad_frames} refused {run.difference}"
    )
    return Part(
        *("frames into the emulated image", frames, met, good and met > frames // 2),
        *(time.monotonic() - start_s, note.strip()),
    )


def write(path: Path, text: str) -> None:
    try:
        path.write_text(text + "\n", encoding="utf-8")
    except OSError as error:
        raise UserError(f"{path}: cannot be written ({error})") from None
