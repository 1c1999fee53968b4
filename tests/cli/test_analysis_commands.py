"""``snooker fit`` and ``compare`` of runs that are not finished, or whose folder is read-only."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest
from command_line import Snooker
from repeating import made

from snooker_cli.analysis import run_analysis


@pytest.mark.parametrize("command", ["fit", "compare"])
def test_an_unfinished_run_is_analysed_as_far_as_it_is(
    command: str, separate: Path, snooker: Snooker
) -> None:
    (separate / "point-0001" / "repeats-0001-0001.h5").unlink()
    ended = snooker(command, "small", "--json")
    assert (ended.code, ended.err) == (0, "")
    rows = json.loads(ended.out)
    content = json.loads((separate / f"{command}.json").read_text(encoding="utf-8"))
    assert content["rows"] == rows
    assert {row["repeats"] for row in rows if row["parameters"] == {"cor": 1.0}} <= {0, 2}
    printed = snooker(command, "small").out
    assert "cor=1.0: 2 of 3 repeats" in printed
    assert all(note["note"] in printed for note in content["notes"])
    shutil.rmtree(separate / "point-0001")
    assert "cor=1.0: 0 of 3 repeats" in snooker(command, "small").out
    rows = json.loads(snooker(command, "small", "--json").out)
    assert {row["parameters"]["cor"] for row in rows} == {0.85}
    shutil.rmtree(separate / "point-0000")
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
    assert snooker("export", "small").code == 0


@pytest.mark.parametrize("command", ["fit", "compare"])
def test_an_analysis_that_cannot_be_saved_is_printed(
    command: str, finished: Path, snooker: Snooker, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(path: Path, content: object) -> None:
        raise PermissionError(13, "Permission denied")

    for options in ([], ["--json"]):
        printed = snooker(command, "small", *options).out
        (finished / f"{command}.json").unlink()
        with monkeypatch.context() as patched:
            patched.setattr(run_analysis, "write_json", refused)
            ended = snooker(command, "small", *options)
        assert (ended.code, ended.out) == (2, printed)
        assert ended.err.startswith(f"snooker: runs/small/{command}.json: cannot be written ")
