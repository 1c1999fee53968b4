"""The runner as a process that is killed: no file is torn, and a later run completes it."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
from repeating import contents, done, made

from snooker_cli import runs, store
from snooker_cli.runs import RepeatState
from snooker_cli.store import RepeatHeader
from snooker_cli.trace import StopReason

pytestmark = pytest.mark.long

KILLS = int(os.environ.get("SNOOKER_KILLS", "5"))
"""How often a run is killed in a test."""

STARTING = 1.5
"""Seconds in which a process has loaded all and has begun to simulate."""

ENDLESS = "repeats=100000"
"""Far more than a process does before it is stopped."""

Process = subprocess.Popen[Any]


def started_run(config: Path, directory: Path, *more: str) -> Process:
    """A `snooker run` under way."""
    command = [sys.executable, "-m", "snooker_cli", "run", str(config), "--out", str(directory)]
    return subprocess.Popen(
        [*command, "-j", "2", "--no-progress", "--yes", *more],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )


def killed(process: Process) -> None:
    """Kill a process, unless it has ended; it must not have met a bug."""
    process.kill()
    _, talk = process.communicate()
    assert "Traceback" not in talk, talk


def files_in(directory: Path) -> list[Path]:
    return sorted(directory.glob("point-0000/repeats-*.h5"))


def wait_for_files(number: int, directory: Path, process: Process) -> None:
    """Return as soon as this many files exist; looks more often for the last one."""
    while (there := len(files_in(directory))) < number:
        assert process.poll() is None, process.communicate()
        time.sleep(0.002 if there < number - 1 else 0.0002)


def wait_for_part(directory: Path, process: Process) -> None:
    """Return as soon as a file is being written; none may be seen of those that are short."""
    number = len(files_in(directory))
    while not list(directory.glob("point-0000/*.part")):
        assert process.poll() is None, process.communicate()
        if len(files_in(directory)) > number + 3:
            return
        time.sleep(0.0002)


def assert_completes(directory: Path, text: str, reference: Path) -> None:
    """What is there is whole, and a run that does the rest gives an uninterrupted run's bits."""
    left = list(directory.glob("point-0000/*"))
    for path in files_in(directory):
        store.read(path)
    last = max((int(path.name.split(".")[0].split("-")[2]) for path in left), default=0)
    repeats = f"repeats={last + 1}"
    run = made(directory, text, repeats)
    kept = [status.repeat for status in run.statuses(0) if status.state is RepeatState.DONE]
    with runs.locked(directory):
        outcomes = done(run, workers=2)
    assert [result.repeat for result in outcomes if result.cached] == kept
    assert not list(directory.rglob("*.part"))
    uninterrupted = made(reference, text, repeats)
    done(uninterrupted)
    assert contents(run) == contents(uninterrupted)


CHECKPOINTS = ["--checkpoint", "0.0005"]  # minutes


@pytest.mark.parametrize(
    ("collisions", "more"),
    [
        pytest.param(5_000, [], id="short"),
        pytest.param(400_000, [*CHECKPOINTS, "--part"], id="long, checkpoints, parts"),
    ],
)
def test_no_kill_leaves_a_torn_file(
    collisions: int, more: list[str], one_point: str, tmp_path: Path
) -> None:
    """Of batches of about 130 repeats, and of long repeats, which are written as they come.

    Kills are as files appear or are written, or any time from the first instruction on. Checkpoints
    only grow.
    """
    chance = random.Random(collisions)
    config, directory = tmp_path / "kill.yaml", tmp_path / "killed"
    text = one_point.replace("collisions: 150", f"collisions: {collisions}")
    config.write_text(text)
    whole: dict[Path, list[RepeatHeader]] = {}
    growing: dict[Path, int] = {}
    for number in range(KILLS):
        share = [f"{number % 2 + 1}/2"] if "--part" in more else []
        process = started_run(config, directory, "-o", ENDLESS, *more, *share)
        moment = chance.choice(["file", "part", "time"])
        if moment == "file":
            wait_for_files(len(files_in(directory)) + chance.randrange(1, 3), directory, process)
        elif moment == "part":
            wait_for_part(directory, process)
        else:
            time.sleep(chance.uniform(0.0, STARTING))
        killed(process)
        assert process.returncode == -signal.SIGKILL
        there = files_in(directory)
        assert whole.keys() | growing.keys() <= set(there)
        for path in set(there) - whole.keys():
            headers = store.check(path)
            if headers[0].stop.reason is not StopReason.INTERRUPTED:
                whole[path] = headers
                continue
            assert headers[0].collisions >= growing.get(path, 0)
            growing[path] = headers[0].collisions
    assert (CHECKPOINTS[0] in more) or not growing
    assert_completes(directory, text, tmp_path / "uninterrupted")
    assert all(store.check(path) == headers for path, headers in whole.items())
