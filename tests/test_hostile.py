"""Every command ends with a sentence, soon and in little memory, whatever files it is given."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import threading
import time
import warnings
from pathlib import Path

import h5py
import hostile
import pytest
import repeating
from command_line import SMALL, Snooker

from snooker_cli import store
from snooker_cli.engine import simulation
from snooker_cli.errors import StoreError
from snooker_cli.runs import Run
from snooker_cli.runs.execution import execute
from snooker_cli.store import hdf5
from snooker_cli.trace import SERIES_UNITS

CODES = range(6)
REPEATS = Path("point-0000") / "repeats-0000-0002.h5"
SOUND = ("stop: message", "provenance: command", "provenance: config", "far", "fast")
"""Names of what `verify` need not blame: text that is only shown or never read, and large numbers.
"""

SHARE = 24
"""Of all files, each command is tried on one in 24, and on all in long tests."""
SECONDS, BYTES = 10.0, 10**9
LIBRARIES = 300_000_000
"""Bytes that Python and the libraries take in a process of its own."""

BOMB = "a chunk has another size than it declares: a bomb"
COMMAND = f"provenance: command {json.dumps(hostile.ESCAPES)[:12]}"
INNER = r"\u2066\r\n\u200b"
"""The line break in ``hostile.ESCAPES``, as it is printed."""

COMMANDS = [
    "ls",
    "show small",
    "verify small",
    "verify small --replay",
    "fit small",
    "compare small",
    "plot small energy --out drawn",
    "export small --out events.csv",
    "export small --states --out states.csv",
    "animate small --out film.html",
    "run small.yaml --no-progress --yes",
]


def resident(name: str = "VmHWM") -> int:
    """Bytes of this process in memory; by default the most since ``forget_peak``."""
    status = Path("/proc/self/status").read_text()
    (kilobytes,) = re.findall(rf"{name}:\s*(\d+) kB", status)
    return 1024 * int(kilobytes)


def forget_peak() -> None:
    """https://docs.kernel.org/filesystems/proc.html, clear_refs."""
    Path("/proc/self/clear_refs").write_text("5")


def check(snooker: Snooker, command: str, name: str) -> int:
    """Run a command on files of that name and check how it ends; its exit code."""
    forget_peak()
    before, begun = resident("VmRSS"), time.process_time()
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)  # NumPy's, which a user would see
        ended = snooker(*command.split())
    taken = time.process_time() - begun  # other work on the machine does not count
    more = resident() - before
    printed = ended.out + ended.err
    assert ended.code in CODES, (command, name, printed)
    assert not re.search("Traceback|a bug in snooker", printed), (command, name, printed)
    assert printed.replace("\n", "").isprintable(), (command, name, printed)
    assert taken < SECONDS, (command, name, taken)
    assert more + LIBRARIES < BYTES, (command, name, more)
    return ended.code


@pytest.fixture(scope="module")
def repeats(finished_run: Run, tmp_path_factory: pytest.TempPathFactory) -> hostile.Corpus:
    folder = tmp_path_factory.mktemp("repeats")
    return hostile.Corpus(finished_run.directory / REPEATS, folder, hostile.REPEATS)


@pytest.fixture(scope="module")
def manifests(finished_run: Run, tmp_path_factory: pytest.TempPathFactory) -> hostile.Corpus:
    folder = tmp_path_factory.mktemp("manifests")
    return hostile.Corpus(finished_run.directory / "run.json", folder, hostile.MANIFESTS)


def test_reading_refuses_a_file_for_what_is_wrong(finished: Path, repeats: hostile.Corpus) -> None:
    """Not for a hash, which whoever changes a file can make again."""
    path = finished / REPEATS
    for name in repeats.each(path, slice(None)):
        if reason := hostile.REASONS.get(name):
            with pytest.raises(StoreError) as refused:
                store.check(path)
            assert reason in refused.value.reason, name


def test_reading_refuses_a_summary_for_what_is_wrong(warm: Run, tmp_path: Path) -> None:
    """The reason has the name of the wrong column."""
    names = [*SERIES_UNITS, "speed_histogram"]
    columns = {key: d for key, d in hostile.KINDS["summary"].items() if key.split(": ")[0] in names}
    corpus = hostile.Corpus(warm.batches(0)[0], tmp_path, columns)
    assert len(corpus.kept) > 4 * len(SERIES_UNITS)
    for key, content in corpus.kept.items():
        (tmp_path / "file.h5").write_bytes(content)
        column = key.partition(":")[0]
        with pytest.raises(StoreError, match=f"wrong {column} of a summary|wrong end of a summary"):
            store.check(tmp_path / "file.h5")


@pytest.mark.parametrize("name", ["text", "sequence"])
def test_types_come_before_values(name: str, finished: Path, repeats: hostile.Corpus) -> None:
    """HDF5 may crash on values of variable length. Headers are read without the other types."""
    path, reason = finished / REPEATS, "has neither numbers nor text of fixed length"
    path.write_bytes(repeats.kept[f"{reason}: {name} of parameters/snooker"])
    with h5py.File(path) as file, pytest.raises(ValueError, match="text of fixed length"):
        hdf5.read_attribute(file, "parameters/snooker", "scene")
    path.write_bytes(repeats.kept[f"{reason}: {name} of unread"])
    assert len(store.read_headers(path)) == 3


SHARES = [pytest.param(SHARE, id="some"), pytest.param(1, id="all", marks=pytest.mark.long)]


@pytest.mark.parametrize("share", SHARES)
@pytest.mark.parametrize("command", COMMANDS)
def test_hostile_repeats(
    command: str, share: int, finished: Path, repeats: hostile.Corpus, snooker: Snooker
) -> None:
    path = finished / REPEATS
    before = {each: each.read_bytes() for each in path.parent.iterdir()}
    for name in repeats.each(path, slice(COMMANDS.index(command) % share, None, share)):
        code = check(snooker, command, name)
        if command.startswith("verify"):
            assert code == 1 or name.startswith(SOUND), (command, name)
        for other in set(path.parent.iterdir()) - before.keys():
            other.unlink()


@pytest.mark.parametrize("share", SHARES)
@pytest.mark.parametrize("command", [*COMMANDS, "run small.yaml --no-progress --fresh"])
def test_hostile_manifests(
    command: str, share: int, finished: Path, manifests: hostile.Corpus, snooker: Snooker
) -> None:
    for name in manifests.each(finished / "run.json", slice(len(command) % share, None, share)):
        check(snooker, command, name)


@pytest.mark.parametrize("size", [1 << 12, pytest.param(250_000, marks=pytest.mark.long)])
@pytest.mark.parametrize("command", ["validate any.yaml", "run any.yaml --dry-run --yes"])
def test_hostile_configs(command: str, size: int, here: Path, snooker: Snooker) -> None:
    for name, content in hostile.configs(size).items():
        hostile.text(content)(here / "any.yaml")
        assert check(snooker, command, name) == 3, name


@pytest.mark.parametrize("command", ["export", pytest.param("verify", marks=pytest.mark.long)])
def test_little_memory_is_taken(command: str, finished: Path, repeats: hostile.Corpus) -> None:
    """A small process starts the command: at first a child has all memory of its parent."""
    (finished / REPEATS).write_bytes(repeats.kept[BOMB])
    arguments = [sys.executable, "-m", "snooker_cli", command, "runs/small"]
    measured = "done = subprocess.run(sys.argv[1:], stdout=2, check=False).returncode"
    used = "print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss, done)"
    small = [sys.executable, "-c", f"import resource, subprocess, sys; {measured}; {used}"]
    ended = subprocess.run([*small, *arguments], capture_output=True, text=True, check=True)
    kilobytes, code = map(int, ended.stdout.split())
    assert code == 1
    assert "a chunk has another size than it declares" in ended.stderr
    assert 1024 * kilobytes < BYTES


KINDS = {
    "summary": SMALL.replace("150", "1000") + "record: summary\n",
    **{
        shape: SMALL.replace("{radius: 10.0, mass: 1.0e7}", f"{{shape: {shape}, {size}}}").replace(
            "rings: 1", "count: 7"
        )
        for shape, size in (("box", "width: 20, height: 14"), ("periodic", "width: 30, height: 20"))
    },
}


@pytest.mark.parametrize("share", SHARES)
@pytest.mark.parametrize("kind", KINDS)
def test_hostile_summaries_and_boxes(kind: str, share: int, here: Path, snooker: Snooker) -> None:
    """Each command on some files, or on all."""
    (here / "small.yaml").write_text(KINDS[kind])
    assert snooker("run", "small.yaml", "--no-progress").code == 0
    path = here / "runs" / "small" / REPEATS
    corpus = hostile.Corpus(path, here / "corpus", hostile.KINDS[kind])
    for number, command in enumerate(COMMANDS):
        for name in corpus.each(path, slice(number % share, None, share)):
            code = check(snooker, command, name)
            if command.startswith("verify"):
                assert code == 1 or name in SOUND, (command, name)


def test_a_wrong_checkpoint_concerns_only_run(
    here: Path, snooker: Snooker, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What was simulated before the interrupt is read as if the checkpoint were good."""
    (here / "small.yaml").write_text(SMALL.replace("150", "30000").replace("[0.85, 1.0]", "[1.0]"))
    monkeypatch.setattr(simulation, "CHUNK", 5000)
    run = repeating.made(here / "runs" / "small", (here / "small.yaml").read_text(), "repeats=1")
    cancelled = threading.Event()
    watcher = repeating.StopsAfter(9000, cancelled)
    execute(run, workers=1, watcher=watcher, cancelled=cancelled)
    path = repeating.file_of(run, 0, 0)
    good = path.read_bytes()
    assert store.read_checkpoint(path)
    corpus = hostile.Corpus(path, here / "corpus", hostile.CHECKPOINTS)
    readers = ("verify small --replay", "fit small", "export small")
    expected = {command: snooker(*command.split()) for command in readers}
    for name, content in corpus.kept.items():
        for command in readers:
            path.write_bytes(content)
            assert snooker(*command.split()) == expected[command], (command, name)
        check(snooker, "run small.yaml --no-progress -o repeats=1", name)
        assert repeating.done(run)[0].cached
        path.write_bytes(good)


@pytest.mark.parametrize(
    "share", [pytest.param(60, id="some"), pytest.param(6, id="more", marks=pytest.mark.long)]
)
@pytest.mark.parametrize("command", ["animate small --out film.gif --seconds 1", "report small"])
def test_slow_commands(
    command: str, share: int, finished: Path, repeats: hostile.Corpus, snooker: Snooker
) -> None:
    path = finished / REPEATS
    for name in repeats.each(path, slice(0, None, share)):
        assert check(snooker, command, name) in (1, 2) or name.startswith(SOUND), name


@pytest.mark.parametrize("command", ["verify small", "run small.yaml --no-progress", "fit small"])
def test_a_text_of_a_file_has_no_power_over_a_terminal(
    command: str, finished: Path, repeats: hostile.Corpus, snooker: Snooker
) -> None:
    """In a result, in a notice, and in the message of an error."""
    (finished / REPEATS).write_bytes(repeats.kept["version: text"])
    ended = snooker(*command.split())
    printed = ended.out + ended.err
    assert r"\u202egpj.exe" in printed
    assert printed.replace("\n", "").isprintable()


def test_a_text_of_a_file_stays_in_its_line(
    here: Path, finished: Path, repeats: hostile.Corpus, snooker: Snooker
) -> None:
    """After a line break in it, a text could look like a line of snooker."""
    path = finished / REPEATS
    path.write_bytes(repeats.kept["stop: message"])
    assert INNER in snooker("run", "small.yaml", "--no-progress").out
    path.write_bytes(repeats.kept[COMMAND])
    os.utime(path)  # the newest file: its command is shown
    assert INNER in snooker("show", "small").out.splitlines()[-1]
    path.unlink()
    failed = json.dumps({"point": 0, "repeat": 0, "error": hostile.ESCAPES})
    (finished / "failures.jsonl").write_text(failed)
    remark = next(line for line in snooker("show", "small").out.splitlines() if "failed: " in line)
    assert INNER in remark


@pytest.mark.parametrize("name", hostile.BESIDE)
def test_hostile_files_beside_the_repeats(name: str, finished: Path, snooker: Snooker) -> None:
    file, damage = hostile.BESIDE[name]
    (finished / "figures").mkdir()
    damage(finished / file)
    for command in ("ls", "show small", "fit small", "run small.yaml --no-progress"):
        assert check(snooker, command, name) == 0
