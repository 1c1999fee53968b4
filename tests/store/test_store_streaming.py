"""Long repeats: events written as they come are those of the same repeat kept in memory."""

from __future__ import annotations

import subprocess
import sys
import threading
import tracemalloc
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from repeating import content_hash

from snooker_cli import store
from snooker_cli.config import parse
from snooker_cli.engine import simulate
from snooker_cli.errors import UnsoundError
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.scene import Scene
from snooker_cli.store import Provenance, Recorder
from snooker_cli.store import file_format as layout
from snooker_cli.store.reader import EventReader
from snooker_cli.store.writer import ROWS, WAITING
from snooker_cli.trace import Events, Trace, joined

LONG = 3 * ROWS + 1000


@pytest.fixture(scope="module")
def scene(small_config: str) -> Scene:
    return starting_scene(parse(small_config, overrides=["cor=1"]).config, 0)


@pytest.fixture(scope="module")
def trace(scene: Scene) -> Trace:
    return simulate(scene, collisions=LONG)


def events_of(trace: Trace) -> Events:
    assert trace.events is not None
    return trace.events


@pytest.mark.parametrize(
    ("number", "piece"),
    [(0, ROWS), (ROWS, ROWS), (ROWS + 1, 777 * 13), (LONG, 777 * 13), (LONG, LONG)],
)
def test_the_pieces_do_not_matter(
    number: int, piece: int, trace: Trace, tmp_path: Path, provenance: Provenance
) -> None:
    events = events_of(trace)[:number]
    at_wall = int(events.at_wall.sum())
    trace = replace(trace, wall_events=at_wall, pair_events=number - at_wall)
    with Recorder(tmp_path / "pieces.h5") as recorder:
        for repeat in (3, 5):
            recorder.begin(trace.start)
            for start in range(0, max(number, 1), piece):
                recorder.add(events[start : min(start + piece, number)])
            recorder.end(repeat, replace(trace, events=None))
        recorder.finish(provenance)
    for found, header in store.read(tmp_path / "pieces.h5"):
        whole = content_hash(replace(trace, events=events))
        assert content_hash(found) == header.fingerprint == whole
        assert len(events_of(found)) == number
    assert [header.stop for header in store.check(tmp_path / "pieces.h5")] == [trace.stop] * 2


def test_what_is_not_finished_leaves_nothing(trace: Trace, tmp_path: Path) -> None:
    threads = threading.active_count()
    with Recorder(tmp_path / "one.h5") as recorder:
        recorder.begin(trace.start)
        recorder.add(events_of(trace))
        assert len(list(tmp_path.iterdir())) == 1
        assert threading.active_count() == threads + 1
    assert list(tmp_path.iterdir()) == []
    assert threading.active_count() == threads


def test_memory_is_bounded_by_chunks(trace: Trace, tmp_path: Path, provenance: Provenance) -> None:
    """Of eight times as many events no more is kept than waits to be written."""
    events = replace(events_of(trace), time=np.zeros(LONG), residual=np.zeros(LONG))
    size = 24 * ROWS  # bytes of a chunk in memory

    def most(times: int) -> int:
        tracemalloc.start()
        with Recorder(tmp_path / "one.h5") as recorder:
            recorder.begin(trace.start)
            for _ in range(times):
                for start in range(0, 3 * ROWS, ROWS // 2):
                    piece = events[start : start + ROWS // 2]
                    recorder.add(joined([piece, piece[:0]]))
            number, at_wall = times * 3 * ROWS, times * int(events[: 3 * ROWS].at_wall.sum())
            ended = replace(trace, events=None, wall_events=at_wall, pair_events=number - at_wall)
            recorder.end(0, ended)
            recorder.finish(provenance)
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return peak

    most(1)  # what is imported and cached by the first
    # In the queue, in the writer, being joined, and the writer's copies, with room to spare.
    assert most(8) < (2 * WAITING + 4) * size < 24 * size


# A full disk

FULL = """
import resource, signal, sys
from pathlib import Path
from snooker_cli import store
from snooker_cli import errors
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.config import parse
from snooker_cli.engine import simulate

scene = starting_scene(parse(sys.stdin.read()).config, 0)
source = store.Provenance("{}", "", "{}", 0, 1, "{}", "", "", "", 0.0)
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
for case in sys.argv[2:]:
    collisions, room = map(int, case.split(","))
    trace = simulate(scene, collisions=collisions)
    resource.setrlimit(resource.RLIMIT_FSIZE, (room, resource.RLIM_INFINITY))
    for _ in range(2):
        try:
            store.write(Path(sys.argv[1]), [(0, trace)], source)
        except errors.StoreError as error:
            print(error)
    resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
"""


def test_a_full_disk_is_reported(small_config: str, tmp_path: Path) -> None:
    """Files may not grow beyond a size: at once, after some chunks, or in the end."""
    path = tmp_path / "one.h5"
    cases = ["300,1000", "200000,100000", "200000,2400000"]

    done = subprocess.run(
        [sys.executable, "-c", FULL, path, *cases],
        input=small_config.replace("0.85", "1.0").replace("sweep: {cor: [1.0, 1.0]}", ""),
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
    sentence = f"{path}: cannot write the result (File too large); make room or choose"
    messages = [line[: len(sentence)] for line in done.stdout.splitlines()]
    assert messages == [sentence] * 2 * len(cases)
    assert list(tmp_path.iterdir()) == []


def test_times_that_fall_between_two_blocks_are_refused(
    trace: Trace, provenance: Provenance, tmp_path: Path
) -> None:
    """A block that begins earlier than the one before it ended."""
    path, size = tmp_path / "falls.h5", 1000
    store.write(path, [(0, trace)], provenance)
    with h5py.File(path, "r+") as file:
        times = file[f"{layout.TIME}/value"]
        times[size:] = times[size:] - (times[size] - times[size - 2])
    with h5py.File(path) as file:
        pieces = EventReader(file, size).pieces(slice(0, LONG))
        next(pieces)
        with pytest.raises(UnsoundError, match="order of the times"):
            next(pieces)
