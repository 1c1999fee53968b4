"""A long repeat that was interrupted or killed goes on from its checkpoint with the same bits."""

from __future__ import annotations

import itertools
import time
from pathlib import Path

import h5py
import pytest
from repeating import contents, done, file_of, made, stopped

from snooker_cli import store
from snooker_cli.engine import simulation
from snooker_cli.errors import StoreError
from snooker_cli.files import user_key
from snooker_cli.runs.run import RepeatState
from snooker_cli.store import file_format as layout

FEW = """\
container: {radius: 10.0}
balls: {rings: 2, radius: 0.5, speed: 10}
cor: 0.9
collisions: 140000
"""
MANY = """\
container: {radius: 10.0}
balls: {count: 300, packing: 0.3, speed: 10}
cor: 0.95
collisions: 100000
"""
CONFIGS: dict[str, tuple[str, tuple[str, ...]]] = {
    "all pairs, slides": (FEW, ("collapse=slide", "wall_cor=0.95", "cor=1")),
    "all pairs, free": (FEW, ("cor=1", "container.mass=50")),
    "cells, free, tc, summary": (
        MANY,
        ("container.mass=500", "collapse={tc: 0.1}", "record=summary"),
    ),
    "all pairs, rough": (FEW, ("cor=1", "tangential_cor=1", "balls.spin=2", "wall_friction=0.1")),
    "cells, rough, snapshots": (
        MANY,
        ("record=snapshots", "tangential_cor=0.5", "friction=0.2", "balls.spin={temperature: 9}"),
    ),
    "cells, free, tc, snapshots": (
        MANY,
        ("container.mass=500", "collapse={tc: 0.1}", "record=snapshots"),
    ),
}
PIECE = 13_000
RUNS_OF_TWO_SEEDS = (("run", ()), ("other", ("seed=7",)))


@pytest.mark.parametrize("name", CONFIGS)
def test_checkpoints_do_not_change_a_bit(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Saved after every chunk, and with an interrupt after every third one."""
    text, overrides = CONFIGS[name]
    whole = made(tmp_path / "whole", text, *overrides)
    done(whole)
    monkeypatch.setattr(simulation, "CHUNK", PIECE)
    run = made(tmp_path / "pieces", text, *overrides)
    interrupts = 0
    while run.status_of(0, 0).state is not RepeatState.DONE:
        (result,) = stopped(run, 2 * PIECE + 1, interval=0.0)
        assert result.error is None
        interrupts += run.status_of(0, 0).state is RepeatState.INTERRUPTED
    assert interrupts >= 2
    assert contents(run) == contents(whole)
    with pytest.raises(StoreError):  # a repeat that is done has none
        store.read_checkpoint(file_of(run, 0, 0).with_name("none.h5"))
    assert store.read_checkpoint(file_of(run, 0, 0)) is None
    checked = [header._replace(start="") for header in store.check(file_of(run, 0, 0))]
    assert checked == store.read_headers(file_of(run, 0, 0))  # which has read no start


@pytest.mark.parametrize("forged", ["another key", "another version", "another file"])
def test_a_strangers_checkpoint_is_not_used(
    forged: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    """Kernels would use its arrays without a check; the repeat begins again."""
    text, overrides = CONFIGS["all pairs, free"]
    monkeypatch.setattr(simulation, "CHUNK", PIECE)
    runs = [made(tmp_path / name, text, *overrides, *more) for name, more in RUNS_OF_TWO_SEEDS]
    for run in runs:
        stopped(run, PIECE + 1)
    path, other = (file_of(run, 0, 0) for run in runs)
    if forged == "another key":
        monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
        user_key.cache_clear()
    elif forged == "another version":
        monkeypatch.setattr(layout, "sources_hash", lambda *_: "other sources")
    else:
        with h5py.File(path, "r+") as file, h5py.File(other) as another:
            del file[layout.CHECKPOINT]
            another.copy(layout.CHECKPOINT, file)
    with pytest.raises(StoreError, match="of another user, machine or version"):
        store.read_checkpoint(path)
    (result,) = done(runs[0])
    user_key.cache_clear()
    assert (result.error, result.collisions) == (None, 140_000)
    assert "the repeat begins again" in caplog.text


def test_without_a_key_nothing_is_lost(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "state").write_text("no folder")
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    user_key.cache_clear()
    text, overrides = CONFIGS["all pairs, free"]
    monkeypatch.setattr(simulation, "CHUNK", PIECE)
    run = made(tmp_path / "run", text, *overrides)
    stopped(run, PIECE + 1)
    assert "a later run cannot continue this repeat" in caplog.text
    store.check(file_of(run, 0, 0))
    (result,) = done(run)
    assert (result.error, result.collisions) == (None, 140_000)


def test_the_time_of_a_continued_repeat_is_that_of_all_its_parts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On a clock that goes 1,000 s each time that it is read."""
    text, overrides = CONFIGS["all pairs, free"]
    run, reads = made(tmp_path / "run", text, *overrides), itertools.count(0, 1000)
    monkeypatch.setattr(simulation, "CHUNK", PIECE)
    monkeypatch.setattr(time, "perf_counter", lambda: float(next(reads)))
    seconds = []
    for collisions in (PIECE + 1, PIECE + 1, 10**9):
        stopped(run, collisions)
        header = run.status_of(0, 0).header
        assert header is not None
        seconds.append(header.provenance.seconds)
    assert seconds[2] > seconds[1] > seconds[0] > 0
