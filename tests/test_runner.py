"""The runner: resuming, the same bits however it is run, failures, kills and interrupts."""

from __future__ import annotations

import json
import random
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from snooker_cli import results, store
from snooker_cli.arrange import arrange
from snooker_cli.config import digest, parse, points
from snooker_cli.engine import ENGINE_VERSION, simulate
from snooker_cli.results import Run
from snooker_cli.runner import Outcome, Watcher, check_scenes, execute
from snooker_cli.scene import SceneError
from snooker_cli.trace import StopReason


class Notes(Watcher):
    """Everything that a run told."""

    def __init__(self) -> None:
        self.lock = threading.Lock()
        self.collisions = 0
        self.outcomes: list[Outcome] = []

    def events(self, number: int) -> None:
        with self.lock:
            self.collisions += number

    def finished(self, outcome: Outcome) -> None:
        with self.lock:
            self.outcomes.append(outcome)


def done(run: Run, *, workers: int = 1, watcher: Watcher | None = None) -> list[Outcome]:
    """The outcomes of doing what is missing of a run."""
    return execute(run, workers=workers, watcher=watcher or Watcher(), cancelled=threading.Event())


def made(directory: Path, text: str, *overrides: str) -> Run:
    """A run's folder for a config."""
    return results.create(directory, parse(text, overrides=overrides).experiment)


def contents(run: Run) -> dict[tuple[int, int], str]:
    """The content hash of every repeat; each file is read and checked for it."""
    return {
        (point.index, repeat): store.content_hash(store.read(run.path(point.index, repeat)).trace)
        for point in run.points
        for repeat in range(run.experiment.repeats)
    }


def bytes_of(directory: Path) -> dict[str, bytes]:
    """The files of all repeats. A repeat made again differs, by its provenance's seconds."""
    return {
        str(path.relative_to(directory)): path.read_bytes()
        for path in directory.glob("point-*/repeat-*")
    }


@pytest.fixture
def copied(finished_run: Run, tmp_path: Path) -> Run:
    """A copy of the finished run, to be changed."""
    shutil.copytree(finished_run.directory, tmp_path / "copied")
    return results.open_run(tmp_path / "copied")


# Resuming


def test_outcomes_tell_what_is_in_the_files(copied: Run) -> None:
    notes = Notes()
    outcomes = done(copied, watcher=notes)
    assert [(outcome.point, outcome.repeat) for outcome in outcomes] == [
        (point, repeat) for point in (0, 1) for repeat in (0, 1, 2)
    ]
    assert sorted(notes.outcomes, key=lambda each: (each.point, each.repeat)) == outcomes
    for outcome in outcomes:
        trace = store.read(copied.path(outcome.point, outcome.repeat)).trace
        assert outcome.stop == trace.stop
        assert outcome.collisions == trace.collisions
        assert outcome.error is None


def test_a_second_run_simulates_nothing(copied: Run) -> None:
    before = bytes_of(copied.directory)
    notes = Notes()
    outcomes = done(copied, watcher=notes)
    assert all(outcome.cached for outcome in outcomes)
    assert notes.collisions == 0
    assert bytes_of(copied.directory) == before


def remove(path: Path) -> None:
    path.unlink()


def truncate(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-1000])


def empty(path: Path) -> None:
    path.write_bytes(b"")


def flip_a_bit(path: Path) -> None:
    trace = store.read(path).trace
    image = bytearray(path.read_bytes())
    image[image.index(trace.start.velocities.tobytes()) + 5] ^= 1
    path.write_bytes(image)


def put_another_repeat_there(path: Path) -> None:
    shutil.copy(path.with_name("repeat-0002.h5"), path)


def put_another_point_there(path: Path) -> None:
    shutil.copy(path.parent.with_name("point-0000") / path.name, path)


def put_another_engines_there(path: Path) -> None:
    stored = store.read(path)
    old = replace(stored.provenance, engine_version=ENGINE_VERSION - 1)
    store.write(path, stored.trace, old)


@pytest.mark.parametrize(
    "damage",
    [
        remove,
        truncate,
        empty,
        flip_a_bit,
        put_another_repeat_there,
        put_another_point_there,
        put_another_engines_there,
    ],
)
def test_one_bad_file_is_done_again_and_only_that(
    damage: Callable[[Path], None], copied: Run, finished_run: Run
) -> None:
    before = bytes_of(copied.directory)
    damage(copied.path(1, 1))
    outcomes = done(copied)
    assert [(each.point, each.repeat) for each in outcomes if not each.cached] == [(1, 1)]
    after = bytes_of(copied.directory)
    name = "point-0001/repeat-0001.h5"
    assert after.pop(name) != before.pop(name)
    assert after == before
    assert contents(copied) == contents(finished_run)


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
            stored = store.read(finished_run.path(point.index, repeat))
            told = stored.provenance
            assert (told.point, told.repeat) == (point.index, repeat)
            assert told.engine_version == ENGINE_VERSION
            assert json.loads(told.parameters) == dict(point.parameters)
            experiment = parse(told.config).experiment
            assert experiment == point.experiment
            assert told.digest == digest(experiment)
            again = simulate(
                arrange(experiment, told.repeat),
                collisions=experiment.collisions,
                time=experiment.time,
            )
            assert store.content_hash(again) == store.content_hash(stored.trace)


def test_provenance_names_the_software_and_the_moment(finished_run: Run) -> None:
    told, _ = store.read_provenance(finished_run.path(0, 0))
    assert {"python", "snooker", "numpy", "numba", "h5py"} <= set(json.loads(told.versions))
    assert told.machine
    assert told.started.endswith("+00:00")
    assert told.seconds > 0


def test_an_infinite_mass_in_a_sweep_is_json_in_the_file(small_config: str, tmp_path: Path) -> None:
    run = made(tmp_path, small_config.replace("sweep", "# "), "container.mass=.inf", "repeats=1")
    swept = replace(run.points[0], parameters=(("container.mass", float("inf")),))
    assert [each.error for each in done(replace(run, points=(swept,)))] == [None]
    told, _ = store.read_provenance(run.path(0, 0))
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
    copied.path(0, 1).rmdir()
    assert [each.cached for each in done(copied)] == [True, False, True, True, True, True]
    assert contents(copied) == contents(finished_run)


def test_a_scene_that_cannot_exist_tells_its_point(small_config: str) -> None:
    swept = parse(small_config, overrides=["balls.radius=1.0,3.0"]).experiment
    with pytest.raises(SceneError, match=r"\(at the point .*balls\.radius=3\.0\)") as caught:
        check_scenes(points(swept))
    assert caught.value.key == "balls.radius"


# Interrupts


class StopsAfter(Watcher):
    """Cancels the run when so many collisions are simulated."""

    def __init__(self, collisions: int, cancelled: threading.Event) -> None:
        self.left = collisions
        self.cancelled = cancelled

    def events(self, number: int) -> None:
        self.left -= number
        if self.left <= 0:
            self.cancelled.set()


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
    saved = store.read(run.path(0, 0)).trace
    assert saved.collisions == stopped.collisions
    assert 100_000 <= saved.collisions < 150_000
    assert [outcome.cached for outcome in done(run)] == [False, False]
    assert contents(run) == contents(whole)
    # What was saved is the beginning of the whole.
    events, all_events = saved.events, store.read(whole.path(0, 0)).trace.events
    assert events is not None
    assert all_events is not None
    for name in ("time", "i", "j", "impulse"):
        column = getattr(events, name)
        assert column.tobytes() == getattr(all_events, name)[: len(events)].tobytes()


def test_nothing_begins_in_a_cancelled_run(small_config: str, tmp_path: Path) -> None:
    run = made(tmp_path, small_config)
    cancelled = threading.Event()
    cancelled.set()
    assert execute(run, workers=2, watcher=Watcher(), cancelled=cancelled) == []
    assert bytes_of(tmp_path) == {}


ENDLESS = "repeats=3000"
"""Far more than a process does before it is stopped."""


def started(config: Path, directory: Path) -> subprocess.Popen[str]:
    """A real `snooker run` with an end far away."""
    command = [sys.executable, "-m", "snooker_cli", "run", str(config), "--out", str(directory)]
    return subprocess.Popen(
        [*command, "-o", ENDLESS, "-j", "2", "--no-progress"],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )


def repeats_in(directory: Path) -> list[Path]:
    return sorted(directory.glob("point-0000/repeat-*.h5"))


def ended(path: Path) -> StopReason:
    return store.read_provenance(path)[1].reason


def wait_for_repeats(number: int, directory: Path, process: subprocess.Popen[str]) -> None:
    """Return as soon as so many repeats are there; the last one is waited for without pause."""
    while (found := len(repeats_in(directory))) < number:
        assert process.poll() is None, process.communicate()
        time.sleep(0.002 if found < number - 1 else 0.0)


def assert_completes(directory: Path, text: str, reference: Path) -> None:
    """What is there is whole, and a run that does the rest gives an uninterrupted run's bits."""
    left = list(directory.glob("point-0000/*"))
    for path in repeats_in(directory):
        store.read(path)
    repeats = 1 + max(int(path.name[7:].split(".")[0]) for path in left)
    run = made(directory, text, f"repeats={repeats}")
    kept = [path for path in repeats_in(directory) if ended(path) is not StopReason.INTERRUPTED]
    outcomes = done(run, workers=2)
    assert [run.path(0, each.repeat) for each in outcomes if each.cached] == kept
    assert not list(directory.rglob("*.part"))
    uninterrupted = made(reference, text, f"repeats={repeats}")
    done(uninterrupted)
    assert contents(run) == contents(uninterrupted)


@pytest.fixture
def one_point(small_config: str) -> str:
    """The small config at a CoR of 1, where every repeat goes on to its last collision."""
    return small_config.replace("sweep: {cor: [0.85, 1.0]}\n", "").replace("cor: 0.85", "cor: 1")


def test_no_kill_leaves_a_torn_file(one_point: str, tmp_path: Path) -> None:
    """SIGKILL at ten moments: when a file has just appeared, or up to about one later."""
    chance = random.Random(1)
    config, directory = tmp_path / "kill.yaml", tmp_path / "killed"
    config.write_text(one_point)
    whole: set[Path] = set()
    for _ in range(10):
        process = started(config, directory)
        wait_for_repeats(len(repeats_in(directory)) + chance.randrange(1, 6), directory, process)
        for _ in range(chance.choice([0, chance.randrange(100_000)])):
            pass
        process.kill()
        _, said = process.communicate()
        assert process.returncode == -signal.SIGKILL
        assert "Traceback" not in said
        for path in set(repeats_in(directory)) - whole:
            store.read(path)
            whole.add(path)
    assert_completes(directory, one_point, tmp_path / "uninterrupted")


def test_signals_end_a_run_between_files(one_point: str, tmp_path: Path) -> None:
    config, directory = tmp_path / "stop.yaml", tmp_path / "stopped"
    config.write_text(one_point)
    for number in (signal.SIGINT, signal.SIGTERM):
        process = started(config, directory)
        wait_for_repeats(len(repeats_in(directory)) + 3, directory, process)
        process.send_signal(number)
        _, said = process.communicate()
        assert process.returncode == 130
        assert said.endswith("snooker: stopping; saving what is under way\n")
        assert not list(directory.rglob("*.part"))
    assert_completes(directory, one_point, tmp_path / "uninterrupted")
