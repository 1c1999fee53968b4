"""A document as PDF."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from pypdf import PdfReader

from snooker_cli.report.document import write_html, write_pdf

SQUARE = '<svg xmlns="http://www.w3.org/2000/svg" width="9" height="9"><path d="M0 0h9v9z"/></svg>'


def test_the_pdf_has_its_figures_without_links(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Windows refuses links to most users."""

    def refused(*_: Any, **__: Any) -> None:
        raise OSError("a required privilege is not held by the client")

    monkeypatch.setattr(Path, "symlink_to", refused)
    (tmp_path / "figures").mkdir()
    (tmp_path / "figures" / "square.svg").write_text(SQUARE, encoding="utf-8")
    square = {"label": "Figure 1", "file": "square", "caption": "A square.", "alt": "a square"}
    blocks = [{"kind": "figure", **square}, {"kind": "paragraph", "text": "Text."}]
    path = write_pdf({"title": "Squares", "summary": [], "blocks": blocks}, tmp_path)
    assert "A square." in PdfReader(path).pages[0].extract_text()
    assert sorted(each.name for each in tmp_path.iterdir()) == ["figures", "report.pdf"]


def test_text_of_a_run_is_no_html(tmp_path: Path) -> None:
    blocks = [{"kind": "paragraph", "text": "<script>1</script>"}]
    shown = {"title": "<script>2</script>", "summary": ["<script>3</script>"], "blocks": blocks}
    written = write_html(shown, [], tmp_path).read_text(encoding="utf-8")
    for number in "123":
        assert f"<script>{number}" not in written
        assert f"&lt;script&gt;{number}" in written


def rows_on_pages(number: int, folder: Path) -> list[int]:
    """How many rows each page has of a table of this many rows."""
    column = {"heading": "Column", "width": 9, "right": False}
    rows = [[f"cell-{each}"] for each in range(number)]
    table = {"kind": "table", "label": "Table 1", "caption": "", "columns": [column], "rows": rows}
    path = write_pdf({"title": "A table", "summary": [], "blocks": [table]}, folder)
    return [page.extract_text().count("cell-") for page in PdfReader(path).pages]


def test_the_last_rows_of_a_table_stay_together(tmp_path: Path) -> None:
    most, *_ = rows_on_pages(100, tmp_path)
    for more in (1, 2):
        assert rows_on_pages(most + more, tmp_path) == [most + more - 3, 3]
