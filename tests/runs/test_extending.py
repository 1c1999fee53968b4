"""More collisions or time: the same bits as if a run had been as long at once."""

from __future__ import annotations

import threading
from pathlib import Path

import pytest
from repeating import StopsAfter, bytes_of, contents, done, made

from snooker_cli import runs, store
from snooker_cli.errors import RunError
from snooker_cli.runs.execution import execute
from snooker_cli.trace import StopReason


@pytest.mark.parametrize("record", ["events", "summary"])
@pytest.mark.parametrize(
    ("before", "after"),
    [
        (["collisions=150"], ["collisions=400", "repeats=4"]),
        (["time=2"], ["time=6.5"]),
        (["collisions=150", "time=3"], ["collisions=200", "time=5"]),
    ],
)
def test_a_longer_end_gives_the_bits_of_a_run_that_was_as_long_at_once(
    before: list[str], after: list[str], record: str, small_config: str, tmp_path: Path
) -> None:
    text = small_config.replace("collisions: 150", f"record: {record}")
    short = made(tmp_path / "run", text, *before)
    done(short)
    kept = contents(short)
    longer = made(tmp_path / "run", text, *after)
    assert [longer.shorter(point) for point in longer.points] == [3, 3]
    assert not any(each.cached for each in done(longer))
    at_once = made(tmp_path / "at once", text, *after)
    done(at_once)
    assert contents(longer) == contents(at_once)
    assert contents(longer) != kept
    assert [longer.shorter(point) for point in longer.points] == [0, 0]
    assert all(each.cached for each in done(longer))


def test_a_longer_end_keeps_what_went_before(small_config: str, tmp_path: Path) -> None:
    run = made(tmp_path, small_config)
    done(run)
    before = {point.index: list(run.traces(point)) for point in run.points}
    done(made(tmp_path, small_config, "collisions=300"))
    run = runs.open_run(tmp_path)
    for point in run.points:
        for old, new in zip(before[point.index], run.traces(point), strict=True):
            assert old.events is not None
            assert new.events is not None
            for name in ("time", "i", "j", "impulse"):
                column = getattr(new.events, name)[: len(old.events)]
                assert column.tobytes() == getattr(old.events, name).tobytes()


@pytest.mark.parametrize(("stopped_after", "replaced"), [(1, False), (70_000, True)])
def test_an_interrupt_while_extending_loses_no_collision(
    stopped_after: int, replaced: bool, small_config: str, tmp_path: Path
) -> None:
    """What is there is kept unless what is under way has come as far; chunks are of 16,384."""
    text = small_config.replace("sweep: {cor: [0.85, 1.0]}\n", "").replace("cor: 0.85", "cor: 1")
    short = made(tmp_path / "run", text, "collisions=70000", "repeats=1")
    done(short)
    before = bytes_of(short.directory)
    longer = made(tmp_path / "run", text, "collisions=200000", "repeats=1")
    cancelled = threading.Event()
    (stopped,) = execute(
        longer, workers=1, watcher=StopsAfter(stopped_after, cancelled), cancelled=cancelled
    )
    assert stopped.stop is not None
    assert stopped.stop.reason is StopReason.INTERRUPTED
    assert (bytes_of(longer.directory) != before) == replaced
    assert stopped.unstored == (not replaced)
    assert store.check(longer.path(0, 0)).collisions == (81_920 if replaced else 70_000)
    assert len(longer.present(longer.points[0])) == 1
    assert longer.shorter(longer.points[0]) == (not replaced)
    assert not list(tmp_path.rglob("*.part"))
    done(longer)
    at_once = made(tmp_path / "at once", text, "collisions=200000", "repeats=1")
    done(at_once)
    assert contents(longer) == contents(at_once)


def test_what_an_interrupted_extension_leaves_is_all_there(
    small_config: str, tmp_path: Path
) -> None:
    """One repeat is as long as the run is now, the others are as they were; all are read."""
    elastic = small_config.replace("[0.85, 1.0]", "[1.0]")
    done(made(tmp_path, elastic))
    done(made(tmp_path, elastic, "collisions=151", "repeats=1"))
    made(tmp_path, elastic, "collisions=151")
    run = runs.open_run(tmp_path)
    (point,) = run.points
    assert (len(run.present(point)), run.shorter(point)) == (3, 2)
    assert [trace.collisions for trace in run.traces(point)] == [151, 150, 150]
    # What is extended stays: the former end would cut it off.
    with pytest.raises(RunError) as caught:
        made(tmp_path, elastic)
    assert caught.value.code == "shorter_limits"
