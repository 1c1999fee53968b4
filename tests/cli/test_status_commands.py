"""``snooker ls``, ``show`` and ``verify``: states of repeats, and every bad file is found."""

from __future__ import annotations

import fcntl
import json
import os
import shutil
import subprocess
import sys
import threading
from collections.abc import Callable
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import Snooker
from repeating import StopsAfter, done, made

from snooker_cli import runs, store
from snooker_cli.engine import ENGINE_VERSION
from snooker_cli.engine.clock import LEAST_EVENTS
from snooker_cli.files import temporary_path, write_json
from snooker_cli.runs.execution import execute
from snooker_cli.runs.folder import note_failure
from snooker_cli.runs.status import run_status
from snooker_cli.runs.verification import verify
from snooker_cli.trace import StopReason, Trace

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
    trace, header = store.read(path)
    stop = replace(trace.stop, reason=StopReason.INTERRUPTED, message="cut")
    store.write(path, replace(trace, stop=stop), header.provenance)


def test_a_finished_run_is_done(finished: Path, snooker: Snooker) -> None:
    (one,) = listed(snooker)
    run = runs.open_run("small")
    collisions = sum(trace.collisions for point in run.points for trace in run.traces(point))
    files = list(finished.glob("point-*/*.h5"))
    assert [one[name] for name in COUNTS] == [6, 0, 0, 0]
    assert (one["run"], one["state"]) == ("runs/small", "done")
    assert (one["points"], one["repeats"], one["collisions"]) == (2, 3, collisions)
    assert (one["files"], one["bytes"]) == (6, sum(path.stat().st_size for path in files))
    assert one["engine_version"] == ENGINE_VERSION
    last = datetime.fromisoformat(one["last_file"]).timestamp()
    assert 0 <= max(path.stat().st_mtime for path in files) - last < 1


def test_each_repeat_is_in_one_column(finished: Path, snooker: Snooker) -> None:
    run = runs.open_run("small")
    run.path(0, 0).unlink()
    run.path(0, 1).write_text("not HDF5")
    run.path(1, 1).unlink()
    interrupt(run.path(1, 2))
    note_failure(run, 0, 0, "no room")
    note_failure(run, 1, 0, "of an attempt before; it is done now")
    with (finished / runs.FAILURES).open("a") as file:
        file.write('{"point": 1, "repeat": 1, "err')  # a kill while it was written
    (one,) = listed(snooker)
    assert one["state"] == "unfinished"
    assert [one[name] for name in COUNTS] == [2, 0, 1, 3]
    first, second = shown(snooker)["ledger"]
    assert [first[name] for name in COUNTS] == [1, 0, 1, 1]
    assert [second[name] for name in COUNTS] == [1, 0, 0, 2]
    assert first["remarks"][0] == {"repeat": 0, "remark": "failed: no room"}
    assert first["remarks"][1]["remark"].startswith("not a readable result of snooker (")
    assert second["remarks"] == [{"repeat": 2, "remark": "cut"}]


def test_show_has_ends_analyses_and_the_command(finished: Path, snooker: Snooker) -> None:
    assert snooker("fit", "small").code == 0
    content = shown(snooker)
    run = runs.open_run("small")
    assert [point["parameters"] for point in content["ledger"]] == [{"cor": 0.85}, {"cor": 1.0}]
    for point, one in zip(run.points, content["ledger"], strict=True):
        reasons = [str(trace.stop.reason) for trace in run.traces(point)]
        assert one["ended"] == {reason: reasons.count(reason) for reason in reasons}
    assert content["analyses"] == ["fit.json"]
    commands = {
        store.read_header(path).provenance.command for path in finished.glob("point-*/*.h5")
    }
    assert {content["command"]} == commands


def test_a_locked_folder_is_running(finished: Path, snooker: Snooker) -> None:
    """The lock counts, and the unfinished file; without the lock the file is a leftover."""
    run = runs.open_run("small")
    run.path(1, 0).unlink()
    with runs.locked(finished):
        temporary_path(run.path(1, 0)).touch()
        (one,) = listed(snooker)
        assert one["state"] == "running"
        assert [one[name] for name in COUNTS] == [5, 1, 0, 0]
    (one,) = listed(snooker)
    assert one["state"] == "unfinished"
    assert [one[name] for name in COUNTS] == [5, 0, 0, 1]


def test_reading_the_lock_does_not_stop_a_run_from_starting(
    finished: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A reader has the lock for a moment; a starting run waits that long."""
    reading = os.open(finished, os.O_RDONLY)
    fcntl.flock(reading, fcntl.LOCK_SH)
    assert not runs.is_locked(finished)
    waited: list[float] = []

    def wait(seconds: float) -> None:
        waited.append(seconds)
        if len(waited) == 3:
            os.close(reading)

    monkeypatch.setattr("snooker_cli.runs.folder.time.sleep", wait)
    with runs.locked(finished):
        assert runs.is_locked(finished)
    assert len(waited) == 3


def test_repeats_of_another_engine_version_are_to_do(finished: Path, snooker: Snooker) -> None:
    manifest = json.loads((finished / runs.MANIFEST).read_text())
    manifest["engine_version"] = ENGINE_VERSION - 1
    write_json(finished / runs.MANIFEST, manifest)
    (one,) = listed(snooker)
    assert one["engine_version"] == ENGINE_VERSION - 1
    assert one["to_do"] == 6
    remarks = [each["remark"] for point in shown(snooker)["ledger"] for each in point["remarks"]]
    assert len(remarks) == 6
    assert all(f"is of engine version {ENGINE_VERSION}, not" in remark for remark in remarks)


def test_an_extended_run_has_its_shorter_repeats_to_do(
    finished: Path, snooker: Snooker, small_config: str
) -> None:
    book = run_status(made(finished, small_config, "collisions=151"))
    assert [point.to_do for point in book.points] == [3, 3]
    assert {sentence for point in book.points for _, sentence in point.remarks} == {
        "is shorter than the extended run"
    }


def test_a_folder_that_is_no_run_is_not_listed(finished: Path, snooker: Snooker) -> None:
    (finished.parent / "report").mkdir()
    (finished.parent / "broken").mkdir()
    (finished.parent / "broken" / runs.MANIFEST).write_text("{")
    ended = snooker("ls")
    assert ended.code == 0
    assert len(ended.out.splitlines()) == 2
    broken, small = json.loads(snooker("ls", "--json").out)
    assert (broken["run"], small["run"]) == ("runs/broken", "runs/small")
    assert broken["error"] in ended.err


@pytest.mark.parametrize(
    ("wanted", "near"),
    [("smal", "small"), ("runs/smal", "runs/small"), ("elastic", ""), ("other/small", "")],
)
def test_an_unknown_run_gets_the_nearest_name(
    wanted: str, near: str, finished: Path, snooker: Snooker
) -> None:
    (finished.parent / wanted).mkdir(parents=True)  # no run
    ended = snooker("show", wanted)
    assert (ended.code, ended.out) == (2, "")
    assert (f"nearest is {near}, " in ended.err) == bool(near)
    assert not near or snooker("show", near).code == 0


def verified(snooker: Snooker, *arguments: str) -> dict[str, Any]:
    ended = snooker("verify", "small", *arguments, "--json")
    content = dict(json.loads(ended.out))
    assert (ended.code, ended.err) == (1 if content["bad"] else 0, "")
    return content


@pytest.mark.parametrize("options", [[], ["--replay"], ["--replay", "-j", "1"]])
def test_a_complete_run_has_no_bad_file(
    options: list[str], finished: Path, snooker: Snooker
) -> None:
    content = verified(snooker, *options)
    assert content == {
        "run": "runs/small",
        "replayed": "--replay" in options,
        "done": 6,
        "interrupted": 0,
        "shorter": 0,
        "missing": 0,
        "bad": [],
    }


@pytest.mark.parametrize("record", ["events", "summary"])
def test_ends_at_a_time_and_summaries_are_replayed(
    record: str, tmp_path: Path, small_config: str
) -> None:
    text = small_config.replace("collisions: 150", f"record: {record}")
    run = made(tmp_path, text, "time=3", "repeats=2")
    done(run)
    assert [each.state for each in verify(run, replay=True, workers=2)] == ["done"] * 4


def rewrite(path: Path, change: Callable[[Trace], Trace]) -> None:
    """Change a repeat and write it with a hash that fits: only a replay can know."""
    trace, header = store.read(path)
    store.write(path, change(trace), header.provenance)


def nudge(trace: Trace) -> Trace:
    """The last bit of one impulse."""
    events = trace.events
    assert events is not None
    impulse = events.impulse.copy()
    impulse[20] = np.nextafter(impulse[20], 0.0)
    return replace(trace, events=replace(events, impulse=impulse))


def nudge_finish(trace: Trace) -> Trace:
    places = trace.finish.positions.copy()
    places[3, 1] = np.nextafter(places[3, 1], 9.0)
    finish = replace(trace.finish, positions=places)
    return replace(trace, finish=finish)


def nudge_start(trace: Trace) -> Trace:
    motions = trace.start.velocities.copy()
    motions[0, 0] = np.nextafter(motions[0, 0], 99.0)
    start = replace(trace.start, velocities=motions)
    return replace(trace, start=start)


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        (nudge, "simulating it again gives other bits"),
        (nudge_finish, "simulating it again gives other bits"),
        (nudge_start, "its start is not the one that its config gives"),
    ],
)
def test_a_replay_finds_one_bit(
    change: Callable[[Trace], Trace], problem: str, finished: Path, snooker: Snooker
) -> None:
    path = finished / "point-0001" / "repeat-0002.h5"
    rewrite(path, change)
    assert verified(snooker)["bad"] == []
    (bad,) = verified(snooker, "--replay")["bad"]
    assert (bad["point"], bad["repeat"]) == (1, 2)
    ended = snooker("verify", "small", "--replay")
    assert ended.code == 1
    first, last = ended.out.splitlines()
    relative = path.relative_to(finished.parents[1])
    assert first == bad["error"] == f"{relative}: {problem}; delete it and run again"
    assert last == "runs/small: 5 complete repeats, 1 bad file, read and simulated again"


def test_every_bad_file_has_its_line(finished: Path, snooker: Snooker) -> None:
    """By a real process: truncated, flipped, foreign, and not where they belong."""
    files = sorted(finished.glob("point-*/*.h5"))
    files[0].write_bytes(files[0].read_bytes()[:-500])
    image = bytearray(files[1].read_bytes())
    image[image.index(store.read(files[1])[0].start.positions.tobytes()) + 9] ^= 4
    files[1].write_bytes(image)
    shutil.copy(files[4], files[3])
    extra = finished / "point-0007" / "repeat-0000.h5"
    extra.parent.mkdir()
    shutil.copy(files[5], extra)
    found = subprocess.run(
        [sys.executable, "-m", "snooker_cli", "verify", "small"],
        cwd=finished.parents[1],
        capture_output=True,
        text=True,
        check=False,
    )
    assert (found.returncode, found.stderr) == (1, "")
    lines = found.stdout.splitlines()
    expected = [
        (files[0], "not a readable result of snooker"),
        (files[1], "its content has changed since it was written"),
        (files[3], "is repeat 1 of point 1"),
        (extra, "belongs to no point of this run"),
    ]
    for line, (path, problem) in zip(lines, expected, strict=False):
        assert line.startswith(f"{path.relative_to(finished.parents[1])}: {problem}"), line
    assert lines[4:] == ["runs/small: 3 complete repeats, 4 bad files, read again"]


def test_repeats_that_are_not_done_are_no_error(
    finished: Path, snooker: Snooker, small_config: str
) -> None:
    run = runs.open_run("small")
    run.path(0, 0).unlink()
    content = verified(snooker)
    assert (content["done"], content["missing"]) == (5, 1)
    made(finished, small_config, "repeats=2")
    content = verified(snooker, "--replay")
    assert (content["done"], content["missing"], content["bad"]) == (5, 1, [])
    made(finished, small_config, "collisions=151", "repeats=3")
    content = verified(snooker, "--replay")
    assert (content["done"], content["shorter"], content["missing"]) == (0, 5, 1)
    assert content["bad"] == []


@pytest.mark.parametrize("record", ["events", "summary"])
def test_an_interrupted_repeat_is_replayed_up_to_its_end(
    record: str, tmp_path: Path, small_config: str
) -> None:
    overrides = ("cor=1", "collisions=150000", "repeats=1", f"record={record}")
    run = made(tmp_path, small_config, *overrides)
    cancelled = threading.Event()
    execute(run, workers=1, watcher=StopsAfter(1, cancelled), cancelled=cancelled)
    (verdict,) = verify(run, replay=True, workers=1)
    assert verdict.header is not None
    assert (verdict.state, verdict.header.collisions) == (StopReason.INTERRUPTED, LEAST_EVENTS)


def test_another_engine_version_cannot_be_replayed(finished: Path, snooker: Snooker) -> None:
    manifest = json.loads((finished / runs.MANIFEST).read_text())
    manifest["engine_version"] = old = ENGINE_VERSION - 1
    write_json(finished / runs.MANIFEST, manifest)
    for path in finished.glob("point-*/*.h5"):
        trace, header = store.read(path)
        store.write(path, trace, replace(header.provenance, engine_version=old))
    assert verified(snooker)["done"] == 6
    ended = snooker("verify", "small", "--replay")
    assert (ended.code, ended.out) == (2, "")
    assert f"holds results of engine version {old}" in ended.err


def test_verifying_needs_no_lock_and_writes_nothing(finished: Path, snooker: Snooker) -> None:
    before = {path: path.stat().st_mtime_ns for path in finished.rglob("*")}
    with runs.locked(finished):
        assert verified(snooker, "--replay")["done"] == 6
    assert {path: path.stat().st_mtime_ns for path in finished.rglob("*")} == before
    assert list(finished.parent.iterdir()) == [finished]
