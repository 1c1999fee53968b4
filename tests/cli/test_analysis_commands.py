"""``snooker fit``, ``compare`` and ``reproduce``: which rows and notes they print, and when."""

from __future__ import annotations

import json
import re
import shutil
import sys
from pathlib import Path

import pytest
from command_line import Snooker
from repeating import made

from snooker_cli.reproduction.reproduce import RUNS


def test_an_unfinished_run_is_analysed_as_far_as_it_is(separate: Path, snooker: Snooker) -> None:
    (separate / "point-0001" / "repeats-0001-0001.h5").unlink()
    for command in ("fit", "compare"):
        rows = json.loads(snooker(command, "small", "--json").out)
        assert {row["repeats"] for row in rows if row["parameters"] == {"cor": 1.0}} <= {0, 2}
        assert "cor=1.0: 2 of 3 repeats" in snooker(command, "small").out
        brief = snooker(command, "small", "--brief")
        if command == "compare":  # `fit` states no result of an elastic gas
            assert "; only 2 of 3 repeats are there" in brief.out
        assert "the run is unfinished: 5 of 6 repeats are there" in brief.err
    shutil.rmtree(separate / "point-0001")
    for command in ("fit", "compare"):
        assert "cor=1.0: 0 of 3 repeats" in snooker(command, "small").out
        rows = json.loads(snooker(command, "small", "--json").out)
        assert {row["parameters"]["cor"] for row in rows} == {0.85}


def test_an_unfinished_extension_is_analysed_with_a_note(
    finished: Path, snooker: Snooker, small_config: str
) -> None:
    made(finished, small_config, "collisions=151")
    for command in ("fit", "compare"):
        ended = snooker(command, "small")
        assert ended.code == 0
        assert "\n3 of 3 repeats end " in ended.out
        assert "cor=0.85" in ended.out
    assert (
        "snooker: 6 of 6 repeats end " in snooker("plot", "small", "energy", "--format", "svg").err
    )


def test_rows_for_few_readers_are_those_of_all(finished: Path, snooker: Snooker) -> None:
    """They are printed, too, if no other row is wanted."""
    usual, every = (snooker("fit", "small", *more).out for more in ([], ["--all"]))
    assert [text.count("\npressure  ") for text in (usual, every)] == [2, 3]
    assert [text.count("\ntemperature  ") for text in (usual, every)] == [0, 2]
    assert "half range" in every
    assert snooker("fit", "small", "--quantity", "temperature").out.count("\ntemperature  ") == 2
    usual, every = (snooker("compare", "small", *more).out for more in ([], ["--all"]))
    assert [("source report," in text) for text in (usual, every)] == [False, True]
    constants = snooker("compare", "small", "--model", "source report").out
    assert "decay constant of energy" in constants
    pressure = snooker("compare", "small", "--quantity", "pressure, Pa m").out  # as tables have it
    assert "\npressure, Pa m  " in pressure
    second = ("--quantity", "temperature", "--quantity", "nonsense")
    assert "--quantity nonsense: no quantity contains this" in snooker("fit", "small", *second).err
    names = snooker("fit", "small", "--quantity", "nonsense").err
    assert names.count("pressure") == 2  # the names of tables
    assert not re.search("[_1]", names)


def test_reproduce_simulates_missing_runs_and_keeps_finished_ones(
    here: Path, snooker: Snooker, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Only the first config is there, so the command ends at the second one."""
    first, second = RUNS[:2]
    monkeypatch.setattr("snooker_cli.config.template_configs.EXAMPLES", here)
    (here / "small.yaml").rename(here / f"{first}.yaml")
    ended = snooker("reproduce")
    assert ended.code == 3
    assert f"results in {Path('runs', first)}" in ended.out
    assert f"{second}.yaml: there is no file" in ended.err
    assert snooker("reproduce").out == ""


def test_reproduce_simulates_nothing_without_its_libraries(
    here: Path, snooker: Snooker, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "typst", None)
    ended = snooker("reproduce")
    assert (ended.code, ended.out) == (2, "")
    assert "typst is not installed; install it with" in ended.err
    assert not (here / "runs").exists()


def test_a_warning_names_what_helps_where_most_repeats_ended_early(
    here: Path, snooker: Snooker
) -> None:
    """All three repeats at a CoR of 0.8 end in a wall trap, and none at 1."""
    snooker("run", "small.yaml", "-o", "sweep={cor: [0.8, 1.0]}")
    where = ("small", "--where", "cor=0.8")
    warning = (
        "snooker: 3 of 3 repeats ended early, so that results rest on their beginnings; to "
        "continue them, set `collapse: slide` (exact, fixed container) or "
        "`collapse: {tc: 0.01}` in the config\n"
    )
    for command in ("fit", "compare"):
        for ended in (snooker(command, *where, "--brief"), snooker(command, *where)):
            assert ended.err == warning
            assert "; all 3 repeats ended early" in ended.out
        assert snooker(command, "small", "--where", "cor=1.0", "--brief").err == ""
    assert snooker("plot", "small", "energy", *where[1:], "--format", "svg").err == warning
