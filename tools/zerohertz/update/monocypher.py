"""Monocypher's EdDSA, from the same C file that the boot loader is made of."""

from __future__ import annotations

import ctypes
import functools
import os
import shutil
import subprocess

from zerohertz.errors import UserError
from zerohertz.paths import BUILD, ROOT

SEED_BYTES, PUBLIC_BYTES, SIGNATURE_BYTES = 32, 32, 64
FOLDER = ROOT / ".cache" / "monocypher"
_SECRET_BYTES = 64


@functools.cache
def _library() -> ctypes.CDLL:
    source = FOLDER / "monocypher.c"
    if not source.is_file():
        raise UserError(f"{source}: not there; run tools/fetch_monocypher.sh")
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        raise UserError("gcc: not installed; run tools/zh setup")
    library = BUILD / "monocypher" / "monocypher.so"
    if not library.is_file() or library.stat().st_mtime < source.stat().st_mtime:
        library.parent.mkdir(parents=True, exist_ok=True)
        new = library.with_suffix(f".{os.getpid()}")
        command = (compiler, "-O2", "-shared", "-fPIC", "-o", str(new), str(source))
        subprocess.run(command, check=True)
        new.replace(library)
    return ctypes.CDLL(str(library))


def _pair(seed: bytes) -> tuple[bytes, bytes]:
    secret = ctypes.create_string_buffer(_SECRET_BYTES)
    public = ctypes.create_string_buffer(PUBLIC_BYTES)
    # It wipes the seed it is given.
    given = ctypes.create_string_buffer(seed, SEED_BYTES)
    _library().crypto_eddsa_key_pair(secret, public, given)
    return secret.raw, public.raw


def public_key(seed: bytes) -> bytes:
    """Of the private key, which is 32 random bytes."""
    return _pair(seed)[1]


def sign(seed: bytes, text: bytes) -> bytes:
    """EdDSA on curve 25519 with BLAKE2b."""
    signature = ctypes.create_string_buffer(SIGNATURE_BYTES)
    secret = _pair(seed)[0]
    _library().crypto_eddsa_sign(signature, secret, text, ctypes.c_size_t(len(text)))
    return signature.raw


def signed(signature: bytes, public: bytes, text: bytes) -> bool:
    """Whether the owner of that key signed this text."""
    length = ctypes.c_size_t(len(text))
    return bool(_library().crypto_eddsa_check(signature, public, text, length) == 0)
