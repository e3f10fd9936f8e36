"""Pages of the C interface, a page per header, made of Doxygen's XML."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from html import escape
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from zerohertz.site import c_headers

FOLDER = "c"
INDEX = f"{FOLDER}/index.md"
_WIDE = 90  # characters of a signature in one line
_TAGS = {"computeroutput": "code", "bold": "b", "emphasis": "i", "itemizedlist": "ul"}
_TAGS |= {"orderedlist": "ol", "listitem": "li", "verbatim": "pre", "para": "p"}
WITHOUT = (
    "# C interface\n\nThis site was made without Doxygen, which makes this reference. Install it "
    "with\n`apt-get install doxygen` and run `tools/zh site` again. Until then read the headers: "
    "they\ndescribe everything that they declare.\n"
)


def write(folder: Path, work: Path) -> int:
    """The pages below `folder`; how many headers they describe. No Doxygen: one that says so."""
    (folder / FOLDER).mkdir(parents=True, exist_ok=True)
    if not c_headers.installed():
        (folder / INDEX).write_text(WITHOUT, encoding="utf-8")
        return 0
    xml = c_headers.read(work)
    files = [_compound(path) for path in sorted(xml.glob("*_8h.xml"))]
    headers = {_path_of(file): file for file in files}
    structs = {
        found.get("id", ""): found
        for path in [*xml.glob("struct*.xml"), *xml.glob("union*.xml")]
        for found in [_compound(path)]
    }
    book = _Book(_places(headers, structs), structs)
    for name, file in headers.items():
        page = folder / FOLDER / f"{name}.md"
        page.parent.mkdir(parents=True, exist_ok=True)
        page.write_text(book.page(name, file), encoding="utf-8")
    (folder / INDEX).write_text(book.index(headers), encoding="utf-8")
    return len(headers)


def _compound(path: Path) -> Element:
    found = ElementTree.parse(path).getroot().find("compounddef")
    assert found is not None, path
    return found


def _path_of(file: Element) -> str:
    location = file.find("location")
    assert location is not None
    return location.get("file", "")


def _text(element: Element | None) -> str:
    return "" if element is None else "".join(element.itertext()).strip()


def _anchor(name: str) -> str:
    """As the table of contents makes it of a heading."""
    return name.lower()


def _title(member: Element) -> str:
    """An enum without a name goes by its first value."""
    name = _text(member.find("name"))
    if name and not name.startswith("@"):
        return name
    return f"{_text(member.find('enumvalue/name'))} and others"


def _members(file: Element, *kinds: str) -> Iterator[Element]:
    for member in file.iter("memberdef"):
        if member.get("kind") in kinds:
            yield member


def _places(headers: dict[str, Element], structs: dict[str, Element]) -> dict[str, str]:
    """Page and anchor of everything that has a heading, by Doxygen's number."""
    found = {}
    for name, file in headers.items():
        found[file.get("id", "")] = name
        for member in _members(file, "function", "enum", "typedef"):
            anchor = _anchor(_title(member)).replace(" ", "-")
            found[member.get("id", "")] = f"{name}#{anchor}"
            for value in member.findall("enumvalue"):
                found[value.get("id", "")] = f"{name}#{anchor}"
        for inner in file.findall("innerclass"):
            if inner.get("refid") in structs:
                found[inner.get("refid", "")] = f"{name}#{_anchor(_text(inner))}"
    return found


def _headed(heading: str, parts: list[str]) -> list[str]:
    return [heading, *parts] if parts else []


@dataclass(frozen=True)
class _Book:
    places: dict[str, str]
    structs: dict[str, Element]

    def index(self, headers: dict[str, Element]) -> str:
        lines = ["# C interface", "", "Made from the headers by Doxygen.", ""]
        for folder, title in c_headers.FOLDERS.items():
            lines += [f"## {title}", "", "| header | what it is |", "|---|---|"]
            for name in sorted(n for n in headers if n.startswith(f"{folder}/")):
                told = _text(headers[name].find("detaileddescription")).partition(". ")[0]
                told = " ".join(told.replace("|", "\\|").split()).rstrip(".")
                lines.append(f"| [`{name}`]({name}.md) | {escape(told)} |")
            lines.append("")
        return "\n".join(lines)

    def page(self, name: str, file: Element) -> str:
        parts = [f"# {Path(name).name}", f'`#include "{Path(name).name}"` from `{name}`']
        parts += [self._described(file, name)]
        parts += _headed(
            "## Functions", [self._function(m, name) for m in _members(file, "function")]
        )
        parts += _headed("## Types", [*self._structs(file, name), *self._types(file, name)])
        defines = [m for m in _members(file, "define") if m.find("initializer") is not None]
        macros = [self._table([self._define(m, name) for m in defines])] if defines else []
        parts += _headed("## Macros", macros)
        return "\n\n".join(part for part in parts if part) + "\n"

    def _structs(self, file: Element, page: str) -> list[str]:
        inner = [i.get("refid", "") for i in file.findall("innerclass")]
        return [
            self._struct(self.structs[number], page) for number in inner if number in self.structs
        ]

    def _types(self, file: Element, page: str) -> list[str]:
        members = _members(file, "enum", "typedef")
        return [self._type(m, page) for m in members if not self._is_struct(m)]

    def _is_struct(self, member: Element) -> bool:
        """A typedef of a struct whose table goes by the same name."""
        name = _text(member.find("name"))
        return any(
            r.get("refid") in self.structs
            and _text(self.structs[r.get("refid", "")].find("compoundname")) == name
            for r in member.findall("type/ref")
        )

    def _function(self, member: Element, page: str) -> str:
        arguments = [
            self._declared(p.find("type"), _text(p.find("declname")), _text(p.find("array")), page)
            for p in member.findall("param")
        ]
        plain = sum(len("".join(p.itertext()).strip()) + 2 for p in member.findall("param"))
        head = self._declared(member.find("type"), _text(member.find("name")), "", page)
        gap = ",\n    " if plain + len(_text(member.find("name"))) > _WIDE else ", "
        start = "\n    " if "\n" in gap else ""
        return self._shown(_title(member), f"{head}({start}{gap.join(arguments)})", member, page)

    def _type(self, member: Element, page: str) -> str:
        if member.get("kind") == "typedef":
            name, behind = _text(member.find("name")), _text(member.find("argsstring"))
            code = f"typedef {self._declared(member.find('type'), name, behind, page)}"
            return self._shown(name, code, member, page)
        rows = [
            (f"{_text(v.find('name'))} {_text(v.find('initializer'))}", self._described(v, page))
            for v in member.findall("enumvalue")
        ]
        return self._shown(_title(member), "", member, page) + "\n\n" + self._table(rows)

    def _struct(self, struct: Element, page: str) -> str:
        rows = []
        for member in _members(struct, "variable"):
            behind = _text(member.find("argsstring")) + _text(member.find("bitfield"))
            declared = self._declared(member.find("type"), _text(member.find("name")), behind, page)
            rows.append((declared, self._described(member, page)))
        name = _text(struct.find("compoundname"))
        return self._shown(name, "", struct, page) + "\n\n" + self._table(rows)

    def _define(self, member: Element, page: str) -> tuple[str, str]:
        arguments = [_text(p) for p in member.findall("param")]
        name = _text(member.find("name")) + (f"({', '.join(arguments)})" if arguments else "")
        return escape(f"{name} {_text(member.find('initializer'))}"), self._described(member, page)

    def _shown(self, title: str, code: str, member: Element, page: str) -> str:
        shown = f"<pre><code>{code}</code></pre>" if code else ""
        parts = (f"### {title}", shown, self._described(member, page))
        return "\n\n".join(part for part in parts if part)

    def _table(self, rows: list[tuple[str, str]]) -> str:
        body = "".join(f"<tr><td><code>{a}</code></td><td>{b}</td></tr>\n" for a, b in rows)
        return f'<div class="c-members"><table>\n{body}</table></div>'

    def _declared(self, kind: Element | None, name: str, behind: str, page: str) -> str:
        written = "" if kind is None else self._inline(kind, page).strip()
        if written.endswith("(*"):  # a pointer to a function: its name stands in the type
            return f"{written}{escape(name)}{escape(behind)}"
        gap = "" if written.endswith("*") or not written or not name else " "
        return f"{written}{gap}{escape(name)}{escape(behind)}"

    def _described(self, element: Element, page: str) -> str:
        return "".join(
            self._inline(found, page).strip()
            for tag in ("briefdescription", "detaileddescription")
            if (found := element.find(tag)) is not None
        )

    def _inline(self, element: Element, page: str) -> str:
        """HTML of an element's content; links where there is something to lead to."""
        out = escape(element.text or "")
        for child in element:
            inner = self._inline(child, page)
            if child.tag == "ref" and child.get("refid") in self.places:
                inner = f'<a href="{self._address(child.get("refid", ""), page)}">{inner}</a>'
            elif child.tag == "para" and child.find("verbatim") is not None:
                inner = f"<div>{inner}</div>"
            elif tag := _TAGS.get(child.tag):
                inner = f"<{tag}>{inner}</{tag}>"
            out += inner + escape(child.tail or "")
        return out

    def _address(self, number: str, page: str) -> str:
        target, _, anchor = self.places[number].partition("#")
        if target == page and anchor:
            return f"#{anchor}"
        place = os.path.relpath(target, Path(page).parent) + ".html"
        return f"{place}#{anchor}" if anchor else place
