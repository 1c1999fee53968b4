"""Repeats in batches: how they are cut and stored, which file counts, and what fails alone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from repeating import batches_of, bytes_of, contents, done, made, stopped

from snooker_cli import store
from snooker_cli.config import Config, to_json
from snooker_cli.engine import simulate
from snooker_cli.errors import RunError, SceneError, StoreError
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.runs import RepeatState, RunFolder, batch
from snooker_cli.runs.folder import failures
from snooker_cli.runs.verification import verify
from snooker_cli.scene import Scene
from snooker_cli.trace import StopReason


def names(run: RunFolder, point: int = 0) -> list[str]:
    """The repeats in the names of a point's files: ``0000-0002``."""
    return [path.stem.removeprefix("repeats-") for path in run.batches(point)]


# How repeats are cut


def test_files_do_not_depend_on_the_number_of_threads(small_config: str, tmp_path: Path) -> None:
    """Eight repeats of each point in batches of three, which have the bits of single repeats."""
    alone = made(tmp_path / "alone", small_config, "repeats=8")
    with batches_of(1):
        done(alone)
    assert names(alone) == [f"{k:04d}-{k:04d}" for k in range(8)]
    for workers in (1, 4):
        run = made(tmp_path / str(workers), small_config, "repeats=8")

        with batches_of(3):
            done(run, workers=workers)
        assert names(run, 0) == names(run, 1) == ["0000-0002", "0003-0005", "0006-0007"]
        assert contents(run) == contents(alone)


def test_missing_repeats_get_files_of_their_own(one_point: str, tmp_path: Path) -> None:
    """They never join repeats that are not next to them."""
    run = made(tmp_path, one_point, "repeats=8")
    with batches_of(2):
        done(run)
    bits = contents(run)
    for repeats in ((0, 1), (4, 5), (6, 7)):
        run.path(0, repeats).unlink()
    kept = bytes_of(tmp_path)
    results = done(run)
    assert [result.repeat for result in results if result.cached] == [2, 3]
    assert names(run) == ["0000-0001", "0002-0003", "0004-0007"]
    assert kept.items() <= bytes_of(tmp_path).items()
    assert contents(run) == bits


# Several files of one repeat


def test_an_interrupted_extension_keeps_the_older_file(one_point: str, tmp_path: Path) -> None:
    """Until the rest is done, also if that run is killed before it deletes the file."""
    with batches_of(4):
        done(made(tmp_path, one_point, "repeats=4"))
    run = made(tmp_path, one_point, "repeats=4", "collisions=400")
    with batches_of(1):
        stopped(run, 1)
    (point,) = run.points
    left = run.shorter(point)
    assert 0 < left < 4
    assert "0000-0003" in names(run)
    older = run.path(0, range(4)).read_bytes()
    with batches_of(1):
        results = done(run)
    assert sum(result.cached for result in results) == 4 - left
    singles = [f"{k:04d}-{k:04d}" for k in range(4)]
    assert names(run) == singles
    run.path(0, range(4)).write_bytes(older)
    assert [trace.collisions for trace in run.traces(point)] == [400] * 4
    assert all(result.cached for result in done(run))
    assert names(run) == singles


def test_of_two_files_the_done_one_counts_or_else_the_longer(
    one_point: str, tmp_path: Path
) -> None:
    """Repeats of 150 collisions, some of which an extension to 400 has begun or done."""
    short = made(tmp_path, one_point, "repeats=4")
    done(short)
    run = made(tmp_path, one_point, "repeats=4", "collisions=400")
    (header, *_), (point,) = store.read_headers(short.path(0, range(4))), run.points
    source = replace(
        header.provenance, config=to_json(point.config), digest=run.digests[point.index]
    )
    for repeat, collisions in enumerate((100, 200, 400)):
        trace = simulate(starting_scene(run.config, repeat), collisions=collisions)
        if collisions < 400:
            trace = replace(trace, stop=trace.stop._replace(reason=StopReason.INTERRUPTED))
        store.write(run.path(0, [repeat]), [(repeat, trace)], source)
    assert [trace.collisions for trace in run.traces(point)] == [150, 200, 400, 150]
    states = [status.state for status in run.statuses(0)]
    assert states == [
        RepeatState.SHORTER,
        RepeatState.INTERRUPTED,
        RepeatState.DONE,
        RepeatState.SHORTER,
    ]
    with pytest.raises(RunError) as caught:  # for a longer file, though a shorter one is there
        made(tmp_path, one_point, "repeats=4")
    assert caught.value.code == "shorter_limits"
    assert [result.repeat for result in done(run) if result.cached] == [2]
    assert names(run) == ["0000-0001", "0002-0002", "0003-0003"]
    assert [trace.collisions for trace in run.traces(point)] == [400] * 4
    with pytest.raises(StoreError, match="longer than the run was; give the command again"):
        list(short.traces(short.points[0]))  # by a command that began before the extension


# Failures


def unplaceable(*repeats: int) -> Callable[..., Scene]:
    """Places balls, but not those of some repeats."""

    def place(config: Config, repeat: int) -> Scene:
        if repeat in repeats:
            raise SceneError("balls", f"no place in repeat {repeat}")
        return starting_scene(config, repeat)

    return place


def refuse_to_place(monkeypatch: pytest.MonkeyPatch, *repeats: int) -> None:
    """Let these repeats fail in ``simulate_and_store``, together and alone."""
    place = unplaceable(*repeats)
    monkeypatch.setattr(batch, "first_scene", place)
    monkeypatch.setattr(
        batch, "starting_scenes", lambda config, some: [place(config, k) for k in some]
    )


def test_a_repeat_without_a_place_for_its_balls_fails_alone(
    one_point: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = made(tmp_path / "run", one_point, "repeats=4")
    with monkeypatch.context() as patched:
        refuse_to_place(patched, 1)
        results = done(run)
    errors = [result.error or "" for result in results]
    assert [bool(error) for error in errors] == [False, True, False, False]
    assert "no place in repeat 1" in errors[1]
    assert failures(run) == {(0, 1): errors[1]}
    assert names(run) == ["0000-0003"]
    assert run.present(run.points[0]) == [0, 2, 3]
    assert [status.repeat for status in verify(run, replay=True, workers=1)] == [0, 1, 2, 3]
    assert [result.cached for result in done(run)] == [True, False, True, True]
    assert names(run) == ["0000-0003", "0001-0001"]
    assert failures(run) == {}
    whole = made(tmp_path / "whole", one_point, "repeats=4")
    done(whole)
    assert contents(run) == contents(whole)
