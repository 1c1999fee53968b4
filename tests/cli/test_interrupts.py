"""Ctrl-C and SIGTERM: one sentence and code 130 from the first moment on, and none is lost."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
import weakref
from pathlib import Path

import pytest

from snooker_cli.cli.exit_codes import raising

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
from snooker_cli.cli.exit_codes import guarded

def command():
    threading.Thread(target=threading.Event().wait).start()
    os.kill(os.getpid(), signal.SIGINT)

guarded(command)
"""


SLURM = """
class SLURMCluster:
    scheduler_address = "tcp://10.0.0.1:8786"

    def __init__(self, **settings):
        pass

    def adapt(self, maximum_jobs):
        pass

    def __enter__(self):
        return self

    def __exit__(self, *error):
        print("the jobs are ended")
"""

STUBBORN = """#!/bin/sh
trap 'exit 130' TERM
sleep 0.2  # the script has not got its handlers yet
echo "$@"
while :; do sleep 0.02; done
"""


def ended(script: str, *arguments: str, folder: Path) -> tuple[int, str, str]:
    """The code of a script, and what it said; Ctrl-C is not ignored, as behind an `&`."""
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
def test_one_while_modules_load(
    module: str, number: signal.Signals, command: str, here: Path
) -> None:
    arguments = [module, str(int(number)), "snooker", command, "small.yaml"]
    said = ended(AS_A_MODULE_LOADS, *arguments, folder=here)
    assert said == (130, "", "snooker: interrupted\n")
    assert not (here / "runs").exists()


def test_one_while_a_thread_reads_is_not_answered_after_that(tmp_path: Path) -> None:
    """Python waits for threads at its end; one that reads a large file would be long."""
    assert ended(AS_A_THREAD_READS, folder=tmp_path) == (130, "", "snooker: interrupted\n")


class Reader:
    """What can be referred to weakly."""


def lose_one(came: list[int]) -> None:
    """Interrupt this process in the callback of a weak reference, and wait."""
    reader = Reader()
    callback = weakref.ref(reader, lambda _: os.kill(os.getpid(), signal.SIGTERM))
    with raising() as numbers:
        try:
            del reader
            assert callback() is None
            time.sleep(60)
        finally:
            came.extend(numbers)


def test_one_in_a_callback_is_not_lost(capsys: pytest.CaptureFixture[str]) -> None:
    """As h5py has them when a dataset is closed: Python drops what is raised there."""
    came: list[int] = []
    with pytest.raises(KeyboardInterrupt):
        lose_one(came)
    assert came == [signal.SIGTERM, signal.SIGALRM]
    assert capsys.readouterr().err == ""


def test_what_our_starter_has_us_ignore_is_ignored() -> None:
    before = signal.signal(signal.SIGTERM, signal.SIG_IGN)
    try:
        with raising() as came:
            os.kill(os.getpid(), signal.SIGTERM)
        assert came == []
        assert signal.getsignal(signal.SIGTERM) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGTERM, before)


def test_one_ends_the_jobs_that_the_script_for_slurm_has_begun(tmp_path: Path) -> None:
    """The script of the page, with others in the place of SLURM and of snooker."""
    page = (Path(__file__).parents[2] / "docs" / "cluster.md").read_text(encoding="utf-8")
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
    said, _ = process.communicate(timeout=60)
    assert (process.returncode, said) == (130, "the jobs are ended\n")
