"""The text of this report, figures and tables -> one HTML page and a PDF; the same bytes each time.

templates/report.md.j2 holds the text and explains its marks.
"""

from __future__ import annotations

import base64
import json
import re
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from importlib.resources import files
from pathlib import Path
from typing import Any

from snooker_cli.errors import UserError
from snooker_cli.formatting import listed, rough, short, with_error

EPOCH = 0
"""Date of the PDF, s since 1970: the same bytes each time."""


@dataclass
class ReportDocument:
    """A title, a summary, and blocks.

    A block is a dict with ``kind``: heading and paragraph have ``text``; barrier has nothing;
    figure has ``label``, ``file`` and ``caption``; table has ``label``, ``caption``, ``columns``
    (each with ``heading``, ``width`` and ``right``) and ``rows`` of cells.
    """

    title: str = ""
    summary: list[str] = field(default_factory=list)
    blocks: list[dict[str, Any]] = field(default_factory=list)


def require_libraries() -> None:
    """Raise ``UserError`` if jinja2 or typst is not installed."""
    for library in ("jinja2", "typst"):
        try:
            __import__(library)
        except ImportError:
            raise UserError(
                f"{library} is not installed",
                "install it with `pip install 'snooker-cli[report]'`",
                code="missing library",
            ) from None


def document(values: Mapping[str, Any], figures: Mapping[str, tuple[str, str]]) -> ReportDocument:
    """The document from the template.

    values : what the template refers to
    figures : label and caption by file
    """
    found = ReportDocument()
    for chunk in re.split(r"\n\s*\n", _rendered("report.md.j2", values).strip()):
        first, *lines = chunk.strip().splitlines()
        mark, _, rest = first.partition(" ")
        text = " ".join(chunk.split())
        if mark == "#":
            found.title = rest
        elif mark == "##":
            found.blocks.append({"kind": "heading", "text": rest})
        elif mark == "@barrier":
            found.blocks.append({"kind": "barrier"})
        elif mark == "@figures":
            for file in rest.split():
                label, caption = figures[file]
                found.blocks.append(
                    {"kind": "figure", "label": label, "file": file, "caption": caption}
                )
        elif mark == "@table":
            found.blocks.append({"kind": "table", "label": f"Table {rest}", **_table(lines)})
        elif found.blocks:
            found.blocks.append({"kind": "paragraph", "text": text})
        else:
            found.summary.append(text)
    return found


def _table(lines: Sequence[str]) -> dict[str, Any]:
    """Caption, columns and rows of a table in the template."""
    head, *rows = [
        [cell.strip() for cell in line.strip()[1:-1].split("|")] for line in lines if line[0] == "|"
    ]
    columns = []
    for cell in head:
        heading, side, width = re.fullmatch(r"(.*) ([<>])(\d+)", cell).groups()  # type: ignore[union-attr]
        columns.append({"heading": heading, "width": int(width), "right": side == ">"})
    caption = " ".join(line.strip() for line in lines if line[0] != "|")
    return {"caption": caption, "columns": columns, "rows": rows}


def write_html(document: ReportDocument, players: Sequence[str], folder: Path) -> Path:
    """Write ``report.html``, which contains every figure and the players, given as HTML."""
    images = {
        block["file"]: "data:image/svg+xml;base64,"
        + base64.b64encode((folder / "figures" / f"{block['file']}.svg").read_bytes()).decode()
        for block in document.blocks
        if block["kind"] == "figure"
    }
    path = folder / "report.html"
    values = {**asdict(document), "images": images, "players": players}
    path.write_text(_rendered("report.html.j2", values, escape=True), encoding="utf-8")
    return path


def write_pdf(document: ReportDocument, folder: Path) -> Path:
    """Write ``report.pdf``. Raises ``UserError``."""
    import typst

    path = folder / "report.pdf"
    with tempfile.TemporaryDirectory(dir=folder) as scratch:
        # Typst reads only files below its root, so template and data are put next to the figures.
        source = Path(scratch) / "report.typ"
        source.write_text(_template("report.typ"), encoding="utf-8")
        data = Path(scratch) / "document.json"
        data.write_text(json.dumps(asdict(document)), encoding="utf-8")
        (Path(scratch) / "figures").symlink_to((folder / "figures").resolve())
        try:
            typst.compile(
                str(source), output=str(path), root=str(folder.resolve()), timestamp=EPOCH
            )
        except RuntimeError as error:
            raise UserError(f"{path}: typst cannot make the PDF ({error})") from None
    return path


def _rendered(name: str, values: Mapping[str, Any], *, escape: bool = False) -> str:
    """A template with its values filled in; an unknown value is an error."""
    import jinja2

    environment = jinja2.Environment(
        autoescape=escape, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters |= {
        "short": short,
        "rough": rough,
        "listed": lambda words: listed(list(words)),
    }
    environment.globals |= {
        "with_error": with_error,
        "row": lambda *cells: f"| {' | '.join(map(str, cells))} |",
    }
    return environment.from_string(_template(name)).render(values)


def _template(name: str) -> str:
    return (files("snooker_cli.report") / "templates" / name).read_text(encoding="utf-8")
