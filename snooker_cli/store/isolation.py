"""Check files in a process of its own, which a file may crash, keep busy or fill with memory."""

import signal
import sys
import time
from contextlib import AbstractContextManager, suppress
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from snooker_cli.errors import RunError, StoreError
from snooker_cli.store.file_format import RepeatHeader
from snooker_cli.store.reader import check, file_info

if sys.platform != "win32":
    import resource

SECONDS, BYTES_PER_SECOND = 20, 1e6  # processor time for a file; most take a hundredth of it
MEMORY, MEMORY_PER_BYTE = 1.2e9, 8  # bytes for a process and a file; the libraries take 2e8


class IsolatedChecker(AbstractContextManager["IsolatedChecker"]):
    """Checks files one after the other in a child process; a new one begins after a crash."""

    _process: Any = None

    def __exit__(self, *_error: object) -> None:
        if self._process is not None:
            self._process.kill()

    def check(self, path: Path) -> list[RepeatHeader]:
        """As ``reader.check``. Raises ``StoreError`` also for a file that ends the process.

        Raises ``RunError`` if no process can begin.
        """
        if self._process is None:
            context = get_context("spawn")  # a fork would copy locks that other threads hold
            self._files, there = context.Pipe()
            self._process = context.Process(target=_check_files, args=(there,), daemon=True)
            self._process.start()
            there.close()
            if self._answer() is not None:
                raise RunError("no process to check files can begin", "close other programs")
        size = (file_info(path) or (0, 0))[0]
        seconds = int(SECONDS + size / BYTES_PER_SECOND)
        limits = seconds, int(MEMORY + MEMORY_PER_BYTE * size)
        with suppress(OSError):
            self._files.send((path, *limits))
        answer = self._answer()
        if isinstance(answer, int):
            how = f"crashes (exit code {answer})"
            if sys.platform != "win32" and answer == -signal.SIGXCPU:
                how = f"takes longer than {seconds} s"
            answer = StoreError(path, f"reading it {how}", "delete it and run again")
        if isinstance(answer, StoreError):
            raise answer
        return list(answer)

    def _answer(self) -> Any:
        """What the process sends, or its exit code after it has ended."""
        try:
            return self._files.recv()
        except (EOFError, OSError):
            self._process.join()
            code, self._process = self._process.exitcode, None
            return code


def _check_files(files: Connection) -> None:
    """Answer each path with the headers of its file or an error, until the parent ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the parent
    files.send(None)
    with suppress(EOFError, OSError):
        while True:
            path, seconds, memory = files.recv()
            if sys.platform != "win32":
                _limit(resource.RLIMIT_CPU, int(time.process_time()) + seconds)
                _limit(resource.RLIMIT_DATA, memory)
                _limit(resource.RLIMIT_CORE, 0)
            try:
                files.send(check(path))
            except StoreError as error:
                files.send(error)


def _limit(name: int, limit: int) -> None:
    """Give this process at most so much of a resource, or what the system allows."""
    if sys.platform != "win32":
        _, most = resource.getrlimit(name)
        limit = limit if most == resource.RLIM_INFINITY else min(limit, most)
        resource.setrlimit(name, (limit, most))
