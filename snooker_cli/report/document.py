"""A report as plain data: headings, paragraphs, figures and tables, for HTML and PDF alike."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any


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
class Table:
    """A table; ``right`` tells which columns hold numbers, ``widths`` how wide they are."""

    label: str
    caption: str
    headings: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    right: tuple[bool, ...]
    widths: tuple[float, ...]
    kind: str = field(default="table", init=False)


Block = Heading | Paragraph | Figure | Table


@dataclass(frozen=True)
class Document:
    """A title, a summary, and what follows."""

    title: str
    summary: tuple[str, ...]
    blocks: tuple[Block, ...]

    def as_json(self) -> dict[str, Any]:
        """The document as JSON."""
        return asdict(self)
