"""``snooker fit`` and ``snooker compare``: tables, their notes, JSON, and unfinished runs."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from conftest import Ended
from repeating import made

from snooker_cli.analysis.decay import LAWS, QUANTITIES, SAMPLING
from snooker_cli.analysis.fitting import NOTHING_DECAYS

Snooker = Callable[..., Ended]

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


def test_fit_prints_a_table_and_its_notes(finished: Path, snooker: Snooker) -> None:
    ended = snooker("fit", "small")
    assert ended.code == 0
    lines = ended.out.splitlines()
    assert lines[0].split("  ")[0] == "point"
    for heading in ("R²", "rms residual", "repeats", "bootstrap", "(max-min)/2"):
        assert heading in lines[0]
    table = lines[1 : 1 + 2 * len(QUANTITIES) * len(LAWS)]
    for quantity in QUANTITIES:
        assert sum(quantity.replace("_", " ") + "  " in line for line in table) >= 2 * len(LAWS)
    assert lines[1 + len(table)] == SAMPLING
    elastic = [line for line in table if line.startswith("cor=1.0   kinetic energy")]
    for line in elastic:
        assert line.split()[4:] == ["–", "–", "–", "–", "–", "0"]
    notes = lines[2 + len(table) :]
    assert (
        f"cor=1.0: no fit of kinetic energy and local energy in 3 of 3 repeats: {NOTHING_DECAYS}"
        in notes
    )
    assert any(
        line.startswith("cor=0.85: ") and "ended early, in a wall trap" in line for line in notes
    )


def test_json_is_a_list_and_the_notes_are_saved(finished: Path, snooker: Snooker) -> None:
    for command, keys in (("fit", FIT_KEYS), ("compare", COMPARE_KEYS)):
        ended = snooker(command, "small", "--json")
        assert ended.code == 0
        rows = json.loads(ended.out)
        assert isinstance(rows, list)
        assert all(keys <= set(row) for row in rows)
        content = saved(finished, f"{command}.json")
        assert content["rows"] == rows
        printed = snooker(command, "small").out
        for note in content["notes"]:
            assert note["note"] in printed


def test_compare_prints_a_table_and_its_notes(finished: Path, snooker: Snooker) -> None:
    ended = snooker("compare", "small")
    assert ended.code == 0
    assert "cor=1.0   pressure, Pa m" in ended.out
    said = [note["note"] for note in saved(finished, "compare.json")["notes"]]
    assert any("skip the first 18 ball-ball collisions" in note for note in said)
    assert any("ended early, in a wall trap" in note for note in said)
    # A note on all points stands there once, without their names.
    assert len(ended.out.splitlines()) == len(set(ended.out.splitlines()))


def test_an_unfinished_run_is_analysed_as_far_as_it_is(finished: Path, snooker: Snooker) -> None:
    (finished / "point-0001" / "repeat-0001.h5").unlink()
    for command in ("fit", "compare"):
        ended = snooker(command, "small")
        assert ended.code == 0
        note = "cor=1.0: 2 of 3 repeats are there; run the config again for the rest"
        assert note in ended.out.splitlines()
        rows = saved(finished, f"{command}.json")["rows"]
        assert {row["repeats"] for row in rows if row["parameters"] == {"cor": 1.0}} <= {0, 2}
    shutil.rmtree(finished / "point-0001")
    for command in ("fit", "compare"):
        ended = snooker(command, "small")
        assert ended.code == 0
        assert "cor=1.0: 0 of 3 repeats are there; run the config again for the rest" in ended.out
        content = saved(finished, f"{command}.json")
        assert {row["parameters"]["cor"] for row in content["rows"]} == {0.85}
    shutil.rmtree(finished / "point-0000")
    for command in ("fit", "compare"):
        ended = snooker(command, "small")
        assert (ended.code, ended.out) == (2, "")
        assert "no repeat" in ended.err
        assert ended.err.count("\n") == 1


def test_an_extension_that_is_not_finished_is_analysed_and_said(
    finished: Path, snooker: Snooker, small_config: str
) -> None:
    assert not made(finished, small_config, "collisions=151").analyses()
    said = "3 of 3 repeats end where the run did before it was extended; run the config again for"
    for command in ("fit", "compare"):
        ended = snooker(command, "small")
        assert ended.code == 0
        assert f"\n{said} the rest\n" in ended.out
        assert "cor=0.85" in ended.out
    ended = snooker("plot", "small", "energy")
    assert ended.code == 0
    assert f"snooker: {said.replace('3 of 3', '6 of 6')} the rest\n" in ended.err
    for command in ("export", "show", "verify"):
        assert snooker(command, "small").code == 0


def test_what_cannot_be_saved_is_printed(
    finished: Path, snooker: Snooker, monkeypatch: pytest.MonkeyPatch
) -> None:
    from snooker_cli.analysis import run_analysis

    def refused(path: Path, content: object) -> None:
        raise PermissionError(13, "Permission denied")

    printed = {command: snooker(command, "small").out for command in ("fit", "compare")}
    for saved_file in ("fit.json", "compare.json"):
        (finished / saved_file).unlink()
    monkeypatch.setattr(run_analysis, "write_json", refused)
    for command in ("fit", "compare"):
        ended = snooker(command, "small")
        assert (ended.code, ended.out) == (2, printed[command])
        assert ended.err == (
            f"snooker: runs/small/{command}.json: cannot be written (Permission denied), so that "
            "the result is only printed; make the run's folder writable, or copy it\n"
        )
        ended = snooker(command, "small", "--json")
        assert (ended.code, len(ended.err.splitlines())) == (2, 1)
        assert isinstance(json.loads(ended.out), list)
