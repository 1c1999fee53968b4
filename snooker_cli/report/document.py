"""A report as plain data: headings, paragraphs, figures and tables, for HTML and PDF alike."""

from __future__ import annotations

import base64
import json
import tempfile
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from importlib.resources import files
from pathlib import Path
from typing import Any

from snooker_cli.errors import UserError


@dataclass(frozen=True)
class Heading:
    """A section's heading; ``after_figures`` if it waits for all figures before it."""

    text: str
    after_figures: bool = False
    kind: str = field(default="heading", init=False)


@dataclass(frozen=True)
class Paragraph:
    """A paragraph of plain text."""

    text: str
    kind: str = field(default="paragraph", init=False)


@dataclass(frozen=True)
class Figure:
    """A figure by its file, without ending, in the report's folder."""

    label: str
    file: str
    caption: str
    kind: str = field(default="figure", init=False)


@dataclass(frozen=True)
class ReportTable:
    """A table; ``right`` tells which columns hold numbers, ``widths`` how wide they are."""

    label: str
    caption: str
    headings: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    right: tuple[bool, ...]
    widths: tuple[float, ...]
    kind: str = field(default="table", init=False)


Block = Heading | Paragraph | Figure | ReportTable


@dataclass(frozen=True)
class ReportDocument:
    """A title, a summary, and what follows."""

    title: str
    summary: tuple[str, ...]
    blocks: tuple[Block, ...]

    def as_json(self) -> dict[str, Any]:
        """The document as JSON."""
        return asdict(self)


# A document -> one self-contained HTML page, and a PDF by typst; the same bytes each time.

EPOCH = 0
"""The PDF's date, s since 1970: a report says nothing of when it was made."""


def write_html(document: ReportDocument, players: Sequence[str], folder: Path) -> Path:
    """Write ``report.html`` with every figure inside it, and players, which are HTML themselves.

    Raises ``UserError``.
    """
    try:
        import jinja2
    except ImportError:
        raise UserError(_missing("jinja2")) from None
    images = {
        block.file: _as_data(folder / f"{block.file}.svg")
        for block in document.blocks
        if isinstance(block, Figure)
    }
    environment = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined)
    template = environment.from_string(_template("report.html.j2"))
    path = folder / "report.html"
    path.write_text(
        template.render(**document.as_json(), images=images, players=players), encoding="utf-8"
    )
    return path


def write_pdf(document: ReportDocument, folder: Path) -> Path:
    """Write ``report.pdf``. Raises ``UserError``."""
    try:
        import typst
    except ImportError:
        raise UserError(_missing("typst")) from None
    path = folder / "report.pdf"
    with tempfile.TemporaryDirectory(dir=folder) as scratch:
        # Typst reads only below its root: the template and the data stand beside the figures.
        source = Path(scratch) / "report.typ"
        source.write_text(_template("report.typ"), encoding="utf-8")
        data = Path(scratch) / "document.json"
        data.write_text(json.dumps(document.as_json()), encoding="utf-8")
        (Path(scratch) / "figures").symlink_to((folder / "figures").resolve())
        try:
            typst.compile(
                str(source), output=str(path), root=str(folder.resolve()), timestamp=EPOCH
            )
        except RuntimeError as error:
            raise UserError(f"{path}: typst could not lay it out ({error})") from None
    return path


def _as_data(path: Path) -> str:
    """An SVG file as a data URL."""
    return "data:image/svg+xml;base64," + base64.b64encode(path.read_bytes()).decode("ascii")


def _template(name: str) -> str:
    return (files("snooker_cli.report") / "templates" / name).read_text(encoding="utf-8")


def _missing(library: str) -> str:
    return f"{library} is not installed; install snooker's extra: pip install 'snooker[report]'"
