"""A template with values, figures and players -> an HTML page and a PDF, or a text in Markdown.

The same runs always give the same bytes.

templates/run.md.j2 explains the marks of a template.
"""

import base64
import json
import re
from collections.abc import Mapping, Sequence
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from contextlib import AbstractContextManager
from functools import partial
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path
from typing import Any, TypeAlias

import yaml

from snooker_cli.animation import film, page
from snooker_cli.config import Point
from snooker_cli.errors import FigureError, UserError, install_advice
from snooker_cli.figures.drawing import save
from snooker_cli.figures.figure_data import FigureData
from snooker_cli.files import atomic_write, unlinked, write_text
from snooker_cli.formatting import (
    counted,
    listed,
    point_label,
    printable,
    probability,
    ratio,
    rough,
    short,
    with_error,
)
from snooker_cli.pages.html_page import embedded
from snooker_cli.report.markdown import write_markdown
from snooker_cli.runs import RunFolder
from snooker_cli.runs.processes import Processes


def packaged(name: str, package: str = "snooker_cli.report") -> str:
    """The text of a file of a package, such as a template."""
    return (files(package) / name).read_text(encoding="utf-8")


BAR = "\ue000"  # a character of private use for a bar in a cell of a table
EPOCH = 0  # date of the PDF, s since 1970: the same bytes each time
NOTATION: dict[str, str] = yaml.safe_load(packaged("notation.yaml"))
"""What the pages print instead of matches of a pattern."""

Document: TypeAlias = dict[str, Any]
"""``title``, ``summary`` (paragraphs) and ``blocks``.

A block is a dict with ``kind``: heading has ``level`` (1 or 2) and ``text``; paragraph and code
have ``text``; barrier has nothing; film has ``text`` and ``player``, its number among the players,
and is in the HTML page alone; figure has ``label``, ``file``, ``caption``, ``alt`` and
``float``; table has ``label``, ``caption``, ``columns`` (each with ``heading``, ``width`` and
``right``) and ``rows`` of cells; a row of one cell is a heading of the rows below it.
"""


def require_libraries(*names: str) -> None:
    """Raise ``UserError`` if one of these is not installed [jinja2 and typst]."""
    for library in names or ("jinja2", "typst"):
        if find_spec(library) is None:
            raise UserError(
                f"{library} is not installed",
                install_advice("report"),
                code="missing library",
            )


def document(
    template: str, values: Mapping[str, Any], figures: Mapping[str, Mapping[str, str]]
) -> Document:
    """The document from the text of a template.

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
            kind = {"kind": "figure", "float": mark == "@figures"}
            blocks += [{**kind, "file": file, **figures[file]} for file in rest.split()]
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
        [unbroken(cell.strip().replace(BAR, "|")) for cell in line.strip()[1:-1].split("|")]
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
    """A row of a table; a bar in a cell does not end it."""
    return f"| {' | '.join(str(cell).replace('|', BAR) for cell in cells)} |"


def write_html(
    document: Document, players: Sequence[str], folder: Path, name: str = "report"
) -> Path:
    """Write ``NAME.html``, which contains every figure and the players, given as HTML."""
    images = {
        block["file"]: "data:image/svg+xml;base64,"
        + base64.b64encode((folder / "figures" / f"{block['file']}.svg").read_bytes()).decode()
        for block in document["blocks"]
        if block["kind"] == "figure"
    }
    path = folder / f"{name}.html"
    values = {**document, "images": images, "players": players}
    write_text(path, rendered(packaged("templates/report.html.j2"), values, escape=True))
    return path


def write_pdf(document: Document, folder: Path, name: str = "report") -> Path:
    """Write ``NAME.pdf`` as PDF/UA: tagged, with a title and alt texts. Raises ``UserError``.

    PDF/UA refuses a character that no font here has. Such a PDF is tagged, too, but no PDF/UA.
    """
    import typst

    path = folder / f"{name}.pdf"
    source, settings = layout(document, folder)
    try:
        content = typst.compile(source, pdf_standards="ua-1", **settings)
    except RuntimeError:
        try:
            content = typst.compile(source, **settings)
        except RuntimeError as error:
            raise UserError(f"{path}: typst cannot make the PDF ({error})") from None
    with atomic_write(path) as part:
        part.write_bytes(content)
    return path


def layout(document: Document, folder: Path) -> tuple[bytes, dict[str, Any]]:
    """Source and settings of the PDF, for ``typst.compile``."""
    return packaged("templates/report.typ").encode(), {
        "root": str(folder.resolve()),  # Typst reads only files below it, as the figures are
        "sys_inputs": {"document": json.dumps(document)},
        "timestamp": EPOCH,
    }


def rendered(template: str, values: Mapping[str, Any], *, escape: bool = False) -> str:
    """The text of a template with its values filled in; an unknown value is an error."""
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
        "grouped": lambda number: f"{number:,}",
        "powers": lambda text: re.sub(r"\b[\d.]+e-?\d+", lambda e: short(float(e[0])), text),
    }
    environment.globals |= {"with_error": with_error, "row": _row}
    return environment.from_string(template).render(values)


class Pages(AbstractContextManager["Pages"]):
    """Collects a report's figures and players. Raises ``UserError`` without its libraries.

    markdown : whether it is a text in Markdown, which has no players, instead of pages
    figures : label, caption and alt text by file
    other : the process that draws
    """

    def __init__(self, out: Path, markdown: bool = False) -> None:
        require_libraries("jinja2", *(() if markdown else ("typst",)))
        self.markdown = markdown
        out.mkdir(parents=True, exist_ok=True)
        unlinked(out / "figures")
        self.out, self.players = out, list[str]()
        self.figures: dict[str, dict[str, str]] = {}
        self.other = Processes(1)
        self._drawing: list[Future[list[Path]]] = []

    def __exit__(self, error: object, *_: object) -> None:
        if error:
            self.other.kill()  # it may be at a figure that takes a minute
        self.other.shutdown()
        if error is BrokenProcessPool:
            raise UserError(
                f"{self.out}: the system ended the process that draws, perhaps for lack of memory",
                "run the same command again",
            ) from None

    def add_figure(
        self, file: str, picture: FigureData, label: str = "", known: str = ""
    ) -> FigureData:
        """Let a figure be drawn: by default with the next number, and all of its caption."""
        label = label or f"Figure {len(self.figures) + 1}"
        caption = unbroken(" ".join(picture.caption.replace(known, "").split()))
        self.figures[file] = {"label": label, "caption": caption, "alt": picture.alt}
        drawing = partial(save, outlines=True)  # Typst and browsers may lack the font
        self._drawing.append(self.other.submit(drawing, picture, self.out / "figures" / file))
        return picture

    def add_player(self, run: RunFolder, point: Point) -> str:
        """Add a player of a point's first repeat; the reason if there can be none, else empty."""
        if self.markdown:
            return ""
        repeat = run.present(point)[0]
        where = f"{point_label({'cor': point.config.cor} | point.as_json())}, repeat {repeat}"
        title = printable(run.config.title or run.name)
        if not run.can_be_replayed:
            return f"repeat {repeat} is of another engine version, which the page cannot simulate"
        try:
            # The first of all traces, which analyses have read and fitted.
            shown = page(film(next(run.traces(point)), title, where))
        except FigureError as error:
            return f"repeat {repeat} {error}"
        self.players.append(embedded(shown, f"Player, {printable(run.name)}, {where}"))
        return ""

    def write(self, template: str, values: dict[str, Any], name: str = "report") -> list[Path]:
        """Write ``NAME.html`` and ``NAME.pdf``, or ``NAME.md``, when all figures are drawn."""
        for drawing in self._drawing:
            drawing.result()
        content = document(template, values, self.figures)
        if self.markdown:
            return [write_markdown(content, self.out, name)]
        players = self.players if name == "report" else ()
        return [write_html(content, players, self.out, name), write_pdf(content, self.out, name)]
