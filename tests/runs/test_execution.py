"""The runner: resuming, the same bits however it is run, failures and interrupts."""

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
from snooker_cli.config import digest, parse, points
from snooker_cli.containers import Circle
from snooker_cli.engine import ENGINE_VERSION, simulate
from snooker_cli.errors import SceneError, StoreError
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.runs import RepeatStatus, Run
from snooker_cli.runs.execution import ThreadExecutor, Watcher, execute
from snooker_cli.runs.folder import FAILURES, failures
from snooker_cli.runs.plan import SceneClass, scene_classes
from snooker_cli.runs.repeat import RepeatResult
from snooker_cli.runs.status import run_status
from snooker_cli.trace import StopReason


class Notes(Watcher):
    """Everything that a run told."""

    def __init__(self) -> None:
        self.lock = threading.Lock()
        self.collisions = 0
        self.outcomes: list[RepeatResult] = []
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
        assert (self.collisions, [each for each in self.outcomes if not each.cached]) == (0, [])
        self.readied += 1

    def events(self, number: int) -> None:
        with self.lock:
            self.collisions += number

    def finished(self, outcome: RepeatResult) -> None:
        with self.lock:
            self.outcomes.append(outcome)


@pytest.fixture
def copied(finished_run: Run, tmp_path: Path) -> Run:
    """A copy of the finished run, to be changed."""
    shutil.copytree(finished_run.directory, tmp_path / "copied")
    return runs.open_run(tmp_path / "copied")


# Resuming


def test_outcomes_tell_what_is_in_the_files(copied: Run) -> None:
    notes = Notes()
    outcomes = done(copied, watcher=notes)
    assert [(outcome.point, outcome.repeat) for outcome in outcomes] == [
        (point, repeat) for point in (0, 1) for repeat in (0, 1, 2)
    ]
    assert sorted(notes.outcomes, key=lambda each: (each.point, each.repeat)) == outcomes
    assert {outcome.work for outcome in outcomes} == {None}
    for outcome in outcomes:
        trace = store.read(copied.path(outcome.point, outcome.repeat))[0]
        assert outcome.stop == trace.stop
        assert outcome.collisions == trace.collisions
        assert outcome.error is None


def test_a_second_run_simulates_nothing(copied: Run) -> None:
    before = bytes_of(copied.directory)
    notes = Notes()
    outcomes = done(copied, watcher=notes)
    assert all(outcome.cached for outcome in outcomes)
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
    outcomes = done(copied, watcher=notes)
    assert [(each.point, each.repeat) for each in outcomes if not each.cached] == [(1, 1)]
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
    outcomes = done(longer)
    assert [outcome.repeat for outcome in outcomes if not outcome.cached] == [3, 4, 3, 4]
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
        outcomes = done(run, workers=jobs)
        assert [(each.point, each.repeat) for each in outcomes] == [
            (point, repeat) for point in (0, 1) for repeat in range(8)
        ]
        found[jobs] = contents(run)
    assert found[1] == found[2] == found[4]
    assert len(set(found[1].values())) == 16


def test_the_file_tells_how_to_make_the_repeat_again(finished_run: Run) -> None:
    for point in finished_run.points:
        for repeat in range(3):
            trace, header = store.read(finished_run.path(point.index, repeat))
            told = header.provenance
            assert (told.point, told.repeat) == (point.index, repeat)
            assert told.engine_version == ENGINE_VERSION
            assert json.loads(told.parameters) == dict(point.parameters)
            experiment = parse(told.config).experiment
            assert experiment == point.experiment
            assert told.digest == digest(experiment)
            again = simulate(
                starting_scene(experiment, told.repeat),
                collisions=experiment.collisions,
                time=experiment.time,
            )
            assert store.content_hash(again) == store.content_hash(trace)


def test_provenance_names_the_software_and_the_moment(finished_run: Run) -> None:
    told = store.check(finished_run.path(0, 0)).provenance
    assert {"python", "snooker", "numpy", "numba", "h5py"} <= set(json.loads(told.versions))
    assert told.machine
    assert told.started.endswith("+00:00")
    assert told.seconds > 0


def test_an_infinite_mass_in_a_sweep_is_json_in_the_file(small_config: str, tmp_path: Path) -> None:
    run = made(tmp_path, small_config.replace("sweep", "# "), "container.mass=.inf", "repeats=1")
    swept = replace(run.points[0], parameters=(("container.mass", float("inf")),))
    assert [each.error for each in done(replace(run, points=(swept,)))] == [None]
    told = store.check(run.path(0, 0)).provenance
    json.loads(told.parameters, parse_constant=pytest.fail)


# Failures


def test_one_failing_repeat_does_not_stop_the_others(copied: Run, finished_run: Run) -> None:
    for path in copied.directory.glob("point-*/*"):
        path.unlink()
    copied.path(0, 1).mkdir()
    notes = Notes()
    outcomes = done(copied, workers=2, watcher=notes)
    failed = [outcome for outcome in outcomes if outcome.error]
    assert [(outcome.point, outcome.repeat) for outcome in failed] == [(0, 1)]
    assert failed[0].error is not None
    assert "repeat-0001.h5: cannot write the result" in failed[0].error
    assert failed[0].stop is None
    assert failed[0] in notes.outcomes
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
        def finished(self, outcome: RepeatResult) -> None:
            if outcome.error:
                record.rmdir()

    execute(copied, workers=1, watcher=MakesRoom(), cancelled=threading.Event())
    assert list(failures(copied)) == [(0, 1)]


def test_a_scene_that_cannot_exist_tells_its_point(small_config: str) -> None:
    swept = parse(small_config, overrides=["balls.radius=1.0,3.0"]).experiment
    with pytest.raises(SceneError, match=r"\(at the point .*balls\.radius=3\.0\)") as caught:
        scene_classes(points(swept))
    assert caught.value.key == "balls.radius"


TWO_BALLS = """\
container: {radius: 10.0}
balls:
  list:
    - {position: [-4, 0], velocity: [1, 0.1], radius: 1}
    - {position: [4, 0], velocity: [-1, 0], radius: 1}
cor: 1
collisions: 10
"""


def test_repeats_of_given_balls_are_refused() -> None:
    """They would be the same bits again: nothing in a list is random."""
    scene_classes(points(parse(TWO_BALLS).experiment))
    with pytest.raises(SceneError, match=r"^4 repeats of balls\.list .*; set repeats: 1") as caught:
        scene_classes(points(parse(TWO_BALLS, overrides=["repeats=4"]).experiment))
    assert caught.value.key == "repeats"


# Kinds of scenes


GAS = """\
container: {radius: 10.0}
balls: {count: 100, radius: 0.3, speed: 10}
cor: 1
collisions: 10
"""

KERNEL = {
    "cells": False,
    "balls sorted by cells": False,
    "straight walls": False,
    "periodic images": False,
    "moving container": False,
    "unequal balls": False,
    "sliding along the wall": False,
    "events": True,
    "lasting contacts": False,
    "slow collisions elastic": False,
}
LOSSES = {"losses between balls": False, "losses at the wall": False, "wall traps": False}


def kinds_of(text: str, *overrides: str, engine: str | None = None) -> list[SceneClass]:
    return scene_classes(points(parse(text, overrides=overrides).experiment), engine)


def test_kinds_tell_what_is_modelled(small_config: str) -> None:
    lossy, elastic = kinds_of(small_config)
    free = KERNEL | {"moving container": True, "collapse": True}
    assert elastic.models == free | LOSSES
    assert lossy.models == free | dict.fromkeys(LOSSES, True)
    assert [point.index for point in lossy.points + elastic.points] == [0, 1]
    assert (lossy.shape, lossy.balls, elastic.balls) == (Circle, (7,), (7,))


def test_kinds_hold_points_that_ask_for_the_same(small_config: str) -> None:
    swept = ("balls.rings=0,2,1", "cor=0.7,0.8")
    (one,) = kinds_of(small_config, *swept)
    assert one.balls == (1, 19, 7, 1, 19, 7)
    assert [point.index for point in one.points] == list(range(6))
    fixed, free = kinds_of(small_config, "container.mass=.inf,1e7", "cor=1")
    assert (fixed.models["moving container"], free.models["moving container"]) == (False, True)


@pytest.mark.parametrize(
    ("overrides", "expected"),
    [
        ((), {"cells": True}),
        (("balls.count=80",), {}),
        (("record=summary",), {"cells": True, "events": False}),
        (("balls.count=4096", "balls.radius=0.05"), {"cells": True, "balls sorted by cells": True}),
        (("cor=0.9",), {"cells": True} | dict.fromkeys(LOSSES, True)),
        (("cor=0.9", "wall_cor=1"), {"cells": True, "losses between balls": True}),
        (("container={shape: box, width: 20}",), {"cells": True, "straight walls": True}),
        (
            ("container={shape: box, width: 20}", "cor=0.9"),
            {"cells": True, "straight walls": True, **dict.fromkeys(LOSSES, True)}
            | {"wall traps": False},
        ),
        (
            ("container={shape: periodic, width: 20}", "wall_cor=0.9"),
            {"cells": True, "periodic images": True},
        ),
    ],
)
def test_only_what_a_scene_needs_is_modelled(
    overrides: tuple[str, ...], expected: dict[str, bool]
) -> None:
    (kind,) = kinds_of(GAS, *overrides)
    assert kind.models == KERNEL | LOSSES | {"collapse": True} | expected


def test_different_balls_are_another_kind() -> None:
    (equal,) = kinds_of(TWO_BALLS)
    (different,) = kinds_of(TWO_BALLS.replace("[-1, 0], radius: 1", "[-1, 0], radius: 2, mass: 3"))
    assert equal.balls == different.balls == (2,)
    assert different.models == equal.models | {"unequal balls": True}


def test_an_engine_can_be_forced_upon_all_scenes_it_knows(small_config: str) -> None:
    assert kinds_of(GAS, engine="allpairs")[0].models["cells"] is False
    assert {kind.models["cells"] for kind in kinds_of(small_config, engine="cells")} == {True}
    with pytest.raises(SceneError, match="allpairs knows no box: use cells") as caught:
        kinds_of(GAS, "container={shape: box, width: 20}", engine="allpairs")
    assert caught.value.key == "container.shape"


def test_an_unforeseen_error_keeps_its_traceback(
    copied: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    def lost(*_: object, **__: object) -> None:
        raise KeyError("lost")

    shutil.rmtree(copied.directory / "point-0001")
    monkeypatch.setattr("snooker_cli.runs.repeat.versions", lost)
    failed = [outcome for outcome in done(copied) if outcome.error]
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
    outcomes = execute(run, workers=1, watcher=StopsAfter(100_000, cancelled), cancelled=cancelled)
    (stopped,) = outcomes
    assert stopped.stop is not None
    assert stopped.stop.reason is StopReason.INTERRUPTED
    saved = store.read(run.path(0, 0))[0]
    assert saved.collisions == stopped.collisions
    assert 100_000 <= saved.collisions < 150_000
    assert [outcome.cached for outcome in done(run)] == [False, False]
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
    told = threading.Semaphore(0)

    def slow(item: int, keep: Callable[[], bool]) -> int:
        if item == 0:
            return item
        begun.set()
        assert goes_on.wait(60)
        kept.append(keep())
        told.release()
        return item

    with ThreadExecutor(2, cancelled) as threads:
        runs = threads.each(slow, [0, 1, 2, 3, 4, 5, 6])
        assert next(runs) == 0
        assert begun.wait(60)
        cancelled.set()
        assert list(runs) == []
    assert kept == []
    goes_on.set()
    assert told.acquire(timeout=60)
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
