"""docs/notebook.ipynb shows what it gives; ``pytest tests/docs --write-goldens`` updates it.

No notebook server is needed: cells are plain Python, and the last expression of a cell is shown.
"""

from __future__ import annotations

import ast
import base64
import json
import re
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

import pytest

NOTEBOOK = Path(__file__).parents[2] / "docs" / "notebook.ipynb"

Cell = dict[str, Any]


def outputs(source: str, names: dict[str, Any], count: int) -> list[Cell]:
    """What a cell prints and shows, as the format of notebooks has it."""
    tree, last = ast.parse(source), None
    if isinstance(tree.body[-1], ast.Expr):
        last = ast.Expression(tree.body.pop().value)
    with redirect_stdout(StringIO()) as out:
        exec(compile(tree, "cell", "exec"), names)
        shown = None if last is None else eval(compile(last, "cell", "eval"), names)
    found: list[Cell] = []
    if out.getvalue():
        lines = out.getvalue().splitlines(keepends=True)
        found.append({"name": "stdout", "output_type": "stream", "text": lines})
    if shown is not None:
        data: dict[str, Any] = {"text/plain": repr(shown).splitlines(keepends=True)}
        if text := getattr(shown, "_repr_html_", lambda: None)():
            data["text/html"] = text.splitlines(keepends=True)
        if hasattr(shown, "_repr_png_"):
            data["image/png"] = base64.b64encode(shown._repr_png_()).decode()
        result = {"data": data, "execution_count": count, "metadata": {}}
        found.append(result | {"output_type": "execute_result"})
    return found


def without_images(found: list[Cell]) -> str:
    """Outputs without the bytes of images, which differ between versions of matplotlib."""
    return re.sub(r'"image/png": "[^"]+"', "an image", json.dumps(found))


def test_the_notebook_shows_what_its_cells_give(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest
) -> None:
    monkeypatch.chdir(tmp_path)
    notebook = json.loads(NOTEBOOK.read_text(encoding="utf-8"))
    cells = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
    assert sum("image/png" in json.dumps(cell["outputs"]) for cell in cells) == 1
    names: dict[str, Any] = {"__name__": "__main__"}
    for count, cell in enumerate(cells, 1):
        given = outputs("".join(cell["source"]), names, count)
        if request.config.getoption("--write-goldens"):
            cell |= {"outputs": given, "execution_count": count}
        assert without_images(given) == without_images(cell["outputs"])
    assert not list(tmp_path.iterdir())
    if request.config.getoption("--write-goldens"):
        text = json.dumps(notebook, indent=1, ensure_ascii=False) + "\n"
        NOTEBOOK.write_text(text, encoding="utf-8")
