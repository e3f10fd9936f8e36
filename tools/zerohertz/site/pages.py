"""The documentation's source: pages of the checkout with their links set right.

Every page keeps its place in the checkout, so that links between pages stay as they are; only the
start page and the overview move. A header or a script becomes a page that shows it. Links to files
that are no pages become the file's name, for the site has no copy of the sources.
"""

from __future__ import annotations

import ast
import os
import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from zerohertz.errors import UserError
from zerohertz.paths import ROOT
from zerohertz.site import c_headers

START = "tools/docs/start.md"
MOVED = {START: "index.md", "README.md": "overview.md"}
LANGUAGES = {".h": "c", ".py": "python"}
PICTURES = (".gif", ".png", ".svg")
# What the site makes itself.
GENERATED = ("signals.md", "python.md", "twin.html", "studio.html", "c/index.md")
PAGE_FOLDERS = ("firmware", "gain_tables", "hal", "host_sim", "tools")
PYTHON_MODULES = tuple(
    f"zerohertz.{name}"
    for name in ("drive", "sil_types", "plant", "sim", "sim_steps", "estimator", "gym")
)
_SIGNALS = ROOT / "firmware" / "unit" / "signal_list.def"
_SIGNAL = re.compile(r'^SIGNAL_([FU])\(\s*(\w+),(?:[^"]|\n)*?"([^"]*)"\)', re.MULTILINE)
_LINK = re.compile(r"(!?)\[((?:[^\[\]]|\[[^\]]*\])*)\]\(([^()\s]+)\)")
_HEADING = re.compile(r"^(#+) (.*)$", re.MULTILINE)


def place(source: str) -> str:
    """Where a page of the navigation goes."""
    file, _, section = source.partition("#")
    if section:
        return f"{section}.md"
    if file in MOVED:
        return MOVED[file]
    return f"{file}.md" if Path(file).suffix in LANGUAGES else file


def leaves(nav: Any) -> Iterator[str]:
    """The pages of a navigation."""
    for entry in nav:
        for value in entry.values():
            if isinstance(value, str):
                yield value
            else:
                yield from leaves(value)


def unlisted(nav: Any) -> Any:
    """A last section with the pages that the navigation does not name: none is lost."""
    known = {source.partition("#")[0] for source in leaves(nav)}
    found = sorted(
        str(path.relative_to(ROOT))
        for folder in PAGE_FOLDERS
        for path in (ROOT / folder).rglob("*.md")
        if "node_modules" not in path.parts
    )
    entries = [{_title(source): source} for source in found if source not in known]
    return [{"More": entries}] if entries else []


def _title(source: str) -> str:
    heading = _HEADING.search((ROOT / source).read_text(encoding="utf-8"))
    return heading[2] if heading else source


def placed(nav: Any) -> Any:
    """The navigation with the places instead of the sources."""
    return [
        {title: place(value) if isinstance(value, str) else placed(value)}
        for entry in nav
        for title, value in entry.items()
    ]


def stage(sources: list[str], folder: Path) -> None:
    """Write all pages below `folder`. UserError when a link of one leads nowhere."""
    for source in sources:
        if source not in GENERATED:
            _write(folder / place(source), _page(source, sources, folder))
    _write(folder / "signals.md", signals_page())
    _write(folder / "python.md", python_page())


def signals_page() -> str:
    """Reference of the traced signals, from the firmware's own list."""
    rows = [
        f"| `{name}` | {'float' if kind == 'F' else 'whole'} | {text} |"
        for kind, name, text in _SIGNAL.findall(_SIGNALS.read_text(encoding="utf-8"))
    ]
    head = (
        "# Signals\n\nEvery control period computes these. `zh trace` records them, and the\n"
        "hashes of `zh golden` cover them all. The unit ends the name.\n\n"
        "| signal | type | meaning |\n|---|---|---|\n"
    )
    return head + "\n".join(rows) + "\n"


def python_page() -> str:
    """Reference of the Python package's interface, from its own signatures and docstrings."""
    lines = ["# Python interface", "", "`tools/zh python FILE` runs a script with it at hand.", ""]
    for module in PYTHON_MODULES:
        tree = ast.parse((ROOT / "tools" / f"{module.replace('.', '/')}.py").read_text("utf-8"))
        lines += [f"## {module}", "", ast.get_docstring(tree) or "", ""]
        for node in tree.body:
            lines += _described(node, "###")
    return "\n".join(lines) + "\n"


def _described(node: ast.AST, level: str) -> list[str]:
    """A public class with its methods, or a function."""
    if not isinstance(node, (ast.ClassDef, ast.FunctionDef)) or node.name.startswith(("_", "Raw")):
        return []
    text = ast.get_docstring(node) or ""
    if isinstance(node, ast.ClassDef):
        fields = [n for n in node.body if isinstance(n, (ast.AnnAssign, ast.Assign))]
        code = "\n".join([f"class {node.name}:", *(f"    {ast.unparse(n)}" for n in fields)])
        members = [line for n in node.body for line in _described(n, f"{level}#")]
    else:
        returns = f" -> {ast.unparse(node.returns)}" if node.returns else ""
        code, members = f"def {node.name}({ast.unparse(node.args)}){returns}", []
    return [f"{level} {node.name}", "", f"```python\n{code}\n```", "", text, "", *members]


def slug(heading: str) -> str:
    """The anchor of a heading, as the table of contents of MkDocs writes it."""
    plain = re.sub(r"[^\w\s-]", "", re.sub(r"[`*]", "", heading)).strip().lower()
    return re.sub(r"[\s-]+", "-", plain)


def section_of(text: str, anchor: str) -> str:
    """A section with its heading as title."""
    found = [m for m in _HEADING.finditer(text) if slug(m[2]) == anchor]
    if not found:
        raise UserError(f"site: no heading #{anchor}; correct mkdocs.yml")
    begin = found[0]
    level = len(begin[1])
    ends = [m.start() for m in _HEADING.finditer(text, begin.end()) if len(m[1]) <= level]
    return f"# {begin[2]}\n" + text[begin.end() : ends[0] if ends else None]


def _page(source: str, sources: list[str], folder: Path) -> str:
    file, _, section = source.partition("#")
    text = (ROOT / file).read_text(encoding="utf-8")
    if (language := LANGUAGES.get(Path(file).suffix)) is not None:
        head = f"---\nhide: [toc]\n---\n\n# {Path(file).name}\n\n`{file}`\n\n"
        return f"{head}```{language}\n{text}```\n"
    if section:
        text = section_of(text, section)
    return _LINK.sub(lambda found: _link(found, source, sources, folder), text)


def _link(found: re.Match[str], source: str, sources: list[str], folder: Path) -> str:
    mark, words, address = found.groups()
    target, _, anchor = address.partition("#")
    if "://" in address or (not target and "#" not in source):
        return found[0]
    file = source.partition("#")[0]
    name = os.path.relpath(ROOT / Path(file).parent / target, ROOT) if target else file
    if Path(name).suffix in PICTURES:
        _copy(ROOT / name, folder / name)
        return f"{mark}[{words}]({_from(source, name)})"
    page = _page_of(name, anchor, sources)
    if page is not None:
        return f"[{words}]({_from(source, page)})"
    if not (ROOT / name).exists():
        raise UserError(f"{file}: ({address}) leads nowhere; correct the link")
    return words if words.startswith("`") else f"{words} (`{name}`)"


def _page_of(name: str, anchor: str, sources: list[str]) -> str | None:
    """Where a link to a file of the checkout goes; None: the site has no such page."""
    if Path(name).name in GENERATED:
        return Path(name).name
    for candidate in (f"{name}#{anchor}", name, f"{name}/README.md"):
        if candidate in sources:
            rest = f"#{anchor}" if anchor and "#" not in candidate else ""
            return place(candidate) + rest
    if c_headers.installed() and ROOT / name in c_headers.headers():
        return f"c/{name}.md"
    return None


def _from(source: str, target: str) -> str:
    return os.path.relpath(target, Path(place(source)).parent)


def _copy(source: Path, target: Path) -> None:
    target.parent.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(source, target)


def _write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
