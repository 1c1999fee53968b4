"""Files are checked in a child process, which may crash or reach its limits."""

from __future__ import annotations

import json
import os
import signal
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from repeating import bytes_of

from snooker_cli import store
from snooker_cli.errors import StoreError
from snooker_cli.runs import Run
from snooker_cli.store import IsolatedChecker, Provenance, isolation
from snooker_cli.trace import Trace


@pytest.fixture
def checker() -> Iterator[IsolatedChecker]:
    with IsolatedChecker() as checker:
        yield checker


@pytest.fixture
def path(finished_run: Run) -> Path:
    return finished_run.directory / next(iter(bytes_of(finished_run.directory)))


def test_one_process_checks_many_files(checker: IsolatedChecker, path: Path) -> None:
    headers = store.check(path)
    assert checker.check(path) == headers
    process = checker._process.pid
    with pytest.raises(StoreError, match="not a readable result"):
        checker.check(Path(__file__))
    assert checker.check(path) == headers
    assert checker._process.pid == process


def test_a_crash_is_an_error_of_its_file(checker: IsolatedChecker, path: Path) -> None:
    headers = checker.check(path)
    os.kill(checker._process.pid, signal.SIGSEGV)
    with pytest.raises(StoreError, match=r"reading it crashes \(exit code -11\)"):
        checker.check(path)
    assert checker.check(path) == headers


def test_a_file_may_not_take_long(
    checker: IsolatedChecker, path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without any time for a file, the process ends as soon as it has run for a second."""
    headers = checker.check(path)
    monkeypatch.setattr(isolation, "SECONDS", -1)
    with pytest.raises(StoreError, match="reading it takes longer than"):
        all(checker.check(path) for _ in range(10_000))
    monkeypatch.undo()
    assert checker.check(path) == headers


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="memory is limited on Linux only")
def test_a_file_may_not_take_much_memory(
    checker: IsolatedChecker,
    traces: dict[str, Trace],
    provenance: Provenance,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    path, text = tmp_path / "large.h5", json.dumps("a" * 50_000_000)
    store.write(path, [(0, traces["events"])], replace(provenance, config=text))
    assert len(checker.check(path)) == 1
    monkeypatch.setattr(isolation, "MEMORY", 2e8)
    monkeypatch.setattr(isolation, "MEMORY_PER_BYTE", 0)
    with pytest.raises(StoreError, match="not a readable result"):
        checker.check(path)
    monkeypatch.undo()
    assert len(checker.check(path)) == 1
