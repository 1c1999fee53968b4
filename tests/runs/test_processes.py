"""Processes of one machine that simulate the batches of a run."""

from __future__ import annotations

import errno
import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest
from repeating import StopsAtOnce, batches_of, contents, done, made

from snooker_cli import runs
from snooker_cli.errors import RunError
from snooker_cli.runs import execution
from snooker_cli.runs.batch import RepeatResult
from snooker_cli.runs.execution import Watcher, execute


@pytest.fixture(autouse=True)
def few_are_enough(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Two batches of two repeats for each process are many."""
    monkeypatch.setattr(execution, "LEAST_FOR_PROCESS", 2)
    with batches_of(2):
        yield


class Counts(Watcher):
    """Counts the processes that simulate."""

    def __init__(self) -> None:
        self.processes = 0

    def finished(self, _result: RepeatResult) -> None:
        self.processes = max(self.processes, len(multiprocessing.active_children()))


def test_processes_store_the_same_bits_as_threads(small_config: str, tmp_path: Path) -> None:
    by_processes, by_threads = (
        made(tmp_path / name, small_config, "repeats=5") for name in ("processes", "threads")
    )
    watcher = Counts()
    found = done(by_processes, workers=2, watcher=watcher, processes=True)
    expected = done(by_threads, workers=2)
    assert watcher.processes == 2
    assert [(result.point, result.repeat, result.stop) for result in found] == [
        (result.point, result.repeat, result.stop) for result in expected
    ]
    assert contents(by_processes) == contents(by_threads)


def test_an_interrupt_does_not_wait_for_long_batches(small_config: str, tmp_path: Path) -> None:
    """They would take minutes; the first news of them ends the run, and nothing is stored."""
    long = ("cor=1.0", "repeats=8", "collisions=50000000", "record=summary")
    run, stops = made(tmp_path / "run", small_config, *long), StopsAtOnce()
    cancelled, news = stops.cancelled, stops.news
    timer = threading.Timer(60.0, cancelled.set)
    timer.start()
    found = execute(run, workers=2, watcher=stops, cancelled=cancelled, processes=True)
    timer.cancel()
    assert found == []
    assert news
    assert [of_batch.share for of_batch in news] == pytest.approx(
        [of_batch.collisions / 1e8 for of_batch in news]
    )
    assert not multiprocessing.active_children()
    assert not [path for path in run.directory.glob("point-*/*") if path.is_file()]


class Kills(Watcher):
    """Kills one of two processes after the first batch."""

    def finished(self, _result: RepeatResult) -> None:
        for process in multiprocessing.active_children()[:1]:
            process.kill()


def test_a_killed_process_is_one_sentence(small_config: str, tmp_path: Path) -> None:
    run = made(tmp_path / "run", small_config, "repeats=60")
    with pytest.raises(RunError, match=r"the system ended a process of this run.*fewer jobs"):
        done(run, workers=2, watcher=Kills(), processes=True)
    assert not multiprocessing.active_children()
    assert len(done(run)) == 120


def test_without_shared_memory_threads_simulate(
    small_config: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    """As on a system whose /dev/shm is full or read-only."""

    def refused(*_arguments: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("multiprocessing.synchronize._multiprocessing.SemLock", refused)
    run = made(tmp_path / "run", small_config, "repeats=20")
    assert len(done(run, workers=2, processes=True)) == 40
    (notice,) = caplog.messages
    assert "shared memory (/dev/shm) cannot be used (No space left on device)" in notice


@pytest.mark.long
@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
@pytest.mark.parametrize(("number", "code"), [(signal.SIGKILL, -9), (signal.SIGTERM, 130)])
def test_processes_end_with_their_parent(
    number: signal.Signals, code: int, small_config: str, tmp_path: Path
) -> None:
    config = tmp_path / "small.yaml"
    config.write_text(small_config)
    arguments = ["run", str(config), "--out", str(tmp_path / "run"), "-o", "repeats=20000"]
    # A group of its own: all its processes get Ctrl-C of a terminal, or SIGTERM of a batch system.
    parent = subprocess.Popen(
        [sys.executable, "-m", "snooker_cli", *arguments, "-j", "2", "--no-progress"],
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    while not list(tmp_path.glob("run/point-*/*.h5")):
        assert parent.poll() is None
        time.sleep(0.01)
    if number == signal.SIGKILL:
        parent.kill()
    else:
        os.killpg(parent.pid, number)
    # The pipe ends when no process has it any more.
    try:
        _, talk = parent.communicate(timeout=60)
    finally:
        with suppress(ProcessLookupError):
            os.killpg(parent.pid, signal.SIGKILL)
    assert parent.returncode == code
    assert "Traceback" not in talk
    if number != signal.SIGKILL:
        assert "stopping; unfinished batches of short repeats are not saved" in talk
        assert "run the same command again to finish" in talk
        assert not list(tmp_path.rglob("*.part"))
    opened = runs.open_run(tmp_path / "run")
    assert 0 < len(opened.present(opened.points[0])) < 20000
