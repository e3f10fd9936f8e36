"""A signed image as a file: header and application as on the line. hal/boot/boot_image.h."""

from __future__ import annotations

import hashlib
import os
import secrets
import struct
from dataclasses import dataclass
from pathlib import Path

from zerohertz.errors import UserError
from zerohertz.update import monocypher

MAGIC, FORMAT = 0x5055485A, 1
HEADER = struct.Struct("<4I16s64s64s")
SIGNED_BYTES = 96
IMAGE_AT, MARKS_AT = 512, 256  # in a slot
UNIT_BYTES, BOARD_BYTES = 8, 16
VERSION_MAX = 0xFFFFFFFE
_MARK_RECORDS = 3
# Known to everybody: a release refuses its public half (tools/cmake/ZhLoader.cmake).
DEVELOPMENT_SEED = b"ZeroHertz development update key"


@dataclass(frozen=True)
class Image:
    """One signed application."""

    version: int
    board: str
    header: bytes
    application: bytes

    @property
    def file(self) -> bytes:
        return self.header + self.application

    @property
    def slot(self) -> bytes:
        """As a loader leaves it in flash, for a programmer."""
        marks = struct.pack("<2I", 1, 0xFFFFFFFE) * _MARK_RECORDS
        head = self.header.ljust(MARKS_AT, b"\xff") + marks
        return head.ljust(IMAGE_AT, b"\xff") + self.application


def make(application: bytes, board: str, version: int, seed: bytes) -> Image:
    """Signs; UserError for a version or a name that no loader takes."""
    if not 1 <= version <= VERSION_MAX:
        raise UserError(f"--version {version}: give a number from 1 to {VERSION_MAX}")
    name = board.encode()
    if not 0 < len(name) <= BOARD_BYTES:
        raise UserError(f"--board '{board}': give a name of 1 to {BOARD_BYTES} characters")
    if not application:
        raise UserError("the application is empty")
    application += b"\xff" * (-len(application) % UNIT_BYTES)
    digest = hashlib.blake2b(application).digest()
    fields = (MAGIC, FORMAT, version, len(application), name, digest)
    text = HEADER.pack(*fields, b"")[:SIGNED_BYTES]
    return Image(version, board, text + monocypher.sign(seed, text), application)


def read(path: Path) -> Image:
    """UserError unless the file is whole. The signature is the loader's to judge."""
    try:
        content = path.read_bytes()
    except OSError as error:
        raise UserError(f"{path}: cannot be read ({error.strerror})") from None
    if len(content) < HEADER.size:
        raise UserError(f"{path}: is no signed image; make one with --sign")
    magic, kind, version, size, name, digest, _ = HEADER.unpack_from(content)
    if (magic, kind) != (MAGIC, FORMAT):
        raise UserError(f"{path}: is no signed image; make one with --sign")
    application = content[HEADER.size :]
    if len(application) != size or hashlib.blake2b(application).digest() != digest:
        raise UserError(f"{path}: is torn: other bytes than those that were signed")
    board = name.rstrip(b"\0").decode(errors="replace")
    return Image(version, board, content[: HEADER.size], application)


def make_key(path: Path) -> Path:
    """A new private key, for its owner alone, and FILE.pub with the public one; its path."""
    seed = secrets.token_bytes(monocypher.SEED_BYTES)
    # First: without its library no private key is left behind.
    public_key = monocypher.public_key(seed).hex()
    public = path.with_name(path.name + ".pub")
    try:
        handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    except OSError as error:
        raise UserError(f"--make-key {path}: cannot be made ({error.strerror})") from None
    with os.fdopen(handle, "w") as file:
        file.write(seed.hex() + "\n")
    public.write_text(public_key + "\n")
    return public


def read_key(path: Path | None) -> bytes:
    """The private key of --key; without one everybody's."""
    if path is None:
        return DEVELOPMENT_SEED
    try:
        seed = bytes.fromhex(path.read_text().strip())
    except (OSError, ValueError) as error:
        raise UserError(f"--key {path}: holds no private key ({error})") from None
    if len(seed) != monocypher.SEED_BYTES:
        raise UserError(f"--key {path}: holds no private key; --make-key makes one")
    return seed
