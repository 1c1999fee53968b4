"""A document as PDF."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from pypdf import PdfReader

from snooker_cli.report.document import write_pdf

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
