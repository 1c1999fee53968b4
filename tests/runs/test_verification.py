"""`verify` checks files in a child process, which may crash or reach its limits."""

from __future__ import annotations

import errno
import json
import os
import signal
from collections.abc import Iterator
from dataclasses import replace
from multiprocessing.context import SpawnProcess
from pathlib import Path

import pytest
from repeating import bytes_of

from snooker_cli import store
from snooker_cli.errors import DeniedError, RunError, StoreError
from snooker_cli.runs import Run, verification
from snooker_cli.runs.verification import IsolatedChecker
from snooker_cli.store import Provenance
from snooker_cli.trace import Trace


@pytest.fixture
def checker() -> Iterator[IsolatedChecker]:
    with IsolatedChecker() as checker:
        yield checker


@pytest.fixture
def path(finished_run: Run) -> Path:
    return finished_run.directory / next(iter(bytes_of(finished_run.directory)))


def test_one_process_checks_many_files_until_one_ends_it(
    checker: IsolatedChecker, path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By a crash, or because a file takes longer than it may."""
    headers = store.check(path)
    assert checker.check(path) == headers
    process = checker._process.pid
    with pytest.raises(StoreError, match="not a readable result"):
        checker.check(Path(__file__))
    assert checker.check(path) == headers
    assert checker._process.pid == process
    os.kill(process, signal.SIGSEGV)
    with pytest.raises(StoreError, match=r"reading it crashes \(SIGSEGV\)"):
        checker.check(path)
    assert checker.check(path) == headers
    monkeypatch.setattr(verification, "SECONDS", -1)
    with pytest.raises(StoreError, match="reading it takes longer than"):
        all(checker.check(path) for _ in range(10_000))
    monkeypatch.undo()
    assert checker.check(path) == headers


def test_a_killed_checker_says_nothing_of_its_file(checker: IsolatedChecker, path: Path) -> None:
    headers = checker.check(path)
    os.kill(checker._process.pid, signal.SIGKILL)
    with pytest.raises(RunError, match=r"ended the process that read this file.*fewer --jobs"):
        checker.check(path)
    assert checker.check(path) == headers


def test_a_checker_that_cannot_begin_is_one_sentence(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The system refuses the process, or ends it before it can answer."""
    started = SpawnProcess.start

    def refused(_process: SpawnProcess) -> None:
        raise BlockingIOError(errno.EAGAIN, "Resource temporarily unavailable")

    def killed(process: SpawnProcess) -> None:
        started(process)
        process.kill()

    for start in (refused, killed):
        monkeypatch.setattr(SpawnProcess, "start", start)
        with (
            IsolatedChecker() as checker,
            pytest.raises(RunError, match="no process to check files can begin"),
        ):
            checker.check(path)


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="memory is limited on Linux only")
def test_a_file_may_not_take_much_memory(
    checker: IsolatedChecker,
    path: Path,
    traces: dict[str, Trace],
    provenance: Provenance,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Where a small file is read, a large one is refused."""
    large, text = tmp_path / "large.h5", json.dumps({"title": "a" * 100_000_000})
    store.write(large, [(0, traces["events"])], replace(provenance, config=text))
    assert len(checker.check(large)) == 1
    monkeypatch.setattr(verification, "MEMORY", 3e8)
    monkeypatch.setattr(verification, "MEMORY_PER_BYTE", 0)
    assert len(checker.check(path)) == 3
    with pytest.raises(DeniedError, match="needs more memory than there is"):
        checker.check(large)
    monkeypatch.undo()
    assert len(checker.check(large)) == 1
