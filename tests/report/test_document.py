"""A document as PDF."""

from __future__ import annotations

from pathlib import Path

import pytest
from pypdf import PdfReader

from snooker_cli.report.document import unbroken, write_html, write_pdf


def test_a_character_that_no_font_has_does_not_stop_the_pdf(tmp_path: Path) -> None:
    content = {"title": "\U0001f1e9\U0010fffd", "summary": [], "blocks": []}
    assert len(PdfReader(write_pdf(content, tmp_path)).pages) == 1


def test_text_of_a_run_is_no_html(tmp_path: Path) -> None:
    blocks = [{"kind": "paragraph", "text": "<script>1</script>"}]
    shown = {"title": "<script>2</script>", "summary": ["<script>3</script>"], "blocks": blocks}
    written = write_html(shown, [], tmp_path).read_text(encoding="utf-8")
    for number in "123":
        assert f"<script>{number}" not in written
        assert f"&lt;script&gt;{number}" in written


@pytest.mark.parametrize(
    ("text", "printed"),
    [
        ("1.0 ± 0.1 1/s at CoR 0.8", "1.0_±_0.1_s⁻¹ at CoR_0.8"),
        ("2 Pa m, 3 %, r = 0.001 m", "2_Pa·m, 3_%, r_=_0.001_m"),
        ("691.6 ± 3.4 W", "691.6_±_3.4_W"),
        ("rings to 0.7 R, speed / 10, 2 × 10⁻⁶ s", "rings to 0.7_R, speed_/_10, 2_×_10⁻⁶_s"),
        ("2 marks in 5 m/s and PV/NT", "2 marks in 5_m/+s and PV/+NT"),
        ("docs/glossary.md", "docs/glossary.md"),
    ],
)
def test_values_and_units_do_not_break(text: str, printed: str) -> None:
    assert unbroken(text) == printed.replace("_", "\u00a0").replace("+", "\u2060")
