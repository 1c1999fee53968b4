"""How commands end: exit codes for errors, Ctrl-C and SIGTERM, and readers that go away."""

from __future__ import annotations

import logging
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from command_line import Snooker

from snooker_cli.errors import UserError, raising

LOUD = ("export", "show", "verify")

AS_A_MODULE_LOADS = """
import os, signal, sys
from snooker_cli.cli import main

module, number, *sys.argv = sys.argv[1:]

class Finder:
    def find_spec(name, path=None, target=None):
        if name == module:
            sys.meta_path.remove(Finder)
            os.kill(os.getpid(), int(number))

sys.meta_path.insert(0, Finder)
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

SLURM = """
from unittest.mock import MagicMock

SLURMCluster = MagicMock()
cluster = SLURMCluster.return_value
cluster.__enter__.return_value.scheduler_address = "tcp://10.0.0.1:8786"
cluster.__exit__.side_effect = lambda *_: print("the jobs are ended")
"""

STUBBORN = """#!/bin/sh
trap 'exit 130' TERM
sleep 0.2  # the script has not got its handlers yet
echo "$@"
while :; do sleep 0.02; done
"""


def lost(*_arguments: object) -> str:
    raise KeyError("lost")


@pytest.mark.parametrize("wanted", ["", "0", "1"])
def test_an_unexpected_error_is_a_sentence_and_a_traceback_on_request(
    wanted: str, finished: Path, snooker: Snooker, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SNOOKER_TRACEBACK", wanted)
    monkeypatch.setattr("snooker_cli.api.open", lost)
    ended = snooker("export", "small")
    assert (ended.code, ended.out) == (1, "")
    assert ("Traceback" in ended.err) == ("in lost" in ended.err) == (wanted == "1")
    last = ended.err.splitlines()[-1]
    assert last.startswith("snooker: unexpected KeyError: 'lost'; ")
    assert ("SNOOKER_TRACEBACK=1" in last) == (wanted != "1")
    monkeypatch.setattr("snooker_cli.runs.batch.versions", lost)
    many = ("-o", "repeats=8", "-j", "1", "--fresh")
    ended = snooker("run", "small.yaml", "--no-progress", *many)
    assert ended.code == 4
    printed = [line for line in ended.err.splitlines() if line.startswith("snooker: point ")]
    assert len(printed) == 10
    assert all(" failed: unexpected KeyError: 'lost'; " in line for line in printed)
    assert ended.err.count("Traceback") == (10 if wanted == "1" else 0)


def test_too_little_memory_is_a_sentence(
    finished: Path, snooker: Snooker, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("snooker_cli.runs.batch.versions", lambda: np.empty(2**56))
    ended = snooker("run", "small.yaml", "--no-progress", "-j", "1", "--fresh")
    assert ended.code == 4
    assert "there is too little memory (" in ended.err
    assert "use fewer balls, or a smaller --jobs" in ended.err
    assert "bug" not in ended.err


COMMANDS = [["schema"], *(pytest.param([name, "small"], marks=pytest.mark.long) for name in LOUD)]


@pytest.mark.parametrize("arguments", COMMANDS)
def test_a_reader_that_leaves_or_a_closed_stdout_is_no_error(
    arguments: list[str], finished: Path
) -> None:
    """As with `| head` and `>&-`."""
    command = [sys.executable, "-m", "snooker_cli", *arguments]
    read, write = os.pipe()
    os.close(read)
    with os.fdopen(write) as pipe:
        done = subprocess.run(command, stdout=pipe, stderr=subprocess.PIPE, check=False)
    assert (done.returncode, done.stderr) == (0, b"")
    closed = ["sh", "-c", 'exec "$@" >&-', "sh", *command]
    done = subprocess.run(closed, capture_output=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, b"", b"")


def test_notices_for_a_closed_stderr_are_not_in_the_output(here: Path) -> None:
    command = [sys.executable, "-m", "snooker_cli", "init", "haff", "--out", "-"]
    closed = ["sh", "-c", 'exec "$@" 2>&-', "sh", *command]
    done = subprocess.run(closed, capture_output=True, text=True, check=True)
    assert "repeats:" in done.stdout
    assert "snooker: tip:" not in done.stdout


def test_ctrl_c_while_a_command_writes(here: Path, snooker: Snooker) -> None:
    """While its reader waits, an export hangs in a write until it is interrupted."""
    long = ["-o", "cor=1", "-o", "repeats=1", "-o", "collisions=20000", "--out", "long"]
    assert snooker("run", "small.yaml", "--no-progress", *long).code == 0
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
    ("module", "number", "command"),
    [
        ("typer", signal.SIGINT, "run"),
        ("snooker_cli.cli.options", signal.SIGTERM, "run"),
        ("numpy", signal.SIGINT, "run"),
        ("h5py", signal.SIGTERM, "run"),
        ("pydantic", signal.SIGINT, "validate"),
    ],
)
def test_an_interrupt_while_modules_load(
    module: str, number: signal.Signals, command: str, here: Path
) -> None:
    arguments = [module, str(int(number)), "snooker", command, "small.yaml"]
    printed = ended(AS_A_MODULE_LOADS, *arguments, folder=here)
    assert printed == (130, "", "snooker: interrupted\n")
    assert not (here / "runs").exists()


@pytest.mark.parametrize("script", [AS_A_THREAD_READS, IN_A_CALLBACK])
def test_an_interrupt_ends_a_command_at_once(script: str, tmp_path: Path) -> None:
    """Python waits for threads when it ends, and drops what is raised in a callback, as of h5py."""
    assert ended(script, folder=tmp_path) == (130, "", "snooker: interrupted\n")


def test_a_signal_that_the_parent_ignores_stays_ignored() -> None:
    before = signal.signal(signal.SIGTERM, signal.SIG_IGN)
    try:
        with raising() as came:
            os.kill(os.getpid(), signal.SIGTERM)
        assert came == []
        assert signal.getsignal(signal.SIGTERM) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGTERM, before)


def test_an_interrupt_ends_the_jobs_of_the_script_for_slurm(tmp_path: Path) -> None:
    """The script of docs/cluster.md, with substitutes for SLURM and snooker."""
    page = (Path(__file__).parents[1] / "docs" / "cluster.md").read_text(encoding="utf-8")
    (script,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    (tmp_path / "on_slurm.py").write_text(script)
    (tmp_path / "dask_jobqueue.py").write_text(SLURM)
    (tmp_path / "snooker").write_text(STUBBORN)
    (tmp_path / "snooker").chmod(0o755)
    process = subprocess.Popen(
        [sys.executable, "on_slurm.py", "decay.yaml", "--out", "decay"],
        cwd=tmp_path,
        env={**os.environ, "PATH": os.pathsep.join([str(tmp_path), os.environ["PATH"]])},
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    begun = process.stdout.readline()
    assert begun == "run decay.yaml --out decay --executor dask=tcp://10.0.0.1:8786\n"
    process.terminate()
    printed, _ = process.communicate(timeout=60)
    assert (process.returncode, printed) == (130, "the jobs are ended\n")


def test_a_log_record_of_the_package_is_a_notice(
    here: Path, snooker: Snooker, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As the engine's when it compiles."""

    def compiling(*_arguments: object) -> None:
        logging.getLogger("snooker_cli.engine").info("compiling")
        raise UserError("that is all")

    monkeypatch.setattr("snooker_cli.api.open", compiling)
    for _ in range(2):
        ended = snooker("export", "small")
        assert (ended.code, ended.err) == (2, "snooker: compiling\nsnooker: that is all\n")
