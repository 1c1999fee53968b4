"""``snooker verify``: what is bad is found, and nothing else."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from repeating import StopsAfter, done, made

from snooker_cli import runs, store
from snooker_cli.engine import ENGINE_VERSION
from snooker_cli.engine.clock import LEAST_EVENTS
from snooker_cli.files import write_json
from snooker_cli.runs.execution import execute
from snooker_cli.runs.verification import verify
from snooker_cli.trace import StopReason, Trace

Snooker = Callable[..., Any]


def verified(snooker: Snooker, *arguments: str) -> dict[str, Any]:
    ended = snooker("verify", "small", *arguments, "--json")
    content = dict(json.loads(ended.out))
    assert (ended.code, ended.err) == (1 if content["bad"] else 0, "")
    return content


@pytest.mark.parametrize("options", [[], ["--replay"], ["--replay", "-j", "1"]])
def test_a_whole_run_is_whole(options: list[str], finished: Path, snooker: Snooker) -> None:
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
    how = "read and simulated again" if options else "read again"
    assert snooker("verify", "small", *options).out == f"runs/small: 6 complete repeats, {how}\n"


@pytest.mark.parametrize("record", ["events", "summary"])
def test_other_ends_and_records_are_simulated_again_too(
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
    ("change", "said"),
    [
        (nudge, "simulating it again gives other bits"),
        (nudge_finish, "simulating it again gives other bits"),
        (nudge_start, "its start is not the one that its config gives"),
    ],
)
def test_a_replay_finds_one_bit(
    change: Callable[[Trace], Trace], said: str, finished: Path, snooker: Snooker
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
    assert first == bad["error"] == f"{relative}: {said}; delete it and run again"
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
    for line, (path, said) in zip(lines, expected, strict=False):
        assert line.startswith(f"{path.relative_to(finished.parents[1])}: {said}"), line
    assert lines[4:] == ["runs/small: 3 complete repeats, 4 bad files, read again"]


def test_what_is_not_done_is_no_fault(finished: Path, snooker: Snooker, small_config: str) -> None:
    run = runs.open_run("small")
    run.path(0, 0).unlink()
    content = verified(snooker)
    assert (content["done"], content["missing"]) == (5, 1)
    made(finished, small_config, "repeats=2")
    content = verified(snooker, "--replay")
    assert (content["done"], content["missing"], content["bad"]) == (5, 1, [])
    assert snooker("verify", "small").out.splitlines()[1:] == [
        "1 missing; run the config again to complete them"
    ]
    made(finished, small_config, "collisions=151", "repeats=3")
    content = verified(snooker, "--replay")
    assert (content["done"], content["shorter"], content["missing"]) == (0, 5, 1)
    assert content["bad"] == []


@pytest.mark.parametrize("record", ["events", "summary"])
def test_an_interrupted_repeat_is_simulated_as_far_as_it_went(
    record: str, tmp_path: Path, small_config: str
) -> None:
    overrides = ("cor=1", "collisions=150000", "repeats=1", f"record={record}")
    run = made(tmp_path, small_config, *overrides)
    cancelled = threading.Event()
    execute(run, workers=1, watcher=StopsAfter(1, cancelled), cancelled=cancelled)
    (verdict,) = verify(run, replay=True, workers=1)
    assert verdict.header is not None
    assert (verdict.state, verdict.header.collisions) == (StopReason.INTERRUPTED, LEAST_EVENTS)


def test_another_engine_versions_bits_cannot_be_made_again(
    finished: Path, snooker: Snooker
) -> None:
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
