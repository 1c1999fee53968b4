"""A template with values, and figures -> one HTML page and a PDF; the same bytes each time.

templates/report.md.j2 explains the marks of both templates.
"""

import base64
import json
import re
import tempfile
from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any, TypeAlias

import yaml

from snooker_cli.errors import UserError
from snooker_cli.files import atomic_write, write_text
from snooker_cli.formatting import counted, listed, probability, ratio, rough, short, with_error
from snooker_cli.report.packaged import packaged

EPOCH = 0  # date of the PDF, s since 1970: the same bytes each time
NOTATION: dict[str, str] = yaml.safe_load(packaged("notation.yaml"))
"""What the pages print instead of matches of a pattern."""

Document: TypeAlias = dict[str, Any]
"""``title``, ``summary`` (paragraphs) and ``blocks``.

A block is a dict with ``kind``: heading has ``level`` (1 or 2) and ``text``; paragraph and code
have ``text``; barrier has nothing; film has ``text`` and ``player``, its place among the players,
and is in the HTML page alone; figure has ``label``, ``file``, ``caption``, ``alt`` and
``float``; table has ``label``, ``caption``, ``columns`` (each with ``heading``, ``width`` and
``right``) and ``rows`` of cells; a row of one cell is a heading of the rows below it.
"""


def require_libraries() -> None:
    """Raise ``UserError`` if jinja2 or typst is not installed."""
    for library in ("jinja2", "typst"):
        if find_spec(library) is None:
            raise UserError(
                f"{library} is not installed",
                "install it with `pip install 'snooker-cli[report]'`",
                code="missing library",
            )


def document(
    template: str,
    values: Mapping[str, Any],
    figures: Mapping[str, Mapping[str, str]],
) -> Document:
    """The document from a template.

    values : what the template refers to
    figures : label, caption and alt text by file
    """
    title, summary, blocks = "", [], list[dict[str, Any]]()
    for chunk in re.split(r"\n\s*\n", rendered(template, values).strip()):
        first, *lines = chunk.strip().splitlines()
        mark, _, rest = first.partition(" ")
        if mark == "#":
            title = rest
        elif mark in ("##", "###"):
            blocks.append({"kind": "heading", "level": len(mark) - 1, "text": rest})
        elif mark == "@barrier":
            blocks.append({"kind": "barrier"})
        elif mark in ("@figures", "@grid"):
            place = {"kind": "figure", "float": mark == "@figures"}
            blocks += [{**place, "file": file, **figures[file]} for file in rest.split()]
        elif mark == "@film":
            player, _, text = rest.partition(" ")
            blocks.append({"kind": "film", "player": int(player), "text": unbroken(text)})
        elif mark == "@code":
            blocks.append({"kind": "code", "text": "\n".join(lines)})
        elif mark == "@table":
            number = rest or 1 + sum(block["kind"] == "table" for block in blocks)
            blocks.append({"kind": "table", "label": f"Table {number}", **_table(lines)})
        elif blocks:
            blocks.append({"kind": "paragraph", "text": unbroken(" ".join(chunk.split()))})
        else:
            summary.append(unbroken(" ".join(chunk.split())))
    return {"title": title, "summary": summary, "blocks": blocks}


def _table(lines: Sequence[str]) -> dict[str, Any]:
    """Caption, columns and rows of a table in the template."""
    head, *rows = [
        [unbroken(cell.strip()) for cell in line.strip()[1:-1].split("|")]
        for line in lines
        if line[0] == "|"
    ]
    columns = []
    for cell in head:
        heading, side, width = re.fullmatch(r"(.*) ([<>])(\d+)", cell).groups()  # type: ignore[union-attr]
        columns.append({"heading": heading, "width": int(width), "right": side == ">"})
    caption = " ".join(line.strip() for line in lines if line[0] != "|")
    return {"caption": unbroken(caption), "columns": columns, "rows": rows}


def unbroken(text: str) -> str:
    """A text with one notation of units, which does not break inside a value, a unit or a ratio."""
    for pattern, printed in NOTATION.items():
        text = re.sub(pattern, printed, text)
    return text


def _row(*cells: object) -> str:
    return f"| {' | '.join(map(str, cells))} |"


def write_html(document: Document, players: Sequence[str], folder: Path) -> Path:
    """Write ``report.html``, which contains every figure and the players, given as HTML."""
    images = {
        block["file"]: "data:image/svg+xml;base64,"
        + base64.b64encode((folder / "figures" / f"{block['file']}.svg").read_bytes()).decode()
        for block in document["blocks"]
        if block["kind"] == "figure"
    }
    path = folder / "report.html"
    values = {**document, "images": images, "players": players}
    write_text(path, rendered("report.html.j2", values, escape=True))
    return path


def write_pdf(document: Document, folder: Path) -> Path:
    """Write ``report.pdf`` as PDF/UA: tagged, with a title and alt texts. Raises ``UserError``."""
    import typst

    path = folder / "report.pdf"
    with tempfile.TemporaryDirectory(dir=folder) as name:
        # Typst reads only files below its root, the folder that has the figures.
        scratch = Path(name)
        (scratch / "report.typ").write_text(packaged("templates/report.typ"), encoding="utf-8")
        (scratch / "document.json").write_text(json.dumps(document), encoding="utf-8")
        source, root = str(scratch / "report.typ"), str(folder.resolve())
        try:
            with atomic_write(path) as part:
                typst.compile(
                    source,
                    str(part),
                    root=root,
                    format="pdf",
                    timestamp=EPOCH,
                    pdf_standards="ua-1",
                )
        except RuntimeError as error:
            raise UserError(f"{path}: typst cannot make the PDF ({error})") from None
    return path


def rendered(name: str, values: Mapping[str, Any], *, escape: bool = False) -> str:
    """A template with its values filled in; an unknown value is an error."""
    import jinja2

    environment = jinja2.Environment(
        autoescape=escape, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters |= {
        "short": short,
        "rough": rough,
        "ratio": ratio,
        "probability": probability,
        "counted": counted,
        "listed": lambda words: listed(list(words)),
        "general": lambda value: f"{value:g}",
        "powers": lambda text: re.sub(r"\b[\d.]+e-?\d+", lambda e: short(float(e[0])), text),
    }
    environment.globals |= {
        "with_error": with_error,
        "row": _row,
    }
    return environment.from_string(packaged(f"templates/{name}")).render(values)
