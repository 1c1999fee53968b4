"""Kept results: their owners, their order and their limit, in memory and in the user's folder."""

from __future__ import annotations

import gc
import os
import stat
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from snooker_cli import results_cache
from snooker_cli.results_cache import Memory, from_cache, size_of


class Owner:
    """An object with results."""


def test_results_of_deleted_objects_do_not_count() -> None:
    memory, owner = Memory(2000), Owner()
    kept = memory.keep("a", np.zeros(100), owner)
    for _ in range(9):
        memory.keep("a", np.zeros(100), Owner())
    gc.collect()
    assert memory.find("a", owner) is kept
    assert memory.size == 800


def test_the_limit_is_that_of_the_results_used_last() -> None:
    memory = Memory(2000)
    for key in ("a", "b"):
        memory.keep(key, np.zeros(100))
    assert memory.find("a") is not None
    memory.keep("c", np.zeros(100))
    assert [memory.find(key) is not None for key in "abc"] == [True, False, True]
    large = memory.get("large", lambda: np.zeros(1000))
    assert memory.get("large", lambda: np.ones(1)) is large
    assert memory.find("a") is None
    assert memory.size == size_of(large)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of kept results, of which there is none."""
    monkeypatch.setenv("SNOOKER_CACHE_DIR", str(tmp_path))
    return tmp_path / "analyses"


def value_of(origin: list[Any], new: object = "new") -> object:
    return from_cache(origin, lambda: new)


def test_a_result_is_made_once_for_its_origin(folder: Path) -> None:
    assert value_of(["results", 1], {"a": [0.1, None]}) == {"a": [0.1, None]}
    assert value_of(["results", 1]) == {"a": [0.1, None]}
    assert value_of(["results", 2]) == "new"
    assert len([*folder.iterdir()]) == 2


def test_what_is_not_final_is_not_kept(folder: Path) -> None:
    assert from_cache(["a"], lambda: "half", lambda value: value != "half") == "half"
    assert value_of(["a"]) == "new"


def test_results_that_were_not_used_for_long_make_room(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(results_cache, "MOST_BYTES", 1000)
    for number in range(9):
        value_of([number], 98 * "a")
        for path in folder.iterdir():  # clocks of files may be coarse
            os.utime(path, ns=(path.stat().st_atime_ns, path.stat().st_mtime_ns - 10**9))
    assert value_of([0]) == 98 * "a"
    value_of([9], 98 * "a")
    value_of([10], 98 * "a")
    kept = [number for number in range(11) if value_of([number], "") != ""]
    assert kept == [0, 5, 6, 7, 8, 9, 10]


def test_a_new_result_does_not_look_at_all_others(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A sweep may have ten thousand points."""
    looks: list[Path] = []

    def counted(path: Path) -> int:
        looks.append(path)
        return forget(path)

    forget = results_cache._forget_oldest
    monkeypatch.setattr(results_cache, "_forget_oldest", counted)
    for number in range(9):
        value_of([number])
    assert looks == [folder]


def test_other_users_cannot_change_the_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """Else nothing is read there, nothing is kept, and a sentence says so once."""
    shared = tmp_path / "shared"
    shared.mkdir()
    shared.chmod(0o777)
    monkeypatch.setenv("SNOOKER_CACHE_DIR", str(shared))
    assert [value_of(["a"], number) for number in range(2)] == [0, 1]
    assert not [*shared.iterdir()]
    (record,) = caplog.records
    assert f"other users can change {shared}" in record.getMessage()
    assert "SNOOKER_CACHE_DIR" in record.getMessage()
    shared.chmod(stat.S_IRWXU)


def test_a_full_disk_keeps_nothing_and_says_so(
    folder: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_text", full)
    assert value_of(["a"], 5) == 5
    assert "cannot be written (No space left on device); the result is not kept" in caplog.text
    assert not [*folder.iterdir()]
