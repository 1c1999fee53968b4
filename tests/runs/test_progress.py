"""How far a run is: within repeats, with the time that is left, on a terminal and in a log."""

from __future__ import annotations

import itertools
from pathlib import Path

import pytest
from repeating import done, made, stopped

from snooker_cli.config import parse, points
from snooker_cli.engine import simulation
from snooker_cli.runs import progress
from snooker_cli.runs.batch import Batch, Progress, RepeatResult
from snooker_cli.runs.watched_execution import RunProgress
from snooker_cli.trace import Stop, StopReason

BALLS = "container: {radius: 10.0}\nballs: {rings: 1, radius: 1.0, speed: 1.0}\ncor: 0.9\n"


def watcher(limits: str, repeats: int = 2, shown: bool = False) -> RunProgress:
    """The progress of a run of points with limits, and how many repeats each has."""
    of_run = points(parse(BALLS + limits).config)
    return RunProgress(of_run, {point.index: repeats for point in of_run}, shown)


def ended(repeat: int, reason: StopReason, collisions: int, time: float = 1.0) -> RepeatResult:
    return RepeatResult(0, repeat, Stop(reason, time, (), ""), collisions)


def test_collisions_within_repeats_count() -> None:
    """At 4 s, 400 of 2,000 collisions: 16 s are left."""
    run = watcher("collisions: 1000")
    run.reached(Progress(Batch(0, (0,)), 100, 0.1, 0.0))
    run.reached(Progress(Batch(0, (0,)), 300, 0.3, 0.0))
    run.reached(Progress(Batch(0, (1,)), 100, 0.1, 0.0))
    text = "400/2,000 collisions, 0/2 repeats, 100 events/s, 16 s left"
    assert run.now(4.0) == (400.0, 2000.0, text)
    assert run.now(0.0)[2] == "400/2,000 collisions, 0/2 repeats"
    run.finished(ended(0, StopReason.COLLISIONS, 1000))
    run.reached(Progress(Batch(0, (0,)), 990, 0.99, 0.0))  # on its way when the repeat ended
    text = "1,100/2,000 collisions, 1/2 repeats, 110 events/s, 8.2 s left"
    assert run.now(10.0) == (1100.0, 2000.0, text)
    assert run.simulated == 1100


def test_a_repeat_that_ends_early_leaves_less_to_do() -> None:
    run = watcher("collisions: 1000")
    run.reached(Progress(Batch(0, (0,)), 200, 0.2, 0.0))
    run.finished(ended(0, StopReason.WALL_TRAP, 250))
    run.reached(Progress(Batch(0, (1,)), 50, 0.05, 0.0))
    run.finished(RepeatResult(0, 1, error="no room"))
    assert run.now(1.0) == (250.0, 250.0, "250/250 collisions, 1/2 repeats, 300 events/s")


def test_what_was_there_before_gives_no_speed() -> None:
    """Half a repeat from a checkpoint and a stored one; 100 collisions took 2 s, 900 are left."""
    run = watcher("collisions: 1000", repeats=3)
    run.finished(RepeatResult(0, 0, Stop(StopReason.COLLISIONS, 1.0, (), ""), 1000, cached=True))
    run.reached(Progress(Batch(0, (1,)), 100, 0.6, 0.5))
    text = "1,600/3,000 collisions, 1/3 repeats, 50 events/s, 28 s left"
    assert run.now(2.0) == (1600.0, 3000.0, text)
    run.finished(RepeatResult(0, 1, Stop(StopReason.COLLISIONS, 1.0, (), ""), 1000, continued=500))
    assert run.simulated == 500
    assert run.now(10.0)[2] == "2,000/3,000 collisions, 2/3 repeats, 50 events/s, 20 s left"


def test_runs_limited_by_time_count_time() -> None:
    run = watcher("time: 20.0", repeats=1)
    run.reached(Progress(Batch(0, (0,)), 100, 0.25, 0.0))
    assert run.now(1.0)[2] == "5/20 s of simulated time, 100 events/s, 3 s left"


def test_two_limits_count_repeats() -> None:
    """A batch of four repeats is half done on average."""
    run = watcher("time: 20.0\ncollisions: 1000", repeats=8)
    run.reached(Progress(Batch(0, (0, 1, 2, 3)), 100, 0.5, 0.0))
    assert run.now(1.0)[2] == "2.0/8 repeats, 100 events/s, 3 s left"


def test_points_of_a_sweep_count_as_long_as_they_are() -> None:
    run = watcher("collisions: 1\nsweep: {collisions: [1000, 3000]}", repeats=1)
    run.reached(Progress(Batch(1, (0,)), 1500, 0.5, 0.0))
    assert run.now(1.0)[:2] == (1500.0, 4000.0)


@pytest.mark.parametrize("limit", ["collisions: 300000", "time: 300000"])
def test_a_long_repeat_counts_and_is_continued(
    limit: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """From its start and from its checkpoint, the share rises to 1."""
    monkeypatch.setattr(simulation, "CHUNK", 10_000)
    run = made(tmp_path / "run", f"{BALLS}{limit}".replace("0.9", "1.0"))
    seen: list[Progress] = []

    class Follows(RunProgress):
        def reached(self, progress: Progress) -> None:
            super().reached(progress)
            seen.append(progress)

    stopped(run, 20_000)  # chunks end with an epoch too, at 16,384
    follower = Follows(run.points, {0: 1}, False)
    (result,) = done(run, watcher=follower)
    assert result.continued == 26_384
    assert follower.simulated == result.collisions - 26_384
    shares = [news.share for news in seen]
    assert shares == sorted(set(shares))
    assert shares[-1] == 1.0
    assert {news.given for news in seen} == {seen[0].given}
    assert 0.0 < seen[0].given < seen[0].share
    per_share = [news.collisions / (news.share - news.given) for news in seen]
    assert min(per_share) == pytest.approx(max(per_share), rel=0.1)  # it is an elastic gas
    total = follower.now(1.0)
    assert total[0] == total[1]


def test_a_log_gets_a_line_after_ever_more_minutes(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """On a clock that goes 30 s for each percent."""
    run = watcher("collisions: 10000", repeats=1, shown=True)
    clock = itertools.count(0.0, 30.0)
    monkeypatch.setattr(progress.time, "perf_counter", lambda: next(clock))
    run.simulating(0.0)
    for percent in range(1, 100):
        run.reached(Progress(Batch(0, (0,)), 100 * percent, percent / 100, 0.0))
    lines = capsys.readouterr().err.splitlines()
    assert lines[0] == "snooker: 200/10,000 collisions, 3 events/s, 49 minutes left"
    assert [line.split("/")[0] for line in lines] == [
        "snooker: 200",
        "snooker: 400",
        "snooker: 800",
        "snooker: 1,600",
        "snooker: 3,200",
        "snooker: 6,400",
    ]


def test_a_run_without_progress_writes_no_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    run = watcher("collisions: 10000", repeats=1)
    monkeypatch.setattr(progress.time, "perf_counter", itertools.count(0.0, 1000.0).__next__)
    run.simulating(0.0)
    run.reached(Progress(Batch(0, (0,)), 100, 0.5, 0.0))
    assert capsys.readouterr().err == ""


def test_a_compilation_shows_its_functions_and_the_time_that_is_left(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """In the bar that is open, or in one of its own; the last function takes longest."""
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    text = progress.compiling_text(50, 100, 10.0)
    assert text == "compiling, first use on this machine: 50/100 functions, 13 s left"
    assert "left" not in progress.compiling_text(0, 100, 10.0)
    compiling = progress._Compiling()
    with progress.Bar() as bar:
        for done in range(3):
            assert compiling(done, 3)
        assert [task.completed for task in bar.tasks] == [2]
        assert "2/3 functions" in bar.tasks[0].description
        assert compiling(3, 3)
        assert bar.tasks == []


def test_without_a_terminal_a_compilation_has_no_bar() -> None:
    compiling = progress._Compiling()
    assert [compiling(done, 3) for done in range(4)] == 4 * [False]
