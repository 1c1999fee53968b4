"""``snooker ls``, ``show`` and ``verify``: states of repeats, and what a replay finds."""

from __future__ import annotations

import errno
import json
import os
import re
import shutil
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from command_line import Snooker
from repeating import done, made, stopped

from snooker_cli import runs, store
from snooker_cli.engine import ENGINE_VERSION
from snooker_cli.files import temporary_path, write_json
from snooker_cli.runs import RunFolder
from snooker_cli.runs.folder import record_failure
from snooker_cli.runs.status import run_status
from snooker_cli.runs.verification import verify
from snooker_cli.trace import StopReason

COUNTS = ("done", "running", "failed", "to_do")


def listed(snooker: Snooker) -> list[dict[str, Any]]:
    ended = snooker("ls", "--json")
    assert (ended.code, ended.err) == (0, "")
    return list(json.loads(ended.out))


def shown(snooker: Snooker) -> dict[str, Any]:
    ended = snooker("show", "small", "--json")
    assert (ended.code, ended.err) == (0, "")
    return dict(json.loads(ended.out))


def test_one_bad_run_hides_no_other(
    finished: Path, snooker: Snooker, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever is wrong with it: its manifest, or what the system or this program does with it."""
    broken = finished.with_name("broken")
    copied = Path(shutil.copytree(finished, broken)) / runs.MANIFEST
    manifest = json.loads(copied.read_text())

    def errors() -> list[str]:
        ended = snooker("ls")
        assert ended.code == 0
        assert [line.split()[0] for line in ended.out.splitlines()] == ["run", "small"]
        return ended.err.splitlines()

    manifest["points"][0]["index"] = 10**300
    write_json(copied, manifest)
    (line,) = errors()
    assert line.startswith("snooker: runs/broken/run.json: cannot be read (points[0].index: 1000")
    shutil.copy(finished / runs.MANIFEST, copied)
    for error in (OSError(errno.EIO, "broken", "runs/broken"), KeyError("lost")):

        def read(run: RunFolder, *_: object, error: Exception = error) -> dict[str, Any]:
            if run.directory == Path("runs", "broken"):
                raise error
            return run_status(run)

        monkeypatch.setattr("snooker_cli.api.checks.run_status", read)
        (line,) = errors()
        assert "broken" in line or "lost" in line


@pytest.mark.skipif(not hasattr(time, "tzset"), reason="there are no time zones by name")
def test_a_time_zone_that_is_none_is_no_error(
    finished: Path, snooker: Snooker, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Python knows none that is a day or more from UTC."""
    with monkeypatch.context() as patched:
        patched.setenv("TZ", "UTC+99")
        time.tzset()
        for command in (["ls"], ["show", "small"]):
            ended = snooker(*command)
            assert ended.code == 0
            assert re.search(r"\d{4}-\d\d-\d\d \d\d:\d\d UTC", ended.out)
    time.tzset()


def test_each_repeat_is_in_one_column(separate: Path, snooker: Snooker) -> None:
    """An unfinished file counts as running while the folder is locked; else it is a leftover."""
    run = runs.open_run("small")
    run.path(0, [1]).write_text("not HDF5")
    for point in (0, 1):
        run.path(point, [0]).unlink()
    interrupted = run.path(1, [2])
    ((trace, header),) = store.read(interrupted)
    stop = trace.stop._replace(reason=StopReason.INTERRUPTED, message="cut")
    store.write(interrupted, [(2, replace(trace, stop=stop))], header.provenance)
    record_failure(run, 0, 0, "no room")
    record_failure(run, 1, 1, "of an attempt before; it is done now")
    with runs.locked(separate):
        temporary_path(run.path(1, [0])).touch()
        (row,) = listed(snooker)
        assert (row["state"], *(row[name] for name in COUNTS)) == ("running", 2, 1, 1, 2)
    (row,) = listed(snooker)
    assert (row["state"], *(row[name] for name in COUNTS)) == ("unfinished", 2, 0, 1, 3)
    first, second = shown(snooker)["ledger"]
    assert first["remarks"][0] == {"repeat": 0, "remark": "failed: no room"}
    assert first["remarks"][1]["remark"].startswith("not a readable result of snooker (")
    assert second["remarks"] == [{"repeat": 2, "remark": "cut"}]


@pytest.mark.parametrize("command", ["show small", "run small.yaml"])
def test_a_file_that_may_not_be_read_is_kept(
    command: str, finished: Path, snooker: Snooker, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Permissions hide an intact file: no advice to delete it, and no run replaces it."""
    path, opened = Path("runs/small/point-0001/repeats-0000-0002.h5"), h5py.File
    whole = path.read_bytes()
    os.utime(path)  # so that no header is remembered

    def open_h5(file: Any, *given: Any, **how: Any) -> h5py.File:
        if str(file) == str(path):
            raise PermissionError(13, "Permission denied")
        return opened(file, *given, **how)

    monkeypatch.setattr(h5py, "File", open_h5)
    ended = snooker(*command.split())
    printed = ended.out + ended.err
    sentence = f"{path}: cannot be read (permission denied); check its permissions"
    assert printed.count(sentence) == 1
    assert "delete" not in printed
    assert path.read_bytes() == whole
    assert (ended.code == 2) == command.startswith("run")
    assert not (finished / "failures.jsonl").exists()


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


def test_repeats_of_another_engine_version_are_to_do_and_cannot_be_replayed(
    finished: Path, snooker: Snooker
) -> None:
    old = ENGINE_VERSION - 1
    manifest = json.loads((finished / runs.MANIFEST).read_text())
    write_json(finished / runs.MANIFEST, manifest | {"engine_version": old})
    (row,) = listed(snooker)
    assert (row["engine_version"], row["to_do"]) == (old, 6)
    for point in shown(snooker)["ledger"]:
        for remark in point["remarks"]:
            assert f"is of engine version {ENGINE_VERSION}, not" in remark["remark"]
    for path in finished.glob("point-*/*.h5"):
        traces, headers = zip(*store.read(path), strict=True)
        source = replace(headers[0].provenance, engine_version=old)
        store.write(path, [*zip(range(3), traces, strict=True)], source)
    assert verified(snooker)["done"] == 6
    ended = snooker("verify", "small", "--replay")
    assert (ended.code, ended.out) == (2, "")
    assert f"holds results of engine version {old}" in ended.err


THREE = """
container: {radius: 10.0}
balls:
  list:
    - {position: [-3.0, 0.0], velocity: [1.0, 0.0], radius: 0.5}
    - {position: [0.0, 0.0], velocity: [0.0, 0.0], radius: 0.5}
    - {position: [3.0, 0.0], velocity: [-1.0, 0.0], radius: 0.5}
cor: 0.05
wall_cor: 1.0
collisions: 10000
"""


def test_a_collapse_that_an_older_engine_recorded_as_complete(here: Path, snooker: Snooker) -> None:
    """Engine 8 ended a repeat after 64 collisions for each ball of the scene."""
    run = made(Path("runs/three"), THREE)
    (result,) = done(run)
    assert result.stop is not None
    assert result.stop.reason is StopReason.COLLAPSE
    ((trace, header),) = store.read(path := run.path(0, [0]))
    complete = replace(trace, stop=trace.stop._replace(reason=StopReason.COLLISIONS, balls=()))
    short = replace(complete, events=trace.events[:-1], pair_events=trace.pair_events - 1)
    manifest = json.loads((run.directory / runs.MANIFEST).read_text())
    write_json(run.directory / runs.MANIFEST, manifest | {"engine_version": 8})
    source = replace(header.provenance, engine_version=8)
    for stored, hidden in ((complete, True), (short, False)):
        store.write(path, [(0, stored)], source)
        (row,) = json.loads(snooker("show", "three", "--json").out)["ledger"]
        assert row["ended"] == {"collisions": 1}
        remark = {"repeat": 0, "remark": "has collapsed, which engine version 8 did not recognise"}
        assert row["remarks"] == [remark] * hidden
        reason = StopReason.COLLAPSE if hidden else StopReason.COLLISIONS
        opened = runs.open_run("three")
        assert opened.read(opened.points[0], 0).stop.reason is reason
        compared = snooker("compare", "three").out
        assert ("0 of 1 complete" in compared) is hidden
        assert ("the repeat ended early, in a collapse" in compared) is hidden


@pytest.mark.parametrize(("part", "column"), [("events", "impulse"), ("start", "velocities")])
def test_a_replay_finds_one_bit(part: str, column: str, finished: Path, snooker: Snooker) -> None:
    """Though the file is written with a hash that fits. Other words about an end are no bits.

    The start follows from the config, so that no replay is needed to find another one.
    """
    path = Path("runs/small/point-0001/repeats-0000-0002.h5")
    found = store.read(path)
    traces = {header.repeat: trace for trace, header in found}
    whole: Any = getattr(traces[2], part)
    nudged = getattr(whole, column).copy()
    nudged.flat[3] = np.nextafter(nudged.flat[3], 99.0)
    traces[2] = replace(traces[2], **{part: replace(whole, **{column: nudged})})
    traces[1] = replace(traces[1], stop=traces[1].stop._replace(message="in other words"))
    store.write(path, [*traces.items()], found[0][1].provenance)
    problem = "simulating repeat 2 again gives other bits"
    if part == "start":
        problem = "repeat 2 starts from another scene than the config's"
    else:
        assert verified(snooker)["bad"] == []
    (bad,) = verified(snooker, "--replay", "-j", "1")["bad"]
    assert (bad["point"], bad["repeat"]) == (1, 2)
    assert bad["error"].startswith(f"{path}: {problem}; ")


@pytest.mark.parametrize("record", ["events", "summary"])
def test_every_end_can_be_replayed(record: str, tmp_path: Path, small_config: str) -> None:
    """An end at a time, and at an interrupt."""
    text = small_config.replace("collisions: 150", f"record: {record}")
    run = made(tmp_path / "time", text, "time=3", "repeats=1", "cor=1")
    done(run)
    cut = made(tmp_path / "stopped", text, "cor=1", "collisions=150000", "repeats=1")
    stopped(cut, 1)
    for checked, state in ((run, "done"), (cut, StopReason.INTERRUPTED)):
        (verdict,) = verify(checked, replay=True, workers=1)
        assert verdict.state == state


def test_ls_names_once_what_older_versions_kept_in_runs(finished: Path, snooker: Snooker) -> None:
    former = [finished / "analysis.json", finished / "point-0001" / "exact-0000.json"]
    for path in former:
        path.write_text("{}")
    shutil.copytree(finished, "runs/other")
    ended = snooker("ls")
    assert ended.err == (
        "snooker: 2 runs with analysis.json or point-*/exact-*.json of an older version, which "
        "nothing reads; delete them\n"
    )
    assert snooker("run", "small.yaml", "--fresh", "--no-progress").code == 0
    assert not any(path.exists() for path in former)
