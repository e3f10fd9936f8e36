"""The rules of the words find what they are for."""

from __future__ import annotations

import pytest
import typer

from zerohertz.paths import ROOT
from zerohertz.testing import text_rules
from zerohertz.testing.text_rules import AIM, LIMIT, Passage, breaches, long_sentences, sentences


def of(words: int) -> list[Passage]:
    return [Passage("here:1", "word " * words + "end.")]


def test_a_sentence_may_have_so_many_words_and_no_more() -> None:
    assert breaches(of(LIMIT - 1)) == []
    (found,) = breaches(of(LIMIT))
    assert found.startswith(f"here:1: {LIMIT + 1} words, at most {LIMIT}: word word")


def test_a_sentence_beyond_the_aim_is_listed() -> None:
    assert long_sentences(of(AIM - 1)) == []
    assert len(long_sentences(of(AIM))) == 1


@pytest.mark.parametrize(
    ("text", "count"),
    [
        ("One. Two! Three? Four", 4),
        ("One idea; another", 2),
        ("See Figs. 8 and 9, eq. (3), e.g. here", 1),
        ("Said (in brackets.) Then more", 2),
        ("A [link](to/a.page.md) and `code. Code` in it", 1),
    ],
)
def test_where_a_sentence_ends(text: str, count: int) -> None:
    assert len(sentences(text)) == count


def test_a_word_that_has_another_name_is_found() -> None:
    text = [Passage("here:1", "takes over with an Impressed Current")]
    assert breaches(text) == ["here:1: `impressed current` is called `I-f`"]


def test_a_page_is_read_by_paragraph_and_item() -> None:
    page = "# Head\n\nOne\ntwo.\n\n- three\n  four\n- five\n\n| six |\n```\nseven\n```\n1. eight\n"
    found = text_rules.of_lines("page", text_rules.prose(page))
    assert [(p.where, p.text) for p in found] == [
        ("page:3", "One two."),
        ("page:6", "three four"),
        ("page:8", "five"),
        ("page:14", "eight"),
    ]


def test_a_header_is_read_by_comment() -> None:
    source = """/* Head
 * of it.
 *
 *   a = b
 */
int a; /* behind */
// one
// line
int b; // other
"""
    found = text_rules.of_source("a.h", source)
    assert [(p.where, p.text) for p in found] == [
        ("a.h:1", "Head of it."),
        ("a.h:4", "a = b"),
        ("a.h:6", "behind"),
        ("a.h:7", "one line"),
        ("a.h:9", "other"),
    ]


def test_the_strings_of_a_list_are_read() -> None:
    source = '/* "no" string */\nPARAM(a, "one "\n      "text", 3)\n'
    texts = [p.text for p in text_rules.of_source("a.def", source)]
    assert texts == ['"no" string', "one text"]


def test_the_help_of_a_command_is_read() -> None:
    app = typer.Typer()

    @app.command()
    def one(width: int = typer.Option(1, help="How wide.")) -> None:
        """What it does.

        And more.
        """

    found = list(text_rules.of_help(typer.main.get_command(app)))
    assert [p.text for p in found][:3] == ["What it does.", "And more.", "How wide."]
    assert found[2].where == "zh --width"


def test_everything_is_looked_at() -> None:
    places = {p.where.split(":")[0] for p in text_rules.of_sources(ROOT)}
    assert {
        "firmware/law/drive.h",
        "firmware/parameters/param_list.def",
        "hal/include/hal_drive_io.h",
    } <= places
    assert {"host_sim/sil.h", "host_sim/plant.hpp"} <= places
    assert any(p.where.startswith("README.md:") for p in text_rules.of_pages(ROOT))
    assert {"zh demo", "zh campaign fuzz --parser"} <= {p.where for p in text_rules.of_commands()}
