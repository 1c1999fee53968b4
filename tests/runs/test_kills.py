"""The runner as a process: kills and signals, and two of them in one folder."""

from __future__ import annotations

import os
import random
import re
import shutil
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest
from forging import Forged, forge
from repeating import contents, done, made

from snooker_cli import runs, store
from snooker_cli.runs import RepeatState
from snooker_cli.store import RepeatHeader
from snooker_cli.trace import StopReason

pytestmark = pytest.mark.long

KILLS = int(os.environ.get("SNOOKER_KILLS", "5"))
"""How often a run is killed in the test of kills."""

ENDLESS = "repeats=100000"
"""Far more than a process does before it is stopped."""


Process = subprocess.Popen[str] | Forged
"""A `snooker run` under way."""


def arguments(config: Path, directory: Path, *more: str) -> list[str]:
    """Of a `snooker run` with an end far away, unless options give another number of repeats."""
    where, endless = (
        ["--out", str(directory)],
        [] if "repeats" in "".join(more) else ["-o", ENDLESS],
    )
    return ["run", str(config), *where, *endless, "-j", "2", "--no-progress", "--yes", *more]


def started(config: Path, directory: Path, *more: str) -> subprocess.Popen[str]:
    """A real `snooker run` with an end far away."""
    return subprocess.Popen(
        [sys.executable, "-m", "snooker_cli", *arguments(config, directory, *more)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )


def files_in(directory: Path) -> list[Path]:
    return sorted(directory.glob("point-0000/repeats-*.h5"))


def wait_for_files(number: int, directory: Path, process: Process) -> None:
    """Return as soon as this many files exist; looks more often for the last one."""
    while (found := len(files_in(directory))) < number:
        assert process.poll() is None, process.communicate()
        time.sleep(0.002 if found < number - 1 else 0.0002)


def assert_completes(directory: Path, text: str, reference: Path) -> None:
    """What is there is whole, and a run that does the rest gives an uninterrupted run's bits."""
    left = list(directory.glob("point-0000/*"))
    for path in files_in(directory):
        store.read(path)
    last = max(int(path.name.split(".")[0].split("-")[2]) for path in left)
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


# Kills and signals


def wait_for_part(directory: Path, process: Process) -> None:
    """Return as soon as a file is being written; none may be seen of those that are short."""
    number = len(files_in(directory))
    while not list(directory.glob("point-0000/*.part")):
        assert process.poll() is None, process.communicate()
        if len(files_in(directory)) > number + 3:
            return
        time.sleep(0.0002)


def kill(process: Process, directory: Path, chance: random.Random, moment: str) -> None:
    """SIGKILL a run: as files appear or are written, up to about a file's time later, or any time
    from its first instruction on."""
    if moment == "file":
        number = len(files_in(directory)) + chance.randrange(1, 3)
        wait_for_files(number, directory, process)
    elif moment == "part":
        wait_for_part(directory, process)
    else:
        time.sleep(chance.uniform(0.0, 2.0 if moment == "beginning" else 0.1))
    for _ in range(chance.choice([0, chance.randrange(100_000)])):
        pass
    process.kill()
    _, stderr = process.communicate()
    assert process.returncode == -signal.SIGKILL
    assert "Traceback" not in stderr


CHECKPOINTS = ["--checkpoint", "0.0005"]  # minutes


@pytest.mark.parametrize(
    ("collisions", "more"),
    [
        pytest.param(5_000, [], id="short"),
        pytest.param(400_000, [], id="long"),
        pytest.param(400_000, CHECKPOINTS, id="checkpoints"),
        pytest.param(5_000, ["--part"], id="parts"),
        pytest.param(400_000, [*CHECKPOINTS, "--part"], id="parts with checkpoints"),
    ],
)
def test_no_kill_leaves_a_torn_file(
    collisions: int, more: list[str], one_point: str, tmp_path: Path
) -> None:
    """Of batches of about 130 repeats, and of long repeats, which are written as they come.

    Checkpoints only grow.
    """
    chance = random.Random(collisions)
    config, directory = tmp_path / "kill.yaml", tmp_path / "killed"
    text = one_point.replace("collisions: 150", f"collisions: {collisions}")
    config.write_text(text)
    whole: dict[Path, list[RepeatHeader]] = {}
    growing: dict[Path, int] = {}
    with forge(config, tmp_path / "forge") as making:
        for number in range(KILLS):
            share = [f"{number % 2 + 1}/2"] if "--part" in more else []
            if number % 20 == 1:
                process: Process = started(config, directory, *more, *share)
                kill(process, directory, chance, "beginning")
            else:
                moment = chance.choice(["file", "part", "time"])
                process = Forged(making, arguments(config, directory, *more, *share))
                kill(process, directory, chance, moment)
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
    assert "Traceback" not in (tmp_path / "forge" / "talk").read_text()
    if not files_in(directory):  # of kills before the first one alone
        done(made(directory, text, "repeats=1"))
    assert_completes(directory, text, tmp_path / "uninterrupted")
    assert all(store.check(path) == headers for path, headers in whole.items())


def test_no_kill_of_an_extension_loses_a_repeat(one_point: str, tmp_path: Path) -> None:
    """Each extension is killed, and a longer one follows. Every repeat stays or becomes longer."""
    chance = random.Random(1)
    config, directory, step = tmp_path / "extend.yaml", tmp_path / "killed", 20_000 // KILLS
    config.write_text(one_point)
    done(made(directory, one_point, "collisions=2000", "repeats=400"))
    lengths = [2000] * 400
    with forge(config, tmp_path / "forge") as making:
        for number in range(1, KILLS + 1):
            longer = f"collisions={2000 + step * number}"
            more = ["-o", longer, "-o", "repeats=400"]
            before = {path.stat().st_ino for path in files_in(directory)}
            process = Forged(making, arguments(config, directory, *more))
            if number % 2:
                time.sleep(chance.uniform(0.0, 0.2))
            while not number % 2 and process.poll() is None:
                if {path.stat().st_ino for path in files_in(directory)} - before:
                    break
            process.kill()
            process.communicate()
            run = runs.open_run(directory)
            now = [trace.collisions for trace in run.traces(run.points[0])]
            assert len(now) == 400
            assert all(new >= old for new, old in zip(now, lengths, strict=True))
            lengths = now
    assert "Traceback" not in (tmp_path / "forge" / "talk").read_text()
    assert_completes(
        directory,
        one_point.replace("collisions: 150", longer.replace("=", ": ")),
        tmp_path / "uninterrupted",
    )


# Two processes in one folder


MEETINGS = int(os.environ.get("SNOOKER_MEETINGS", "6"))
"""How often two processes meet in a folder."""

READERS = ["fit", "compare", "verify", "show", "ls", "export", "plot"]


def ended(process: Forged) -> int:
    process.communicate()
    assert process.returncode is not None
    return process.returncode


@pytest.mark.parametrize("meeting", ["both run", "one is killed", "one extends, one reads"])
def test_two_processes_meet_in_one_folder(meeting: str, one_point: str, tmp_path: Path) -> None:
    """One has the lock, and the other ends with a sentence; what is read is whole."""
    chance, config, directory = random.Random(meeting), tmp_path / "c.yaml", tmp_path / "shared"
    config.write_text(one_point)
    with forge(config, tmp_path / "first") as one, forge(config, tmp_path / "second") as other:
        for number in range(1, MEETINGS + 1):
            reads = "reads" in meeting
            limits = [f"collisions={1000 * number if reads else 20_000}", "repeats=40"]
            if not reads or number == 1:
                shutil.rmtree(directory, ignore_errors=True)
            if number == 1 and reads:
                done(made(directory, one_point, "collisions=500", "repeats=40"))
            run = arguments(config, directory, "-o", limits[0], "-o", limits[1])
            first = Forged(one, run)
            time.sleep(chance.choice([0.0, chance.uniform(0.0, 0.3)]))
            reader = READERS[number % len(READERS)]
            to = ["--out", str(tmp_path / "out.csv")] if reader == "export" else []
            words = [reader, str(directory), *(["energy"] if reader == "plot" else []), *to]
            second = Forged(other, words if reads else run)
            if meeting == "one is killed":
                time.sleep(chance.uniform(0.0, 0.2))
                with suppress(ProcessLookupError):
                    first.kill()
            codes = ended(first), ended(second)
            expected = {
                "both run": [(0, 0), (0, 2), (2, 0)],
                "one is killed": [(-9, 0), (-9, 2), (0, 0), (0, 2), (2, 0)],
            }.get(meeting, [(0, 0), (0, 1)])
            assert codes in expected
            text = one_point.replace("collisions: 150", limits[0].replace("=", ": "))
            if not files_in(directory):  # of a kill before the first one
                done(made(directory, text, limits[1]))
            assert_completes(directory, text, tmp_path / f"alone {number if reads else 0}")
    for folder in ("first", "second"):
        talk = (tmp_path / folder / "talk").read_text()
        assert not re.search("Traceback|a bug in snooker", talk), talk
        for line in talk.splitlines():
            assert re.match("snooker: ", line), talk
            assert "repeats-" not in line or "is longer than the run was; give" in line, talk
