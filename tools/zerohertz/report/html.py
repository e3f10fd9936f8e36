"""Small pieces of HTML: everything that comes from data is escaped here and nowhere else."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from html import escape
from pathlib import Path

from zerohertz.paths import INSTALLED

STYLE = Path(__file__).with_name("report.css")
SCRIPT = Path(__file__).with_name("chart.js")


def page(title: str, body: str) -> str:
    """A whole document that needs nothing from anywhere."""
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title>\n<style>\n{STYLE.read_text(encoding='utf-8')}</style>\n</head>\n"
        f"<body>\n<main>\n{body}\n</main>\n<script>\n{SCRIPT.read_text(encoding='utf-8')}</script>\n"
        "</body>\n</html>\n"
    )


def image(file: Path, alt: str) -> str:
    """A PNG or GIF inside the page; the installed package lacks the large ones."""
    if INSTALLED and not file.is_file():
        return ""
    data = base64.b64encode(file.read_bytes()).decode()
    kind = file.suffix.removeprefix(".")
    return f'<img alt="{escape(alt, quote=True)}" src="data:image/{kind};base64,{data}">'


def chart(content: str, alt: str) -> str:
    """JSON of a chart, which chart.js draws."""
    label, data = escape(alt, quote=True), escape(content, quote=True)
    return f'<div class="chart" aria-label="{label}" data-chart="{data}"></div>'


def badge(good: bool, yes: str = "matches", no: str = "does not match") -> str:
    """Verdict in a word and a sign; colour only helps."""
    kind, text = ("yes", f"✓ {yes}") if good else ("no", f"✗ {no}")
    return f'<span class="badge {kind}">{text}</span>'


def table(header: Sequence[str], rows: Iterable[Sequence[str]], numeric: Sequence[int] = ()) -> str:
    """Cells are HTML already; columns in `numeric` are set right."""

    def cells(tag: str, texts: Sequence[str]) -> str:
        return "".join(
            f"<{tag}{' class=n' if k in numeric else ''}>{text}</{tag}>"
            for k, text in enumerate(texts)
        )

    body = "\n".join(f"<tr>{cells('td', row)}</tr>" for row in rows)
    return (
        f'<div class="wide"><table><thead><tr>{cells("th", header)}</tr></thead>'
        f"<tbody>\n{body}\n</tbody></table></div>"
    )


def definitions(pairs: Iterable[tuple[str, str]]) -> str:
    """Term and text, the text HTML already."""
    return "<dl>" + "".join(f"<dt>{escape(t)}</dt><dd>{d}</dd>" for t, d in pairs) + "</dl>"


def folded(summary: str, text: str) -> str:
    """A file's text that opens on a click."""
    return f"<details><summary>{escape(summary)}</summary><pre>{escape(text)}</pre></details>"


def card(title: str, sign: str, good: bool, content: str, anchor: str = "") -> str:
    """A picture with its words; a frame marks what does not match."""
    name = f' id="{anchor}"' if anchor else ""
    return (
        f'<article class="card{"" if good else " miss"}"{name}><header><h3>{escape(title)}</h3>'
        f"{sign}</header>{content}</article>"
    )
