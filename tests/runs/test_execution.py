"""Executing a run: resuming, the same bits however it is executed, failures and interrupts."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from repeating import bytes_of, contents, done, made, stopped

from snooker_cli import runs, store
from snooker_cli.engine import ENGINE_VERSION
from snooker_cli.errors import StoreError
from snooker_cli.runs import RunFolder
from snooker_cli.runs.batch import RepeatResult
from snooker_cli.runs.execution import Watcher
from snooker_cli.runs.folder import FAILURES, failures, record_failure
from snooker_cli.trace import StopReason


class Notes(Watcher):
    """What a run reports."""

    def __init__(self) -> None:
        self.results: list[RepeatResult] = []
        self.refused: list[str] = []

    def unusable(self, problem: str) -> None:
        self.refused.append(problem)

    def simulating(self, compiling: float) -> None:
        assert compiling > 0
        assert all(result.cached for result in self.results)

    def finished(self, result: RepeatResult) -> None:
        self.results.append(result)


@pytest.fixture
def copied(finished_one_each: RunFolder, tmp_path: Path) -> RunFolder:
    """A copy of the finished run with one file for each repeat, to be changed."""
    shutil.copytree(finished_one_each.directory, tmp_path / "copied")
    return runs.open_run(tmp_path / "copied")


# Resuming


def changed(**provenance: Any) -> Callable[[Path], None]:
    def change(path: Path) -> None:
        ((trace, header),) = store.read(path)
        source = replace(header.provenance, **provenance)
        store.write(path, [(header.repeat, trace)], source)

    return change


DAMAGES: list[tuple[Callable[[Path], object], str]] = [
    (lambda path: path.unlink(), ""),
    (lambda path: path.write_bytes(path.read_bytes()[:-1000]), "not a readable result of snooker"),
    (
        lambda path: shutil.copy(path.with_name("repeats-0002-0002.h5"), path),
        "is repeat 2 of point 1",
    ),
    (changed(engine_version=ENGINE_VERSION - 1), f"is of engine version {ENGINE_VERSION - 1}, not"),
    (changed(digest="0" * 64), "is of another config"),
]


@pytest.mark.parametrize(("damage", "reason"), DAMAGES)
def test_one_bad_file_is_done_again_and_only_that(
    damage: Callable[[Path], object], reason: str, copied: RunFolder, finished_run: RunFolder
) -> None:
    before = bytes_of(copied.directory)
    path = copied.path(1, [1])
    damage(path)
    notes = Notes()
    if reason:
        with pytest.raises(StoreError, match=f"^{path}: {reason}"):
            list(copied.traces(copied.points[1]))
    results = done(copied, watcher=notes)
    assert [(result.point, result.repeat) for result in results if not result.cached] == [(1, 1)]
    after = bytes_of(copied.directory)
    name = "point-0001/repeats-0001-0001.h5"
    assert after.pop(name) != before.pop(name)
    assert after == before
    assert contents(copied) == contents(finished_run)
    assert len(notes.refused) == (reason != "")
    assert all(problem.startswith(f"{path}: {reason}") for problem in notes.refused)


# Extending: the bits of a run that was as long from the start


@pytest.mark.parametrize(
    ("before", "after", "record"),
    [
        (["collisions=150"], ["collisions=400", "repeats=4"], "events"),
        (["collisions=150", "time=3"], ["collisions=200", "time=5"], "summary"),
    ],
)
def test_an_extended_run_has_the_bits_of_one_that_was_as_long_from_the_start(
    before: list[str], after: list[str], record: str, small_config: str, tmp_path: Path
) -> None:
    text = small_config.replace("collisions: 150", f"record: {record}")
    short = made(tmp_path / "run", text, *before)
    done(short)
    kept = contents(short)
    longer = made(tmp_path / "run", text, *after)
    assert [longer.shorter(point) for point in longer.points] == [3, 3]
    assert not any(result.cached for result in done(longer))
    at_once = made(tmp_path / "at once", text, *after)
    done(at_once)
    assert contents(longer) == contents(at_once)
    assert contents(longer) != kept
    assert [longer.shorter(point) for point in longer.points] == [0, 0]
    assert all(result.cached for result in done(longer))


@pytest.mark.parametrize(("stopped_after", "replaced"), [(1, False), (70_000, True)])
def test_an_interrupt_while_extending_loses_no_collision(
    stopped_after: int, replaced: bool, one_point: str, tmp_path: Path
) -> None:
    """The old file stays unless the new repeat has come as far; chunks are of 16,384."""
    short = made(tmp_path / "run", one_point, "collisions=70000", "repeats=1")
    done(short)
    before = bytes_of(short.directory)
    longer = made(tmp_path / "run", one_point, "collisions=200000", "repeats=1")
    (result,) = stopped(longer, stopped_after)
    assert result.stop is not None
    assert result.stop.reason is StopReason.INTERRUPTED
    assert (bytes_of(longer.directory) != before) == replaced
    assert result.unstored == (not replaced)
    (header,) = store.check(longer.path(0, [0]))
    assert header.collisions == (81_920 if replaced else 70_000)
    assert longer.shorter(longer.points[0]) == (not replaced)
    assert not list(tmp_path.rglob("*.part"))
    done(longer)
    at_once = made(tmp_path / "at once", one_point, "collisions=200000", "repeats=1")
    done(at_once)
    assert contents(longer) == contents(at_once)


# Failures


def test_a_cut_line_of_the_record_hides_no_other(copied: RunFolder) -> None:
    record_failure(copied, 0, 1, "no room")
    with (copied.directory / FAILURES).open("a") as file:
        file.write('{"point": 1, "rep')
    assert failures(copied) == {(0, 1): "no room"}
