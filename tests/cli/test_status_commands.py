"""``snooker ls``, ``show`` and ``verify``: states of repeats, and what a replay finds."""

from __future__ import annotations

import fcntl
import json
import os
import signal
import threading
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from command_line import Snooker
from repeating import StopsAfter, done, made

from snooker_cli import runs, store
from snooker_cli.engine import ENGINE_VERSION
from snooker_cli.engine.clock import LEAST_EVENTS
from snooker_cli.files import temporary_path, write_json
from snooker_cli.runs.execution import execute
from snooker_cli.runs.folder import is_locked, record_failure
from snooker_cli.runs.status import ended as endings
from snooker_cli.runs.verification import IsolatedChecker, verify
from snooker_cli.store import RepeatHeader
from snooker_cli.trace import StopReason

COUNTS = ("done", "running", "failed", "to_do")


def listed(snooker: Snooker, *arguments: str) -> list[dict[str, Any]]:
    ended = snooker("ls", *arguments, "--json")
    assert (ended.code, ended.err) == (0, "")
    return list(json.loads(ended.out))


def shown(snooker: Snooker) -> dict[str, Any]:
    ended = snooker("show", "small", "--json")
    assert (ended.code, ended.err) == (0, "")
    return dict(json.loads(ended.out))


def interrupt(path: Path) -> None:
    """Make a file one that an interrupt has saved."""
    ((trace, header),) = store.read(path)
    stop = replace(trace.stop, reason=StopReason.INTERRUPTED, message="cut")
    store.write(path, [(header.repeat, replace(trace, stop=stop))], header.provenance)


def test_each_repeat_is_in_one_column(separate: Path, snooker: Snooker) -> None:
    run = runs.open_run("small")
    run.path(0, [0]).unlink()
    run.path(0, [1]).write_text("not HDF5")
    run.path(1, [1]).unlink()
    interrupt(run.path(1, [2]))
    record_failure(run, 0, 0, "no room")
    record_failure(run, 1, 0, "of an attempt before; it is done now")
    (row,) = listed(snooker)
    assert row["state"] == "unfinished"
    assert [row[name] for name in COUNTS] == [2, 0, 1, 3]
    first, second = shown(snooker)["ledger"]
    assert [first[name] for name in COUNTS] == [1, 0, 1, 1]
    assert [second[name] for name in COUNTS] == [1, 0, 0, 2]
    assert first["remarks"][0] == {"repeat": 0, "remark": "failed: no room"}
    assert first["remarks"][1]["remark"].startswith("not a readable result of snooker (")
    assert second["remarks"] == [{"repeat": 2, "remark": "cut"}]


def test_complete_repeats_are_counted_first() -> None:
    counts = {"wall_trap": 136, "time": 3, "collisions": 61}
    assert endings({"ended": counts}) == "64 complete, 136 wall trap"
    assert endings({"ended": {"wall_trap": 2}}) == "2 wall trap"


@pytest.mark.parametrize("command", ["show", "verify", "run", "run --dry-run"])
@pytest.mark.parametrize("name", ["run.json", "point-0001/repeats-0000-0002.h5"])
def test_a_file_that_may_not_be_read_is_kept(
    name: str, command: str, finished: Path, snooker: Snooker, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Permissions hide an intact file: no advice to delete it, and no run replaces it."""
    path, whole = Path("runs/small", name), (finished / name).read_bytes()
    os.utime(path)  # so that no header is remembered
    opened, read_text = h5py.File, Path.read_text

    def refuse(file: object) -> None:
        if str(file) == str(path):
            raise PermissionError(13, "Permission denied")

    def open_h5(file: Any, *given: Any, **how: Any) -> h5py.File:
        refuse(file)
        return opened(file, *given, **how)

    def read(file: Path, *given: Any) -> str:
        refuse(file)
        return read_text(file, *given)

    monkeypatch.setattr(h5py, "File", open_h5)
    monkeypatch.setattr(Path, "read_text", read)
    # Patches do not reach the process that ``verify`` begins.
    monkeypatch.setattr(IsolatedChecker, "check", lambda _, file: store.check(file))
    begins = command.startswith("run")
    name_of, *options = command.split()
    ended = snooker(name_of, "small.yaml" if begins else "small", *options)
    printed = ended.out + ended.err
    sentence = f"{path}: cannot be read (permission denied); check its permissions"
    assert printed.count(sentence) == 1
    assert "delete" not in printed
    assert (finished / name).read_bytes() == whole
    if begins:
        assert ended.code == 2
        assert not (finished / "failures.jsonl").exists()


def test_a_locked_folder_is_running(separate: Path, snooker: Snooker) -> None:
    """The lock counts, and the unfinished file; without the lock the file is a leftover."""
    run = runs.open_run("small")
    for repeat in (0, 1):
        run.path(1, [repeat]).unlink()
    with runs.locked(separate):
        for missing, running in (([0], 1), ([0, 1], 2), ([1, 2], 2)):
            part = temporary_path(run.path(1, missing))
            part.touch()
            (row,) = listed(snooker)
            assert row["state"] == "running"
            assert [row[name] for name in COUNTS] == [4, running, 0, 2 - running]
    (row,) = listed(snooker)
    assert row["state"] == "unfinished"
    assert [row[name] for name in COUNTS] == [4, 0, 0, 2]


def test_reading_the_lock_does_not_stop_a_run_from_starting(
    finished: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A reader has the lock for a moment; a starting run waits that long."""
    reading = os.open(finished, os.O_RDONLY)
    fcntl.flock(reading, fcntl.LOCK_SH)
    assert not is_locked(finished)
    waited: list[float] = []

    def wait(seconds: float) -> None:
        waited.append(seconds)
        if len(waited) == 3:
            os.close(reading)

    monkeypatch.setattr("snooker_cli.runs.folder.time.sleep", wait)
    with runs.locked(finished):
        assert is_locked(finished)
    assert len(waited) == 3


def test_an_unknown_run_gets_the_nearest_name(finished: Path, snooker: Snooker) -> None:
    for wanted, near in (("runs/smal", "nearest is runs/small, "), ("elastic", "")):
        (finished.parent / wanted).mkdir(parents=True)  # no run
        ended = snooker("show", wanted)
        assert (ended.code, ended.out) == (2, "")
        assert ("nearest" in ended.err) == bool(near)
        assert near in ended.err


def verified(snooker: Snooker, *arguments: str) -> dict[str, Any]:
    ended = snooker("verify", "small", *arguments, "--json")
    content = dict(json.loads(ended.out))
    assert (ended.code, ended.err) == (1 if content["bad"] else 0, "")
    return content


def test_repeats_that_are_not_done_are_no_error(
    separate: Path, snooker: Snooker, small_config: str
) -> None:
    run = runs.open_run("small")
    run.path(0, [0]).unlink()
    content = verified(snooker)
    assert (content["done"], content["missing"]) == (5, 1)
    made(separate, small_config, "repeats=2")
    content = verified(snooker, "--replay")
    assert (content["done"], content["missing"], content["bad"]) == (3, 1, [])
    made(separate, small_config, "collisions=151", "repeats=3")
    assert [point["to_do"] for point in shown(snooker)["ledger"]] == [3, 3]
    content = verified(snooker, "--replay")
    assert (content["done"], content["shorter"], content["missing"]) == (0, 5, 1)
    assert content["bad"] == []


def test_verifying_needs_no_lock_and_writes_nothing(finished: Path, snooker: Snooker) -> None:
    before = {path: path.stat().st_mtime_ns for path in finished.rglob("*")}
    with runs.locked(finished):
        assert verified(snooker, "--replay")["done"] == 6
    assert {path: path.stat().st_mtime_ns for path in finished.rglob("*")} == before
    assert list(finished.parent.iterdir()) == [finished]


def test_repeats_of_another_engine_version_are_to_do_and_cannot_be_replayed(
    finished: Path, snooker: Snooker
) -> None:
    old = ENGINE_VERSION - 1
    manifest = json.loads((finished / runs.MANIFEST).read_text())
    write_json(finished / runs.MANIFEST, manifest | {"engine_version": old})
    (row,) = listed(snooker)
    assert (row["engine_version"], row["to_do"]) == (old, 6)
    remarks = [
        remark["remark"] for point in shown(snooker)["ledger"] for remark in point["remarks"]
    ]
    assert len(remarks) == 6
    assert all(f"is of engine version {ENGINE_VERSION}, not" in remark for remark in remarks)
    for path in finished.glob("point-*/*.h5"):
        traces, headers = zip(*store.read(path), strict=True)
        source = replace(headers[0].provenance, engine_version=old)
        store.write(path, [*zip(range(3), traces, strict=True)], source)
    assert verified(snooker)["done"] == 6
    ended = snooker("verify", "small", "--replay")
    assert (ended.code, ended.out) == (2, "")
    assert f"holds results of engine version {old}" in ended.err


def nudged(array: np.ndarray, index: int | tuple[int, int]) -> np.ndarray:
    """A copy with the last bit of one number changed."""
    copy = array.copy()
    copy[index] = np.nextafter(copy[index], 99.0)
    return copy


@pytest.mark.parametrize(
    ("part", "column", "index"),
    [
        ("events", "impulse", 20),
        ("finish", "positions", (3, 1)),
        ("start", "velocities", (0, 0)),
    ],
)
def test_a_replay_finds_one_bit(
    part: str, column: str, index: Any, finished: Path, snooker: Snooker
) -> None:
    """Though the file is written with a hash that fits."""
    path = Path("runs/small/point-0001/repeats-0000-0002.h5")
    found = store.read(path)
    traces = {header.repeat: trace for trace, header in found}
    whole: Any = getattr(traces[2], part)
    changed = replace(whole, **{column: nudged(getattr(whole, column), index)})
    traces[2] = replace(traces[2], **{part: changed})
    store.write(path, [*traces.items()], found[0][1].provenance)
    assert verified(snooker)["bad"] == []
    (bad,) = verified(snooker, "--replay", "-j", "1")["bad"]
    assert (bad["point"], bad["repeat"]) == (1, 2)
    assert bad["error"].startswith(f"{path}: simulating repeat 2 again gives other bits; ")


def test_other_words_are_no_other_bits(finished: Path, snooker: Snooker) -> None:
    """Of a file by a snooker that reported less about the same end."""
    path = Path("runs/small/point-0000/repeats-0000-0002.h5")
    found = store.read(path)
    for change, bad in (({"message": "trapped", "accumulation_time": None}, 0), ({"time": 9.0}, 3)):
        traces = [
            (header.repeat, replace(trace, stop=replace(trace.stop, **change)))
            for trace, header in found
        ]
        store.write(path, traces, found[0][1].provenance)
        assert len(verified(snooker, "--replay", "-j", "1")["bad"]) == bad


@pytest.mark.parametrize("record", ["events", "summary"])
def test_every_end_can_be_replayed(record: str, tmp_path: Path, small_config: str) -> None:
    """An end at a time, and at an interrupt."""
    text = small_config.replace("collisions: 150", f"record: {record}")
    run = made(tmp_path / "time", text, "time=3", "repeats=2")
    done(run)
    assert [each.state for each in verify(run, replay=True, workers=2)] == ["done"] * 4
    run = made(tmp_path / "stopped", text, "cor=1", "collisions=150000", "repeats=1")
    cancelled = threading.Event()
    execute(run, workers=1, watcher=StopsAfter(1, cancelled), cancelled=cancelled)
    (verdict,) = verify(run, replay=True, workers=1)
    assert verdict.header is not None
    assert (verdict.state, verdict.header.collisions) == (StopReason.INTERRUPTED, LEAST_EVENTS)


def test_a_file_that_crashes_its_reader_is_one_bad_file(
    finished: Path, snooker: Snooker, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The process ends by the signal of a crash; another one reads the rest."""
    (bad, _), check = finished.glob("point-*/*.h5"), IsolatedChecker.check

    def crashing(checker: IsolatedChecker, path: Path) -> list[RepeatHeader]:
        headers = check(checker, path)
        if path == bad:
            os.kill(checker._process.pid, signal.SIGSEGV)
            return check(checker, path)
        return headers

    monkeypatch.setattr(IsolatedChecker, "check", crashing)
    ended = snooker("verify", str(finished), "-j", "1")
    assert (ended.code, ended.err) == (1, "")
    error, counts = ended.out.splitlines()
    assert error.startswith(f"{bad}: reading it crashes (SIGSEGV); ")
    assert "3 complete repeats, 1 bad file" in counts
