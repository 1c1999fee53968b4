"""``snooker fit`` and ``compare``: tables, notes, JSON, and unfinished runs."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest
from command_line import Snooker
from repeating import made

from snooker_cli.analysis import run_analysis

FIT_KEYS = {"parameters", "quantity", "model", "value", "error", "repeats", "unit", "reason"}

COMPARE_KEYS = {
    "parameters",
    "quantity",
    "model",
    "measured",
    "error",
    "predicted",
    "difference",
    "difference_in_errors",
    "repeats",
    "samples",
    "unit",
}


def saved(folder: Path, name: str) -> dict[str, Any]:
    """What an analysis has left in the run's folder."""
    content: dict[str, Any] = json.loads((folder / name).read_text(encoding="utf-8"))
    assert set(content) == {"made_from", "rows", "notes"}
    for note in content["notes"]:
        assert set(note) == {"parameters", "note"}
    return content


@pytest.mark.parametrize(("command", "keys"), [("fit", FIT_KEYS), ("compare", COMPARE_KEYS)])
def test_rows_and_notes_are_printed_and_saved(
    command: str, keys: set[str], finished: Path, snooker: Snooker
) -> None:
    ended = snooker(command, "small", "--json")
    assert ended.code == 0
    rows = json.loads(ended.out)
    assert rows
    assert all(keys <= set(row) for row in rows)
    content = saved(finished, f"{command}.json")
    assert content["rows"] == rows
    printed = snooker(command, "small").out
    assert any("in a wall trap" in note["note"] for note in content["notes"])
    assert all(note["note"] in printed for note in content["notes"])


@pytest.mark.parametrize("command", ["fit", "compare"])
def test_an_unfinished_run_is_analysed_as_far_as_it_is(
    command: str, finished: Path, snooker: Snooker
) -> None:
    (finished / "point-0001" / "repeat-0001.h5").unlink()
    ended = snooker(command, "small")
    assert ended.code == 0
    assert "cor=1.0: 2 of 3 repeats" in ended.out
    rows = saved(finished, f"{command}.json")["rows"]
    assert {row["repeats"] for row in rows if row["parameters"] == {"cor": 1.0}} <= {0, 2}
    shutil.rmtree(finished / "point-0001")
    ended = snooker(command, "small")
    assert ended.code == 0
    assert "cor=1.0: 0 of 3 repeats" in ended.out
    content = saved(finished, f"{command}.json")
    assert {row["parameters"]["cor"] for row in content["rows"]} == {0.85}
    shutil.rmtree(finished / "point-0000")
    ended = snooker(command, "small")
    assert (ended.code, ended.out, ended.err.count("\n")) == (2, "", 1)


def test_an_unfinished_extension_is_analysed_with_a_note(
    finished: Path, snooker: Snooker, small_config: str
) -> None:
    assert not made(finished, small_config, "collisions=151").analyses()
    for command in ("fit", "compare"):
        ended = snooker(command, "small")
        assert ended.code == 0
        assert "\n3 of 3 repeats end " in ended.out
        assert "cor=0.85" in ended.out
    ended = snooker("plot", "small", "energy")
    assert ended.code == 0
    assert "snooker: 6 of 6 repeats end " in ended.err
    for command in ("export", "show", "verify"):
        assert snooker(command, "small").code == 0


@pytest.mark.parametrize("command", ["fit", "compare"])
def test_an_analysis_that_cannot_be_saved_is_printed(
    command: str, finished: Path, snooker: Snooker, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(path: Path, content: object) -> None:
        raise PermissionError(13, "Permission denied")

    printed = snooker(command, "small").out
    (finished / f"{command}.json").unlink()
    monkeypatch.setattr(run_analysis, "write_json", refused)
    ended = snooker(command, "small")
    assert (ended.code, ended.out) == (2, printed)
    assert ended.err.startswith(f"snooker: runs/small/{command}.json: cannot be written ")
    ended = snooker(command, "small", "--json")
    assert (ended.code, len(ended.err.splitlines())) == (2, 1)
    assert isinstance(json.loads(ended.out), list)
