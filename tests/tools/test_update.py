"""zh update: keys, signed images, and what it says to a loader that is none."""

from __future__ import annotations

import os
import re
import struct
import subprocess
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from zerohertz.errors import UserError
from zerohertz.link import client as link
from zerohertz.link.client import Client, NoAnswerError, Op
from zerohertz.link.frame import Frame, Reader, encode
from zerohertz.paths import ROOT
from zerohertz.update import command, loader, monocypher, restart
from zerohertz.update import image as images
from zerohertz.update.image import DEVELOPMENT_SEED, Image
from zerohertz.update.loader import Loader, RefusedError

APPLICATION = bytes(range(250)) * 3


@pytest.fixture
def app() -> typer.Typer:
    app = typer.Typer()
    command.register(app)
    app.command("other")(lambda: None)
    return app


def image(version: int = 7, board: str = "board") -> Image:
    return images.make(APPLICATION, board, version, DEVELOPMENT_SEED)


class FakeLoader:
    """The far end of a line: keeps what it is sent, answers as told."""

    def __init__(self, **state: int) -> None:
        self.state = {"running": 3, "counter": 3, "room": 4096} | state
        self.board = b"board"
        self.heard: list[Frame] = []
        self.refuse: dict[int, int] = {}
        self.lost = 0  # answers that do not arrive
        self.becomes: int | None = 7  # the version that runs behind a commit
        self._reader, self._said = Reader(), b""

    def send(self, data: bytes) -> None:
        for frame in self._reader.feed(data):
            self.heard.append(frame)
            if self.lost:
                self.lost -= 1
                continue
            self._said += encode(Frame(frame.sequence, frame.op | 0x80, self._answer(frame)))

    def _answer(self, frame: Frame) -> bytes:
        if status := self.refuse.get(frame.op):
            return bytes((status,))
        if frame.op == loader.COMMIT and self.becomes is not None:
            self.state |= {"running": self.becomes, "counter": self.becomes}
        if frame.op == loader.ASK:
            return b"\0" + struct.pack("<HIII16s", 1, *self.state.values(), self.board)
        return b"\0"

    def receive(self, timeout_s: float) -> bytes:
        said, self._said = self._said, b""
        return said

    def close(self) -> None:
        pass

    def ops(self) -> list[int]:
        return [frame.op for frame in self.heard]


def talk(far: FakeLoader) -> Loader:
    return Loader(far, answer_s=0.05, slow_s=0.05)


def test_all_of_an_image_arrives_in_order() -> None:
    far, sent = FakeLoader(), image()
    seen: list[int] = []
    assert loader.send(talk(far), sent, 1.0, seen.append).running == 7
    assert far.ops() == [0x70, 0x71, *[0x72] * 4, 0x73, 0x70]
    assert far.heard[1].body == sent.header
    data = [frame.body for frame in far.heard if frame.op == loader.DATA]
    assert b"".join(body[4:] for body in data) == sent.application
    assert [struct.unpack_from("<I", body)[0] for body in data] == [0, 224, 448, 672]
    assert seen[-1] == len(sent.application)


@pytest.mark.parametrize(
    ("version", "board", "state", "said"),
    [
        (7, "other", {}, "is for the board other; this one is board"),
        (3, "board", {}, "is version 3; this drive takes 4 or higher"),
        (2, "board", {"running": 0}, "is version 2; this drive takes 3 or higher"),
        (7, "board", {"room": 8}, "has 752 bytes; 8 is the most"),
    ],
)
def test_what_the_loader_would_refuse_is_not_sent(
    version: int, board: str, state: dict[str, int], said: str
) -> None:
    far = FakeLoader(**state)
    with pytest.raises(UserError, match=said):
        loader.send(talk(far), image(version, board), 1.0)
    assert set(far.ops()) == {loader.ASK}


@pytest.mark.parametrize("status", loader.REASONS)
def test_a_refusal_is_told_in_words(status: int) -> None:
    far = FakeLoader()
    far.refuse = {loader.BEGIN: status}
    with pytest.raises(RefusedError, match=re.escape(loader.REASONS[status])):
        loader.send(talk(far), image(), 1.0)
    assert loader.DATA not in far.ops()


def test_a_lost_answer_is_asked_for_again() -> None:
    far = FakeLoader()
    client = talk(far)
    client.find(1.0, lambda _: None)
    far.lost = 2
    client.update(image(), lambda _: None)
    assert far.heard[1] == far.heard[2] == far.heard[3]


def test_a_loader_that_falls_silent_is_told() -> None:
    far = FakeLoader()
    far.lost = 100
    with pytest.raises(UserError, match=r"fallen silent\. The update is not complete"):
        talk(far).update(image(), lambda _: None)
    with pytest.raises(UserError, match="no boot loader answers"):
        talk(far).find(0.3, lambda _: None)


def test_an_application_that_runs_is_told_from_silence() -> None:
    far = FakeLoader()
    far.refuse = {loader.ASK: 5}
    said: list[str] = []
    with pytest.raises(UserError, match="switch the drive off and on"):
        talk(far).find(0.3, said.append)
    assert said == ["the application runs"]


def test_an_application_is_asked_once_to_restart() -> None:
    far = FakeLoader()
    far.refuse = {loader.ASK: 5}
    calls: list[str] = []

    def call() -> None:
        calls.append("")
        far.refuse.clear()

    assert talk(far).find(1.0, calls.append, call).running == 3
    assert calls == [""]
    far.refuse = {loader.ASK: 5}
    with pytest.raises(UserError, match="no boot loader answers"):
        talk(far).find(0.3, lambda _: None, lambda: calls.append("again"))
    assert calls == ["", "again"]


@pytest.mark.parametrize(
    ("status", "said"),
    [
        (5, "has no boot loader below it"),
        (6, "add --by-hand"),
        (7, "somebody else has taken over"),
        (8, "the drive runs, or saves its parameters: stop it"),
        (9, None),  # a loader's: the reset was faster than the answer
        (-1, None),  # no answer: as before
    ],
)
def test_why_an_application_does_not_restart_is_told(
    status: int, said: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[tuple[int, bytes]] = []

    def sealed(drive: Client, op: Op, body: bytes, what: str) -> bytes:
        asked.append((op, body))
        if status < 0:
            raise NoAnswerError("no answer")
        raise link.RefusedError(what, status)

    monkeypatch.setattr(Client, "sealed", sealed)
    monkeypatch.setattr(Client, "session", 5)
    if said is None:
        restart.into_loader(FakeLoader(), bytes(16))
    else:
        with pytest.raises(UserError, match=said):
            restart.into_loader(FakeLoader(), bytes(16))
    assert asked == [(0x24, b"\5\0\0\0")]


def test_an_application_that_does_not_answer_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(restart, "_STARTS_WITHIN_S", 0.1)
    far = FakeLoader()
    far.lost = 1000
    with pytest.raises(UserError, match="version 7 is installed and proven, but does not answer"):
        restart.application(far, 7, 0.01, 0.01)


def test_an_update_that_does_not_start_is_told() -> None:
    far = FakeLoader()
    far.becomes = None
    with pytest.raises(UserError, match="version 3 starts instead"):
        loader.send(talk(far), image(), 1.0)


def test_a_signed_image_is_read_back_and_a_torn_one_is_not(tmp_path: Path) -> None:
    made, file = image(), tmp_path / "a.zhu"
    file.write_bytes(made.file)
    assert images.read(file) == made
    assert len(made.application) % 8 == 0
    for torn in (made.file[:-1], made.file[:-1] + b"\0", made.file + b"\0"):
        file.write_bytes(torn)
        with pytest.raises(UserError, match="is torn"):
            images.read(file)
    for other in (b"", b"ZHUP", b"\0" * 1000):
        file.write_bytes(other)
        with pytest.raises(UserError, match="is no signed image"):
            images.read(file)


def test_the_signature_is_of_the_header_and_the_key() -> None:
    made = image()
    text, signature = made.header[:96], made.header[96:]
    public = monocypher.public_key(DEVELOPMENT_SEED)
    assert monocypher.signed(signature, public, text)
    assert not monocypher.signed(signature, public, text[:-1] + b"\0")
    assert not monocypher.signed(signature, monocypher.public_key(bytes(32)), text)


def test_the_development_key_is_the_one_that_releases_refuse() -> None:
    text = (ROOT / "tools" / "cmake" / "ZhLoader.cmake").read_text()
    known = re.search(r"set\(ZH_DEVELOPMENT_UPDATE_KEY (\w+)\)", text)
    assert known is not None
    assert known[1] == monocypher.public_key(DEVELOPMENT_SEED).hex()


def test_a_key_is_its_owners_alone_and_never_overwritten(app: typer.Typer, tmp_path: Path) -> None:
    key = tmp_path / "my.key"
    assert CliRunner().invoke(app, ["update", "--make-key", str(key)]).exit_code == 0
    assert key.stat().st_mode & 0o777 == 0o600
    seed = images.read_key(key)
    assert (tmp_path / "my.key.pub").read_text().strip() == monocypher.public_key(seed).hex()
    assert seed != DEVELOPMENT_SEED
    with pytest.raises(UserError, match="cannot be made"):
        images.make_key(key)
    assert images.read_key(key) == seed
    key.write_text("nothing")
    with pytest.raises(UserError, match="holds no private key"):
        images.read_key(key)


def test_without_its_library_no_key_is_left_behind(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def missing(seed: bytes) -> bytes:
        raise UserError("not there")

    monkeypatch.setattr(monocypher, "public_key", missing)
    with pytest.raises(UserError, match="not there"):
        images.make_key(tmp_path / "my.key")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (("a.zhu", "--version", "7"), "--version: only with --sign"),
        (("a.zhu", "--port", "p", "--key", "k"), "--key: only with --sign"),
        (("a.zhu", "--drive-key", "k"), "--drive-key: only with --port"),
        (("a.zhu", "--by-hand"), "--by-hand: only with --port"),
        (("--make-key", "k", "--port", "p"), "--make-key: makes keys alone"),
        (("a.zhu", "--make-key", "k"), "--make-key: makes keys alone"),
    ],
)
def test_options_that_would_do_nothing_are_refused(
    app: typer.Typer, words: tuple[str, ...], why: str
) -> None:
    assert why in str(CliRunner().invoke(app, ["update", *words]).exception)


def test_an_image_that_cannot_be_written_is_told(app: typer.Typer, tmp_path: Path) -> None:
    (tmp_path / "firmware.bin").write_bytes(APPLICATION)
    words = ["--sign", str(tmp_path / "firmware.bin"), "--version", "7", "--board", "board"]
    done = CliRunner().invoke(app, ["update", str(tmp_path / "nowhere" / "a.zhu"), *words])
    assert isinstance(done.exception, UserError)
    assert "a.zhu: cannot be written" in str(done.exception)


def test_the_command_signs_for_the_board_that_was_built(app: typer.Typer, tmp_path: Path) -> None:
    binary, made = tmp_path / "firmware.bin", tmp_path / "a.zhu"
    binary.write_bytes(APPLICATION)
    words = ["update", str(made), "--sign", str(binary)]
    refused = CliRunner().invoke(app, words)
    assert "--version: is missing" in str(refused.exception)
    refused = CliRunner().invoke(app, [*words, "--version", "7"])
    assert "--board: is missing" in str(refused.exception)
    (tmp_path / "board.txt").write_text("board\n")
    done = CliRunner().invoke(app, [*words, "--version", "7"])
    assert done.exit_code == 0
    assert "warning: everybody has the development key" in done.output
    assert images.read(made) == image()
    told = CliRunner().invoke(app, ["update", str(made)])
    assert told.stdout.endswith("version 7 for board, 912 bytes\n")


def test_a_release_is_not_signed_with_everybodys_key(app: typer.Typer, tmp_path: Path) -> None:
    (tmp_path / "firmware.bin").write_bytes(APPLICATION)
    (tmp_path / "board.txt").write_text("board\nrelease\n")
    made, key = tmp_path / "a.zhu", tmp_path / "my.key"
    words = ["update", str(made), "--sign", str(tmp_path / "firmware.bin"), "--version", "7"]
    key.write_text(DEVELOPMENT_SEED.hex())
    for options in ((), ("--board", "other"), ("--key", str(key))):
        refused = CliRunner().invoke(app, [*words, *options])
        assert "development key, which signs this, and this is a release" in str(refused.exception)
        assert not made.exists()
    key.write_text(bytes(range(32)).hex())
    done = CliRunner().invoke(app, [*words, "--key", str(key)])
    assert done.exit_code == 0
    assert "warning" not in done.output
    assert images.read(made).board == "board"


def test_the_command_sends_and_tells(
    app: typer.Typer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    far, file = FakeLoader(), tmp_path / "a.zhu"
    monkeypatch.setattr(command, "SerialLine", lambda port, baud: far)
    monkeypatch.setattr(restart, "application", lambda line, version: f"version {version} runs")
    file.write_bytes(image().file)
    words = ["update", "--port", "/dev/none", str(file)]
    sent = CliRunner().invoke(app, words)
    assert sent.exit_code == 0, sent.output
    assert "version 7 runs" in sent.output
    assert loader.COMMIT in far.ops()
    refused = CliRunner().invoke(app, words)
    assert "is version 7; this drive takes 8 or higher" in str(refused.exception)
    assert far.ops().count(loader.BEGIN) == 1


@pytest.mark.parametrize(
    ("version", "board"), [(0, "b"), (0xFFFFFFFF, "b"), (1, ""), (1, "b" * 17)]
)
def test_what_no_loader_takes_is_not_signed(version: int, board: str) -> None:
    with pytest.raises(UserError):
        image(version, board)


def test_a_loader_reaches_its_own_part_of_the_flash_alone() -> None:
    """What its drivers may change, against where the loader and the parameters lie."""
    f405 = (ROOT / "hal" / "stm32f405" / "CMakeLists.txt").read_text()
    g431 = (ROOT / "hal" / "stm32g431" / "CMakeLists.txt").read_text()

    def number(text: str, name: str) -> int:
        found = re.search(rf"\b{name}=(\w+?)u\b", text)
        assert found is not None, name
        return int(found[1], 0)

    def loader_end(port: str) -> int:
        text = (ROOT / "hal" / port / "boot" / "loader.ld").read_text()
        found = re.search(r"FLASH.*LENGTH = (\d+)K", text)
        assert found is not None
        return 0x08000000 + 1024 * int(found[1])

    assert {number(f405, f"STM32_FLASH_SECTOR_{s}") for s in "AB"} == {7, 8}
    assert loader_end("stm32f405") <= number(f405, "STM32_FLASH_START")
    first, last = (number(g431, f"G431_FLASH_PAGE_{n}") for n in ("FIRST", "LAST"))
    assert loader_end("stm32g431") <= number(g431, "G431_FLASH_START")
    assert number(g431, "G431_FLASH_START") < 0x08000000 + 2048 * first
    assert 0x08000000 + 2048 * (last + 1) == number(g431, "G431_FLASH_END")
    parameters = (ROOT / "hal" / "stm32g431" / "g431_flash.h").read_text()
    start = re.search(r"#define G431_FLASH_START +(\w+?)u", parameters)
    assert start is not None
    assert number(g431, "G431_FLASH_END") <= int(start[1], 0)


def test_a_release_refuses_everybodys_update_key(tmp_path: Path) -> None:
    """The header that the build makes, through the preprocessor."""
    script = tmp_path / "make.cmake"
    module = ROOT / "tools" / "cmake" / "ZhLoader.cmake"

    def compiled(key: str, *options: str) -> int:
        script.write_text(
            f'set(PROJECT_SOURCE_DIR "{ROOT}")\nset(PROJECT_BINARY_DIR "{tmp_path}")\n'
            f'include("{module}")\nzh_update_key(stm32f405)\n'
        )
        subprocess.run(
            ["cmake", f"-DZH_UPDATE_KEY={key}", "-P", script], check=True, capture_output=True
        )
        header = tmp_path / "generated" / "boot_key.h"
        command = ["gcc", *options, "-fsyntax-only", "-x", "c", header]
        return subprocess.run(command, capture_output=True, env=os.environ).returncode

    own = tmp_path / "own.pub"
    own.write_text("12" * 32 + "\n")
    assert compiled("") == 0
    assert compiled("", "-DZH_RELEASE") != 0
    assert compiled(str(own), "-DZH_RELEASE") == 0
    everybodys = tmp_path / "everybodys.pub"
    everybodys.write_text(monocypher.public_key(DEVELOPMENT_SEED).hex())
    assert compiled(str(everybodys), "-DZH_RELEASE") != 0
