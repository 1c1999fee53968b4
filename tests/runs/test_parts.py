"""Parts of a run: each does its share of the batches, at the same time, in the same folder."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest
from command_line import SMALL, Snooker
from repeating import batches_of, contents, created, done, made, run_of

from snooker_cli import runs
from snooker_cli.errors import RunError
from snooker_cli.runs.execution import share_of
from snooker_cli.runs.folder import locked_for_part


def names(directory: Path) -> set[str]:
    """The files of a run."""
    return {str(path.relative_to(directory)) for path in directory.rglob("*") if path.is_file()}


@pytest.mark.parametrize("parts", [2, 9])
def test_parts_make_the_files_of_a_plain_run_and_nothing_twice(parts: int, tmp_path: Path) -> None:
    """Seven batches: two points of seven repeats, two in a batch."""
    simulated = []
    with batches_of(2):
        plain, shared = (made(tmp_path / name, SMALL, "repeats=7") for name in ("a", "b"))
        done(plain)
        for part in range(1, parts + 1):
            results = done(shared, part=share_of(shared, part, parts)[0])
            simulated += [(result.point, result.repeat) for result in results if not result.cached]
    assert len(simulated) == len(set(simulated)) == 14
    assert names(plain.directory) == names(shared.directory)
    assert contents(plain) == contents(shared)


def test_parts_delete_nothing_and_a_plain_run_does(tmp_path: Path) -> None:
    run = made(tmp_path / "run", SMALL)
    with batches_of(1):
        done(run)
    record = run.directory / "failures.jsonl"
    record.write_text('{"point": 0, "repeat": 0, "error": "no room"}\n')
    longer = run_of(run.directory, SMALL, "collisions=200")
    runs.create(longer)
    before = names(run.directory)
    for part in (1, 2):
        done(longer, part=share_of(longer, part, 2)[0])
    assert names(run.directory) > before
    done(longer)
    assert len([*longer.directory.glob("point-*/*.h5")]) < len(before)
    assert not record.exists()


@pytest.mark.skipif(sys.platform == "win32", reason="it cannot lock folders")
def test_parts_share_the_lock_with_parts_of_the_same_config_only(tmp_path: Path) -> None:
    run = created(tmp_path / "run", run_of(tmp_path, SMALL).config)
    other = run_of(run.directory, SMALL, "repeats=9")
    with locked_for_part(run), locked_for_part(run):
        for refused in (runs.locked(run.directory), locked_for_part(other)):
            with pytest.raises(RunError) as caught, refused:
                pytest.fail("locked")
            assert caught.value.code == "locked"
    with runs.locked(run.directory), pytest.raises(RunError), locked_for_part(run):
        pytest.fail("locked")


def test_a_part_is_planned_alone_and_may_be_empty(here: Path, snooker: Snooker) -> None:
    plans = [
        json.loads(snooker("run", "small.yaml", *part, "--dry-run", "--json").out)
        for part in ([], ["--part", "1/2"], ["--part", "2/2"])
    ]
    for name in ("to_do", "collisions", "bytes"):
        assert plans[0][name] == plans[1][name] + plans[2][name]
        assert plans[1][name] > 0
    sentence = "part 3 of 16 has nothing to do: the run has 2 batches\n"
    for dry in (["--dry-run"], []):
        ended = snooker("run", "small.yaml", "--part", "3/16", *dry)
        assert (ended.code, ended.out) == (0, sentence)
