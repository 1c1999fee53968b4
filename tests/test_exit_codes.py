"""How commands end: exit codes for errors, Ctrl-C and SIGTERM, and readers that go away."""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from command_line import Snooker

AS_A_MODULE_LOADS = """
import os, sys

module, number, *sys.argv = sys.argv[1:]

class Finder:
    def find_spec(name, path=None, target=None):
        if name == module:
            sys.meta_path.remove(Finder)
            os.kill(os.getpid(), int(number))

sys.meta_path.insert(0, Finder)
from snooker_cli.cli import main
main()
"""

AS_A_THREAD_READS = """
import os, signal, threading
from snooker_cli.errors import guarded

def command():
    threading.Thread(target=threading.Event().wait).start()
    os.kill(os.getpid(), signal.SIGINT)

guarded(command)
"""

IN_A_CALLBACK = """
import os, signal, time, weakref
from snooker_cli.errors import guarded

class Reader:
    pass

def command():
    reader = Reader()
    callback = weakref.ref(reader, lambda _: os.kill(os.getpid(), signal.SIGTERM))
    del reader
    time.sleep(60)

guarded(command)
"""


AT_THE_VERY_END = """
import os, signal, sys
from snooker_cli.cli import main

class Late:
    def __del__(self, kill=os.kill, process=os.getpid(), number=int(sys.argv.pop(1))):
        kill(process, number)

late = Late()
main()
"""

STDOUT_IS_FULL = (
    "snooker: stdout: No space left on device; check the path, the disk and its permissions\n"
)


def lost(*_arguments: object) -> str:
    raise KeyError("lost")


@pytest.mark.parametrize("wanted", ["0", "1"])
def test_an_unexpected_error_is_a_sentence_and_a_traceback_on_request(
    wanted: str, finished: Path, snooker: Snooker, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SNOOKER_TRACEBACK", wanted)
    monkeypatch.setattr("snooker_cli.open", lost)
    ended = snooker("export", "small")
    assert (ended.code, ended.out) == (1, "")
    assert ("Traceback" in ended.err) == ("in lost" in ended.err) == (wanted == "1")
    assert ended.err.splitlines()[-1].startswith("snooker: unexpected KeyError: 'lost'; ")
    assert ("SNOOKER_TRACEBACK=1" in ended.err) == (wanted != "1")
    monkeypatch.setattr("snooker_cli.runs.batch.versions", lost)
    many = ("-o", "repeats=8", "-j", "1", "--fresh")
    ended = snooker("run", "small.yaml", "--no-progress", *many)
    assert ended.code == 4
    printed = [line for line in ended.err.splitlines() if line.startswith("snooker: point ")]
    assert len(printed) == 10
    assert all(" failed: unexpected KeyError: 'lost'; " in line for line in printed)
    assert ended.err.count("Traceback") == (10 if wanted == "1" else 0)


def test_too_little_memory_for_a_run_names_its_jobs(
    finished: Path, snooker: Snooker, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("snooker_cli.runs.batch.versions", lambda: np.empty(2**56))
    ended = snooker("run", "small.yaml", "--no-progress", "-j", "1", "--fresh")
    assert "there is too little memory (" in ended.err
    assert "use fewer balls, or a smaller --jobs" in ended.err
    monkeypatch.setattr("snooker_cli.open", lambda _: np.empty(2**56))
    assert "--jobs" not in snooker("export", "small").err


def test_streams_that_are_closed_are_no_error(here: Path) -> None:
    """As with `| head`, `>&-` and `2>&-`. The output has no notices."""
    command = [sys.executable, "-m", "snooker_cli", "init", "haff", "--out", "-"]
    read, write = os.pipe()
    os.close(read)
    with os.fdopen(write) as pipe:
        done = subprocess.run(command, stdout=pipe, stderr=subprocess.PIPE, check=True)
    assert done.stderr.startswith(b"snooker: tip: ")
    assert done.stderr.count(b"\n") == 1
    for stream, printed in ((">", ""), ("2>", "# yaml-language-server")):
        closed = ["sh", "-c", f'exec "$@" {stream}&-', "sh", *command]
        done_in_shell = subprocess.run(closed, capture_output=True, text=True, check=True)
        assert done_in_shell.stdout.startswith(printed)
        assert "snooker: tip:" not in done_in_shell.stdout


@pytest.mark.skipif(sys.platform != "linux", reason="memory is limited on Linux only")
def test_too_little_memory_is_one_sentence(here: Path) -> None:
    """Libraries that do not load report it in ways of their own."""
    done = subprocess.run(
        [sys.executable, "-m", "snooker_cli", "run", "small.yaml"],
        capture_output=True,
        text=True,
        check=False,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (300 * 10**6,) * 2),
    )
    assert done.returncode == 1
    assert "snooker: there is too little memory to load a library (MemoryError: " in done.stderr
    assert "; close other programs, or let this one use more (`ulimit -v`)" in done.stderr
    assert "balls" not in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no full device here")
def test_a_full_device_is_named(here: Path) -> None:
    command = [sys.executable, "-m", "snooker_cli", "init"]
    with Path("/dev/full").open("w") as full:
        for where in ({"stderr": subprocess.PIPE}, {"stderr": full}):
            done = subprocess.run(command, stdout=full, text=True, check=False, **where)
            assert done.returncode == 2
            assert done.stderr in (None, STDOUT_IS_FULL)


def test_a_reader_that_leaves_or_waits_ends_an_export(here: Path, snooker: Snooker) -> None:
    """While its reader waits, an export hangs in a write until it is interrupted."""
    long = ["-o", "cor=1", "-o", "repeats=1", "-o", "collisions=20000", "--out", "long"]
    assert snooker("run", "small.yaml", "--no-progress", *long).code == 0
    export = f"{sys.executable} -m snooker_cli export long | head -n 1"
    done = subprocess.run(export, shell=True, capture_output=True, check=True)
    assert (done.stdout, done.stderr) == (b"time,i,j,impulse\n", b"")
    process = subprocess.Popen(
        [sys.executable, "-m", "snooker_cli", "export", "long"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "time,i,j,impulse\n"
    process.send_signal(signal.SIGINT)
    _, printed = process.communicate()
    assert process.returncode == 130
    assert printed == "snooker: interrupted\n"


def ended(script: str, *arguments: str, folder: Path) -> tuple[int, str, str]:
    """Exit code, stdout and stderr of a script; Ctrl-C is not ignored, as it is after `&`."""
    done = subprocess.run(
        [sys.executable, "-c", script, *arguments],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    return done.returncode, done.stdout, done.stderr


@pytest.mark.parametrize(
    ("module", "number"),
    [
        ("signal", signal.SIGINT),
        ("typer", signal.SIGINT),
        ("numpy", signal.SIGTERM),
        ("h5py", signal.SIGHUP),
    ],
)
def test_an_interrupt_while_modules_load(module: str, number: signal.Signals, here: Path) -> None:
    arguments = [module, str(int(number)), "snooker", "run", "small.yaml"]
    printed = ended(AS_A_MODULE_LOADS, *arguments, folder=here)
    assert printed == (130, "", "snooker: interrupted\n")
    assert not (here / "runs").exists()


@pytest.mark.parametrize("script", [AS_A_THREAD_READS, IN_A_CALLBACK])
def test_an_interrupt_ends_a_command_at_once(script: str, tmp_path: Path) -> None:
    """Python waits for threads when it ends, and drops what is raised in a callback, as of h5py."""
    assert ended(script, folder=tmp_path) == (130, "", "snooker: interrupted\n")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_after_all_is_done_changes_nothing(number: signal.Signals, here: Path) -> None:
    """While Python deletes its modules, for most of a second, it handles no signals."""
    printed = ended(AT_THE_VERY_END, str(int(number)), "init", "--list", folder=here)
    assert (printed[0], printed[2]) == (0, "")
    assert "haff" in printed[1]


@pytest.mark.skipif(sys.platform == "win32", reason="there are no such limits")
@pytest.mark.parametrize(
    "command", ["plot small energy", "report small", "run small.yaml --out runs/other"]
)
def test_a_full_disk_leaves_no_empty_folders(
    command: str, finished: Path, snooker: Snooker
) -> None:
    unlimited = resource.getrlimit(resource.RLIMIT_FSIZE)
    before = sorted(Path.cwd().rglob("*"))
    resource.setrlimit(resource.RLIMIT_FSIZE, (0, unlimited[1]))
    try:
        assert snooker(*command.split()).code == 2
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, unlimited)
    assert sorted(Path.cwd().rglob("*")) == before
