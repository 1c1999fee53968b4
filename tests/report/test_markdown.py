"""A document as Markdown, read by an independent parser."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from hypothesis import example, given
from hypothesis import strategies as st
from markdown_it import MarkdownIt
from markdown_it.token import Token

from snooker_cli.report.markdown import escaped, markdown, write_markdown
from snooker_cli.report.run_report import run_report
from snooker_cli.runs import RunFolder

PARSER = MarkdownIt("commonmark").enable(["table", "strikethrough"])


def inline(text: str) -> Iterator[Token]:
    return (token for token in PARSER.parse(text) if token.type == "inline")


def plain(token: Token) -> str:
    """The text that a reader sees; marks but for bold labels would be lost."""
    allowed = {"text", "text_special", "entity", "strong_open", "strong_close", "softbreak"}
    kinds = {child.type for child in token.children or ()}
    assert kinds <= allowed, (kinds, token.content)
    return "".join(child.content for child in token.children or ())


@given(st.text("ab1 _*`|~$#[]()<>&\\-+.!=:", min_size=1, max_size=30))
@example("1. a")
@example("# a")
@example("T_rot/T_tr and _a_ | *b*")
@example("=====")
def test_a_text_means_itself(text: str) -> None:
    text = " ".join(text.split()) or "a"
    _, token, _ = inline(f"before\n\n{escaped(text)}\n\nafter\n")
    assert plain(token) == text
    cells = [plain(token) for token in inline(f"| a | b |\n| --- | --- |\n| {escaped(text)} | c |")]
    assert cells == ["a", "b", text, "c"]


def test_a_document_has_its_blocks() -> None:
    columns = [{"heading": "a|b", "right": False}, {"heading": "n", "right": True}]
    document: dict[str, Any] = {
        "title": "T",
        "summary": ["1/s\u2060 and\u00a02"],
        "blocks": [
            {"kind": "heading", "level": 1, "text": "H"},
            {"kind": "code", "text": "```\nx"},
            {"kind": "film", "text": "a film", "player": 0},
            {"kind": "figure", "file": "1-a", "label": "Figure 1", "caption": "C", "alt": "A [1]"},
            {"kind": "table", "label": "Table 1", "caption": "D", "columns": columns,
             "rows": [["group"], ["x", "1"]]},
        ],
    }  # fmt: skip
    assert markdown(document) == (
        "# T\n\n1/s and 2\n\n## H\n\n````\n```\nx\n````\n\n![A \\[1\\]](figures/1-a.png)\n\n"
        "**Figure 1.** C\n\n**Table 1.** D\n\n"
        "| a\\|b | n |\n| --- | ---: |\n| **group** |  |\n| x | 1 |\n"
    )


def test_a_report_in_markdown_has_what_the_pages_have(
    finished_run: RunFolder, tmp_path: Path
) -> None:
    """The same sentences, tables and figures, but no film; and the same bytes again."""
    (path,) = run_report([finished_run], tmp_path / "text", lambda _: None, markdown=True)
    run_report([finished_run], tmp_path / "pages", lambda _: None)
    assert path.name == "report.md"
    text = path.read_text("utf-8")
    page = (tmp_path / "pages" / "report.html").read_text("utf-8")
    page = re.sub(r'srcdoc="[^"]*"|src="[^"]*"', "", page).replace("\u2060", "")
    page = " ".join(re.sub("<[^>]*>", "", page).replace("\u00a0", " ").split())
    tokens = PARSER.parse(text)
    assert not [token for token in tokens if token.type.startswith("html")]
    images = []
    for token in inline(text):
        (image,) = token.children or () if token.content.startswith("![") else [None]
        if image is not None:
            images.append(str(image.attrs["src"]))
            continue
        shown = plain(token).replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
        shown = shown.replace("'", "&#39;").replace('"', "&#34;").removesuffix(" --markdown")
        assert " ".join(shown.split()) in page, shown
    figures = sorted(file.name for file in (tmp_path / "pages" / "figures").glob("*.png"))
    assert sorted(images) == [f"figures/{name}" for name in figures]
    assert all((path.parent / image).is_file() for image in images)
    assert sum(token.type == "table_open" for token in tokens) == page.count("Table ") > 2
    assert "snooker report small --markdown" in text
    (again,) = run_report([finished_run], tmp_path / "again", lambda _: None, markdown=True)
    assert again.read_bytes() == path.read_bytes()


def test_the_file_is_named(tmp_path: Path) -> None:
    document = {"title": "<script>", "summary": [], "blocks": []}
    path = write_markdown(document, tmp_path, "mine")
    assert path == tmp_path / "mine.md"
    assert path.read_text("utf-8") == "# &lt;script&gt;\n"
