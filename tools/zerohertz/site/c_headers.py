"""What Doxygen knows of the C headers, as XML.

Our comments are plain C comments. On the copy that Doxygen reads they become its own: the first one
of a file describes the file, one behind code describes what stands before it, any other what
follows.
"""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

from zerohertz.errors import UserError
from zerohertz.paths import ROOT

FOLDERS = {
    "host_sim": "The SIL library libzerohertz_sil",
    "hal/include": "What a board provides",
    "firmware/unit": "One drive",
    "firmware/host": "Link, store, trace, records",
    "firmware/sequence": "State machine and restart",
    "firmware/guard": "Protection",
    "firmware/parameters": "Parameters",
    "firmware/fieldbus": "Modbus and CANopen",
    "firmware/law": "The control law",
}
_COMMENT = re.compile(r'"(?:[^"\\\n]|\\.)*"|/\*(.*?)\*/', re.DOTALL)
_SPECIAL = re.compile(r"([\\@<>#%&$])")
_SETTINGS = """
INPUT = "{source}"
OUTPUT_DIRECTORY = "{out}"
RECURSIVE = YES
FILE_PATTERNS = *.h
STRIP_FROM_PATH = "{source}"
FULL_PATH_NAMES = YES
GENERATE_XML = YES
XML_PROGRAMLISTING = NO
GENERATE_HTML = NO
GENERATE_LATEX = NO
EXTRACT_ALL = YES
EXTRACT_STATIC = YES
OPTIMIZE_OUTPUT_FOR_C = YES
MARKDOWN_SUPPORT = NO
MACRO_EXPANSION = YES
EXPAND_ONLY_PREDEF = YES
PREDEFINED = ZH_API= CHECKED= COLD= __attribute__(x)=
SORT_MEMBER_DOCS = NO
QUIET = YES
WARNINGS = NO
"""


def installed() -> bool:
    return shutil.which("doxygen") is not None


def headers() -> list[Path]:
    """Of the checkout, in the order of FOLDERS; what lies deeper in host_sim is its own affair."""
    return [
        path
        for folder in FOLDERS
        for path in sorted((ROOT / folder).glob("*.h" if folder == "host_sim" else "**/*.h"))
    ]


def read(work: Path) -> Path:
    """Folder with Doxygen's XML, made below `work`."""
    source, out = work / "headers", work / "doxygen"
    for path in headers():
        copy = source / path.relative_to(ROOT)
        copy.parent.mkdir(parents=True, exist_ok=True)
        copy.write_text(doxygen_comments(path.read_text(encoding="utf-8")), encoding="utf-8")
    out.mkdir(parents=True, exist_ok=True)
    done = subprocess.run(
        ("doxygen", "-"),
        input=_SETTINGS.format(source=source, out=out),
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode != 0:
        raise UserError(f"doxygen: {done.stderr.strip()[-2000:]}")
    return out / "xml"


def doxygen_comments(text: str) -> str:
    """The header with every comment as Doxygen wants it."""

    def changed(found: re.Match[str]) -> str:
        if found[1] is None:
            return found[0]
        line = text[text.rfind("\n", 0, found.start()) + 1 : found.start()].strip()
        if found.start() == 0:
            return f"/** @file\n{_body(found[1])}*/"
        return f"/**{'<' if line and line[-1] not in '{(' else ''} {_body(found[1])}*/"

    return _COMMENT.sub(changed, text)


def _body(text: str) -> str:
    """Its words, none of them a command; what is set in columns stays as it is."""
    lines = [re.sub(r"^ *\* ?", "", line.rstrip()) for line in text.split("\n")]
    parts: list[str] = []
    verbatim = False
    for line in lines:
        aligned = line.startswith("  ") and len(lines) > 1 and line is not lines[0]
        if aligned != verbatim and line:
            parts.append("@verbatim" if aligned else "@endverbatim\n")
            verbatim = aligned
        parts.append(line if verbatim else _SPECIAL.sub(r"\\\1", line))
    if verbatim:
        parts.append("@endverbatim")
    return "\n".join(parts) + "\n"
