"""A repeat of another run is used by no command, and no export replaces what a run holds."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from command_line import SMALL, Ended
from repeating import done, made

from snooker_cli import runs

Snooker = Callable[..., Ended]

REPEAT = Path("runs/small/point-0000/repeat-0000.h5")

COMMANDS = (
    ("fit", "small"),
    ("compare", "small"),
    ("plot", "small", "energy"),
    ("animate", "small", "--out", "film.html"),
    ("export", "small"),
    ("export", "small", "--states"),
    ("export", "small", "--states", "--out", "states.h5"),
    ("verify", "small"),
)


@pytest.fixture(params=["another config", "another point", "another repeat"])
def foreign(request: pytest.FixtureRequest, finished: Path, tmp_path: Path) -> Path:
    """A run whose first repeat is another's."""
    if request.param == "another config":
        done(made(tmp_path / "other", SMALL, "balls.rings=2"))
        source = tmp_path / "other" / "point-0000" / "repeat-0000.h5"
    elif request.param == "another point":
        source = REPEAT.parents[1] / "point-0001" / "repeat-0000.h5"
    else:
        source = REPEAT.with_name("repeat-0001.h5")
    shutil.copy(source, REPEAT)
    return finished


@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: " ".join(command[:3]))
def test_a_repeat_of_another_run_is_refused(
    command: tuple[str, ...], foreign: Path, snooker: Snooker
) -> None:
    ended = snooker(*command)
    assert ended.code == 1
    output = ended.out if command[0] == "verify" else ended.err
    assert str(REPEAT) in output
    assert "run the config again, which replaces it" in output
    assert not list(Path().glob("film*"))
    assert not list(Path().glob("states*"))


@pytest.mark.parametrize(
    "out",
    [
        str(REPEAT),
        "runs/small/run.json",
        "runs/small/fit.json",
        "copy/repeat.h5",
    ],
)
def test_an_export_does_not_replace_results(out: str, finished: Path, snooker: Snooker) -> None:
    snooker("fit", "small")
    Path("copy").mkdir()
    shutil.copy(REPEAT, "copy/repeat.h5")
    before = Path(out).read_bytes()
    form = ("--states",) if out.endswith("h5") else ("--format", "csv")
    ended = snooker("export", "small", *form, "--out", out)
    assert (ended.code, ended.out) == (2, "")
    assert ended.err == (
        f"snooker: --out {out}: this file holds results of a run; give another name\n"
    )
    assert Path(out).read_bytes() == before


@pytest.mark.parametrize("out", ["events.csv", "states.h5"])
def test_an_export_replaces_an_export(out: str, finished: Path, snooker: Snooker) -> None:
    form = ("--states",) if out.endswith("h5") else ("--format", "csv")
    for _ in range(2):
        assert snooker("export", "small", *form, "--out", out).code == 0


# Analyses and the repeats they are of


def test_an_analysis_tells_of_the_repeats_that_it_has_read(
    finished: Path, snooker: Snooker, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Though others come while it reads."""
    last = Path("runs/small/point-0001/repeat-0002.h5")
    there = last.read_bytes()
    last.unlink()
    read = runs.Run.read

    def slow(*arguments: object) -> object:
        last.write_bytes(there)
        return read(*arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(runs.Run, "read", slow)
    rows = json.loads(snooker("fit", "small", "--json").out)
    counts = {
        row["parameters"]["cor"]: row["repeats"] + row["failed"]
        for row in rows
        if row["quantity"] == "kinetic_energy"
    }
    assert counts == {0.85: 3, 1.0: 2}
    (note,) = [
        each["note"]
        for each in json.loads(Path("runs/small/fit.json").read_text())["notes"]
        if "are there" in each["note"]
    ]
    assert note == "2 of 3 repeats are there; run the config again for the rest"


def test_what_is_analysed_while_a_run_goes_on_does_not_outlive_it(
    finished: Path, snooker: Snooker, monkeypatch: pytest.MonkeyPatch
) -> None:
    Path("runs/small/point-0001/repeat-0002.h5").unlink()
    from snooker_cli.runs import execution

    do = execution.simulate_repeat

    def meanwhile(*arguments: object) -> object:
        Path("runs/small/compare.json").write_text("{}")
        return do(*arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(execution, "simulate_repeat", meanwhile)
    ended = snooker("run", "small.yaml")
    assert ended.code == 0
    assert "removed compare.json" in ended.err
    assert not Path("runs/small/compare.json").exists()
