"""Processes for tests that begin at once: forked from one that has loaded and compiled all."""

from __future__ import annotations

import os
import select
import signal
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

FORGE = """
import os, sys
from snooker_cli.cli import main

answers = os.fdopen(os.dup(1), "w")
os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
sys.argv = ["snooker", "run", *sys.argv[1:], "-o", "repeats=1", "-j", "1", "--no-progress"]
try:
    main()
except SystemExit as end:
    assert end.code == 0, end.code
for line in sys.stdin:
    child = os.fork()
    if child == 0:
        sys.argv = ["snooker", *line.split()]
        main()
    print(child, file=answers, flush=True)
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), file=answers, flush=True)
"""


class Forged:
    """A forked process; it is used as one of ``subprocess.Popen``."""

    def __init__(self, forge: subprocess.Popen[str], arguments: Sequence[str]) -> None:
        self.answers = forge.stdout
        forge.stdin.write(" ".join(arguments) + "\n")
        forge.stdin.flush()
        self.number = int(self.answers.readline())
        self.returncode: int | None = None

    def poll(self) -> int | None:
        if self.returncode is None and select.select([self.answers], [], [], 0)[0]:
            self.returncode = int(self.answers.readline())
        return self.returncode

    def kill(self) -> None:
        os.kill(self.number, signal.SIGKILL)

    def communicate(self) -> tuple[str, str]:
        if self.returncode is None:
            self.returncode = int(self.answers.readline())
        return "", ""


@contextmanager
def forge(config: Path, folder: Path) -> Iterator[subprocess.Popen[str]]:
    """What forks such processes, after a run of a config in a folder; stderr goes to ``talk``."""
    folder.mkdir()
    with (
        (folder / "talk").open("w") as stderr,
        subprocess.Popen(
            [sys.executable, "-c", FORGE, config, "--out", folder / "run"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=stderr,
            text=True,
        ) as process,
    ):
        yield process
        process.stdin.close()
        assert process.wait() == 0
