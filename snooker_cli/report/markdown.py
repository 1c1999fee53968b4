"""A document as GitHub-flavoured Markdown, with its figures beside it, for one's own text."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from snooker_cli.files import write_text

_JOINED = str.maketrans({"\u2060": "", "\u00a0": " "})
"""Marks of the pages at which no line breaks: they are invisible in a text that is edited."""

_MARKS = re.compile(r"[\\`*\[\]|~$]|(?<!\w)_|_(?!\w)")  # an underscore inside a word is none
_BEGINNING = re.compile(r"^(\d*)([-+.)#=]+)(?=\s|$)")  # of a list, a heading or a line below one


def escaped(text: str) -> str:
    """A text as a paragraph or cell whose characters mean themselves: no Markdown, and no HTML."""
    text = text.translate(_JOINED).replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
    return _BEGINNING.sub(r"\1\\\2", _MARKS.sub(r"\\\g<0>", text))


def markdown(document: dict[str, Any]) -> str:
    """The text of a document; see ``report.document.Document``. A film has no place in it."""
    parts = [f"# {escaped(document['title'])}", *map(escaped, document["summary"])]
    for block in document["blocks"]:
        match block["kind"]:
            case "heading":
                parts.append(f"{'#' * (block['level'] + 1)} {escaped(block['text'])}")
            case "paragraph":
                parts.append(escaped(block["text"]))
            case "code":
                longest = max(map(len, re.findall("`+", block["text"])), default=0)
                fence = "`" * max(3, longest + 1)
                parts.append(f"{fence}\n{block['text']}\n{fence}")
            case "figure":
                parts += [
                    f"![{escaped(block['alt'])}](figures/{block['file']}.png)",
                    _caption(block),
                ]
            case "table":
                parts += [_caption(block), _table(block["columns"], block["rows"])]
    return "\n\n".join(parts) + "\n"


def _caption(block: dict[str, Any]) -> str:
    return f"**{escaped(block['label'])}.** {escaped(block['caption'])}"


def _table(columns: Sequence[dict[str, Any]], rows: Sequence[Sequence[str]]) -> str:
    """A heading of rows is a row whose first cell is bold."""
    lines = [[escaped(column["heading"]) for column in columns]]
    lines.append(["---:" if column["right"] else "---" for column in columns])
    for row in rows:
        cells = [escaped(cell) for cell in row]
        if len(cells) < len(columns):
            cells = [f"**{cells[0]}**"] + [""] * (len(columns) - 1)
        lines.append(cells)
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)


def write_markdown(document: dict[str, Any], folder: Path, name: str = "report") -> Path:
    """Write ``NAME.md``, whose figures are in ``figures/`` beside it."""
    path = folder / f"{name}.md"
    write_text(path, markdown(document))
    return path
