"""The text of this report, figures and tables -> one HTML page and a PDF; the same bytes each time.

templates/report.md.j2 holds the text and explains its marks.
"""

from __future__ import annotations

import base64
import json
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from importlib.resources import files
from pathlib import Path
from typing import Any

from snooker_cli.errors import UserError
from snooker_cli.formatting import listed, short, with_error

EPOCH = 0
"""Date of the PDF, s since 1970: the same bytes each time."""


@dataclass(frozen=True)
class TableColumn:
    """A column: its heading, its relative width, and whether it is aligned right."""

    heading: str
    width: float
    right: bool = True


@dataclass(frozen=True)
class Table:
    """Columns and rows of cells."""

    columns: Sequence[TableColumn]
    rows: Sequence[Sequence[str]]


@dataclass
class ReportDocument:
    """A title, a summary, and blocks.

    A block is a dict with ``kind``: heading and paragraph have ``text``; barrier has nothing;
    figure has ``label``, ``file`` and ``caption``; table has ``label``, ``caption``, ``columns``
    and ``rows``.
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


def document(
    values: Mapping[str, Any],
    figures: Mapping[str, tuple[str, str]],
    tables: Mapping[str, Table],
) -> ReportDocument:
    """The document from the template.

    values : what the template refers to
    figures : label and caption by file
    tables : by name
    """
    found = ReportDocument()
    for chunk in _rendered("report.md.j2", values).split("\n\n"):
        first, _, rest = chunk.strip().partition("\n")
        mark, _, line = first.partition(" ")
        text = " ".join(chunk.split())
        if mark == "#":
            found.title = line
        elif mark == "##":
            found.blocks.append({"kind": "heading", "text": line})
        elif mark == "@barrier":
            found.blocks.append({"kind": "barrier"})
        elif mark == "@figures":
            for file in line.split():
                label, caption = figures[file]
                found.blocks.append(
                    {"kind": "figure", "label": label, "file": file, "caption": caption}
                )
        elif mark == "@table":
            number, name = line.split()
            caption = " ".join(rest.split())
            found.blocks.append(
                {"kind": "table", "label": f"Table {number}", "caption": caption}
                | asdict(tables[name])
            )
        elif text and found.blocks:
            found.blocks.append({"kind": "paragraph", "text": text})
        elif text:
            found.summary.append(text)
    return found


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
    environment.filters |= {"short": short, "listed": lambda words: listed(list(words))}
    environment.globals["with_error"] = with_error
    return environment.from_string(_template(name)).render(values)


def _template(name: str) -> str:
    return (files("snooker_cli.report") / "templates" / name).read_text(encoding="utf-8")
