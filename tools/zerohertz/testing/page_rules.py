"""Rules of CONVENTIONS 6 for the pages: lines that fit, links that work.

Words and sentences: text_rules.py. Spelling is codespell's (the stage `pages`). Tables, code and
HTML may have longer lines.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from zerohertz.testing.text_rules import prose, tracked

LONGEST_LINE = 120
# Pages that `zh site` makes, beside the ones of the repository.
MADE = ("twin.html", "studio.html")
_LINK = re.compile(r"\]\(([^)\s]+)\)")
_HEADING = re.compile(r"^#+ +(.*)$")


def pages(root: Path) -> list[Path]:
    """Every page under version control."""
    return tracked(root, "*.md")


def check_tree(root: Path) -> list[str]:
    """Every breach, as `file:line: what is wrong`."""
    return [
        f"{page.relative_to(root)}:{number}: {what}"
        for page in pages(root)
        for number, what in sorted(check_page(page))
    ]


def check_page(page: Path) -> Iterator[tuple[int, str]]:
    """Breaches in one page, by line."""
    for number, line in prose(page.read_text()):
        if len(line) > LONGEST_LINE and not line.lstrip().startswith(("|", "<", "[!", "![")):
            yield number, f"{len(line)} characters, at most {LONGEST_LINE}"
        for target in _LINK.findall(line):
            if not leads_somewhere(page, target):
                yield number, f"nothing at {target}"


def leads_somewhere(page: Path, target: str) -> bool:
    """Whether a link within the repository names a file and, after #, one of its headings."""
    if re.match(r"[a-z]+:", target) or target.rpartition("/")[2] in MADE:
        return True
    name, _, anchor = target.partition("#")
    file = (page.parent / name).resolve() if name else page
    if not file.exists():
        return False
    return not anchor or file.suffix != ".md" or anchor in anchors(file.read_text())


def anchors(text: str) -> set[str]:
    """What links to the headings of a page end with."""
    headings = (_HEADING.match(line) for _, line in prose(text))
    return {_anchor(heading[1]) for heading in headings if heading}


def _anchor(heading: str) -> str:
    plain = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", heading).replace("`", "").strip().lower()
    return re.sub(r"[^\w\- ]", "", plain).replace(" ", "-")
