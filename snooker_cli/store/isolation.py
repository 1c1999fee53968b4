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
MEMORY, MEMORY_PER_BYTE = 10**9, 8  # bytes for a file, besides those of the libraries


class IsolatedChecker(AbstractContextManager["IsolatedChecker"]):
    """Checks files one after the other in a child process; a new one begins after a crash."""

    def __init__(self) -> None:
        self._process: Any = None

    def __exit__(self, *_error: object) -> None:
        if self._process is not None:
            self._process.kill()

    def check(self, path: Path) -> list[RepeatHeader]:
        """As ``reader.check``. Raises ``StoreError`` also for a file that ends the process.

        Raises ``RunError`` if no process can begin.
        """
        size = (file_info(path) or (0, 0))[0]
        seconds = SECONDS + size / BYTES_PER_SECOND
        if self._process is None:
            self._begin()
        try:
            self._files.send((path, seconds, MEMORY + MEMORY_PER_BYTE * size))
            found = self._files.recv()
        except (EOFError, OSError):
            self._process.join()
            code, self._process = self._process.exitcode, None
            how = signal.Signals(-code).name if code < 0 else f"exit code {code}"
            reason = f"reading it crashes ({how})"
            if how == "SIGXCPU":
                reason = f"reading it takes longer than {seconds:.0f} s"
            raise StoreError(path, reason, "delete it and run again") from None
        if isinstance(found, StoreError):
            raise found
        assert isinstance(found, list)
        return found

    def _begin(self) -> None:
        # A fork would copy locks that other threads hold.
        context = get_context("spawn")
        self._files, there = context.Pipe()
        process = context.Process(target=_check_files, args=(there,), daemon=True)
        process.start()
        self._process = process
        there.close()
        try:
            self._files.recv()
        except (EOFError, OSError):
            raise RunError("no process to check files can begin", "close other programs") from None


def _check_files(files: Connection) -> None:
    """Answer each path with the headers of its file or an error, until the parent ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the parent
    libraries = _address_space()
    files.send(None)
    with suppress(EOFError, OSError):
        while True:
            path, seconds, memory = files.recv()
            _set_limits(time.process_time() + seconds, libraries and libraries + memory)
            try:
                files.send(check(path))
            except StoreError as error:
                files.send(error)


def _address_space() -> int:
    """Bytes of address space that this process has; 0 where the system does not show it."""
    try:
        pages = Path("/proc/self/statm").read_text(encoding="ascii").split()[0]
    except OSError:
        return 0
    return int(pages) * resource.getpagesize()


def _set_limits(seconds: float, memory: int) -> None:
    """Limit the processor time and the address space (if not 0) of this process."""
    if sys.platform == "win32":
        return
    limits = {resource.RLIMIT_CPU: int(seconds), resource.RLIMIT_CORE: 0}  # no core file
    if memory:
        limits[resource.RLIMIT_AS] = memory
    for name, limit in limits.items():
        _, most = resource.getrlimit(name)
        limit = limit if most == resource.RLIM_INFINITY else min(limit, most)
        resource.setrlimit(name, (limit, most))
