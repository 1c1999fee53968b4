"""Executing a run: resuming, the same bits however it is executed, failures and interrupts."""

from __future__ import annotations

import json
import shutil
import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from repeating import StopsAfter, bytes_of, contents, done, made

from snooker_cli import runs, store
from snooker_cli.config import digest, parse
from snooker_cli.engine import ENGINE_VERSION, simulate
from snooker_cli.errors import StoreError
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.runs import RepeatStatus, Run
from snooker_cli.runs.execution import ThreadExecutor, Watcher, execute
from snooker_cli.runs.folder import FAILURES, failures
from snooker_cli.runs.repeat import RepeatResult
from snooker_cli.runs.status import run_status
from snooker_cli.trace import StopReason


class Notes(Watcher):
    """Everything that a run reports."""

    def __init__(self) -> None:
        self.lock = threading.Lock()
        self.collisions = 0
        self.results: list[RepeatResult] = []
        self.readied = 0
        self.removed: list[str] = []
        self.refused: list[RepeatStatus] = []
        self.figures = False

    def unusable(self, status: RepeatStatus) -> None:
        self.refused.append(status)

    def outdated(self, removed: list[Path], figures: bool) -> None:
        self.removed, self.figures = [path.name for path in removed], figures

    def simulating(self, compiling: float) -> None:
        assert compiling > 0
        assert (self.collisions, [each for each in self.results if not each.cached]) == (0, [])
        self.readied += 1

    def events(self, number: int) -> None:
        with self.lock:
            self.collisions += number

    def finished(self, result: RepeatResult) -> None:
        with self.lock:
            self.results.append(result)


@pytest.fixture
def copied(finished_run: Run, tmp_path: Path) -> Run:
    """A copy of the finished run, to be changed."""
    shutil.copytree(finished_run.directory, tmp_path / "copied")
    return runs.open_run(tmp_path / "copied")


# Resuming


def test_results_are_what_is_in_the_files(copied: Run) -> None:
    notes = Notes()
    results = done(copied, watcher=notes)
    assert [(result.point, result.repeat) for result in results] == [
        (point, repeat) for point in (0, 1) for repeat in (0, 1, 2)
    ]
    assert sorted(notes.results, key=lambda each: (each.point, each.repeat)) == results
    assert {result.work for result in results} == {None}
    for result in results:
        trace = store.read(copied.path(result.point, result.repeat))[0]
        assert result.stop == trace.stop
        assert result.collisions == trace.collisions
        assert result.error is None


def test_a_second_run_simulates_nothing(copied: Run) -> None:
    before = bytes_of(copied.directory)
    notes = Notes()
    results = done(copied, watcher=notes)
    assert all(result.cached for result in results)
    assert (notes.collisions, notes.readied) == (0, 0)
    assert bytes_of(copied.directory) == before


def remove(path: Path) -> None:
    path.unlink()


def truncate(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-1000])


def empty(path: Path) -> None:
    path.write_bytes(b"")


def flip_a_bit(path: Path) -> None:
    trace = store.read(path)[0]
    image = bytearray(path.read_bytes())
    image[image.index(trace.start.velocities.tobytes()) + 5] ^= 1
    path.write_bytes(image)


def put_another_repeat_there(path: Path) -> None:
    shutil.copy(path.with_name("repeat-0002.h5"), path)


def put_another_point_there(path: Path) -> None:
    shutil.copy(path.parent.with_name("point-0000") / path.name, path)


def put_another_engine_versions_there(path: Path) -> None:
    trace, header = store.read(path)
    old = replace(header.provenance, engine_version=ENGINE_VERSION - 1)
    store.write(path, trace, old)


def put_a_forced_engines_there(path: Path) -> None:
    trace, header = store.read(path)
    store.write(path, trace, replace(header.provenance, engine="cells"))


DAMAGES: dict[Callable[[Path], None], str] = {
    remove: "",
    truncate: "not a readable result of snooker",
    empty: "not a readable result of snooker",
    flip_a_bit: "its content has changed since it was written",
    put_another_repeat_there: "is repeat 2 of point 1",
    put_another_point_there: "is repeat 1 of point 0",
    put_another_engine_versions_there: f"is of engine version {ENGINE_VERSION - 1}, not",
    put_a_forced_engines_there: "is of --engine cells",
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_one_bad_file_is_done_again_and_only_that(
    damage: Callable[[Path], None], copied: Run, finished_run: Run
) -> None:
    before = bytes_of(copied.directory)
    path = copied.path(1, 1)
    damage(path)
    notes = Notes()
    if DAMAGES[damage]:
        with pytest.raises(StoreError, match=f"^{path}: {DAMAGES[damage]}"):
            list(copied.traces(copied.points[1]))
    results = done(copied, watcher=notes)
    assert [(each.point, each.repeat) for each in results if not each.cached] == [(1, 1)]
    after = bytes_of(copied.directory)
    name = "point-0001/repeat-0001.h5"
    assert after.pop(name) != before.pop(name)
    assert after == before
    assert contents(copied) == contents(finished_run)
    assert len(notes.refused) == (DAMAGES[damage] != "")
    assert all(each.reason.startswith(DAMAGES[damage]) for each in notes.refused)


def test_more_repeats_extend_a_run(copied: Run, small_config: str, tmp_path: Path) -> None:
    before = bytes_of(copied.directory)
    longer = made(copied.directory, small_config, "repeats=5")
    results = done(longer)
    assert [result.repeat for result in results if not result.cached] == [3, 4, 3, 4]
    assert before.items() <= bytes_of(copied.directory).items()
    at_once = made(tmp_path / "at once", small_config, "repeats=5")
    done(at_once)
    assert contents(longer) == contents(at_once)


def test_fewer_repeats_keep_the_others(copied: Run, small_config: str) -> None:
    before = bytes_of(copied.directory)
    assert len(done(made(copied.directory, small_config, "repeats=2"))) == 4
    assert bytes_of(copied.directory) == before


def test_new_repeats_make_old_fits_outdated(copied: Run, small_config: str) -> None:
    figure = copied.directory / "figures" / "speeds.json"
    figure.parent.mkdir()
    figure.write_text(json.dumps(dict.fromkeys(runs.FIGURE_KEYS)))
    for name in runs.ANALYSES:
        (copied.directory / name).write_text("[]")
    nothing_new, more = Notes(), Notes()
    done(copied, watcher=nothing_new)
    assert (nothing_new.removed, nothing_new.figures) == ([], False)
    assert len(copied.analyses()) == 2
    done(made(copied.directory, small_config, "repeats=4"), watcher=more)
    assert (more.removed, more.figures) == (["fit.json", "compare.json"], True)
    assert copied.analyses() == []
    assert copied.figures() == [figure]


# The same bits


@pytest.mark.parametrize("record", ["events", "summary"])
def test_results_do_not_depend_on_the_number_of_threads(
    record: str, small_config: str, tmp_path: Path
) -> None:
    overrides = (f"record={record}", "repeats=8")
    runs = {jobs: made(tmp_path / str(jobs), small_config, *overrides) for jobs in (1, 2, 4)}
    found = {}
    for jobs, run in runs.items():
        results = done(run, workers=jobs)
        assert [(each.point, each.repeat) for each in results] == [
            (point, repeat) for point in (0, 1) for repeat in range(8)
        ]
        found[jobs] = contents(run)
    assert found[1] == found[2] == found[4]
    assert len(set(found[1].values())) == 16


def test_the_file_tells_how_to_make_the_repeat_again(finished_run: Run) -> None:
    for point in finished_run.points:
        for repeat in range(3):
            trace, header = store.read(finished_run.path(point.index, repeat))
            source = header.provenance
            assert (source.point, source.repeat) == (point.index, repeat)
            assert source.engine_version == ENGINE_VERSION
            assert json.loads(source.parameters) == dict(point.parameters)
            assert {"python", "snooker", "numpy", "numba", "h5py"} <= set(
                json.loads(source.versions)
            )
            assert source.machine
            assert source.started.endswith("+00:00")
            assert source.seconds > 0
            experiment = parse(source.config).experiment
            assert experiment == point.experiment
            assert source.digest == digest(experiment)
            again = simulate(
                starting_scene(experiment, source.repeat),
                collisions=experiment.collisions,
                time=experiment.time,
            )
            assert store.content_hash(again) == store.content_hash(trace)


def test_an_infinite_mass_in_a_sweep_is_json_in_the_file(small_config: str, tmp_path: Path) -> None:
    run = made(tmp_path, small_config.replace("sweep", "# "), "container.mass=.inf", "repeats=1")
    swept = replace(run.points[0], parameters=(("container.mass", float("inf")),))
    assert [each.error for each in done(replace(run, points=(swept,)))] == [None]
    source = store.check(run.path(0, 0)).provenance
    json.loads(source.parameters, parse_constant=pytest.fail)


# Failures


def test_one_failing_repeat_does_not_stop_the_others(copied: Run, finished_run: Run) -> None:
    for path in copied.directory.glob("point-*/*"):
        path.unlink()
    copied.path(0, 1).mkdir()
    notes = Notes()
    results = done(copied, workers=2, watcher=notes)
    failed = [result for result in results if result.error]
    assert [(result.point, result.repeat) for result in failed] == [(0, 1)]
    assert failed[0].error is not None
    assert "repeat-0001.h5: cannot write the result" in failed[0].error
    assert failed[0].stop is None
    assert failed[0] in notes.results
    assert failures(copied) == {(0, 1): failed[0].error}
    first, second = run_status(copied).points
    assert (first.done, first.failed, first.to_do, second.done) == (2, 1, 0, 3)
    assert first.remarks == [(1, f"failed: {failed[0].error}")]
    copied.path(0, 1).rmdir()
    assert [each.cached for each in done(copied)] == [True, False, True, True, True, True]
    assert failures(copied) == {}
    assert not (copied.directory / FAILURES).exists()
    assert contents(copied) == contents(finished_run)


def test_a_failure_is_noted_once_there_is_room_for_it(copied: Run) -> None:
    """Other repeats under way may have filled the disk when one fails."""
    path, record = copied.path(0, 1), copied.directory / FAILURES
    path.unlink()
    path.mkdir()
    record.mkdir()

    class MakesRoom(Watcher):
        def finished(self, result: RepeatResult) -> None:
            if result.error:
                record.rmdir()

    execute(copied, workers=1, watcher=MakesRoom(), cancelled=threading.Event())
    assert list(failures(copied)) == [(0, 1)]


def test_an_unforeseen_error_keeps_its_traceback(
    copied: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    def lost(*_: object, **__: object) -> None:
        raise KeyError("lost")

    shutil.rmtree(copied.directory / "point-0001")
    monkeypatch.setattr("snooker_cli.runs.repeat.versions", lost)
    failed = [result for result in done(copied) if result.error]
    assert [(each.point, each.repeat, each.error) for each in failed] == [
        (1, repeat, "KeyError: 'lost'") for repeat in range(3)
    ]
    assert all("in lost" in each.traceback for each in failed)


# Interrupts


def test_an_interrupted_repeat_is_saved_and_done_again(small_config: str, tmp_path: Path) -> None:
    overrides = ("cor=1", "collisions=150000", "repeats=2")
    whole = made(tmp_path / "whole", small_config, *overrides)
    done(whole)
    run = made(tmp_path / "interrupted", small_config, *overrides)
    cancelled = threading.Event()
    results = execute(run, workers=1, watcher=StopsAfter(100_000, cancelled), cancelled=cancelled)
    (stopped,) = results
    assert stopped.stop is not None
    assert stopped.stop.reason is StopReason.INTERRUPTED
    saved = store.read(run.path(0, 0))[0]
    assert saved.collisions == stopped.collisions
    assert 100_000 <= saved.collisions < 150_000
    assert [result.cached for result in done(run)] == [False, False]
    assert contents(run) == contents(whole)
    # What was saved is the beginning of the whole.
    events, all_events = saved.events, store.read(whole.path(0, 0))[0].events
    assert events is not None
    assert all_events is not None
    for name in ("time", "i", "j", "impulse"):
        column = getattr(events, name)
        assert column.tobytes() == getattr(all_events, name)[: len(events)].tobytes()


def test_what_has_nothing_to_keep_is_left_behind() -> None:
    """As a thread that arranges a million balls; it learns of it when it has something."""
    cancelled, begun, goes_on = threading.Event(), threading.Event(), threading.Event()
    kept: list[bool] = []
    ended = threading.Semaphore(0)

    def slow(item: int, keep: Callable[[], bool]) -> int:
        if item == 0:
            return item
        begun.set()
        assert goes_on.wait(60)
        kept.append(keep())
        ended.release()
        return item

    with ThreadExecutor(2, cancelled) as threads:
        runs = threads.each(slow, [0, 1, 2, 3, 4, 5, 6])
        assert next(runs) == 0
        assert begun.wait(60)
        cancelled.set()
        assert list(runs) == []
    assert kept == []
    goes_on.set()
    assert ended.acquire(timeout=60)
    assert not any(kept)


def test_what_has_something_to_keep_is_waited_for() -> None:
    cancelled, begun = threading.Event(), threading.Event()

    def slow(item: int, keep: Callable[[], bool]) -> int:
        assert keep()
        begun.set()
        assert cancelled.wait(60)
        return item

    with ThreadExecutor(1, cancelled) as threads:
        runs = threads.each(slow, range(7))
        threading.Thread(target=lambda: (begun.wait(60), cancelled.set())).start()
        # One is under way, and another may have begun before the cancelling was seen.
        assert 0 in runs


def test_what_goes_wrong_in_a_thread_is_raised() -> None:
    def wrong(item: int, keep: Callable[[], bool]) -> int:
        raise ValueError(f"item {item}")

    with ThreadExecutor(1, threading.Event()) as threads, pytest.raises(ValueError, match="item 3"):
        list(threads.each(wrong, [3]))


def test_nothing_begins_in_a_cancelled_run(small_config: str, tmp_path: Path) -> None:
    run = made(tmp_path, small_config)
    cancelled = threading.Event()
    cancelled.set()
    assert execute(run, workers=2, watcher=Watcher(), cancelled=cancelled) == []
    assert bytes_of(tmp_path) == {}
